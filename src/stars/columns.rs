//! Which columns of a table are place, magnitude, colour and motion of its stars.

use super::passbands::{of_gaia, of_tycho};

/// Columns by name, as the user says; what is not said is recognised by the usual names.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Choice {
    /// Right ascension \[deg\] and declination \[deg\].
    pub place: Option<[String; 2]>,
    /// V \[mag\].
    pub mag: Option<String>,
    /// Gaia's G \[mag\].
    pub g: Option<String>,
    /// Gaia's BP and RP \[mag\].
    pub bp_rp: Option<[String; 2]>,
    /// B-V \[mag\].
    pub bv: Option<String>,
    /// Proper motion in right ascension (times cos Dec) and declination \[mas/yr\].
    pub motion: Option<[String; 2]>,
}

/// How V and B-V follow from columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Light {
    /// V itself.
    Johnson(usize),
    /// VT, and BT.
    Tycho(usize, Option<usize>),
    /// G, and BP-RP.
    Gaia(usize, Option<GaiaColour>),
}

/// Where BP-RP is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GaiaColour {
    /// In a column.
    Column(usize),
    /// The difference of two.
    Difference(usize, usize),
}

/// The columns of a table, by number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Columns {
    /// Right ascension and declination.
    pub place: [usize; 2],
    /// Whence V.
    pub light: Light,
    /// B-V.
    pub bv: Option<usize>,
    /// Proper motion.
    pub motion: Option<[usize; 2]>,
    /// Julian year of a row's place.
    pub epoch: Option<usize>,
    /// Julian year of the places where no column has it, by what catalogue the names are of.
    pub usual_epoch: f64,
}

/// Names of right ascension and declination, and the epoch of the places in the catalogues that use them; none: that
/// depends on the mission.
const PLACES: [(&str, &str, Option<f64>); 8] = [
    ("ra_deg", "dec_deg", Some(2000.0)),
    ("ra", "dec", None),
    ("_RAJ2000", "_DEJ2000", Some(2000.0)),
    ("RAmdeg", "DEmdeg", Some(2000.0)),
    ("RA_ICRS", "DE_ICRS", None),
    ("RAICRS", "DEICRS", Some(1991.25)),
    ("RAdeg", "DEdeg", Some(2000.0)),
    ("RAJ2000", "DEJ2000", Some(2000.0)),
];
const V: [&str; 2] = ["mag_v", "Vmag"];
const VT: [&str; 1] = ["VTmag"];
const BT: [&str; 1] = ["BTmag"];
const G: [&str; 2] = ["phot_g_mean_mag", "Gmag"];
const BP: [&str; 2] = ["phot_bp_mean_mag", "BPmag"];
const RP: [&str; 2] = ["phot_rp_mean_mag", "RPmag"];
const BP_RP: [&str; 2] = ["bp_rp", "BP-RP"];
const BV: [&str; 4] = ["colour_bv", "color_bv", "B-V", "b_v"];
const MOTIONS: [(&str, &str); 4] =
    [("pmra", "pmdec"), ("pmRA", "pmDE"), ("pmra_mas_yr", "pmdec_mas_yr"), ("pm_ra", "pm_dec")];
const EPOCH: [&str; 1] = ["ref_epoch"];
/// Names of columns that a message shows.
const SHOWN: usize = 20;

/// Epoch of Gaia DR3's places.
const GAIA_EPOCH: f64 = 2016.0;

impl Columns {
    /// The columns of a table with these names.
    ///
    /// # Errors
    /// What was looked for and what the table has, where place or magnitude are not to be found.
    pub fn find(names: &[String], choice: &Choice) -> Result<Self, String> {
        let has = || {
            let short = |name: &String| name.chars().take(40).flat_map(char::escape_debug).collect::<String>();
            let more =
                if names.len() > SHOWN { format!(" and {} more", names.len() - SHOWN) } else { String::new() };
            format!("the file has {}{more}", names.iter().take(SHOWN).map(short).collect::<Vec<_>>().join(", "))
        };
        let at = |name: &str| names.iter().position(|n| n.eq_ignore_ascii_case(name));
        let any = |usual: &[&str]| usual.iter().find_map(|name| at(name));
        let said = |name: &String| at(name).ok_or_else(|| format!("no column {name:?}; {}", has()));
        let both = |[a, b]: &[String; 2]| Ok::<_, String>([said(a)?, said(b)?]);

        let recognised = PLACES.iter().find_map(|(ra, dec, epoch)| Some(([at(ra)?, at(dec)?], *epoch)));
        let (place, epoch) = match (&choice.place, recognised) {
            (Some(place), _) => {
                let usual = |(ra, dec, _): &&(&str, &str, _)| {
                    place[0].eq_ignore_ascii_case(ra) && place[1].eq_ignore_ascii_case(dec)
                };
                (both(place)?, PLACES.iter().find(usual).map_or(Some(2000.0), |(.., epoch)| *epoch))
            }
            (None, Some(found)) => found,
            (None, None) => {
                let looked_for = PLACES.map(|(ra, dec, _)| format!("{ra} + {dec}")).join(", ");
                return Err(format!(
                    "no columns of right ascension and declination: looked for {looked_for}; {}",
                    has()
                ));
            }
        };
        let light = Self::light(choice, &said, &any)?.ok_or_else(|| {
            let looked_for = [&V[..], &VT, &G].concat().join(", ");
            format!("no column of magnitudes: looked for {looked_for}; {}", has())
        })?;
        let gaia = matches!(light, Light::Gaia(..));
        Ok(Self {
            place,
            light,
            bv: choice.bv.as_ref().map(said).transpose()?.or_else(|| any(&BV)),
            motion: match &choice.motion {
                Some(motion) => Some(both(motion)?),
                None => MOTIONS.iter().find_map(|(ra, dec)| Some([at(ra)?, at(dec)?])),
            },
            epoch: any(&EPOCH),
            usual_epoch: epoch.unwrap_or(if gaia { GAIA_EPOCH } else { 2000.0 }),
        })
    }

    fn light(
        choice: &Choice,
        said: &impl Fn(&String) -> Result<usize, String>,
        any: &impl Fn(&[&str]) -> Option<usize>,
    ) -> Result<Option<Light>, String> {
        if let Some(name) = &choice.mag {
            return Ok(Some(Light::Johnson(said(name)?)));
        }
        let bands = match &choice.bp_rp {
            Some([bp, rp]) => Some(GaiaColour::Difference(said(bp)?, said(rp)?)),
            None => {
                any(&BP_RP).map(GaiaColour::Column).or_else(|| Some(GaiaColour::Difference(any(&BP)?, any(&RP)?)))
            }
        };
        if let Some(name) = &choice.g {
            return Ok(Some(Light::Gaia(said(name)?, bands)));
        }
        let tycho = || any(&VT).map(|vt| Light::Tycho(vt, any(&BT)));
        Ok(any(&V).map(Light::Johnson).or_else(tycho).or_else(|| any(&G).map(|g| Light::Gaia(g, bands))))
    }

    /// The numbers of all columns to be read.
    pub fn wanted(&self) -> Vec<usize> {
        let mut wanted = self.place.to_vec();
        match self.light {
            Light::Johnson(v) => wanted.push(v),
            Light::Tycho(vt, bt) => wanted.extend([Some(vt), bt].into_iter().flatten()),
            Light::Gaia(g, None) => wanted.push(g),
            Light::Gaia(g, Some(GaiaColour::Column(c))) => wanted.extend([g, c]),
            Light::Gaia(g, Some(GaiaColour::Difference(bp, rp))) => wanted.extend([g, bp, rp]),
        }
        wanted.extend(self.bv);
        wanted.extend(self.motion.into_iter().flatten());
        wanted.extend(self.epoch);
        wanted
    }
}

impl Light {
    /// V, NaN where it is not known, and the colour that follows, from a row's values by column.
    pub fn of(&self, values: &[f64]) -> (f64, Option<f64>) {
        let known = |value: f64| value.is_finite().then_some(value);
        match *self {
            Self::Johnson(v) => (values[v], None),
            Self::Tycho(vt, bt) => of_tycho(values[vt], bt.and_then(|bt| known(values[bt] - values[vt]))),
            Self::Gaia(g, colour) => {
                let colour = colour.and_then(|colour| match colour {
                    GaiaColour::Column(c) => known(values[c]),
                    GaiaColour::Difference(bp, rp) => known(values[bp] - values[rp]),
                });
                of_gaia(values[g], colour)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn find(names: &str, choice: &Choice) -> Result<Columns, String> {
        Columns::find(&names.split(' ').map(str::to_owned).collect::<Vec<_>>(), choice)
    }

    #[test]
    fn usual_names_are_recognised() {
        let gaia = "source_id ra dec phot_g_mean_mag phot_bp_mean_mag phot_rp_mean_mag bp_rp pmra pmdec ref_epoch";
        let found = find(gaia, &Choice::default()).expect("Gaia");
        assert_eq!((found.place, found.light), ([1, 2], Light::Gaia(3, Some(GaiaColour::Column(6)))));
        assert_eq!((found.motion, found.epoch, found.usual_epoch), (Some([7, 8]), Some(9), 2016.0));
        let tycho =
            find("TYC1 pmRA pmDE BTmag VTmag RA(ICRS) RAmdeg DEmdeg", &Choice::default()).expect("Tycho-2");
        assert_eq!((tycho.place, tycho.light), ([6, 7], Light::Tycho(4, Some(3))));
        let hipparcos = find("HIP RAICRS DEICRS Vmag B-V pmRA pmDE", &Choice::default()).expect("Hipparcos");
        assert_eq!((hipparcos.light, hipparcos.bv, hipparcos.usual_epoch), (Light::Johnson(3), Some(4), 1991.25));
        let plain = find("ra_deg dec_deg mag_v colour_bv", &Choice::default()).expect("plain");
        assert_eq!((plain.wanted(), plain.motion), (vec![0, 1, 2, 3], None));
        let vizier = find("BPmag RPmag Gmag RA_ICRS DE_ICRS", &Choice::default()).expect("Gaia of VizieR");
        assert_eq!((vizier.wanted(), vizier.usual_epoch), (vec![3, 4, 2, 0, 1], 2016.0));
    }

    #[test]
    fn what_is_said_goes_first() {
        let choice = Choice {
            place: Some(["x".into(), "y".into()]),
            g: Some("z".into()),
            bp_rp: Some(["b".into(), "r".into()]),
            bv: Some("c".into()),
            motion: Some(["u".into(), "v".into()]),
            ..Choice::default()
        };
        let found = find("ra dec Vmag x y z b r c u v", &choice).expect("all there");
        assert_eq!(found.wanted(), [3, 4, 5, 6, 7, 8, 9, 10]);
    }

    #[test]
    fn usual_names_that_are_said_keep_their_epoch() {
        let choice = Choice { place: Some(["RA".into(), "DEC".into()]), ..Choice::default() };
        assert_eq!(find("ra dec phot_g_mean_mag", &choice).expect("Gaia").usual_epoch, 2016.0);
    }

    #[test]
    fn what_is_missing_is_told_with_what_is_there() {
        let told = find("alpha delta Vmag", &Choice::default()).expect_err("no place");
        assert!(told.contains("RAmdeg + DEmdeg") && told.contains("alpha, delta, Vmag"), "{told}");
        let told = find("ra dec flux", &Choice::default()).expect_err("no magnitude");
        assert!(told.contains("phot_g_mean_mag") && told.contains("flux"), "{told}");
        let choice = Choice { mag: Some("magnitude".into()), ..Choice::default() };
        assert!(find("ra dec flux", &choice).expect_err("not there").contains("\"magnitude\""));
    }
}
