//! `locoman-robot servo`: for the person who assembles the hand.
//!
//! Nothing is written into a servo, and nothing moves, before the person has agreed. What is found is told on stdout.

mod go;
mod person;
mod scan;
mod setup;
mod zero;

use std::path::{Path, PathBuf};

use anyhow::Context;
pub use go::{Going, go};
pub use person::{Person, Terminal};
pub use scan::scan;
pub use setup::set_up;
pub use zero::find_zeros;

use super::{Bus, Place, SerialLine, ServoSettings, Zeros, default_zeros_file, find_port};
use crate::control::RobotConfig;

/// Arguments of `locoman-robot servo`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The servos' line, in place of the one in servos.toml: a path such as /dev/ttyUSB0, or `auto`.
    #[arg(long, value_name = "PORT")]
    pub port: Option<String>,
    /// Where the zero angles are kept. Default: locoman/servo_zeros.toml in $XDG_CONFIG_HOME or ~/.config.
    #[arg(long, value_name = "FILE")]
    pub zeros: Option<PathBuf>,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What the person can do.
#[derive(Debug, clap::Subcommand)]
pub enum Command {
    /// Find every servo at every speed, and say what is missing or not set up. Writes nothing.
    Scan,
    /// Give new servos their ids and settings, one after another. Asks before it writes.
    Setup {
        /// Only this place: right-1, right-2, right-3, right-gripper, left-1, ... Default: all eight.
        #[arg(long, value_name = "PLACE")]
        place: Option<Place>,
    },
    /// Find directions and zero angles of the assembled arms, and keep them in a file. Switches the torque off.
    Zero,
    /// Move one joint slowly to an angle.
    Move {
        /// Which: right-1, right-2, right-3, right-gripper, left-1, ...
        place: Place,
        /// Where to, rad.
        #[arg(allow_hyphen_values = true)]
        angle_rad: f64,
        /// How fast, rad/s, 0.05 to 1.
        #[arg(long, default_value_t = 0.3)]
        speed_rad_s: f64,
    },
}

/// Runs `locoman-robot servo`.
pub fn run(args: &Args, configs: &Path, person: &mut dyn Person) -> anyhow::Result<()> {
    let mut settings = ServoSettings::load(configs)?;
    settings.port = args.port.clone().unwrap_or(settings.port);
    let file = args.zeros.clone().unwrap_or_else(default_zeros_file);
    let port = find_port(&settings.port)?;
    let line = SerialLine::open(&port, settings.baud)?;
    let mut bus = Bus::new(line, settings.baud, settings.reply_slack());
    match &args.command {
        Command::Scan => scan(&mut bus, &settings, &port, person),
        Command::Setup { place } => {
            let places = place.map_or_else(|| Place::ALL.to_vec(), |place| vec![place]);
            places.into_iter().try_for_each(|place| set_up(&mut bus, place, &settings, person))
        }
        Command::Zero => {
            let poses = RobotConfig::load(configs).context("the arms' folded pose is needed")?.control.poses;
            if let Some(zeros) = find_zeros(&mut bus, &settings, &poses, person)? {
                zeros.save(&file)?;
                person.tell(&format!("Written: {}", file.display()));
            }
            Ok(())
        }
        Command::Move { place, angle_rad, speed_rad_s } => {
            let zeros = Zeros::load(&file, &settings)?;
            let going = Going { place: *place, angle_rad: *angle_rad, speed_rad_s: *speed_rad_s };
            go(&mut bus, &going, &settings, &zeros, person)
        }
    }
}
