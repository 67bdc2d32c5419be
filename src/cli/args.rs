//! What can be typed.

use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

/// Synthetic telescope frames of satellites, and the light curves in them.
#[derive(Debug, Parser)]
#[command(name = "nightglass", version, about, max_term_width = 110)]
pub struct Cli {
    #[command(flatten)]
    pub(super) global: Global,
    #[command(subcommand)]
    pub(super) command: Command,
}

/// Options of every command.
#[derive(Debug, Args)]
pub(super) struct Global {
    /// Directory (or file, for `init` and `catalog import`) to write to
    #[arg(short = 'o', long = "output", value_name = "PATH", global = true)]
    pub output: Option<PathBuf>,
    /// Replace a key of the scene: key.path=value, the value in TOML, else a bare string; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", global = true, value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Replace the scene's seed
    #[arg(long, global = true)]
    pub seed: Option<u64>,
    /// Number of threads (default: all cores); changes no pixel
    #[arg(long, global = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// One JSON object on stdout instead of text
    #[arg(long, global = true)]
    pub json: bool,
    /// Say more
    #[arg(short, long, global = true)]
    pub verbose: bool,
    /// Say nothing but errors
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Replace the output of another scene
    #[arg(long, global = true)]
    pub force: bool,
    /// Use of a graphics processor; nothing in this version needs one
    #[arg(long, global = true, default_value = "auto", value_parser = ["auto", "off", "require"])]
    pub gpu: String,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// The main job: plan, frames, photometry, light curve
    Run(RunArgs),
    /// Geometry of every exposure, and when it is worth taking
    Plan(SceneArgs),
    /// Frames only; any subset or crop gives the pixels of the whole
    Render(RenderArgs),
    /// Light curve from frames: pixels and headers
    Photometry(PhotometryArgs),
    /// What is in the frames, what is left out and why, which noise dominates, what it costs
    Explain(SceneArgs),
    /// A commented scene to start from
    Init(InitArgs),
    /// All faults of a scene at once
    Check(SceneArgs),
    /// JSON Schema of the scene file
    Schema,
    /// Star catalogues: import, info
    Catalog(CatalogArgs),
    /// Built-in stations
    Stations,
    /// Built-in scenes
    Scenes,
    /// Shell completions
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
}

#[derive(Debug, Args)]
pub(super) struct SceneArgs {
    /// Scene file, or the name of a built-in scene
    pub scene: String,
}

#[derive(Debug, Args)]
pub(super) struct RunArgs {
    /// Scene file, or the name of a built-in scene
    #[arg(default_value = "pogs-geo")]
    pub scene: String,
    #[command(flatten)]
    pub part: PartArgs,
}

#[derive(Debug, Args)]
pub(super) struct RenderArgs {
    /// Scene file, or the name of a built-in scene
    pub scene: String,
    #[command(flatten)]
    pub part: PartArgs,
}

/// Part of a scene's frames.
#[derive(Debug, Args)]
pub(super) struct PartArgs {
    /// Frames A..B (without B), A..=B, A.., or one number
    #[arg(long, value_name = "A..B")]
    pub frames: Option<String>,
    /// Pixels x0,y0,width,height of each frame
    #[arg(long, value_name = "X0,Y0,W,H")]
    pub crop: Option<String>,
}

#[derive(Debug, Args)]
pub(super) struct PhotometryArgs {
    /// FITS frames
    #[arg(required = true)]
    pub frames: Vec<PathBuf>,
    /// The scene they belong to: predicts places and fills in geometry
    #[arg(long)]
    pub scene: Option<String>,
    /// Place of the target, 0-based pixels X,Y
    #[arg(long, value_name = "X,Y", conflicts_with = "radec", allow_hyphen_values = true)]
    pub xy: Option<String>,
    /// Place of the target, ICRS degrees RA,DEC
    #[arg(long, value_name = "A,D", allow_hyphen_values = true)]
    pub radec: Option<String>,
    /// How to measure
    #[arg(long, value_parser = ["aperture"])]
    pub method: Option<String>,
}

#[derive(Debug, Args)]
pub(super) struct InitArgs {
    /// A built-in scene or station; none: every key, commented
    pub name: Option<String>,
}

#[derive(Debug, Args)]
pub(super) struct CatalogArgs {
    #[command(subcommand)]
    pub action: CatalogAction,
}

#[derive(Debug, Subcommand)]
pub(super) enum CatalogAction {
    /// Make a catalogue file (-o FILE) from an astrometry.net index such as Debian's astrometry-data-tycho2-07
    Import {
        /// FITS index
        file: PathBuf,
        /// Name stored in the catalogue
        #[arg(long, default_value = "tycho2")]
        name: String,
    },
    /// What a catalogue holds
    Info {
        /// Catalogue file; none: the built-in one
        file: Option<PathBuf>,
    },
}

fn key_value(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => Ok((key.trim().to_owned(), value.trim().to_owned())),
        _ => Err(format!("{text:?} is not KEY=VALUE")),
    }
}
