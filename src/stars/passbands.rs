//! From the magnitudes of Tycho and Gaia to Johnson's V and B-V.
//!
//! Tycho: V = VT - 0.090 (BT - VT), B-V = 0.850 (BT - VT) (ESA 1997, SP-1200, vol. 1, sect. 1.3; B-V to 0.05 mag).
//! Gaia: polynomials in x = BP-RP of the Gaia DR3 documentation, sect. 5.5.1 (Riello et al. 2021, A&A 649, A3, app. C):
//! G - V for -0.5 < x < 5 (0.03 mag), G - VT and G - BT for -0.3 < x < 3. Their difference is BT - VT and gives B-V as
//! Tycho's does, to 0.1 mag. Beyond its ends a relation keeps the value there.

/// Ranges of BP-RP in which G - V, and G - VT with G - BT, are given.
const V_RANGE: [f64; 2] = [-0.5, 5.0];
const TYCHO_RANGE: [f64; 2] = [-0.3, 3.0];

/// G - V in powers of BP-RP.
const G_V: [f64; 4] = [-0.027_04, 0.014_24, -0.215_6, 0.014_26];
/// G - VT.
const G_VT: [f64; 4] = [-0.010_77, -0.068_2, -0.238_7, 0.023_42];
/// G - BT.
const G_BT: [f64; 6] = [-0.004_288, -0.854_7, 0.124_4, -0.908_5, 0.484_3, -0.068_14];

/// BP-RP of the Sun (Casagrande & VandenBerg 2018, MNRAS 479, L102): taken where a star's is not known.
const SUN_BP_RP: f64 = 0.82;

fn polynomial(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// V and B-V of Tycho's VT and BT - VT; at an unknown colour V = VT - 0.07, as for the mean star.
pub fn of_tycho(vt: f64, bt_vt: Option<f64>) -> (f64, Option<f64>) {
    (bt_vt.map_or(vt - 0.07, |colour| vt - 0.090 * colour), bt_vt.map(|colour| 0.850 * colour))
}

/// V and B-V of Gaia's G and BP-RP; at an unknown colour V is that of a star as yellow as the Sun.
pub fn of_gaia(g: f64, bp_rp: Option<f64>) -> (f64, Option<f64>) {
    let x = bp_rp.unwrap_or(SUN_BP_RP).clamp(V_RANGE[0], V_RANGE[1]);
    let colour = bp_rp.map(|x| {
        let x = x.clamp(TYCHO_RANGE[0], TYCHO_RANGE[1]);
        0.850 * (polynomial(&G_VT, x) - polynomial(&G_BT, x))
    });
    (g - polynomial(&G_V, x), colour)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The Sun: V - G = 0.15, B-V = 0.65; Vega: all colours 0; K0 III, B-V = 1.0 at BP-RP = 1.15.
    #[test]
    fn known_stars_have_their_colours() {
        for (bp_rp, v_less_g, bv) in [(0.82, 0.152, 0.63), (0.0, 0.027, 0.0), (1.15, 0.27, 0.98)] {
            let (v, colour) = of_gaia(10.0, Some(bp_rp));
            assert!((v - 10.0 - v_less_g).abs() < 0.03, "{bp_rp} {v}");
            assert!((colour.expect("known") - bv).abs() < 0.1, "{bp_rp} {colour:?}");
        }
        assert_eq!(of_gaia(10.0, None), (of_gaia(10.0, Some(0.82)).0, None));
    }

    /// V by way of VT and BT agrees with V straight from G.
    #[test]
    fn both_ways_to_v_agree() {
        for step in 0..20 {
            let x = -0.2 + 0.1 * f64::from(step);
            let (vt, bt) = (-polynomial(&G_VT, x), -polynomial(&G_BT, x));
            let (straight, by_tycho) = (of_gaia(0.0, Some(x)).0, of_tycho(vt, Some(bt - vt)).0);
            assert!((straight - by_tycho).abs() < 0.06, "{x} {straight} {by_tycho}");
        }
    }

    #[test]
    fn relations_are_held_beyond_their_ends() {
        assert_eq!(of_gaia(10.0, Some(9.0)), of_gaia(10.0, Some(5.0)));
        assert_eq!(of_tycho(10.0, None), (9.93, None));
    }
}
