//! What do materials look like? A sphere of each, under the Sun from the upper left.
//!
//! ```sh
//! cargo run --release --example what_do_materials_look_like     # -> out/materials.png
//! ```
//!
//! Rows: Lambert, Phong, the draft's Phong, Blinn-Phong, the draft's Blinn-Phong; Cook-Torrance, Oren-Nayar,
//! Ashikhmin-Shirley, and a faceted mirror (each facet shows the Sun or nothing); aluminium, gold, white paint, MLI, solar cells.

use glam::DVec3;
use nightglass::io::preview::rgb_png;
use nightglass::object::matter::{Material, Model, directional_albedo, materials, weight};

const SIDE: usize = 200;
const SUN_RADIUS: f64 = 4.65e-3;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let model = |name: &str, diffuse, specular, exponent, roughness| {
        let model = Model::from_name(name).ok_or("a model of this name")?;
        Ok::<_, String>((name.to_owned(), Material { model, diffuse, specular, exponent, roughness }))
    };
    let preset = |name: &str| Some((name.to_owned(), materials::preset(name)?));
    let mut all = vec![
        model("lambert", 0.8, 0.0, 1.0, 1.0)?,
        model("phong", 0.4, 0.4, 20.0, 1.0)?,
        model("phong-draft", 0.4, 0.4, 20.0, 1.0)?,
        model("blinn-phong", 0.4, 0.4, 60.0, 1.0)?,
        model("blinn-phong-draft", 0.4, 0.4, 60.0, 1.0)?,
        model("cook-torrance", 0.2, 0.5, 1.0, 0.25)?,
        model("oren-nayar", 0.8, 0.0, 1.0, 0.6)?,
        model("ashikhmin-shirley", 0.3, 0.4, 100.0, 1.0)?,
        model("mirror", 0.2, 0.8, 1.0, 1.0)?,
    ];
    all.extend(
        ["black-paint", "aluminium", "gold", "white-paint", "mli", "solar-cell"].into_iter().filter_map(preset),
    );
    println!("{:18} albedo at 0, 60, 85 deg", "material");
    for (name, material) in &all {
        let albedo = [0.0f64, 60.0, 85.0].map(|deg| directional_albedo(material, deg.to_radians()));
        println!("{name:18} {:.3} {:.3} {:.3}", albedo[0], albedo[1], albedo[2]);
    }
    let (columns, rows) = (5, all.len().div_ceil(5));
    let mut rgb = vec![12u8; 3 * columns * rows * SIDE * SIDE];
    for (k, (_, material)) in all.iter().enumerate() {
        let sphere = sphere(material);
        for y in 0..SIDE {
            let row = (k / columns * SIDE + y) * columns * SIDE + k % columns * SIDE;
            for x in 0..SIDE {
                rgb[3 * (row + x)..3 * (row + x) + 3].fill(sphere[y * SIDE + x]);
            }
        }
    }
    std::fs::create_dir_all("out")?;
    std::fs::write("out/materials.png", rgb_png(columns * SIDE, rows * SIDE, &rgb)?)?;
    println!("wrote out/materials.png");
    Ok(())
}

/// Grey levels of a sphere by rows from the top; the observer at +z.
fn sphere(material: &Material) -> Vec<u8> {
    let sun = DVec3::new(-0.5, 0.6, 0.7).normalize();
    let radius = 0.46 * SIDE as f64;
    let level = |k: usize| {
        let at = |n: usize| n as f64 + 0.5 - 0.5 * SIDE as f64;
        let (x, y) = (at(k % SIDE) / radius, -at(k / SIDE) / radius);
        let z2 = 1.0 - x * x - y * y;
        if z2 <= 0.0 {
            return 12;
        }
        let mut normal = DVec3::new(x, y, z2.sqrt());
        if material.model == Model::Mirror {
            // facets of 4 deg, as of a ball of mirrors
            normal = (normal / 0.07).round().normalize();
        }
        let radiance = weight(material, normal, sun, DVec3::Z, SUN_RADIUS) / normal.z.max(1e-3);
        (20.0 + 235.0 * (radiance / 0.6).clamp(0.0, 1.0).sqrt()) as u8
    };
    (0..SIDE * SIDE).map(level).collect()
}
