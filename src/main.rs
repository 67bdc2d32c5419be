//! The `nightglass` program.

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    nightglass::cli::main(&nightglass::cli::Cli::parse())
}
