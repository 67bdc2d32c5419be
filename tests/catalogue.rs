//! Catalogues made from tables of stars, on the command line.

use serde_json::Value;
use std::path::Path;
use std::process::Output;

fn nightglass(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = assert_cmd::Command::cargo_bin("nightglass").expect("the program");
    command.current_dir(folder).args(arguments).output().expect("it runs")
}

/// Import `text` with `options`: the folder, and what was said.
fn import(text: &str, options: &[&str]) -> (tempfile::TempDir, Output) {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("stars.csv"), text).expect("written");
    let arguments = [&["catalog", "import", "stars.csv", "-o", "stars.ngc"], options].concat();
    let output = nightglass(folder.path(), &arguments);
    (folder, output)
}

fn err(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn info(folder: &Path) -> Value {
    let output = nightglass(folder, &["catalog", "info", "stars.ngc", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", err(&output));
    serde_json::from_slice::<Value>(&output.stdout).expect("JSON")["rows"][0].clone()
}

#[test]
fn gaia_tables_with_gaps_are_taken() {
    let text = "source_id,ra,dec,phot_g_mean_mag,bp_rp,pmra,pmdec,ref_epoch\r\n1,10.5,41.2,12.0,0.82,1.5,-2.5,2016.0\r\n\
                2,10.6,41.3,13.0,,,,2016.0\r\n3,,41.3,13.0,1.0,,,2016.0\r\n4,10.7,41.3,NaN,1.0,0,0,2016.0\r\n";
    let (folder, output) = import(text, &[]);
    assert_eq!(output.status.code(), Some(0), "{}", err(&output));
    for part in
        ["2 stars, places taken for J2016", "skipped 2 of 4 rows; the first, line 4: ra is not known", "wrote"]
    {
        assert!(err(&output).contains(part), "{part} in {}", err(&output));
    }
    let row = info(folder.path());
    assert_eq!(
        (row["name"].as_str(), row["stars"].as_u64(), row["epoch"].as_f64()),
        (Some("stars"), Some(2), Some(2016.0))
    );
    assert_eq!((row["colour_share"].as_f64(), row["proper_motion_share"].as_f64()), (Some(0.5), Some(0.5)));
    assert!(row["sky_share"].as_f64().expect("a share") < 1e-2);
    assert_eq!(row["counts"][0]["from_mag_v"], 12);
}

#[test]
fn columns_can_be_said() {
    let text = "alpha delta bright mu_a mu_d\n10 20 7.5 1 2\n11 21 8.5 3 4\n";
    let options = ["--ra", "alpha", "--dec", "delta", "--mag", "bright", "--pmra", "mu_a", "--pmdec", "mu_d"];
    let more = ["--epoch", "1991.25", "--complete-to", "8.25", "--name", "mine"];
    let (folder, output) = import(text, &[&options[..], &more].concat());
    assert_eq!(output.status.code(), Some(0), "{}", err(&output));
    let row = info(folder.path());
    assert_eq!((row["name"].as_str(), row["epoch"].as_f64()), (Some("mine"), Some(1991.25)));
    assert_eq!((row["colours"].as_bool(), row["proper_motion_share"].as_f64()), (Some(false), Some(1.0)));
    assert_eq!(row["complete_to_max_mag_v"].as_f64(), Some(8.25));
    let text = nightglass(folder.path(), &["catalog", "info", "stars.ngc"]).stdout;
    let text = String::from_utf8_lossy(&text);
    for part in ["mine: 2 stars", "colours: no", "proper motions: 100.0 %", "median 8.25", "|b| 20-45", "8 .. 9"] {
        assert!(text.contains(part), "{part} in {text}");
    }
    assert_eq!(
        nightglass(folder.path(), &["catalog", "import", "stars.csv", "-o", "stars.ngc"]).status.code(),
        Some(2)
    );
}

#[test]
fn faults_of_a_table_are_exit_code_2_and_name_the_place() {
    let good = "ra,dec,Vmag\n1,2,3\n";
    for (text, options, part) in [
        ("ra,dec,Vmag\n1,2,3\n1,abc,3\n", &[][..], "line 3, column dec: \"abc\" is no number"),
        ("alpha,dec,Vmag\n1,2,3\n", &[], "the file has alpha, dec, Vmag"),
        ("ra,dec,flux\n1,2,3\n", &[], "VTmag"),
        ("ra,dec,Vmag\n1,2\n", &[], "line 2: 2 cells under 3 names"),
        ("ra,dec,Vmag\n1,99,3\n", &[], "dec = 99 is outside -90 .. 90"),
        ("", &[], "no line with the names"),
        ("<?xml version='1.0'?>\n<VOTABLE/>\n", &[], "export it as ECSV"),
        (good, &["--mag", "magnitude"], "no column \"magnitude\""),
        (good, &["--epoch", "12"], "12 is outside 1800 .. 2200"),
        (good, &["--complete-to", "nan"], "outside -2 .. 32"),
        (good, &["--name", "much too long a name for the head"], "1 .. 24"),
        (good, &["--ra", "ra"], "--dec"),
        (good, &["--supplement", "none.csv"], "none.csv"),
    ] {
        let (folder, output) = import(text, options);
        assert_eq!(output.status.code(), Some(2), "{text} {options:?}");
        assert!(err(&output).contains(part), "{part} in {}", err(&output));
        assert!(!folder.path().join("stars.ngc").exists());
    }
}
