//! Parses, runs, prints errors, returns exit codes.

use clap::Parser;
use lightfall::cli::{Cli, exit_code, run};
use std::{io::Write, process::ExitCode};

fn main() -> ExitCode {
    let result = run(&Cli::parse());
    if let Err(error) = &result {
        // Not eprintln!: it panics where stderr is closed.
        let _ = writeln!(std::io::stderr(), "error: {error}");
    }
    exit_code(&result).into()
}
