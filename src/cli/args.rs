//! What can be typed.

use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

/// Synthetic telescope frames of satellites, and the light curves in them.
#[derive(Debug, Parser)]
#[command(name = "nightglass", version, about, max_term_width = 110)]
pub struct Cli {
    #[command(subcommand)]
    pub(super) command: Command,
}

/// Options of every command. They belong to the command itself: options before it would silently give way to those
/// after it.
#[derive(Debug, Args)]
pub(super) struct Global {
    /// Directory (or file, for `init`, `catalog import` and `stations from-fits`) to write to
    #[arg(short = 'o', long = "output", value_name = "PATH")]
    pub output: Option<PathBuf>,
    /// Replace a key of the scene: key.path=value, the value in TOML, else a bare string; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Replace the scene's seed
    #[arg(long, allow_hyphen_values = true, value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    pub seed: Option<u64>,
    /// Number of threads (default: all cores); changes no pixel
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// One JSON object on stdout instead of text
    #[arg(long)]
    pub json: bool,
    /// Say more
    #[arg(short, long)]
    pub verbose: bool,
    /// Say nothing but errors
    #[arg(short, long, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Replace the output of another scene
    #[arg(long)]
    pub force: bool,
    /// Shadows of large shapes on a graphics processor: where it pays, never, or always
    #[arg(long, default_value = "auto", value_parser = ["auto", "off", "require"])]
    pub gpu: String,
}

/// A command's own arguments and the options of every command.
#[derive(Debug, Args)]
pub(super) struct With<T: Args> {
    #[command(flatten)]
    pub args: T,
    #[command(flatten)]
    pub global: Global,
}

/// No arguments of its own.
#[derive(Debug, Args)]
pub(super) struct Nothing {}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// The main job: plan, frames, photometry, light curve, report
    Run(With<RunArgs>),
    /// Geometry of every exposure, and windows: when a target can be observed, and why not when not
    Plan(With<PlanArgs>),
    /// Frames only; any subset or crop gives the pixels of the whole
    Render(With<RenderArgs>),
    /// The page report.html of what lies in a run's directory, made anew
    Report(With<ReportArgs>),
    /// The targets' light curves without images: horizon and daylight are ignored
    Lightcurve(With<SceneArgs>),
    /// Light curve from frames: pixels and headers
    Photometry(Box<With<PhotometryArgs>>),
    /// The shape behind a light curve: facets, body, boxes and panels, with what is sure of them
    Invert(With<InvertArgs>),
    /// Periods in a light curve, and what they may be mistaken for
    Period(With<PeriodArgs>),
    /// Error against run time of every approximation the scene uses, against its slow reference
    Accuracy(With<AccuracyArgs>),
    /// An epoch in every time scale
    Time(With<TimeArgs>),
    /// What is in the frames, what is left out and why, which noise dominates, what it costs
    Explain(With<SceneArgs>),
    /// Signal-to-noise ratio against anything, limiting magnitudes, best exposures; analytic and by frames measured
    #[command(after_help = crate::study::snr::setting::described())]
    Snr(With<SnrArgs>),
    /// Light of the whole sky: budget of every source, all-sky maps, the zenith over the night
    Sky(With<SkyArgs>),
    /// A commented scene to start from
    Init(With<InitArgs>),
    /// All faults of a scene at once
    Check(With<SceneArgs>),
    /// JSON Schema of the scene file
    Schema(With<Nothing>),
    /// Bias, dark and flat frames of a station's camera
    Calibrate(With<CalibrateArgs>),
    /// Many scenes that differ in some keys: run them, or look at the list and its cost first
    Campaign(Box<CampaignArgs>),
    /// Star catalogues: import, info
    Catalog(CatalogArgs),
    /// Built-in stations; one's own from a frame's header
    Stations(Box<StationsArgs>),
    /// Built-in scenes
    Scenes(With<Nothing>),
    /// A shape looked at: what it consists of, its faults, pictures; repaired if asked
    Shape(With<ShapeArgs>),
    /// Graphics processors of this machine
    Gpu(With<Nothing>),
    /// Shell completions
    Completions(With<CompletionArgs>),
}

impl Command {
    /// The options of every command.
    pub fn global(&self) -> &Global {
        match self {
            Self::Run(with) => &with.global,
            Self::Plan(with) => &with.global,
            Self::Time(with) => &with.global,
            Self::Accuracy(with) => &with.global,
            Self::Explain(with) | Self::Check(with) | Self::Lightcurve(with) => &with.global,
            Self::Render(with) => &with.global,
            Self::Report(with) => &with.global,
            Self::Sky(with) => &with.global,
            Self::Snr(with) => &with.global,
            Self::Calibrate(with) => &with.global,
            Self::Photometry(with) => &with.global,
            Self::Invert(with) => &with.global,
            Self::Period(with) => &with.global,
            Self::Init(with) => &with.global,
            Self::Catalog(CatalogArgs { action: CatalogAction::Import(with) }) => &with.global,
            Self::Catalog(CatalogArgs { action: CatalogAction::Info(with) }) => &with.global,
            Self::Stations(args) => match &args.action {
                Some(StationsAction::FromFits(with)) => &with.global,
                None => &args.global,
            },
            Self::Campaign(args) => match &args.action {
                CampaignAction::Run(with) | CampaignAction::Card(with) => &with.global,
            },
            Self::Schema(with) | Self::Scenes(with) | Self::Gpu(with) => &with.global,
            Self::Shape(with) => &with.global,
            Self::Completions(with) => &with.global,
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct ShapeArgs {
    /// OBJ or STL file, or the name of a built-in shape
    pub shape: String,
    /// Weld vertices, drop faces without area and duplicates, turn all faces outwards; with -o the mesh is written
    #[arg(long)]
    pub repair: bool,
}

#[derive(Debug, Args)]
pub(super) struct ReportArgs {
    /// Output directory of `run`
    pub dir: PathBuf,
}

#[derive(Debug, Args)]
pub(super) struct CompletionArgs {
    /// The shell
    pub shell: clap_complete::Shell,
}

#[derive(Debug, Args)]
pub(super) struct SceneArgs {
    /// Scene file, or the name of a built-in scene
    pub scene: String,
}

#[derive(Debug, Args)]
pub(super) struct AccuracyArgs {
    /// Scene file, or the name of a built-in scene
    pub scene: String,
    /// Wanted errors: a key of [accuracy] or an approximation and its error, or one number, a share of the noise of one exposure
    /// [default: the scene's own [accuracy]]
    #[arg(long, value_name = "NAME=ERROR", value_delimiter = ',', allow_hyphen_values = true)]
    pub wanted: Vec<String>,
    /// Write the suggested values into the scene file, and nothing else
    #[arg(long)]
    pub apply: bool,
}

#[derive(Debug, Args)]
pub(super) struct SkyArgs {
    /// Scene file, or the name of a built-in scene
    pub scene: String,
    /// The exposure at whose middle the sky is looked at
    #[arg(long, default_value_t = 0)]
    pub frame: usize,
}

#[derive(Debug, Args)]
pub(super) struct SnrArgs {
    /// Scene file, or the name of a built-in scene
    pub scene: String,
    /// Vary a numeric key of the scene or a parameter of the study: KEY=A..B:log:N, KEY=A..B:lin:N or KEY=A,B,C; once or
    /// twice; none: the magnitude about the limit
    #[arg(long, value_name = "KEY=VALUES", allow_hyphen_values = true)]
    pub sweep: Vec<String>,
    /// SNR of the limiting magnitude and of the exposure sought
    #[arg(long, value_name = "SNR", default_value_t = crate::study::snr::WANTED, value_parser = snr_wanted)]
    pub wanted: f64,
    /// Measure N frames of the target's surroundings for each row
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "200",
          value_parser = clap::value_parser!(u32).range(2..=crate::study::snr::monte_carlo::MOST as i64))]
    pub monte_carlo: Option<u32>,
    /// The exposure whose geometry counts [default: that of the most usual airmass]
    #[arg(long)]
    pub frame: Option<usize>,
    /// Time between two exposures [s] [default: cadence_s - duration_s]
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub dead_time: Option<f64>,
    /// Limiting magnitudes over the sky at that exposure: snr_map
    #[arg(long)]
    pub map: bool,
    /// Limiting magnitudes through its night: snr_night
    #[arg(long)]
    pub night: bool,
}

#[derive(Debug, Args)]
pub(super) struct PlanArgs {
    /// Scene file, or the name of a built-in scene
    pub scene: String,
    /// The windows instead of the exposures on stdout; --json has both, -o writes both and a chart of the night
    #[arg(long, conflicts_with = "catalog")]
    pub windows: bool,
    /// Windows of the objects in this file (two-line sets or orbit mean-elements messages) instead of the targets'
    #[arg(long, value_name = "FILE")]
    pub catalog: Option<PathBuf>,
    /// With --catalog: which objects cross the field while the shutter is open
    #[arg(long, requires = "catalog")]
    pub crossings: bool,
}

#[derive(Debug, Args)]
pub(super) struct TimeArgs {
    /// ISO 8601, "JD 2458138.5" or "MJD 58138.0", then UTC (unless given), TAI, TT, TDB, GPS or UT1; or "now"
    #[arg(required = true)]
    pub epoch: Vec<String>,
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
    #[arg(long, value_name = "A..B", allow_hyphen_values = true)]
    pub frames: Option<String>,
    /// Pixels x0,y0,width,height of each frame
    #[arg(long, value_name = "X0,Y0,W,H", allow_hyphen_values = true)]
    pub crop: Option<String>,
}

/// Formats of light curves beyond ECSV, TDM and SVG.
const FORMATS: &[&str] =
    if cfg!(feature = "parquet") { &["csv", "alcdef", "parquet"] } else { &["csv", "alcdef"] };

#[derive(Debug, Args)]
pub(super) struct InvertArgs {
    /// Light curves of one object: ECSV, CSV, ALCDEF, or DAMIT's lc.txt, with the directions to Sun and observer
    #[arg(required = true, value_name = "LIGHTCURVE")]
    pub lightcurves: Vec<PathBuf>,
    /// Scene that tells attitude and materials; its [inversion] how to seek, unless options do
    #[arg(long)]
    pub scene: Option<String>,
    /// Which target, where there are several
    #[arg(long)]
    pub target: Option<String>,
    /// Bodies tried: convex ones and, where these do not do, boxes and panels; one of both; or an older method
    #[arg(long, value_parser = ["auto", "convex", "nonconvex", "little", "ikeuchi", "nicolet", "draft"])]
    pub model: Option<String>,
    /// What the faces are made of: as the target is said to be, or specular share and exponent sought with the shape
    #[arg(long, value_parser = ["as-target", "fit"])]
    pub brdf: Option<String>,
    /// How the object turns: as the target is said to; about a pole sought over the whole sphere; or, experimental, as a body without
    /// torque, near the tumble told or with --period
    #[arg(long, value_parser = ["as-target", "scan-pole", "scan-tumble"])]
    pub attitude: Option<String>,
    /// Sidereal periods of the search for the pole, or seconds of a tumbler's turn about its angular momentum [s], such as 95..105
    #[arg(long, value_name = "A..B")]
    pub period: Option<String>,
    /// Share of the points kept from the fit to test it, in stretches of time; 0 = none
    #[arg(long, value_name = "SHARE")]
    pub held_out: Option<f64>,
    /// Mesh of the true shape, only compared with
    #[arg(long, value_name = "FILE")]
    pub truth: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(super) struct PeriodArgs {
    /// Light curve: ECSV, CSV, ALCDEF, or DAMIT's lc.txt
    pub lightcurve: PathBuf,
    /// Which target, where there are several
    #[arg(long)]
    pub target: Option<String>,
    /// Shortest period [s] (default: twice the median gap)
    #[arg(long, value_name = "S")]
    pub min_period: Option<f64>,
    /// Longest period [s] (default: the span)
    #[arg(long, value_name = "S")]
    pub max_period: Option<f64>,
    /// Harmonics
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u8).range(1..=8))]
    pub harmonics: u8,
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
    /// Measure whatever is no star: objects found in all frames and linked through them
    #[arg(long, conflicts_with_all = ["xy", "radec"])]
    pub find: bool,
    /// How to measure: fit the image, sum an aperture, or fit the stars beside it too
    #[arg(long, value_parser = ["optimal", "aperture", "joint"])]
    pub method: Option<String>,
    /// Star catalogue made by `catalog import`, in place of the scene's or the built-in one
    #[arg(long, value_name = "FILE")]
    pub catalog: Option<PathBuf>,
    /// Columns of what the errors are made of
    #[arg(long)]
    pub errors: bool,
    /// A picture of each measurement in finder/ of the directory of -o: the target, its aperture, the stars beside it
    #[arg(long, requires = "output")]
    pub finder: bool,
    /// Further formats written to the directory of -o
    #[arg(long, value_name = "FORMAT", value_delimiter = ',', value_parser = clap::builder::PossibleValuesParser::new(FORMATS))]
    pub also: Vec<String>,
    #[command(flatten)]
    pub instead: HeaderArgs,
    #[command(flatten)]
    pub calibration: CalibrationArgs,
}

/// What counts in place of a frame's header.
#[derive(Debug, Args)]
#[command(next_help_heading = "In place of the header")]
pub(super) struct HeaderArgs {
    /// Gain [e-/adu]
    #[arg(long, value_name = "E_ADU")]
    pub gain: Option<f64>,
    /// Read noise [e-]
    #[arg(long, value_name = "E")]
    pub read_noise: Option<f64>,
    /// Level from which a pixel is saturated [adu]
    #[arg(long, value_name = "ADU")]
    pub saturate: Option<f64>,
    /// Bias level [adu]
    #[arg(long, value_name = "ADU", allow_hyphen_values = true)]
    pub bias: Option<f64>,
    /// Exposure time [s]
    #[arg(long, value_name = "S")]
    pub exptime: Option<f64>,
    /// Start of the exposure, UTC, ISO 8601
    #[arg(long, value_name = "UTC")]
    pub time: Option<String>,
    /// Side of a pixel on the sky [arcsec]
    #[arg(long, value_name = "ARCSEC")]
    pub pixel_scale: Option<f64>,
    /// Position angle of the frame's +y, from north through east [deg]
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    pub rotation: Option<f64>,
    /// The frame is a mirror image: with +y to the north, +x goes east
    #[arg(long)]
    pub mirrored: bool,
    /// Width of a point's image, FWHM [arcsec]
    #[arg(long, value_name = "ARCSEC")]
    pub seeing: Option<f64>,
    /// Diameter of the telescope [mm]
    #[arg(long, value_name = "MM")]
    pub aperture_mm: Option<f64>,
    /// Height of the site above the sea [m]
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub elevation: Option<f64>,
    /// Rate of the frame among the stars, dRA/dt cos Dec and dDec/dt [arcsec/s]
    #[arg(long, value_name = "RA,DEC", allow_hyphen_values = true)]
    pub track: Option<String>,
}

/// Calibration frames.
#[derive(Debug, Args)]
#[command(next_help_heading = "Calibration frames, raw ones or a master")]
pub(super) struct CalibrationArgs {
    /// Bias frames
    #[arg(long, value_name = "FRAME", num_args = 1..)]
    pub biases: Vec<PathBuf>,
    /// Dark frames
    #[arg(long, value_name = "FRAME", num_args = 1..)]
    pub darks: Vec<PathBuf>,
    /// Flat frames
    #[arg(long, value_name = "FRAME", num_args = 1..)]
    pub flats: Vec<PathBuf>,
}

#[derive(Debug, Args)]
pub(super) struct CalibrateArgs {
    /// Station file, or the name of a built-in station
    pub station: String,
    /// Frames of each kind
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    pub count: u16,
    /// Exposure of the darks [s]
    #[arg(long, value_name = "S", default_value_t = 60.0, value_parser = seconds)]
    pub dark: f64,
    /// Exposure of the flats [s]
    #[arg(long, value_name = "S", default_value_t = 5.0, value_parser = seconds)]
    pub flat: f64,
    /// Level of the flats, share of saturation
    #[arg(long, default_value_t = 0.5, value_parser = share)]
    pub level: f64,
}

#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(super) struct StationsArgs {
    #[command(subcommand)]
    pub action: Option<StationsAction>,
    #[command(flatten)]
    pub global: Global,
}

#[derive(Debug, Subcommand)]
pub(super) enum StationsAction {
    /// A station file (-o FILE) from the header and the pixels of a camera's frame, each value with its origin
    FromFits(With<FromFitsArgs>),
}

#[derive(Debug, Args)]
pub(super) struct FromFitsArgs {
    /// FITS frame of the camera
    pub frame: PathBuf,
    #[command(flatten)]
    pub instead: HeaderArgs,
}

#[derive(Debug, Args)]
pub(super) struct InitArgs {
    /// A built-in scene or station; none: every key, commented
    pub name: Option<String>,
}

#[derive(Debug, Args)]
pub(super) struct CampaignArgs {
    #[command(subcommand)]
    pub action: CampaignAction,
}

#[derive(Debug, Subcommand)]
pub(super) enum CampaignAction {
    /// Run all scenes into directories of their own (-o DIR); finished ones are kept, failed ones stop no other
    Run(With<CampaignFile>),
    /// The scenes, what they set, how long they take and how large they are; nothing is run
    Card(With<CampaignFile>),
}

#[derive(Debug, Args)]
pub(super) struct CampaignFile {
    /// Campaign file: TOML with base, [set], [grid], [[scene]]
    pub file: PathBuf,
}

#[derive(Debug, Args)]
pub(super) struct CatalogArgs {
    #[command(subcommand)]
    pub action: CatalogAction,
}

#[derive(Debug, Subcommand)]
pub(super) enum CatalogAction {
    /// Make a catalogue file (-o FILE) from a table of stars or an astrometry.net index
    ///
    /// A table is text with a line of names (parted by comma, semicolon, tab, bar or blanks; ECSV too) or a FITS binary
    /// table, in degrees, magnitudes and mas/yr. Columns with the names of Gaia, Tycho-2, Hipparcos and VizieR are
    /// recognised; others can be said. V of Gaia's and Tycho's magnitudes follows by the published relations. An index
    /// is such as Debian's astrometry-data-tycho2-07-littleendian has.
    Import(With<Box<ImportArgs>>),
    /// What a catalogue holds
    Info(With<InfoArgs>),
}

#[derive(Debug, Args)]
pub(super) struct ImportArgs {
    /// Table of stars or FITS index
    pub file: PathBuf,
    /// Name stored in the catalogue, up to 24 bytes [default: "tycho2" of an index, else the file's]
    #[arg(long)]
    pub name: Option<String>,
    /// Column of right ascension [deg]
    #[arg(long, value_name = "COL", requires = "dec")]
    pub ra: Option<String>,
    /// Column of declination [deg]
    #[arg(long, value_name = "COL", requires = "ra")]
    pub dec: Option<String>,
    /// Column of Johnson V
    #[arg(long, value_name = "COL", conflicts_with = "g")]
    pub mag: Option<String>,
    /// Column of Gaia's G
    #[arg(long, value_name = "COL")]
    pub g: Option<String>,
    /// Column of Gaia's BP
    #[arg(long, value_name = "COL", requires = "rp")]
    pub bp: Option<String>,
    /// Column of Gaia's RP
    #[arg(long, value_name = "COL", requires = "bp")]
    pub rp: Option<String>,
    /// Column of B-V
    #[arg(long, value_name = "COL")]
    pub bv: Option<String>,
    /// Column of proper motion in right ascension, times cos Dec [mas/yr]
    #[arg(long, value_name = "COL", requires = "pmdec")]
    pub pmra: Option<String>,
    /// Column of proper motion in declination [mas/yr]
    #[arg(long, value_name = "COL", requires = "pmra")]
    pub pmdec: Option<String>,
    /// Julian year of the places [default: the column ref_epoch, else that of the catalogue whose names the columns have]
    #[arg(long, value_name = "YEAR", value_parser = julian_year)]
    pub epoch: Option<f64>,
    /// V to which the table is complete where it has stars [default: where its counts turn over]
    #[arg(long, value_name = "MAG", allow_hyphen_values = true, value_parser = completeness)]
    pub complete_to: Option<f64>,
    /// Table of stars whose colours and motions the catalogue takes over, and those of them that it lacks
    #[arg(long, value_name = "FILE")]
    pub supplement: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(super) struct InfoArgs {
    /// Catalogue file; none: the built-in one
    pub file: Option<PathBuf>,
}

fn key_value(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => Ok((key.trim().to_owned(), value.trim().to_owned())),
        _ => Err(format!("{text:?} is not KEY=VALUE")),
    }
}

fn julian_year(text: &str) -> Result<f64, String> {
    number_within(text, crate::stars::listing::YEARS)
}

fn completeness(text: &str) -> Result<f64, String> {
    number_within(text, [crate::stars::completeness::NOWHERE, 32.0])
}

fn seconds(text: &str) -> Result<f64, String> {
    number_within(text, [0.0, 1e6])
}

fn snr_wanted(text: &str) -> Result<f64, String> {
    number_within(text, [0.01, 1e6])
}

fn share(text: &str) -> Result<f64, String> {
    number_within(text, [0.0, 10.0])
}

fn number_within(text: &str, [low, high]: [f64; 2]) -> Result<f64, String> {
    let found = text.parse::<f64>().map_err(|_| "no number".to_owned())?;
    if (low..=high).contains(&found) { Ok(found) } else { Err(format!("{found} is outside {low} .. {high}")) }
}
