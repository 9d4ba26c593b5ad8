//! The command `crumple`: words, tables, progress. No numerics: every answer comes from the crate of the same name.

mod commands;
mod options;
mod output;
mod progress;

use std::process::ExitCode;

use clap::Parser;

use commands::{Answer, Command};
use output::Output;

/// Crash simulations in, deformation modes out.
///
/// Reads a bundle of simulations of one part (LS-DYNA d3plot families), describes how each run deformed by a handful of
/// spectral coefficients, groups the runs into deformation modes, and finds the runs that behave like a given one.
#[derive(Parser)]
#[command(
    name = "crumple",
    version,
    max_term_width = 120,
    after_help = "Start here, on the example:\n  crumple analyze examples/hat-section/runs --join 2.5 -o study\n\nExit codes: 0 done, 1 the answer is no (verify, monitor, check), 2 bad input or failure, 130 interrupted."
)]
struct Cli {
    /// Print the result as JSON, for scripts
    #[arg(long, global = true)]
    json: bool,
    /// No progress and no notes on standard error
    #[arg(short, long, global = true)]
    quiet: bool,
    /// Threads to use; results do not depend on it [default: all cores]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    #[command(subcommand)]
    command: Command,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    if let Some(threads) = cli.threads {
        // Fails only if the pool exists already, which it does not yet.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global();
    }
    let output = Output { json: cli.json, quiet: cli.quiet };
    let watch = progress::Terminal::new(cli.quiet);
    let outcome = cli.command.run(&output, &watch);
    watch.finish();
    match outcome {
        Ok(Answer::Done) => ExitCode::SUCCESS,
        Ok(Answer::No) => ExitCode::from(1),
        Err(error) => {
            output::print_error(&error);
            ExitCode::from(if matches!(error, crumple::Error::Stopped) { 130 } else { 2 })
        }
    }
}
