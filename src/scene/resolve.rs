//! From a text to a complete scene: `--set`, the station's preset, one-of siblings, checks, defaults; and from
//! a scene back to the text that gives it again, and to its hash.

use std::path::Path;
use std::rc::Rc;

use sha2::{Digest, Sha256};

use super::builtin::{self, SCENES, STATIONS};
use super::check::Checker;
use super::cross;
use super::fault::{Fault, SceneError};
use super::keys::children;
use super::schema::{ONE_OF, nearest};
use super::target::build_shapes;
use super::tree::{self, Entries, Node, Place, Rank, Source, Value, entry};
use super::typed;
use super::types::{InputFile, Scene};
use super::value::{at, hex, open};

/// What the command line changes in a scene.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options<'a> {
    /// `--set`: key paths and their values, which are TOML, else bare text. Later ones win.
    pub sets: &'a [(String, String)],
    /// `--seed`: replaces the scene's seed.
    pub seed: Option<u64>,
}

/// Loads a scene: the file of that path if it exists, ends in `.toml` or contains a slash, else the built-in
/// scene of that name. The error holds every fault of the scene.
pub fn load(path_or_builtin: &str, options: &Options) -> Result<Scene, SceneError> {
    let path = Path::new(path_or_builtin);
    if path.is_file() || path_or_builtin.ends_with(".toml") || path_or_builtin.contains(['/', '\\']) {
        let text = read_text(path)
            .map_err(|why| SceneError::one(path_or_builtin, format!("cannot read the scene: {why}")))?;
        return load_str(&text, path_or_builtin, path.parent(), options);
    }
    match builtin::find(SCENES, path_or_builtin) {
        Some(text) => load_str(text, path_or_builtin, None, options),
        None => Err(builtin::unknown("scene", path_or_builtin, SCENES)),
    }
}

/// Loads a scene from its text. `origin` names it in faults, and its stem names the scene unless the scene
/// does; relative paths in it refer to `base_dir`, or to the working directory.
pub fn load_str(
    text: &str,
    origin: &str,
    base_dir: Option<&Path>,
    options: &Options,
) -> Result<Scene, SceneError> {
    let source = |origin: &str, rank| {
        Rc::new(Source { origin: origin.into(), base: base_dir.map(Path::to_path_buf), rank })
    };
    let mut root = tree::parse(text, &source(origin, Rank::Scene))
        .map_err(|(message, line)| SceneError::new(origin, vec![Fault::of(origin, "", line, message)]))?;
    let mut faults = Vec::new();
    let set = source("--set", Rank::Set);
    for (path, value) in options.sets {
        if let Err(message) = root.set(path, tree::parse_value(value, &set)) {
            faults.push(Fault::of("--set", path, None, message));
        }
    }
    match options.seed.map(i64::try_from) {
        Some(Ok(seed)) => {
            let place = Place { source: source("--seed", Rank::Set), line: None };
            let node = Node { value: Value::Int(seed), place };
            // the top is a table, so this cannot fail
            root.set("seed", node).unwrap_or_default();
        }
        Some(Err(_)) => {
            faults.push(Fault::of("--seed", "seed", None, format!("seed must lie in 0..{}", i64::MAX)))
        }
        None => {}
    }
    let before = faults.len();
    preset(&mut root, &mut faults);
    let preset_failed = faults.len() > before;
    settle(&mut root, "", "", &mut faults);
    let stem = Path::new(origin).file_stem().map_or("scene".into(), |stem| stem.to_string_lossy());
    let mut checker = Checker::new(&root, if stem.trim().is_empty() { "scene" } else { &stem }, preset_failed);
    let table = checker.scene();
    faults.append(&mut checker.faults);
    faults.append(&mut cross::faults(&table, &root));
    if !faults.is_empty() {
        return Err(SceneError::new(origin, faults));
    }
    let mut scene = typed::read(table, checker.reader.inputs)
        .map_err(|key| SceneError::one(origin, format!("{key}: cannot be read")))?;
    let wrong = build_shapes(&mut scene.target);
    if wrong.is_empty() {
        return Ok(scene);
    }
    let fault = |(key, why): (String, String)| {
        let place = &root.towards(&key).place;
        Fault::new(&key, place, format!("{key}: {why}"))
    };
    Err(SceneError::new(origin, wrong.into_iter().map(fault).collect()))
}

/// A scene that holds a built-in station and nothing else: one instant, no target.
///
/// # Errors
/// That no station has this name.
pub fn load_station(name: &str) -> Result<Scene, SceneError> {
    if builtin::find(STATIONS, name).is_none() {
        return Err(builtin::unknown("station", name, STATIONS));
    }
    let text = format!(
        "[station]\npreset = \"{name}\"\n[exposures]\nstart = 2018-01-20T03:00:00Z\nduration_s = 0.0\n\
         [pointing]\nat = \"azel\"\naz_deg = 0.0\nel_deg = 90.0\n"
    );
    load_str(&text, name, None, &Options::default())
}

fn read_text(path: &Path) -> Result<String, String> {
    let text = open(path).and_then(|mut file| {
        let mut text = String::new();
        std::io::Read::read_to_string(&mut file, &mut text).map(|_| text)
    });
    text.map_err(|why| why.to_string())
}

/// Fills in what the station preset says and the scene does not.
fn preset(root: &mut Node, faults: &mut Vec<Fault>) {
    let Some(station) = root.entries().and_then(|all| entry(all, "station")) else { return };
    let Some(node) = station.entries().and_then(|own| entry(own, "preset")).cloned() else { return };
    let mut fail = |message: String| {
        let shown = tree::show(&node.value);
        faults.push(Fault::new("station.preset", &node.place, format!("station.preset = {shown}: {message}")));
    };
    let Some(name) = node.text() else {
        return fail("must be the name of a built-in station, or a station file".into());
    };
    let path = at(&node, name);
    let (text, origin, base) = match builtin::find(STATIONS, name) {
        Some(text) => (text.to_string(), format!("station {name}"), None),
        None if name.ends_with(".toml") || name.contains('/') => match read_text(&path) {
            Ok(text) => (text, path.display().to_string(), path.parent().map(Path::to_path_buf)),
            Err(why) => return fail(format!("cannot read {}: {why}", path.display())),
        },
        None => return fail(builtin::hint("station", name, STATIONS)),
    };
    let source = Rc::new(Source { origin: origin.clone(), base, rank: Rank::Station });
    let given = match tree::parse(&text, &source) {
        Ok(given) => given,
        Err((message, line)) => return faults.push(Fault::of(&origin, "", line, message)),
    };
    let (Value::Table(tables), Some(all)) = (given.value, root.entries_mut()) else { return };
    for (table, node) in tables {
        match node.value {
            Value::Table(keys) if ["station", "telescope", "detector"].contains(&table.as_str()) => {
                merge(all, &table, keys, &node.place, faults);
            }
            _ => {
                let message =
                    format!("\"{table}\" has no place in a station file; known: station, telescope, detector");
                faults.push(Fault::new(table, &node.place, message));
            }
        }
    }
}

/// Adds the keys of a station's table that the scene does not have.
fn merge(all: &mut Entries, table: &str, keys: Entries, place: &Place, faults: &mut Vec<Fault>) {
    if entry(all, table).is_none() {
        all.push((table.into(), Node { value: Value::Table(Entries::new()), place: place.clone() }));
    }
    let own = all.iter_mut().find(|(name, _)| name == table).and_then(|(_, node)| node.entries_mut());
    let Some(own) = own else { return };
    for (key, node) in keys {
        if table == "station" && key == "preset" {
            faults.push(Fault::new(
                "station.preset",
                &node.place,
                "station.preset: a station file cannot name another",
            ));
        } else if entry(own, &key).is_none() {
            own.push((key, node));
        }
    }
}

/// Of siblings that exclude each other the outranked ones go; equals are a fault.
fn settle(node: &mut Node, schema: &str, path: &str, faults: &mut Vec<Fault>) {
    if let Value::List(items) = &mut node.value {
        for (i, item) in items.iter_mut().enumerate() {
            settle(item, schema, &format!("{path}.{i}"), faults);
        }
        return;
    }
    let Some(entries) = node.entries_mut() else { return };
    for (_, members) in ONE_OF.iter().filter(|(table, _)| *table == schema) {
        let rank =
            |(name, node): &(String, Node)| members.contains(&name.as_str()).then_some(node.place.source.rank);
        let Some(top) = entries.iter().filter_map(rank).max() else { continue };
        entries.retain(|item| rank(item).is_none_or(|own| own == top));
        let names: Vec<&str> =
            entries.iter().filter(|item| rank(item).is_some()).map(|(name, _)| name.as_str()).collect();
        if names.len() > 1
            && let Some((_, last)) = entries.iter().rfind(|item| rank(item).is_some())
        {
            let message =
                format!("{path}: only one of {} may be given, here are {}", members.join(", "), names.join(", "));
            faults.push(Fault::new(path, &last.place, message));
        }
    }
    for key in children(schema) {
        let Some((selector, _)) = key.when else { continue };
        let Some(select) = entry(entries, selector) else { continue };
        let (rank, applies) = (select.place.source.rank, key.applies(select.text()));
        entries.retain(|(name, node)| applies || name != key.name() || node.place.source.rank >= rank);
    }
    for key in children(schema).filter(|key| key.is_table()) {
        if let Some((name, node)) = entries.iter_mut().find(|(name, _)| name == key.name()) {
            let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
            settle(node, key.path, &path, faults);
        }
    }
}

impl Scene {
    /// The complete scene as TOML: every key, no preset, element sets inline, files by their name in `inputs/`.
    /// Loaded again beside those files it gives this scene and this hash.
    pub fn to_toml(&self) -> String {
        typed::write(self, |input| format!("inputs/{}", input.name)).to_string()
    }

    /// SCENESHA: SHA-256, hexadecimal, of the complete scene without `[output]`. The seed counts, and of a file
    /// the scene names its content counts and its name does not.
    pub fn sha256(&self) -> String {
        let mut table = typed::write(self, |input| format!("sha256:{}", input.sha256));
        table.remove("output");
        let beside = self.inputs.iter().filter(|input| input.key.contains(".beside."));
        let beside = beside.map(|input| toml::Value::from(input.sha256.as_str())).collect::<Vec<_>>();
        if !beside.is_empty() {
            table.insert("beside".into(), beside.into());
        }
        hex(&Sha256::digest(table.to_string().as_bytes()))
    }

    /// The files the scene names, in the order of its keys.
    pub fn inputs(&self) -> &[InputFile] {
        &self.inputs
    }
}

/// Text of a built-in scene or station by name; without a name a template with every key commented.
pub fn template(name: Option<&str>) -> Result<String, SceneError> {
    let Some(name) = name else { return Ok(super::template::scene()) };
    match builtin::find(SCENES, name).or_else(|| builtin::find(STATIONS, name)) {
        Some(text) => Ok(text.into()),
        None => {
            let all = SCENES.iter().chain(STATIONS).map(|(name, _)| *name);
            let near = nearest(name, all.clone()).map_or(String::new(), |name| format!("; nearest: {name}"));
            let known = all.collect::<Vec<_>>().join(", ");
            Err(SceneError::one(name, format!("no built-in scene or station has this name{near}; known: {known}")))
        }
    }
}
