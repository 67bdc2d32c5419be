//! Diffuse light of the sky: six sources, each a mean number of electrons per pixel towards a direction.
//!
//! Light from above the atmosphere (starlight, zodiacal light, airglow with its own effective extinction) is dimmed
//! once; light measured at the ground (pollution, twilight) or worked out there (scattered moonlight) is not dimmed again.
//! Twilight and pollution are the excess over the natural sky, so that the dark sky is counted once. All sources of a
//! frame are summed before the one Poisson draw.
//!
//! Each source first says whether it is needed ([`Source::assess`]); what is negligible together is left out
//! together ([`compose`]).

pub mod airglow;
pub mod context;
pub mod draft;
pub mod field;
pub mod krisciunas_schaefer;
pub mod moon_disc;
pub mod moonlight;
pub mod pollution;
pub mod response;
pub mod scattering;
pub mod starlight;
pub mod surface;
pub mod twilight;
pub mod zodiacal;

pub use context::{Context, Field, Toward};

use crate::base::ledger::{Row, Verdict, Why};
use crate::base::surface_brightness::MagArcsec2;
use crate::scene::{Sky, SkyModel};
use crate::stars::drawn::Drawn;

/// A frame's samples may miss the brightest place by this factor.
const BETWEEN_SAMPLES: f64 = 1.1;

/// One source of diffuse light.
pub trait Source: Sync {
    /// Name in the ledger.
    fn name(&self) -> &'static str;
    /// Keyword of its mean in the header.
    fn keyword(&self) -> &'static str;
    /// Model and reference.
    fn basis(&self) -> String;
    /// Why it cannot reach the field or is outside its model there; nothing if it can shine.
    fn absent(&self, field: &Field) -> Option<Why>;
    /// Mean \[e-/px\] in the exposure; NaN where the direction is outside the model.
    fn mean(&self, toward: &Toward) -> f64;
    /// Relative uncertainty of the mean, 1 sigma.
    fn uncertainty(&self) -> f64;

    /// Whether it can reach the field, and at most how much of it.
    fn assess(&self, field: &Field) -> Verdict {
        if let Some(why) = self.absent(field) {
            return Verdict::Absent(why);
        }
        let brightest = field
            .samples
            .iter()
            .map(|t| self.mean(t))
            .fold(0.0, |a: f64, b| if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) });
        if brightest.is_nan() {
            return Verdict::Absent(Why::OutsideModel(format!("{} in this field", self.basis())));
        }
        Verdict::Needed { bound: BETWEEN_SAMPLES * brightest }
    }
}

/// Largest less smallest mean over a field's samples, as a share of the centre's.
pub fn gradient(source: &dyn Source, field: &Field) -> f64 {
    let means = field.samples.iter().map(|t| source.mean(t));
    let (low, high) = means.fold((f64::INFINITY, 0.0f64), |(low, high), m| (low.min(m), high.max(m)));
    let centre = source.mean(field.centre());
    if centre > 0.0 { (high - low) / centre } else { 0.0 }
}

/// The six sources of a frame, in the order of the header; `drawn` says which stars are drawn one by one.
pub fn sources<'a>(context: &'a Context<'a>, drawn: &Drawn) -> Vec<Box<dyn Source + 'a>> {
    let Sky { airglow, pollution, twilight, starlight, moonlight, zodiacal, .. } = &context.scene.sky;
    let choose = |model: &SkyModel, name, keyword, modelled: &dyn Fn(&str) -> Box<dyn Source + 'a>| match model {
        SkyModel::Auto => modelled("auto"),
        SkyModel::Named(model) => modelled(model),
        SkyModel::Off => Box::new(surface::Surface::off(name, keyword)) as Box<dyn Source>,
        SkyModel::Surface(mag) => Box::new(surface::Surface::new(context, name, keyword, MagArcsec2(*mag))),
    };
    vec![
        choose(airglow, "sky.airglow", "SKYAIRG", &|_| Box::new(airglow::Airglow::new(context))),
        choose(pollution, "sky.pollution", "SKYPOLL", &|model| match model {
            "draft" => Box::new(draft::OverCosine::pollution(context)),
            _ => Box::new(pollution::Pollution::new(context)),
        }),
        choose(twilight, "sky.twilight", "SKYTWIL", &|model| match model {
            "draft" => Box::new(draft::OverCosine::twilight(context)),
            "yoachim" => Box::new(twilight::Twilight::yoachim(context)),
            _ => Box::new(twilight::Twilight::patat(context)),
        }),
        choose(starlight, "sky.starlight", "SKYSTAR", &|_| Box::new(starlight::Starlight::new(context, drawn))),
        choose(moonlight, "sky.moonlight", "SKYMOON", &|model| match model {
            "draft" => Box::new(draft::Moonlight::new(context)),
            "krisciunas-schaefer" => Box::new(krisciunas_schaefer::Moonlight::new(context)),
            _ => Box::new(moonlight::Moonlight::new(context)),
        }),
        choose(zodiacal, "sky.zodiacal", "SKYZODI", &|model| match model {
            "roach" => Box::new(zodiacal::Zodiacal::roach(context)),
            _ => Box::new(zodiacal::Zodiacal::leinert(context)),
        }),
    ]
}

/// The sources that take part in a frame, and what the ledger says of all of them. The faintest are left out
/// while the sum of their bounds stays below `allowed` \[e-/px\]; an explicitly named model or number is kept.
pub fn compose<'s, 'a>(
    context: &Context,
    sources: &'s [Box<dyn Source + 'a>],
    allowed: f64,
) -> (Vec<&'s (dyn Source + 'a)>, Vec<Row>) {
    let (sky, field) = (&context.scene.sky, &context.field);
    let mut verdicts = sources.iter().map(|s| s.assess(field)).collect::<Vec<_>>();
    let models = [&sky.airglow, &sky.pollution, &sky.twilight, &sky.starlight, &sky.moonlight, &sky.zodiacal];
    let mut faintest_first = (0..sources.len())
        .filter_map(|i| match verdicts[i] {
            Verdict::Needed { bound } if *models[i] == SkyModel::Auto => Some((i, bound)),
            _ => None,
        })
        .collect::<Vec<_>>();
    faintest_first.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut omitted = 0.0;
    for (i, bound) in faintest_first {
        omitted += bound;
        if omitted > allowed {
            break;
        }
        verdicts[i] = Verdict::Absent(Why::Negligible { bound, allowed });
    }
    let row = |source: &dyn Source, verdict: &Verdict| {
        let mut row = Row::new(source.name(), verdict, &source.basis());
        if verdict.is_needed() {
            row.mean_e_px = source.mean(field.centre());
            row.gradient = gradient(source, field);
            row.uncertainty = source.uncertainty();
        }
        row
    };
    let rows = sources.iter().zip(&verdicts).map(|(s, v)| row(&**s, v)).collect();
    let needed = sources.iter().zip(&verdicts).filter(|(_, v)| v.is_needed()).map(|(s, _)| &**s).collect();
    (needed, rows)
}
