//! Campaigns, as a user runs them: lists, costs, directories, what is kept and what fails.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Output;

fn nightglass(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = assert_cmd::Command::cargo_bin("nightglass").expect("the program");
    command.current_dir(folder).args(arguments).output().expect("it runs")
}

fn err(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A folder with a campaign of two by two small scenes.
fn folder(text: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("moons.toml");
    std::fs::write(&path, text).expect("written");
    (folder, path)
}

const FOUR: &str = r#"
base = "pogs-geo"
[set]
"detector.size_px" = 160
"exposures.count" = 1
"stars.synthetic" = false
[grid]
"target.0.brightness.mag_v" = [11.0, 13.0]
[[scene]]
name = "dark"
[[scene]]
name = "moonlit"
set = { "exposures.start" = 2018-02-05T11:00:00Z }
"#;

#[test]
fn a_campaign_is_listed_run_and_taken_up() {
    let (folder, _) = folder(FOUR);
    let card = nightglass(folder.path(), &["campaign", "card", "moons.toml", "--json"]);
    assert!(card.status.success(), "{}", err(&card));
    let json: Value = serde_json::from_slice(&card.stdout).expect("JSON");
    let rows = json["rows"].as_array().expect("rows");
    assert_eq!(rows.len(), 4);
    assert_eq!(rows[3]["name"], "0003_moonlit_mag-v-13.0");
    assert_eq!(json["cost"]["bytes"].as_f64(), Some(4.0 * 160.0 * 160.0 * 2.0));
    assert!(!folder.path().join("out").exists(), "nothing is run");

    let run = nightglass(folder.path(), &["campaign", "run", "moons.toml", "-o", "all"]);
    assert!(run.status.success(), "{}", err(&run));
    for name in ["0000_dark_mag-v-11.0", "0003_moonlit_mag-v-13.0"] {
        for file in ["scene.toml", "frames/0000.fits", "lightcurve.ecsv"] {
            assert!(folder.path().join("all").join(name).join(file).is_file(), "{name}/{file}");
        }
    }
    let table = std::fs::read_to_string(folder.path().join("all/campaign.ecsv")).expect("the summary");
    assert_eq!(table.lines().filter(|l| l.contains(" done ")).count(), 4, "{table}");

    // taken up: what is there is kept as it is, what is missing is made again, byte for byte
    let frame = folder.path().join("all/0001_dark_mag-v-13.0/frames/0000.fits");
    let before = std::fs::read(&frame).expect("a frame");
    std::fs::remove_dir_all(folder.path().join("all/0001_dark_mag-v-13.0")).expect("removed");
    let again = nightglass(folder.path(), &["campaign", "run", "moons.toml", "-o", "all"]);
    assert!(err(&again).contains("1 scenes done, 3 kept"), "{}", err(&again));
    assert!(before == std::fs::read(&frame).expect("a frame"));
}

/// A scene that fails stops no other: the rest is done, the exit code is 1, and the summary tells why.
#[test]
fn failures_do_not_stop_the_rest() {
    let (folder, _) = folder(FOUR);
    // a file stands where the second scene's directory should
    std::fs::create_dir(folder.path().join("all")).expect("made");
    std::fs::write(folder.path().join("all/0001_dark_mag-v-13.0"), "in the way").expect("written");
    let run = nightglass(folder.path(), &["campaign", "run", "moons.toml", "-o", "all"]);
    assert_eq!(run.status.code(), Some(1), "{}", err(&run));
    assert!(err(&run).contains("1 of 4 scenes failed"), "{}", err(&run));
    let table = std::fs::read_to_string(folder.path().join("all/campaign.ecsv")).expect("the summary");
    assert_eq!(table.lines().filter(|l| l.contains(" done ")).count(), 3, "{table}");
    assert!(table.contains("is a file, no directory"), "{table}");
}

/// Faults of the campaign and of all its scenes are told at once, before anything is run.
#[test]
fn faults_are_told_before_anything_runs() {
    let (folder, path) = folder("base = \"pogs-geo\"\n[grid]\n\"exposures.count\" = [0, 1, -3]\n");
    let run = nightglass(folder.path(), &["campaign", "run", "moons.toml", "-o", "all"]);
    assert_eq!(run.status.code(), Some(2));
    let told = err(&run);
    assert!(told.contains("0000_count-0") && told.contains("0002_count--3") && !told.contains("0001_"), "{told}");
    assert!(!folder.path().join("all").exists());
    std::fs::write(path, "bse = 1").expect("written");
    let run = nightglass(folder.path(), &["campaign", "card", "moons.toml"]);
    assert!(run.status.code() == Some(2) && err(&run).contains("base is required"), "{}", err(&run));
    assert_eq!(nightglass(folder.path(), &["campaign", "run", "missing.toml"]).status.code(), Some(2));
}
