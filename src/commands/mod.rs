//! What the program offers, one file a command.

mod compare;
mod cost;
mod devices;
mod explain;
mod numerics;
mod regress;
mod render;
mod validate;
mod view;

use std::error::Error as _;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{ArgAction, Args, Parser, Subcommand};

use crate::options::{one_line, range};
use crate::scene::Overrides;
use crate::{Error, Result};

/// Renders glass, and shows what accuracy costs
#[derive(Debug, Parser)]
#[command(name = "vitrum", version, max_term_width = 110, arg_required_else_help = true)]
#[command(
    after_help = "Exit codes: 0 done; 1 a check that was asked for failed; 2 bad usage or bad input; 3 no usable Vulkan device."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    talk: Talk,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Renders one image, off screen
    Render(Box<render::RenderCommand>),
    /// Shows a scene in a window, its glass in one's hands
    View(Box<view::ViewCommand>),
    /// Tells which effects a scene calls for and which not, and what each model makes of them
    Explain(explain::ExplainCommand),
    /// Measures what accuracy costs in time, for one scene
    Cost(Box<cost::CostCommand>),
    /// Says how far an image is from a reference
    Compare(compare::CompareCommand),
    /// Renders a suite of pictures and compares them with their references
    Regress(regress::RegressCommand),
    /// Tries every pass on every Vulkan device, under the validation layer
    Validate(validate::ValidateCommand),
    /// Holds the shaders' optics functions on a device against 64-bit arithmetic
    Numerics(numerics::NumericsCommand),
    /// Lists the Vulkan devices and what each can do
    Devices(devices::DevicesCommand),
}

/// What a command line puts in the place of what a scene says.
#[derive(Debug, Args)]
struct Changes {
    /// Index of refraction of every dielectric
    #[arg(long, value_name = "X", value_parser = range::ior)]
    ior: Option<f64>,

    /// Roughness of every dielectric, 0 to 1
    #[arg(long, value_name = "X", value_parser = range::unit)]
    roughness: Option<f64>,

    /// Environment image in place of the scene's
    #[arg(long, value_name = "FILE")]
    env: Option<PathBuf>,

    /// Sets one value of the scene, as its file would: material.glass.ior=1.7, camera.vertical_fov=20, environment.rotation=90; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,

    /// Repairs meshes: welds vertices along cracks, drops duplicate faces, turns triangles to agree with their neighbours, and says so
    #[arg(long)]
    repair: bool,

    /// Interpolates normals of meshes that have none, across edges of up to so many degrees, 0 to 180
    #[arg(long, value_name = "DEGREES", value_parser = range::angle)]
    smooth_angle: Option<f64>,
}

impl Changes {
    fn overrides(&self) -> Overrides {
        Overrides {
            ior: self.ior,
            roughness: self.roughness,
            environment: self.env.clone(),
            settings: self.set.clone(),
            repair: self.repair.then_some(true),
            smooth_angle: self.smooth_angle,
            no_render_table: false,
        }
    }
}

/// How much is said beside results.
#[derive(Clone, Copy, Debug, Args)]
struct Talk {
    /// Say less: errors only
    #[arg(short, long, global = true, conflicts_with = "verbose", display_order = 900)]
    quiet: bool,
    /// Say more
    #[arg(short, long, global = true, action = ArgAction::Count, display_order = 901)]
    verbose: u8,
}

impl Talk {
    /// Something that the user should know, on stderr.
    fn note(self, text: &str) {
        if !self.quiet {
            say(text);
        }
    }

    /// Something for those who asked for more.
    fn detail(self, text: &str) {
        if self.verbose > 0 {
            say(text);
        }
    }

    /// A progress bar pays on a terminal only.
    fn shows_progress(self) -> bool {
        !self.quiet && std::io::stderr().is_terminal()
    }
}

/// Parses the command line of the process, runs it, and tells what went wrong in one line.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) if error.use_stderr() && error.kind() != ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            let error = Error::Usage(one_line(&error));
            report(&error);
            return ExitCode::from(error.exit_code());
        }
        Err(help) => {
            // A closed stdout or stderr leaves nothing to tell.
            let _ = help.print();
            return ExitCode::from(u8::try_from(help.exit_code()).unwrap_or(2));
        }
    };
    let result = match cli.command {
        Command::Render(command) => command.run(cli.talk),
        Command::View(command) => command.run(cli.talk),
        Command::Explain(command) => command.run(),
        Command::Cost(command) => command.run(cli.talk),
        Command::Compare(command) => command.run(cli.talk),
        Command::Regress(command) => command.run(cli.talk),
        Command::Validate(command) => command.run(cli.talk),
        Command::Numerics(command) => command.run(cli.talk),
        Command::Devices(command) => command.run(),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            report(&error);
            ExitCode::from(error.exit_code())
        }
    }
}

/// The error and its causes, a line each; a cause that only repeats what is above it is left out.
fn report(error: &Error) {
    // A path may hold a line break; a line of ours does not.
    let whole = |text: String| text.replace('\n', "\\n");
    let mut lines = vec![whole(format!("error: {error}"))];
    let mut source = error.source();
    while let Some(cause) = source {
        let line = whole(format!("Caused by: {cause}"));
        if lines.last() != Some(&line) {
            lines.push(line);
        }
        source = cause.source();
    }
    say(&lines.join("\n"));
}

/// A line on stderr. Where that is closed or full, there is nobody left to tell.
fn say(text: &str) {
    let _ = std::io::stderr().write_all(format!("{text}\n").as_bytes());
}

/// Prints a result; a reader that went away, as `head` does, is no failure.
fn print(text: &str) -> Result<()> {
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::file("standard output", "write", error))
        }
        _ => Ok(()),
    }
}
