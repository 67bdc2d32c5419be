//! Materials of spacecraft.
//!
//! Published are hemispherical reflectances. Where no other source is named it is 1 - α, α the solar absorptance of
//! Fortescue, Swinerd & Stark 2011 (Spacecraft Systems Engineering, 4th ed., table 11.3), new surfaces. Those are means
//! over the solar spectrum, used here for V: for grey surfaces (aluminium, white and black paint) the two differ
//! by a few per cent; for coloured ones (gold, Kapton) and cells (dark in V, bright in the infrared) by a tenth
//! or more of full scale. How a reflectance splits into diffuse and specular, and the width of every lobe, vary
//! from sample to sample and are chosen here; take a measured table where one exists.
//!
//! | name | published | chosen |
//! |------|-----------|--------|
//! | aluminium | polished aluminium, α = 0.24 (an ideal film reflects 0.91 at 550 nm, Rakić 1995, Appl. Opt. 34, 4755) | specular 0.70 + diffuse 0.06, width 0.15 |
//! | gold | gold, α = 0.25 | specular 0.73 + diffuse 0.02, width 0.10 |
//! | white-paint | silicate, α = 0.14 after 1000 h of ultraviolet light (0.12 new) | all diffuse, slopes of 0.3 rad |
//! | black-paint | polyurethane, α = 0.95; binder of index 1.5: Fresnel 0.04 | diffuse 0.02: 0.05 in all at width 0.4 |
//! | mli | aluminised Kapton, Kapton outside, α = 0.40 | specular 0.50 + diffuse 0.10, width 0.25: the creases |
//! | solar-cell | cover glass of index 1.5: Fresnel 0.04 | diffuse 0.03 of grid and cells, width 0.03; total below 1 - α = 0.12 of GaAs cells, whose infrared is not seen in V |
//! | solar-cell-mirror | the same glass | a flat mirror: the sharpest glint possible |
//!
//! A quarter-wave layer of MgF2 (index 1.38) on the glass would lower 0.04 to 0.014 at its centre.

use super::{Material, Model};

/// Names of the presets.
pub const NAMES: [&str; 7] =
    ["aluminium", "gold", "white-paint", "black-paint", "mli", "solar-cell", "solar-cell-mirror"];

/// The material of a name in [`NAMES`].
pub fn preset(name: &str) -> Option<Material> {
    let metal = |specular, diffuse, roughness| Material {
        model: Model::CookTorrance,
        specular,
        roughness,
        ..Material::lambert(diffuse)
    };
    Some(match name {
        "aluminium" => metal(0.70, 0.06, 0.15),
        "gold" => metal(0.73, 0.02, 0.10),
        "white-paint" => Material { model: Model::OrenNayar, roughness: 0.3, ..Material::lambert(0.86) },
        "black-paint" => metal(0.04, 0.02, 0.4),
        "mli" => metal(0.50, 0.10, 0.25),
        "solar-cell" => metal(0.04, 0.03, 0.03),
        "solar-cell-mirror" => Material { model: Model::Mirror, ..metal(0.04, 0.03, 0.03) },
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::super::directional_albedo;
    use super::*;

    #[test]
    fn every_preset_conserves_energy_and_reflects_what_is_published() {
        let published = [0.76, 0.75, 0.86, 0.05, 0.60, 0.07, 0.07];
        for (name, reflectance) in NAMES.into_iter().zip(published) {
            let material = preset(name).unwrap();
            assert_eq!(material.check(), Ok(()));
            let normal = directional_albedo(&material, 0.0);
            // white paint is darker head-on than its diffuse share, by the shadows of its slopes
            assert!((normal / reflectance - 1.0).abs() < 0.12, "{name}: {normal}");
            for degrees in [30.0, 60.0, 75.0, 85.0, 89.0, 89.9] {
                assert!(directional_albedo(&material, f64::to_radians(degrees)) <= 1.0 + 1e-4, "{name}");
            }
        }
        assert_eq!(preset("cheese"), None);
    }
}
