//! From a checked TOML table to the scene's types and back, key by key.

use toml::{Table as Plain, Value};

use super::field::{Field, Section, get, inner, integer, put};
use super::instrument::{Detector, Psf, Station, Table, Telescope};
use super::shaped::table_of;
use super::target::{load_attitude, load_files, path_of};
use super::types::*;
use super::value::epoch;
use crate::base::accuracy::Accuracy;

/// Sections whose fields are their keys one to one.
macro_rules! section {
    ($type:ident $form:literal: $($field:ident)+) => {
        impl Section for $type {
            fn read(table: &Plain) -> Result<Self, String> {
                Ok($type { $($field: get(table, stringify!($field))?),+ })
            }
            fn write(&self, table: &mut Plain) {
                $(put(table, $form, stringify!($field), &self.$field);)+
            }
        }
    };
}

section!(Station "station": name latitude_deg longitude_deg height_m pressure_hpa temperature_c humidity
    seeing_arcsec artificial_zenith_mcd_m2 light_atlas light_domes extinction ground_albedo horizon_deg scintillation
    scintillation_factor);
section!(Detector "detector": size_px pixel_um kind binning qe gain_e_per_adu read_noise_e dark_e_per_s
    dark_temperature_c temperature_c dark_doubling_c bias_adu bias_structure_adu full_well_e bits prnu dsnu
    hot_pixel_fraction blooming cosmic_rays_per_cm2_s cti nonlinearity overscan_px shutter_s frame_transfer_s
    cmos_read_noise_spread cmos_gain_spread pattern_seed);
section!(PlanLimits "plan": min_el_deg max_sun_el_deg min_moon_sep_deg sunlit limit_mag_v min_snr);
section!(Sky "sky": airglow pollution twilight starlight moonlight zodiacal f107_sfu tilt);
section!(Stars "stars": enabled catalog synthetic limit_mag_v random_count random_mag_v random_seed);
section!(Photometry "photometry": method aperture_px search_px background_px min_stars);
section!(Accuracy "accuracy": omit brightness sky psf trail_px position_mas);
section!(Output "output": format planes star_table crop crop_px full_every report);

/// Arcseconds in a radian.
const ARCSEC: f64 = 206_264.806_247_096_36;

impl Telescope {
    /// Reads the optics; the pixel they shine on gives plate scale from focal length or the reverse.
    fn read(table: &Plain, pixel_m: f64) -> Result<Self, String> {
        let scale: Option<f64> = get(table, "plate_scale_arcsec")?;
        let focal: Option<f64> = get(table, "focal_length_m")?;
        let (plate_scale_arcsec, focal_length_m) = match (scale, focal) {
            (Some(scale), _) => (scale, ARCSEC * pixel_m / scale),
            (None, Some(focal)) => (ARCSEC * pixel_m / focal, focal),
            (None, None) => return Err("plate_scale_arcsec".into()),
        };
        Ok(Self {
            aperture_m: get(table, "aperture_m")?,
            obstruction_m: get(table, "obstruction_m")?,
            plate_scale_arcsec,
            focal_length_m,
            throughput: get(table, "throughput")?,
            filter: get(table, "filter")?,
            position_angle_deg: get(table, "position_angle_deg")?,
            mirrored: get(table, "mirrored")?,
            psf: get(table, "psf")?,
            moffat_beta: get::<Option<f64>>(table, "moffat_beta")?.unwrap_or(3.0),
            vignetting: get(table, "vignetting")?,
            sip: get(table, "sip")?,
            tilt_deg: get(table, "tilt_deg")?,
        })
    }

    fn write(&self, table: &mut Plain) {
        let focal = table.contains_key("focal_length_m").then_some(self.focal_length_m);
        let beta = (self.psf == Psf::Moffat).then_some(self.moffat_beta);
        put(table, "telescope", "aperture_m", &self.aperture_m);
        put(table, "telescope", "obstruction_m", &self.obstruction_m);
        put(table, "telescope", "plate_scale_arcsec", &focal.is_none().then_some(self.plate_scale_arcsec));
        put(table, "telescope", "focal_length_m", &focal);
        put(table, "telescope", "throughput", &self.throughput);
        put(table, "telescope", "filter", &self.filter);
        put(table, "telescope", "position_angle_deg", &self.position_angle_deg);
        put(table, "telescope", "mirrored", &self.mirrored);
        put(table, "telescope", "psf", &self.psf);
        put(table, "telescope", "moffat_beta", &beta);
        put(table, "telescope", "vignetting", &self.vignetting);
        put(table, "telescope", "sip", &self.sip);
        put(table, "telescope", "tilt_deg", &self.tilt_deg);
    }
}

impl Section for Pointing {
    fn read(table: &Plain) -> Result<Self, String> {
        let at = match get::<String>(table, "at")?.as_str() {
            "radec" => At::RaDec { ra_deg: get(table, "ra_deg")?, dec_deg: get(table, "dec_deg")? },
            "azel" => At::AzEl { az_deg: get(table, "az_deg")?, el_deg: get(table, "el_deg")? },
            _ => At::Target(get(table, "target")?),
        };
        Ok(Self { at, offset_px: get(table, "offset_px")? })
    }

    fn write(&self, table: &mut Plain) {
        let (mut target, mut places) = (None, [None; 4]);
        let at: &str = match &self.at {
            At::Target(name) => {
                target.clone_from(name);
                "target"
            }
            At::RaDec { ra_deg, dec_deg } => {
                places = [Some(*ra_deg), Some(*dec_deg), None, None];
                "radec"
            }
            At::AzEl { az_deg, el_deg } => {
                places = [None, None, Some(*az_deg), Some(*el_deg)];
                "azel"
            }
        };
        put(table, "pointing", "at", &at.to_string());
        put(table, "pointing", "target", &target);
        for (name, place) in ["ra_deg", "dec_deg", "az_deg", "el_deg"].iter().zip(&places) {
            put(table, "pointing", name, place);
        }
        put(table, "pointing", "offset_px", &self.offset_px);
    }
}

impl Section for Inversion {
    fn read(table: &Plain) -> Result<Self, String> {
        let word = |name: &str| table.get(name).and_then(Value::as_str);
        let own = |name: &str| table.get(name).and_then(Value::as_table);
        let inside = |name: &'static str| move |key: String| format!("{name}.{key}");
        Ok(Self {
            enabled: get(table, "enabled")?,
            model: get(table, "model")?,
            brdf: match (own("brdf"), word("brdf")) {
                (Some(keys), _) => Law::Given(Box::new(MaterialKeys::read(keys).map_err(inside("brdf"))?)),
                (None, Some("fit")) => Law::Fit,
                _ => Law::AsTarget,
            },
            attitude: match (own("attitude"), word("attitude")) {
                (Some(keys), _) => Turning::Given(Box::new(Attitude::read(keys).map_err(inside("attitude"))?)),
                (None, Some("scan-pole")) => Turning::ScanPole,
                (None, Some("scan-tumble")) => Turning::ScanTumble,
                _ => Turning::AsTarget,
            },
            truth: word("truth").map(Into::into),
            held_out: get(table, "held_out")?,
        })
    }

    /// The rest stands in the table as it was checked.
    fn write(&self, table: &mut Plain) {
        put(table, "inversion", "enabled", &self.enabled);
        put(table, "inversion", "model", &self.model);
        put(table, "inversion", "held_out", &self.held_out);
    }
}

impl Inversion {
    /// Take in a file that one of its keys names.
    fn take(&mut self, input: &InputFile) -> Result<(), String> {
        match (input.key.as_str(), &mut self.brdf, &mut self.attitude) {
            ("inversion.truth", ..) => self.truth = Some(input.path.clone()),
            ("inversion.brdf.brdf", Law::Given(keys), _) => keys.brdf = Table::File(input.path.clone()),
            ("inversion.attitude.file", _, Turning::Given(attitude)) => {
                if let Attitude::Table { file, .. } = &mut **attitude {
                    file.clone_from(&input.path);
                }
                load_attitude(attitude)?;
            }
            _ => {}
        }
        Ok(())
    }
}

impl Section for Exposures {
    fn read(table: &Plain) -> Result<Self, String> {
        let time = table.get("start").and_then(Value::as_datetime).ok_or("start")?;
        let track = match get::<String>(table, "track")?.as_str() {
            "sidereal" => Track::Sidereal,
            "fixed" => Track::Fixed,
            "rates" => Track::Rates(get(table, "rate_arcsec_s")?),
            _ => Track::Target,
        };
        Ok(Self {
            start: epoch(time).ok_or("start")?,
            start_text: time.to_string(),
            count: get(table, "count")?,
            cadence_s: get(table, "cadence_s")?,
            duration_s: get(table, "duration_s")?,
            track,
            only_observable: get(table, "only_observable")?,
        })
    }

    fn write(&self, table: &mut Plain) {
        if let Ok(time) = self.start_text.parse() {
            table.insert("start".into(), Value::Datetime(time));
        }
        put(table, "exposures", "count", &self.count);
        put(table, "exposures", "cadence_s", &self.cadence_s);
        put(table, "exposures", "duration_s", &self.duration_s);
        let (track, rate) = match &self.track {
            Track::Target => ("target", None),
            Track::Sidereal => ("sidereal", None),
            Track::Fixed => ("fixed", None),
            Track::Rates(rate) => ("rates", rate.write()),
        };
        put(table, "exposures", "track", &track.to_string());
        match rate {
            Some(rate) => table.insert("rate_arcsec_s".into(), rate),
            None => table.remove("rate_arcsec_s"),
        };
        put(table, "exposures", "only_observable", &self.only_observable);
    }
}

/// The scene of a checked table; the error is the path of a key that the checks should not have let through.
pub(super) fn read(table: Plain, inputs: Vec<InputFile>) -> Result<Scene, String> {
    fn part<T: Section>(table: &Plain, name: &str) -> Result<T, String> {
        T::read(inner(table, name)?).map_err(|key| format!("{name}.{key}"))
    }
    let detector: Detector = part(&table, "detector")?;
    let pixel_m = detector.pixel_um * 1e-6 * detector.binning as f64;
    let targets = table.get("target").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let target = targets.iter().map(|t| Target::read(t.as_table().ok_or("target")?));
    let mut scene = Scene {
        schema_version: get(&table, "schema_version")?,
        name: get(&table, "name")?,
        seed: get(&table, "seed")?,
        station: part(&table, "station")?,
        telescope: Telescope::read(inner(&table, "telescope")?, pixel_m)
            .map_err(|key| format!("telescope.{key}"))?,
        detector,
        pointing: part(&table, "pointing")?,
        exposures: part(&table, "exposures")?,
        plan: part(&table, "plan")?,
        target: target.collect::<Result<_, String>>().map_err(|key| format!("target: {key}"))?,
        sky: part(&table, "sky")?,
        stars: part(&table, "stars")?,
        photometry: part(&table, "photometry")?,
        inversion: part(&table, "inversion")?,
        accuracy: part(&table, "accuracy")?,
        output: part(&table, "output")?,
        resolved: table,
        inputs: Vec::new(),
    };
    for input in &inputs {
        if let Some(table) = named_table(&mut scene, &input.key) {
            *table = Table::File(input.path.clone());
        }
        if input.key == "telescope.psf" {
            scene.telescope.psf = Psf::Image(input.path.clone());
        }
        scene.inversion.take(input)?;
        if let Some(path) = path_of(&mut scene.target, &input.key) {
            path.clone_from(&input.path);
        }
        if let Some(table) = table_of(&mut scene.target, &input.key) {
            *table = Table::File(input.path.clone());
        }
    }
    load_files(&mut scene.target)?;
    scene.inputs = inputs;
    Ok(scene)
}

/// The field that may name a file, by its key.
fn named_table<'a>(scene: &'a mut Scene, key: &str) -> Option<&'a mut Table> {
    match key {
        "station.extinction" => Some(&mut scene.station.extinction),
        "station.light_atlas" => Some(&mut scene.station.light_atlas),
        "telescope.filter" => Some(&mut scene.telescope.filter),
        "telescope.sip" => Some(&mut scene.telescope.sip),
        "detector.qe" => Some(&mut scene.detector.qe),
        "stars.catalog" => Some(&mut scene.stars.catalog),
        _ => None,
    }
}

/// Put the name of a file at a place below a table.
fn rename(table: &mut Plain, place: &str, name: String) {
    match place.split_once('.') {
        Some((outer, inner)) => {
            if let Some(Value::Table(own)) = table.get_mut(outer) {
                rename(own, inner, name);
            }
        }
        None => {
            table.insert(place.into(), name.into());
        }
    }
}

/// The scene as a table again; `file` names a file that the scene names.
pub(super) fn write(scene: &Scene, file: impl Fn(&InputFile) -> String) -> Plain {
    let mut table = scene.resolved.clone();
    table.insert("name".into(), scene.name.as_str().into());
    table.insert("seed".into(), integer(scene.seed));
    let mut part = |name: &str, fill: &dyn Fn(&mut Plain)| {
        if let Some(Value::Table(own)) = table.get_mut(name) {
            fill(own);
        }
    };
    part("station", &|own| scene.station.write(own));
    part("telescope", &|own| scene.telescope.write(own));
    part("detector", &|own| scene.detector.write(own));
    part("pointing", &|own| scene.pointing.write(own));
    part("exposures", &|own| scene.exposures.write(own));
    part("plan", &|own| scene.plan.write(own));
    part("sky", &|own| scene.sky.write(own));
    part("stars", &|own| scene.stars.write(own));
    part("photometry", &|own| scene.photometry.write(own));
    part("inversion", &|own| scene.inversion.write(own));
    part("accuracy", &|own| scene.accuracy.write(own));
    part("output", &|own| scene.output.write(own));
    let mut copy = scene.clone();
    for input in &scene.inputs {
        if let Some(place) = input.key.strip_prefix("inversion.") {
            part("inversion", &|own| rename(own, place, file(input)));
        }
        if let Some(path) = path_of(&mut copy.target, &input.key).filter(|path| **path == input.path) {
            *path = file(input).into();
        }
        if let Some(table) = table_of(&mut copy.target, &input.key)
            && matches!(table, Table::File(path) if *path == input.path)
        {
            *table = Table::File(file(input).into());
        }
        let own = named_table(&mut copy, &input.key).cloned();
        let (Some((name, key)), Some(Table::File(path))) = (input.key.split_once('.'), own) else { continue };
        if path == input.path {
            part(name, &|own| {
                own.insert(key.into(), file(input).into());
            });
        }
    }
    if copy.target.is_empty() {
        table.remove("target");
    } else {
        let target = copy.target.iter().map(|target| {
            let mut own = Plain::new();
            target.write(&mut own);
            Value::Table(own)
        });
        let target = Value::Array(target.collect());
        table.insert("target".into(), target);
    }
    table
}
