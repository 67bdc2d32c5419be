//! `nightglass report`, and the page at the end of `run`.

use super::args::{Global, ReportArgs};
use super::talk::{Failure, Talk, print_json};
use crate::io::atomic;
use crate::study::report::report as page_of;
use serde_json::json;
use std::path::{Path, PathBuf};

pub(super) fn report(args: &ReportArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let out = global.output.as_deref().unwrap_or(&args.dir);
    let path = write(&args.dir, out, talk)?;
    talk.say(&format!("wrote {}", path.display()));
    if global.json {
        let rows = [json!({ "file": path.display().to_string() })];
        print_json(&json!({ "command": "report", "rows": rows }))?;
    }
    Ok(())
}

/// Write the page of `dir` into the directory `out`, in place of an earlier one; where it is.
pub(super) fn write(dir: &Path, out: &Path, talk: &Talk) -> Result<PathBuf, Failure> {
    let page = page_of(dir).map_err(|e| Failure::Input(e.to_string()))?;
    page.notes.iter().for_each(|note| talk.say(&format!("note: report.html: {note}")));
    let path = out.join("report.html");
    atomic::create_dir(out)?;
    atomic::write(&path, page.html.as_bytes())?;
    Ok(path)
}
