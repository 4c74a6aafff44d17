//! The command line: one file per subcommand.

mod args;
mod bench;
mod compare;
pub mod doctor;
mod environment;
mod info;
mod interrupt;
mod load;
mod progress;
mod quality;
mod render;

pub use args::{BenchArgs, Cli, Command, CompareArgs, RenderArgs};

use crate::{
    Error, Result,
    scene::Scene,
    world::{FEATURES, features},
};

/// How a command that did not fail ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    Done,
    /// By Ctrl-C or a signal to end; the image so far is written.
    Interrupted,
}

/// Runs one command.
///
/// # Errors
/// Whatever kept it from being done, in words for the user.
pub fn run(cli: &Cli) -> Result<Outcome> {
    match &cli.command {
        Command::Render(args) => render::run(args),
        Command::Bench(args) => bench::run(args),
        Command::Compare(args) => compare::run(args).map(|()| Outcome::Done),
        Command::Info { scene, load } => info::run(scene, load).map(|()| Outcome::Done),
        Command::Doctor => doctor::run().map(|()| Outcome::Done),
    }
}

/// The process exit code: 0 done, 1 failed, 2 usage, 130 interrupted.
pub fn exit_code(result: &Result<Outcome>) -> u8 {
    match result {
        Ok(Outcome::Done) => 0,
        Ok(Outcome::Interrupted) => 130,
        Err(Error::Option { .. }) => 2,
        Err(_) => 1,
    }
}

/// What the scene uses, and what is left out as it does not.
fn used_and_left_out(scene: &Scene) -> String {
    let bits = features(scene);
    let named = |on: bool| {
        let names = FEATURES.iter().filter(|f| (bits & f.bit != 0) == on);
        let names: Vec<&str> = names.map(|f| f.name).collect();
        names.join(", ")
    };
    format!("{}; left out: {}", named(true), named(false))
}
