//! The command line: parse, call, print. The only room that reads the clock, the environment and the command
//! line, or writes to the terminal.

mod accuracy;
mod args;
mod calibrate;
mod campaign;
mod catalog;
mod explain;
mod gpu;
mod invert;
mod lightcurve;
mod period;
mod photometry;
mod plan;
mod render;
mod report;
mod run;
mod scenes;
mod shape;
mod shapes;
mod sky;
mod snr;
mod stations;
mod talk;
mod time;

pub use args::Cli;

use args::Command;
use clap::CommandFactory;
use std::process::ExitCode;
use talk::Failure;

/// Carry out a command line; 0 = done, 1 = failed, 2 = usage or bad input.
pub fn main(cli: &Cli) -> ExitCode {
    let global = cli.command.global();
    let talk = talk::Talk::new(global);
    if let Some(threads) = global.threads {
        // fails only if a pool exists already, which nothing here makes
        let _ = rayon::ThreadPoolBuilder::new().num_threads(usize::from(threads)).build_global();
    }
    let result = match &cli.command {
        Command::Run(with) => run::run(&with.args, global, &talk),
        Command::Plan(with) => plan::plan(&with.args, global, &talk),
        Command::Report(with) => report::report(&with.args, global, &talk),
        Command::Render(with) => render::render(&with.args, global, &talk),
        Command::Calibrate(with) => calibrate::calibrate(&with.args, global, &talk),
        Command::Photometry(with) => photometry::photometry(&with.args, global, &talk),
        Command::Invert(with) => invert::invert(&with.args, global, &talk),
        Command::Period(with) => period::period(&with.args, global, &talk),
        Command::Lightcurve(with) => lightcurve::lightcurve(&with.args, global, &talk),
        Command::Time(with) => time::time(&with.args, global),
        Command::Accuracy(with) => accuracy::accuracy(&with.args, global, &talk),
        Command::Explain(with) => explain::explain(&with.args, global, &talk),
        Command::Sky(with) => sky::sky(&with.args, global, &talk),
        Command::Snr(with) => snr::snr(&with.args, global, &talk),
        Command::Init(with) => scenes::init(&with.args, global, &talk),
        Command::Check(with) => scenes::check(&with.args, global, &talk),
        Command::Schema(_) => scenes::schema(),
        Command::Shape(with) => shape::shape(&with.args, global, &talk),
        Command::Gpu(with) => gpu::gpu(&with.global),
        Command::Scenes(_) => scenes::scenes(global),
        Command::Stations(args) => stations::stations(args, global, &talk),
        Command::Campaign(args) => campaign::campaign(args, &talk),
        Command::Catalog(args) => catalog::catalog(&args.action, global, &talk),
        Command::Completions(with) => {
            let mut script = Vec::new();
            clap_complete::generate(with.args.shell, &mut Cli::command(), "nightglass", &mut script);
            talk::print(&String::from_utf8_lossy(&script))
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
