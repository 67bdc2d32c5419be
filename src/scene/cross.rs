//! Relations between keys that no single key can tell: what must be larger than what, which names must exist.

use toml::{Table, Value};

use super::fault::Fault;
use super::tree::{Node, has_targets, show};

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

struct Look<'a> {
    scene: &'a Table,
    root: &'a Node,
}

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

    fn output(&self, found: &mut Vec<Fault>) {
        let Some(formats) = self.get("output.format").and_then(Value::as_array) else { return };
        if !formats.iter().any(|format| format.as_str() == Some("fits")) {
            found.push(
                self.fault("output.format", "must contain \"fits\": photometry and resumption read the frames"),
            );
        }
    }

    fn frames(&self, found: &mut Vec<Fault>) {
        let integers = |path: &str| -> Option<Vec<i64>> {
            self.get(path)?.as_array()?.iter().map(Value::as_integer).collect()
        };
        let (Some(size), Some(crop)) = (integers("detector.size_px"), integers("output.crop")) else { return };
        if let ([width, height], [x0, y0, w, h]) = (size.as_slice(), crop.as_slice())
            && (*w < 1 || *h < 1 || x0 + w > *width || y0 + h > *height)
        {
            let message = format!("must be [x0, y0, width, height] within the frame of {width} x {height} px");
            found.push(self.fault("output.crop", &message));
        }
    }
}
