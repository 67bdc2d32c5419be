//! The command line: parse, call, print. The only room that reads the clock, the environment and the command
//! line, or writes to the terminal.

mod args;
mod catalog;
mod explain;
mod photometry;
mod plan;
mod render;
mod run;
mod scenes;
mod talk;

pub use args::Cli;

use args::Command;
use clap::CommandFactory;
use std::process::ExitCode;
use talk::Failure;

/// Carry out a command line; 0 = done, 1 = failed, 2 = usage or bad input.
pub fn main(cli: &Cli) -> ExitCode {
    let talk = talk::Talk::new(&cli.global);
    if let Some(threads) = cli.global.threads {
        // fails only if a pool exists already, which nothing here makes
        let _ = rayon::ThreadPoolBuilder::new().num_threads(usize::from(threads)).build_global();
    }
    if cli.global.gpu == "require" {
        talk.error("--gpu require: nothing in this version runs on a graphics processor; use auto or off");
        return ExitCode::from(2);
    }
    let result = match &cli.command {
        Command::Run(args) => run::run(args, &cli.global, &talk),
        Command::Plan(args) => plan::plan(args, &cli.global, &talk),
        Command::Render(args) => render::render(args, &cli.global, &talk),
        Command::Photometry(args) => photometry::photometry(args, &cli.global, &talk),
        Command::Explain(args) => explain::explain(args, &cli.global, &talk),
        Command::Init(args) => scenes::init(args, &cli.global, &talk),
        Command::Check(args) => scenes::check(args, &cli.global, &talk),
        Command::Schema => scenes::schema(),
        Command::Scenes => scenes::scenes(&cli.global),
        Command::Stations => scenes::stations(&cli.global),
        Command::Catalog(args) => catalog::catalog(args, &cli.global, &talk),
        Command::Completions { shell } => {
            clap_complete::generate(*shell, &mut Cli::command(), "nightglass", &mut std::io::stdout());
            Ok(())
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::BrokenPipe) => ExitCode::SUCCESS,
        Err(failure) => {
            talk.error(&failure.to_string());
            ExitCode::from(failure.code())
        }
    }
}
