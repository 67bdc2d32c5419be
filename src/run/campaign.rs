//! Campaigns: many scenes that differ from a base scene in some keys.
//!
//! ```text
//! base = "pogs-geo"                        # a built-in scene, or a file beside this one
//! [set]                                    # of all scenes
//! "exposures.count" = 3
//! [grid]                                   # every combination
//! "target.0.brightness.mag_v" = [11.0, 13.0]
//! [[scene]]                                # or one by one; with a grid, each with every combination
//! name = "moonlit"
//! set = { "exposures.start" = "2018-02-05T11:00:00Z" }
//! [[scene]]
//! tle = "satellites.tle"                   # one scene an element set: its orbit and name become the first target's
//! ```

use crate::astro::orbit::tle::Tle;
use crate::io::curve_file;
use crate::scene::{Options, Scene, load};
use std::fmt;
use std::path::{Path, PathBuf};
use toml::Value;

/// Most scenes of a campaign.
const MOST: usize = 100_000;

/// One scene of a campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Number, from 0.
    pub number: usize,
    /// Its name.
    pub name: String,
    /// Keys and values that it sets, in order; later ones win.
    pub sets: Vec<(String, String)>,
}

impl Entry {
    /// The name of its directory: number and name.
    pub fn folder(&self) -> String {
        format!("{:04}_{}", self.number, self.name)
    }

    /// What it sets, in words.
    pub fn told(&self) -> String {
        self.sets.iter().map(|(key, value)| format!("{key}={value}")).collect::<Vec<_>>().join("; ")
    }
}

/// A campaign, expanded.
#[derive(Debug, Clone, PartialEq)]
pub struct Campaign {
    /// The base scene: a path or a built-in name.
    pub base: String,
    /// Its scenes.
    pub entries: Vec<Entry>,
}

/// Everything wrong with a campaign; a line each.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CampaignError(pub Vec<String>);

impl fmt::Display for CampaignError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.join("\n"))
    }
}

impl std::error::Error for CampaignError {}

/// A set of keys with the name it gives.
#[derive(Debug, Clone, Default)]
struct Part {
    name: String,
    sets: Vec<(String, String)>,
}

impl Campaign {
    /// The campaign of a file's text; `file` names it, and its paths are relative to it.
    ///
    /// # Errors
    /// [`CampaignError`] with all faults at once, those of the scenes not included: see [`Campaign::scene`].
    pub fn parse(text: &str, file: &Path) -> Result<Self, CampaignError> {
        let origin = file.display().to_string();
        let folder = file.parent().unwrap_or(Path::new(""));
        let table = text.parse::<toml::Table>();
        let table = table.map_err(|e| CampaignError(vec![format!("{origin}: not TOML: {}", e.message())]))?;
        let mut reader = Reader { faults: Vec::new(), folder };
        for (key, _) in table.iter().filter(|(key, _)| !["base", "set", "grid", "scene"].contains(&key.as_str())) {
            reader.faults.push(format!("{key}: no key of a campaign; known: base, set, grid, scene"));
        }
        let base = match table.get("base") {
            Some(Value::String(name)) if !name.trim().is_empty() => {
                let beside = folder.join(name);
                if beside.is_file() { beside.display().to_string() } else { name.clone() }
            }
            Some(other) => reader.fault("base", other, "must be a built-in scene or a scene file"),
            None => reader.missing("base is required: a built-in scene or a scene file"),
        };
        let common = reader.sets("set", table.get("set"));
        let grid = reader.grid(table.get("grid"));
        let scenes = reader.scenes(table.get("scene"));
        let count = grid.len().saturating_mul(scenes.len());
        if count > MOST {
            reader.faults.push(format!("{count} scenes: a campaign has {MOST} at most"));
        }
        if !reader.faults.is_empty() {
            return Err(CampaignError(reader.faults.into_iter().map(|f| format!("{origin}: {f}")).collect()));
        }
        let every = scenes.iter().flat_map(|scene| grid.iter().map(move |point| (scene, point)));
        let entries = every.enumerate().map(|(number, (scene, point))| {
            let names = [&scene.name, &point.name].map(|n| plain(n)).into_iter().filter(|n| !n.is_empty());
            let name = names.collect::<Vec<_>>().join("_");
            let sets = [&common[..], &scene.sets, &point.sets].concat();
            Entry { number, name: if name.is_empty() { "scene".into() } else { name }, sets }
        });
        Ok(Self { entries: entries.collect(), base })
    }

    /// The scene of an entry; `more` are keys that win over all others.
    ///
    /// # Errors
    /// [`CampaignError`] with its faults, each with the entry's name.
    pub fn scene(
        &self,
        entry: &Entry,
        more: &[(String, String)],
        seed: Option<u64>,
    ) -> Result<Scene, CampaignError> {
        let sets = [&entry.sets, more].concat();
        load(&self.base, &Options { sets: &sets, seed }).map_err(|e| {
            CampaignError(e.faults.iter().map(|fault| format!("{}: {fault}", entry.folder())).collect())
        })
    }
}

struct Reader<'f> {
    faults: Vec<String>,
    folder: &'f Path,
}

impl Reader<'_> {
    fn fault(&mut self, key: &str, value: &Value, must: &str) -> String {
        self.faults.push(format!("{key} = {value}: {must}"));
        String::new()
    }

    fn missing(&mut self, words: &str) -> String {
        self.faults.push(words.to_owned());
        String::new()
    }

    /// Keys and values, as `--set` has them.
    fn sets(&mut self, key: &str, value: Option<&Value>) -> Vec<(String, String)> {
        match value {
            None => Vec::new(),
            Some(Value::Table(table)) => table.iter().map(|(k, v)| (k.clone(), v.to_string())).collect(),
            Some(other) => {
                self.fault(key, other, "must be a table of key paths of a scene, in quotes, and their values");
                Vec::new()
            }
        }
    }

    /// Every combination of the grid's values.
    fn grid(&mut self, value: Option<&Value>) -> Vec<Part> {
        let mut points = vec![Part::default()];
        let table = match value {
            None => return points,
            Some(Value::Table(table)) => table,
            Some(other) => {
                self.fault(
                    "grid",
                    other,
                    "must be a table of key paths of a scene, in quotes, and lists of values",
                );
                return points;
            }
        };
        for (key, values) in table {
            let Value::Array(values) = values else {
                self.fault(&format!("grid.{key:?}"), values, "must be a list of values");
                continue;
            };
            if values.is_empty() || values.len().saturating_mul(points.len()) > MOST {
                self.faults.push(format!("grid.{key:?}: a list of 1 value or more, {MOST} scenes in all at most"));
                continue;
            }
            let short = key.rsplit('.').next().unwrap_or(key);
            points = points
                .iter()
                .flat_map(|point| {
                    values.iter().map(move |value| {
                        let mut point = point.clone();
                        let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
                        let gap = if point.name.is_empty() { "" } else { "_" };
                        point.name = format!("{}{gap}{short}-{text}", point.name);
                        point.sets.push((key.clone(), value.to_string()));
                        point
                    })
                })
                .collect();
        }
        points
    }

    /// The scenes one by one; a single one without a name where none is listed.
    fn scenes(&mut self, value: Option<&Value>) -> Vec<Part> {
        let list = match value {
            None => return vec![Part::default()],
            Some(Value::Array(list)) if !list.is_empty() => list,
            Some(other) => {
                self.fault("scene", other, "must be [[scene]] tables");
                return Vec::new();
            }
        };
        let mut parts = Vec::new();
        for (number, item) in list.iter().enumerate() {
            let key = |name: &str| format!("scene.{number}.{name}");
            let Value::Table(table) = item else {
                self.fault(&format!("scene.{number}"), item, "must be a table");
                continue;
            };
            for (other, _) in table.iter().filter(|(k, _)| !["name", "set", "tle"].contains(&k.as_str())) {
                self.faults
                    .push(format!("{}: no key of a scene of a campaign; known: name, set, tle", key(other)));
            }
            let name = match table.get("name") {
                None => String::new(),
                Some(Value::String(name)) => name.clone(),
                Some(other) => self.fault(&key("name"), other, "must be a text"),
            };
            let part = Part { name, sets: self.sets(&key("set"), table.get("set")) };
            match table.get("tle") {
                None => parts.push(part),
                Some(tle) => parts.extend(self.element_sets(&key("tle"), tle).into_iter().map(|own| Part {
                    name: [part.name.as_str(), &own.name].join(if part.name.is_empty() { "" } else { "_" }),
                    sets: [&part.sets[..], &own.sets].concat(),
                })),
            }
        }
        parts
    }

    /// The element sets of a file, or of lines.
    fn element_sets(&mut self, key: &str, value: &Value) -> Vec<Part> {
        let text = match value {
            Value::String(file) => {
                let path: PathBuf = self.folder.join(file);
                match std::fs::read(&path) {
                    Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
                    Err(why) => {
                        self.faults.push(format!("{key}: cannot read {}: {why}", path.display()));
                        return Vec::new();
                    }
                }
            }
            Value::Array(lines) => lines.iter().filter_map(Value::as_str).collect::<Vec<_>>().join("\n"),
            other => {
                self.fault(key, other, "must be a file of two-line element sets, or their lines");
                return Vec::new();
            }
        };
        let sets = Tle::all(&text);
        if sets.is_empty() {
            self.faults.push(format!("{key}: no two-line element set there"));
        }
        let part = |set: &Tle| {
            let name = set.name.clone().map(|n| n.trim().trim_start_matches("0 ").to_owned());
            let name = name.filter(|n| !n.is_empty());
            let lines = set.lines.iter().map(|l| Value::String(l.clone())).collect::<Vec<_>>();
            let mut sets = vec![("target.0.orbit.tle".to_owned(), Value::Array(lines).to_string())];
            if let Some(name) = &name {
                sets.push(("target.0.name".to_owned(), Value::String(name.clone()).to_string()));
            }
            let number = set.lines[0].get(2..7).unwrap_or_default().trim().to_owned();
            Part { name: name.unwrap_or(number), sets }
        };
        sets.iter().map(part).collect()
    }
}

/// A name that any file system takes: letters, digits, points, + and -, 60 at most.
fn plain(name: &str) -> String {
    let kept = name.chars().map(|c| if c.is_alphanumeric() || "+-.".contains(c) { c } else { '-' });
    kept.collect::<String>().trim_matches(['-', '.']).chars().take(60).collect()
}

/// What came out of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// Frames written.
    pub frames: usize,
    /// Points of the light curve with a magnitude.
    pub points: usize,
    /// Median V; NaN without points, as all that follow.
    pub median_mag_v: f64,
    /// Median standard error \[mag\].
    pub median_mag_err: f64,
    /// Median signal-to-noise ratio of the fluxes.
    pub median_snr: f64,
    /// Reduced chi-square of the shape.
    pub chi2: f64,
}

impl Summary {
    /// Of a scene's output directory; what is not there is not known.
    pub fn of(dir: &Path) -> Self {
        let frames = std::fs::read_dir(dir.join("frames")).map_or(0, |files| files.flatten().count());
        let text = std::fs::read_to_string(dir.join("lightcurve.ecsv")).unwrap_or_default();
        let rows = curve_file::read("lightcurve.ecsv", &text).map(|file| file.rows).unwrap_or_default();
        let good = rows.iter().filter(|row| row.mag.is_finite()).collect::<Vec<_>>();
        let shape = std::fs::read_to_string(dir.join("shape.json")).ok();
        let shape = shape.and_then(|text| serde_json::from_str::<serde_json::Value>(&text).ok());
        Self {
            frames,
            points: good.len(),
            median_mag_v: median(good.iter().map(|row| row.mag)),
            median_mag_err: median(good.iter().map(|row| row.mag_err)),
            median_snr: median(good.iter().map(|row| row.flux / row.flux_err)),
            chi2: shape.and_then(|json| json["chi2_reduced"].as_f64()).unwrap_or(f64::NAN),
        }
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values = values.filter(|v| v.is_finite()).collect::<Vec<_>>();
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 { f64::NAN } else { 0.5 * (values[(n - 1) / 2] + values[n / 2]) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Campaign, CampaignError> {
        Campaign::parse(text, Path::new("c.toml"))
    }

    #[test]
    fn grids_and_lists_multiply() {
        let text = "base = 'pogs-geo'\n[set]\n'exposures.count' = 1\n[grid]\n'target.0.brightness.mag_v' = [11.0, 13.0]\n\
                    'telescope.filter' = ['V', 'R', 'none']\n[[scene]]\nname = 'a b/c'\nset = { seed = 5 }\n[[scene]]\n";
        let campaign = parse(text).expect("a campaign");
        assert_eq!(campaign.entries.len(), 12);
        assert_eq!(campaign.entries[1].folder(), "0001_a-b-c_mag-v-11.0-filter-R");
        assert_eq!(campaign.entries[11].sets.len(), 3);
        let scene = campaign.scene(&campaign.entries[1], &[], None).expect("a scene");
        assert_eq!((scene.seed, scene.exposures.count), (5, 1));
        let last = campaign.scene(&campaign.entries[11], &[], Some(9)).expect("a scene");
        assert_eq!(last.target[0].brightness, crate::scene::Brightness::MagV(13.0));
        assert_eq!(last.seed, 9);
    }

    #[test]
    fn element_sets_become_targets() {
        let text = "base = 'pogs-geo'\n[[scene]]\ntle = ['GOES 14', '1 35491U 09033A   18019.95817924 -.00000090  00000-0  00000-0 0  9991', \
                    '2 35491   0.0698 263.4367 0009544 339.3413 117.1094  1.00271818 31371', \
                    '1 35491U 09033A   18019.95817924 -.00000090  00000-0  00000-0 0  9991', \
                    '2 35491   0.0698 263.4367 0009544 339.3413 117.1094  1.00271818 31371']\n";
        let campaign = parse(text).expect("a campaign");
        let names = campaign.entries.iter().map(Entry::folder).collect::<Vec<_>>();
        assert_eq!(names, ["0000_GOES-14", "0001_35491"]);
        assert!(campaign.scene(&campaign.entries[0], &[], None).is_ok());
    }

    #[test]
    fn faults_are_told_all_at_once() {
        let text = "bas = 1\n[grid]\na = 3\nb = []\n[[scene]]\nname = 4\ntle = 'missing.tle'\nwhat = 1\n";
        let faults = parse(text).expect_err("faults").0;
        assert_eq!(faults.len(), 7, "{faults:?}");
        assert!(faults.iter().all(|f| f.starts_with("c.toml: ")));
        assert!(parse("not toml").is_err());
        let big = format!("base = 'pogs-geo'\n[grid]\na = {0:?}\nb = {0:?}\n", vec![1; 400]);
        assert!(parse(&big).is_err());
    }
}
