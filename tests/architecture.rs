//! The one-way flow: a room uses only rooms above it, and the modules of a room form no circle.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The rooms, from the foundation up to the command line.
const ROOMS: [&str; 16] = [
    "base",
    "astro",
    "object",
    "scene",
    "plan",
    "light",
    "stars",
    "sky",
    "camera",
    "io",
    "photometry",
    "inversion",
    "simulate",
    "run",
    "study",
    "cli",
];

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

fn rust_files(dir: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(dir).expect("a readable folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.extend(rust_files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Code without line comments, so that prose may name any room, and without the unit tests at its end.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("a readable file");
    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    text.lines().map(|l| l.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// The first path segments that follow `prefix` in `code`, groups in braces included.
fn followers(code: &str, prefix: &str) -> BTreeSet<String> {
    let name = |t: &str| t.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut found = BTreeSet::new();
    for (at, _) in code.match_indices(prefix) {
        let rest = &code[at + prefix.len()..];
        match rest.strip_prefix('{') {
            None => {
                found.insert(name(rest));
            }
            Some(group) => {
                let (mut depth, mut start) = (0, true);
                for (i, c) in group.char_indices() {
                    match c {
                        '{' => depth += 1,
                        '}' if depth == 0 => break,
                        '}' => depth -= 1,
                        ',' if depth == 0 => start = true,
                        c if start && !c.is_whitespace() => {
                            found.insert(name(&group[i..]));
                            start = false;
                        }
                        _ => {}
                    }
                }
            }
        }
    }
    found
}

fn room_of(path: &Path) -> Option<usize> {
    let inside = path.strip_prefix(source()).expect("below src");
    let first = inside.components().next()?.as_os_str().to_string_lossy().replace(".rs", "");
    ROOMS.iter().position(|room| *room == first)
}

#[test]
fn every_file_belongs_to_a_room_of_the_list() {
    for path in rust_files(&source()) {
        let name = path.file_name().expect("a file").to_string_lossy().into_owned();
        let top = path.parent() == Some(&source());
        assert!(room_of(&path).is_some() || (top && ["lib.rs", "main.rs"].contains(&name.as_str())), "{path:?}");
    }
}

#[test]
fn no_room_uses_a_room_below_it() {
    let mut upward = Vec::new();
    for path in rust_files(&source()) {
        let Some(own) = room_of(&path) else { continue };
        for used in followers(&code(&path), "crate::") {
            if let Some(other) = ROOMS.iter().position(|room| *room == used)
                && other > own
            {
                upward.push(format!("{} uses {used}", path.display()));
            }
        }
    }
    assert!(upward.is_empty(), "against the flow:\n{}", upward.join("\n"));
}

#[test]
fn modules_of_a_room_form_no_circle() {
    for room in ROOMS {
        let folder = source().join(room);
        if !folder.is_dir() {
            continue;
        }
        let module = |path: &Path| {
            let inside = path.strip_prefix(&folder).expect("below the room");
            inside.components().next().expect("a file").as_os_str().to_string_lossy().replace(".rs", "")
        };
        let mut uses: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for path in rust_files(&folder) {
            let own = module(&path);
            if own == "mod" || own == "tests" {
                continue;
            }
            let text = code(&path);
            let depth = path.strip_prefix(&folder).expect("below").components().count();
            let up = "super::".repeat(depth);
            let mut used = followers(&text, &format!("crate::{room}::"));
            used.extend(followers(&text, &up));
            used.remove(&own);
            uses.entry(own).or_default().extend(used);
        }
        let known = uses.keys().cloned().collect::<BTreeSet<_>>();
        // take away modules that use nothing left, until nothing is left
        let mut left = known;
        loop {
            let free =
                left.iter().filter(|m| uses[*m].intersection(&left).next().is_none()).cloned().collect::<Vec<_>>();
            if free.is_empty() {
                break;
            }
            free.iter().for_each(|m| {
                left.remove(m);
            });
        }
        assert!(left.is_empty(), "circle in {room}: {left:?}");
    }
}

#[test]
fn the_reader_of_paths_sees_groups_and_upward_use() {
    let found = followers("use crate::{astro, base::{units, random}};\nlet x = crate::cli::main();", "crate::");
    assert_eq!(found, ["astro", "base", "cli"].map(String::from).into());
}

#[test]
fn library_code_keeps_from_clock_terminal_and_exit() {
    for path in rust_files(&source()) {
        if room_of(&path) == ROOMS.iter().position(|r| *r == "cli")
            || path.ends_with("main.rs")
            || path.file_name().is_some_and(|name| name.to_string_lossy().ends_with("tests.rs"))
        {
            continue;
        }
        let text = code(&path);
        for forbidden in ["println!", "eprintln!", "process::exit", "SystemTime", "time::Instant::now", "env::var"]
        {
            assert!(!text.contains(forbidden), "{} has {forbidden}", path.display());
        }
    }
}
