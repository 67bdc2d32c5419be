//! `nightglass shape`: a mesh looked at, checked, and repaired if asked.

use super::args::{Global, ShapeArgs};
use super::talk::{Failure, Talk, finite, give, print, print_json, write_bytes};
use crate::astro::attitude::Surroundings;
use crate::base::constants::{AU_M, SUN_RADIUS_M};
use crate::io::preview::rgb_png;
use crate::object::picture::picture;
use crate::object::shape::{Choice, Lighting, Shape};
use crate::object::surface::fault::{Fault, Severity};
use crate::object::surface::mesh::Mesh;
use crate::object::surface::mtl::Mtl;
use crate::object::surface::{check, files, mtl, obj, repair, topology};
use glam::DVec3;
use serde_json::{Value as Json, json};
use std::fmt::Write;
use std::path::Path;

/// Faults of one kind that are told one by one.
const TOLD: usize = 3;
/// Side of a picture \[px\].
const SIDE: u32 = 480;

pub(super) fn shape(args: &ShapeArgs, global: &Global, talk: &Talk) -> Result<(), Failure> {
    let (mut mesh, materials) = read(&args.shape, talk)?;
    let faults = check::faults(&mesh);
    let mut text = report(&mesh, &faults);
    let mut rows = vec![summary("as it is", &mesh, &faults)];
    if args.repair {
        let (mended, done) = repair::repair(&mesh);
        mesh = mended;
        done.iter().for_each(|step| text.push_str(&format!("repaired: {step}\n")));
        let left = check::faults(&mesh);
        text.push_str(&report(&mesh, &left));
        let mut row = summary("repaired", &mesh, &left);
        row["repairs"] = json!(done);
        rows.push(row);
    }
    if let Some(dir) = &global.output {
        write(args, mesh, materials, (dir, global, talk))?;
    }
    if global.json {
        print_json(&json!({ "command": "shape", "rows": rows }))?;
    } else {
        print(&text)?;
    }
    match faults.iter().filter(|f| f.severity() == Severity::Fatal).count() {
        0 => Ok(()),
        count => Err(Failure::Input(format!("{}: {count} faults forbid its use", args.shape))),
    }
}

/// Write the mesh, if it is built in or repaired, with its materials, and its pictures.
fn write(
    args: &ShapeArgs,
    mesh: Mesh,
    materials: Vec<Mtl>,
    (dir, global, talk): (&Path, &Global, &Talk),
) -> Result<(), Failure> {
    let stem = Path::new(&args.shape).file_stem().map_or("shape".into(), |s| s.to_string_lossy().into_owned());
    if args.repair || files::BUILT_IN.contains(&args.shape.as_str()) {
        let library = format!("{stem}.mtl");
        if !materials.is_empty() {
            give(dir, &library, &mtl::write(&materials), global, talk)?;
        }
        let named = (!materials.is_empty()).then_some(library.as_str());
        give(dir, &format!("{stem}.obj"), &obj::write(&mesh, named), global, talk)?;
    }
    let own = Shape::new(&mesh, &Choice { mtl: materials, ..Choice::default() });
    let own = own.map_err(|why| Failure::Input(format!("{}: {why}", args.shape)))?;
    let path = dir.join(format!("{stem}.png"));
    write_bytes(&path, &sheet(&own)?, global)?;
    talk.say(&format!("wrote {}", path.display()));
    Ok(())
}

/// What a mesh consists of, and its faults, for programs.
fn summary(state: &str, mesh: &Mesh, faults: &[Fault]) -> Json {
    let open = topology::open(mesh);
    let sheets = open.iter().filter(|open| **open).count();
    let extent = mesh.bounds().map(|(low, high)| (high - low).to_array());
    let convex = Shape::new(mesh, &Choice::default()).is_ok_and(|shape| shape.is_convex());
    let told = |fault: &Fault| json!({ "severity": word(fault.severity()), "fault": fault.to_string() });
    json!({
        "state": state, "faces": mesh.faces.len(), "vertices": mesh.vertices.len(),
        "closed_parts": open.len() - sheets, "sheets": sheets, "extent_m": extent,
        "area_m2": finite(mesh.area()), "volume_m3": finite(mesh.signed_volume()), "convex": convex,
        "groups": mesh.groups, "materials": mesh.materials,
        "faults": faults.iter().map(told).collect::<Vec<_>>(),
    })
}

fn read(name: &str, talk: &Talk) -> Result<(Mesh, Vec<Mtl>), Failure> {
    if let Some(mesh) = files::built_in(name).filter(|_| !Path::new(name).is_file()) {
        return Ok((mesh, Vec::new()));
    }
    if !Path::new(name).is_file() && !name.contains(['.', '/', '\\']) {
        let known = files::BUILT_IN.join(", ");
        return Err(Failure::Input(format!("\"{name}\" is neither a file nor a built-in shape; known: {known}")));
    }
    let read = files::read(Path::new(name)).map_err(|why| Failure::Input(why.to_string()))?;
    for missing in &read.missing {
        talk.say(&format!("warning: {name} names {missing}, which is not there"));
    }
    Ok((read.mesh, read.materials))
}

fn word(severity: Severity) -> &'static str {
    match severity {
        Severity::Note => "note",
        Severity::Warning => "warning",
        Severity::Fatal => "fatal",
    }
}

fn report(mesh: &Mesh, faults: &[Fault]) -> String {
    let mut text = String::new();
    let open = topology::open(mesh);
    let sheets = open.iter().filter(|open| **open).count();
    let _ = writeln!(
        text,
        "{} faces, {} vertices; {} closed parts, {sheets} sheets",
        mesh.faces.len(),
        mesh.vertices.len(),
        open.len() - sheets
    );
    if let Some((low, high)) = mesh.bounds() {
        let size = high - low;
        let volume = if sheets == 0 { format!(", volume {:.6} m3", mesh.signed_volume()) } else { String::new() };
        let area = mesh.area();
        let _ =
            writeln!(text, "extent {:.6} x {:.6} x {:.6} m, area {area:.6} m2{volume}", size.x, size.y, size.z);
    }
    let names = |all: &[String]| all.iter().filter(|n| !n.is_empty()).cloned().collect::<Vec<_>>().join(", ");
    let _ = writeln!(text, "groups: {}\nmaterials: {}", names(&mesh.groups), names(&mesh.materials));
    if let Ok(shape) = Shape::new(mesh, &Choice::default()) {
        let convex =
            if shape.is_convex() { "convex: it casts no shadow on itself" } else { "it may shadow itself" };
        let _ = writeln!(text, "{convex}; {} pairs of faces overlap in one plane", shape.body.coplanar.len());
    }
    let kind = |fault: &Fault| std::mem::discriminant(fault);
    for same in faults.chunk_by(|a, b| kind(a) == kind(b)) {
        for fault in same.iter().take(TOLD) {
            let _ = writeln!(text, "{}: {fault}", word(fault.severity()));
        }
        if same.len() > TOLD {
            let _ = writeln!(text, "  and {} more like this", same.len() - TOLD);
        }
    }
    if faults.is_empty() {
        text.push_str("no faults\n");
    }
    text
}

/// Four pictures beside each other: from the front, the side, above and askew, the Sun over the observer's left shoulder.
fn sheet(shape: &Shape) -> Result<Vec<u8>, Failure> {
    let views =
        [(DVec3::X, DVec3::Z), (DVec3::Y, DVec3::Z), (DVec3::Z, DVec3::Y), (DVec3::new(1.0, 0.8, 0.6), DVec3::Z)];
    let pictures = views.map(|(observer, up)| {
        let observer = observer.normalize();
        let left = up.cross(observer).normalize();
        let sun = (observer + 0.55 * up - 0.8 * left).normalize();
        let around = Surroundings { earth: DVec3::NAN, sun, velocity: DVec3::NAN, observer };
        picture(shape, &Lighting { around, sun_radius: SUN_RADIUS_M / AU_M }, up, SIDE)
    });
    let side = SIDE as usize;
    let mut rgb = Vec::with_capacity(pictures.len() * 3 * side * side);
    for row in 0..2 {
        for y in 0..side {
            for column in 0..2 {
                rgb.extend_from_slice(&pictures[2 * row + column][3 * side * y..3 * side * (y + 1)]);
            }
        }
    }
    Ok(rgb_png(2 * side, 2 * side, &rgb)?)
}
