//! Relations between keys that no single key can tell: what must be larger than what, which names must exist.

use toml::{Table, Value};

use super::fault::Fault;
use super::tree::{Node, has_targets, show};
use crate::astro::orbit::kepler::eccentric_anomaly;
use crate::astro::separation;
use crate::astro::tumble::checked_inertia;
use crate::base::constants::EARTH_RADIUS_M;
use crate::object::surface::files::BUILT_IN;
use glam::DVec3;

/// Everything wrong between the keys of a checked scene. `root` knows where they were written.
pub(super) fn faults(scene: &Table, root: &Node) -> Vec<Fault> {
    let look = Look { scene, root };
    let mut found = Vec::new();
    look.optics(&mut found);
    look.times(&mut found);
    look.targets(&mut found);
    look.frames(&mut found);
    look.output(&mut found);
    found
}

/// A list of so many numbers.
fn floats<const N: usize>(value: Option<&Value>) -> Option<[f64; N]> {
    let list = value?.as_array()?.iter().map(Value::as_float).collect::<Option<Vec<_>>>()?;
    list.try_into().ok()
}

struct Look<'a> {
    scene: &'a Table,
    root: &'a Node,
}

/// Most cosmic rays of a frame.
const MOST_RAYS: f64 = 1e7;

impl Look<'_> {
    fn get(&self, path: &str) -> Option<&Value> {
        let (table, key) = path.split_once('.')?;
        self.scene.get(table)?.as_table()?.get(key)
    }

    fn number(&self, path: &str) -> Option<f64> {
        match self.get(path)? {
            Value::Integer(int) => Some(*int as f64),
            Value::Float(real) => Some(*real),
            _ => None,
        }
    }

    fn text(&self, path: &str) -> Option<&str> {
        self.get(path)?.as_str()
    }

    /// The fault `path = value: message`, or `path: message` where the value is a default.
    fn fault(&self, path: &str, message: &str) -> Fault {
        let node = self.root.towards(path);
        let value = if node.entries().is_some() { String::new() } else { format!(" = {}", show(&node.value)) };
        Fault::new(path, &node.place, format!("{path}{value}: {message}"))
    }

    fn optics(&self, found: &mut Vec<Fault>) {
        if let (Some(hole), Some(aperture)) =
            (self.number("telescope.obstruction_m"), self.number("telescope.aperture_m"))
            && hole >= aperture
        {
            let message = format!("must be smaller than telescope.aperture_m = {aperture:?}");
            found.push(self.fault("telescope.obstruction_m", &message));
        }
        if let (Some(bias), Some(bits)) = (self.number("detector.bias_adu"), self.number("detector.bits")) {
            let top = libm::exp2(bits) - 1.0;
            if bias >= top {
                found.push(
                    self.fault(
                        "detector.bias_adu",
                        &format!("must lie below {top} ADU, the most {bits} bits hold"),
                    ),
                );
            }
        }
        if let Some([Value::Float(bright), Value::Float(faint)]) =
            self.get("stars.random_mag_v").and_then(Value::as_array).map(Vec::as_slice)
            && bright >= faint
        {
            found.push(self.fault("stars.random_mag_v", "the first must be the smaller magnitude"));
        }
    }

    fn times(&self, found: &mut Vec<Fault>) {
        let (Some(cadence), Some(duration)) =
            (self.number("exposures.cadence_s"), self.number("exposures.duration_s"))
        else {
            return;
        };
        let count = self.number("exposures.count").unwrap_or(1.0);
        let wrong = if cadence < duration {
            format!("must be at least exposures.duration_s = {duration:?} s")
        } else if cadence == 0.0 && count > 1.0 {
            "must be above 0 s where exposures.count is above 1".into()
        } else if cadence * count > 3.2e9 {
            format!("exposures.count = {count} of them last over 100 years")
        } else {
            return;
        };
        found.push(self.fault("exposures.cadence_s", &wrong));
    }

    fn targets(&self, found: &mut Vec<Fault>) {
        let written = has_targets(self.root);
        let targets = self.scene.get("target").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
        let names: Vec<&str> =
            targets.iter().map(|t| t.get("name").and_then(Value::as_str).unwrap_or_default()).collect();
        for (i, name) in names.iter().enumerate() {
            if let Some(first) = names[..i].iter().position(|other| other == name && !name.is_empty()) {
                found.push(
                    self.fault(&format!("target.{i}.name"), &format!("target.{first} has this name already")),
                );
            }
        }
        for (i, target) in targets.iter().enumerate() {
            self.orbit(i, target, found);
            self.shape(i, target, found);
            self.attitude(i, target, found);
        }
        if let Some(name) = self.text("pointing.target")
            && written
            && !names.contains(&name)
        {
            let known = names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
            found.push(self.fault("pointing.target", &format!("no [[target]] has this name; known: {known}")));
        }
        for path in ["pointing.at", "exposures.track", "output.crop"] {
            if !written && self.text(path) == Some("target") {
                found.push(self.fault(path, "the scene has no [[target]]"));
            }
        }
    }

    /// What no single key of an orbit can tell.
    fn orbit(&self, i: usize, target: &Value, found: &mut Vec<Fault>) {
        let orbit = |form: &str| target.get("orbit").and_then(|orbit| orbit.get(form));
        if orbit("kepler").and_then(|k| k.get("e")).and_then(Value::as_float) == Some(1.0) {
            found.push(self.fault(
                &format!("target.{i}.orbit.kepler.e"),
                "must be below 1; give a parabola or hyperbola as a state",
            ));
        }
        if let Some(kepler) = orbit("kepler") {
            let get = |key: &str| kepler.get(key).and_then(Value::as_float);
            if let (Some(a_km), Some(e), Some(mean)) =
                (get("a_km"), get("e").filter(|e| *e < 1.0), get("mean_anomaly_deg"))
            {
                let radius_km = a_km * (1.0 - e * eccentric_anomaly(mean.to_radians(), e).cos());
                if radius_km < EARTH_RADIUS_M / 1e3 {
                    let message = format!(
                        "at its epoch it lies {radius_km:.1} km from the Earth's centre; it must be above {:.1} km",
                        EARTH_RADIUS_M / 1e3
                    );
                    found.push(self.fault(&format!("target.{i}.orbit.kepler"), &message));
                }
            }
        }
        if let Some([x, y, z]) = orbit("state").and_then(|s| floats(s.get("position_km"))) {
            let radius_km = x.hypot(y).hypot(z);
            if radius_km < EARTH_RADIUS_M / 1e3 {
                let message = format!(
                    "it lies {radius_km:.1} km from the Earth's centre; it must be above {:.1} km",
                    EARTH_RADIUS_M / 1e3
                );
                found.push(self.fault(&format!("target.{i}.orbit.state.position_km"), &message));
            }
        }
    }

    /// What no single key of a shape can tell.
    fn shape(&self, i: usize, target: &Value, found: &mut Vec<Fault>) {
        let given = |key: &str| target.get(key).is_some();
        if !given("shape") {
            // with neither, the shape was wrong and is told already
            if !given("brightness") {
                return;
            }
            for key in ["shape_size_m", "material", "part"].into_iter().filter(|key| given(key)) {
                found.push(self.fault(&format!("target.{i}.{key}"), "only of a target with a shape"));
            }
            return;
        }
        if let Some(fixed) = target.get("orbit").and_then(|orbit| orbit.get("fixed"))
            && fixed.get("range_km").is_none()
        {
            let message = "range_km is required of a target with a shape: its brightness depends on its distance";
            found.push(self.fault(&format!("target.{i}.orbit.fixed"), message));
        }
        let fixed = target.get("orbit").is_some_and(|orbit| orbit.get("fixed").is_some());
        for (name, part) in target.get("part").and_then(Value::as_table).into_iter().flatten() {
            if fixed && part.get("point_to").and_then(Value::as_str) == Some("velocity") {
                let message = "a target with a fixed place has no velocity to follow";
                found.push(self.fault(&format!("target.{i}.part.{name}.point_to"), message));
            }
        }
        let built_in = target.get("shape").and_then(Value::as_str).is_some_and(|name| BUILT_IN.contains(&name));
        if given("shape_size_m") && !built_in {
            let message = "only of a built-in shape; a file has its own size, times shape_scale";
            found.push(self.fault(&format!("target.{i}.shape_size_m"), message));
        }
    }

    /// What no single key of an attitude can tell.
    fn attitude(&self, i: usize, target: &Value, found: &mut Vec<Fault>) {
        let Some(attitude) = target.get("attitude") else { return };
        let mut fault = |key: &str, message: &str| {
            found.push(self.fault(&format!("target.{i}.attitude.{key}"), message));
        };
        let zero = |values: &[f64]| values.iter().all(|x| *x == 0.0);
        if floats::<4>(attitude.get("quaternion")).is_some_and(|q| zero(&q)) {
            fault("quaternion", "one of its numbers must differ from 0");
        }
        for key in ["axis", "point_body", "turn_body"] {
            if floats::<3>(attitude.get(key)).is_some_and(|v| zero(&v)) {
                fault(key, "one of its numbers must differ from 0");
            }
        }
        if let (Some(point), Some(turn)) = (floats(attitude.get("point_body")), floats(attitude.get("turn_body")))
        {
            let (point, turn) = (DVec3::from_array(point), DVec3::from_array(turn));
            if separation(point, turn).sin() < 1e-9 && !zero(&turn.to_array()) && !zero(&point.to_array()) {
                fault("turn_body", "must not be parallel to point_body");
            }
        }
        if let Some(inertia) = floats(attitude.get("inertia_kg_m2"))
            && let Err(why) = checked_inertia(DVec3::from_array(inertia))
        {
            fault("inertia_kg_m2", &why.to_string());
        }
        let mode = attitude.get("mode").and_then(Value::as_str).unwrap_or_default();
        let fixed = target.get("orbit").is_some_and(|orbit| orbit.get("fixed").is_some());
        let towards = |key: &str| attitude.get(key).and_then(Value::as_str);
        let by_velocity = [towards("point_to"), towards("turn_to")].contains(&Some("velocity"));
        if fixed && (["nadir", "sun"].contains(&mode) || by_velocity) {
            let key = if by_velocity { "turn_to" } else { "mode" };
            fault(
                key,
                "a target with a fixed place has no velocity to turn by; use inertial, spin, aligned, tumble or table",
            );
        }
        if mode == "aligned" && towards("point_to") == towards("turn_to") {
            fault("turn_to", "must differ from point_to");
        }
    }

    fn output(&self, found: &mut Vec<Fault>) {
        let Some(formats) = self.get("output.format").and_then(Value::as_array) else { return };
        let fits = |format: &Value| matches!(format.as_str(), Some("fits" | "fits.fz"));
        if !formats.iter().any(fits) {
            found.push(self.fault(
                "output.format",
                "must contain \"fits\" or \"fits.fz\": photometry and resumption read the frames",
            ));
        }
    }

    fn frames(&self, found: &mut Vec<Fault>) {
        let binning = self.get("detector.binning").and_then(Value::as_integer).unwrap_or(1).max(1);
        let sides = match self.get("detector.size_px") {
            Some(Value::Integer(side)) => vec![*side],
            Some(Value::Array(sides)) => sides.iter().filter_map(Value::as_integer).collect(),
            _ => Vec::new(),
        };
        let number = |path: &str| {
            let value = self.get(path)?;
            value.as_float().or_else(|| value.as_integer().map(|n| n as f64))
        };
        let pixel_cm = number("detector.pixel_um").unwrap_or(0.0) * 1e-4;
        let [width, height] = [sides.first(), sides.last()].map(|side| side.map_or(0.0, |n| *n as f64));
        let duration = number("exposures.duration_s").unwrap_or(0.0);
        let rate = number("detector.cosmic_rays_per_cm2_s").unwrap_or(0.0);
        let rays = rate * width * height * pixel_cm * pixel_cm * duration;
        if rays > MOST_RAYS {
            let message = format!("makes {rays:.1e} rays a frame; at most {MOST_RAYS:.0e} are allowed");
            found.push(self.fault("detector.cosmic_rays_per_cm2_s", &message));
        }
        let warming =
            number("detector.temperature_c").unwrap_or(0.0) - number("detector.dark_temperature_c").unwrap_or(0.0);
        let doubling = number("detector.dark_doubling_c").unwrap_or(1.0);
        let dark = number("detector.dark_e_per_s").unwrap_or(0.0) * (warming / doubling).exp2() * duration;
        if dark.is_nan() || dark > 1e12 {
            let message = format!("makes {dark:.1e} e- of dark charge; at most 1e12 are allowed");
            found.push(self.fault("detector.dark_doubling_c", &message));
        }
        if let Some(side) = sides.iter().find(|side| *side % binning != 0) {
            found.push(self.fault("detector.binning", &format!("must divide the {side} px of detector.size_px")));
        }
        let integers = |path: &str| -> Option<Vec<i64>> {
            self.get(path)?.as_array()?.iter().map(Value::as_integer).collect()
        };
        let (Some(size), Some(crop)) = (integers("detector.size_px"), integers("output.crop")) else { return };
        let integer = |path: &str| self.get(path).and_then(Value::as_integer);
        let binning = integer("detector.binning").unwrap_or(1).max(1);
        let overscan = integer("detector.overscan_px").unwrap_or(0).max(0);
        if let ([width, height], [x0, y0, w, h]) = (size.as_slice(), crop.as_slice())
            && let (width, height) = ((width / binning).max(1) + overscan, (height / binning).max(1))
            && (*w < 1 || *h < 1 || x0 + w > width || y0 + h > height)
        {
            let message = format!("must be [x0, y0, width, height] within the frame of {width} x {height} px");
            found.push(self.fault("output.crop", &message));
        }
    }
}
