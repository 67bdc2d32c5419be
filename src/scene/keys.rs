//! Every table and key of a scene file. A row: path, kind and range, unit, default, meaning; a row with `when`
//! is accepted only beside that value of its sibling.

use super::schema::{Content, Given, Given::*, Key, Kind, Kind::*};

const fn key(path: &'static str, kind: Kind, unit: &'static str, given: Given, doc: &'static str) -> Key {
    Key::new(path, kind, unit, given, doc)
}

const fn table(path: &'static str, kind: Kind, doc: &'static str) -> Key {
    Key::table(path, kind, doc)
}

const BIG: f64 = 1e12;
const COUNT: i64 = 1_000_000_000;
const QE: &[&str] = &["kaf16803", "krag2003", "e2v230_84", "andor_dw936", "thx7899m"];
const AXES: &[&str] = &["earth", "sun", "velocity", "observer"];
const ATTITUDES: &[&str] = &["inertial", "spin", "nadir", "sun", "aligned", "tumble", "table"];
const SHAPES: &[&str] =
    &["box", "sphere", "cylinder", "cone", "torus", "plate", "dish", "l-shape", "box-wing", "observatory"];
const BRDFS: &[&str] = &[
    "lambert",
    "phong",
    "phong-draft",
    "blinn-phong",
    "blinn-phong-draft",
    "cook-torrance",
    "oren-nayar",
    "ashikhmin-shirley",
    "mirror",
    "aluminium",
    "gold",
    "white-paint",
    "black-paint",
    "mli",
    "solar-cell",
];
/// Those with a number of that name.
const DIFFUSE: &str =
    "lambert|phong|phong-draft|blinn-phong|blinn-phong-draft|cook-torrance|oren-nayar|ashikhmin-shirley|mirror";
const SPECULAR: &str = "phong|phong-draft|blinn-phong|blinn-phong-draft|cook-torrance|ashikhmin-shirley|mirror";
const EXPONENT: &str = "phong|phong-draft|blinn-phong|blinn-phong-draft|ashikhmin-shirley";
const ROUGHNESS: &str = "cook-torrance|oren-nayar";
const MODELS: &[&str] = &["auto", "convex", "nonconvex", "little", "ikeuchi", "nicolet", "draft"];
const EXTINCTION: &[&str] = &["kpno", "ctio", "krag2003", "computed"];

/// Every table and key, in the order of a resolved scene.
#[rustfmt::skip]
pub(super) static KEYS: &[Key] = &[
    key("schema_version", Int(1, 1), "", Is("1"), "version of this format"),
    key("name", Text, "", From("\"my-night\"", "the file's stem"), "name of the scene"),
    key("seed", Int(0, i64::MAX), "", Is("1"), "of every random number; --seed replaces it"),

    table("station", Section, "the site and the air above it"),
    key("station.preset", Preset, "", Optional("\"pogs\""), "fills [station], [telescope] and [detector]; any key written here or there wins"),
    key("station.name", Text, "", Is("\"unnamed\""), "name of the site"),
    key("station.latitude_deg", Real(-90.0, 90.0), "deg", Must("32.9"), "geodetic on WGS 84, north +"),
    key("station.longitude_deg", Real(-180.0, 360.0), "deg", Must("-105.533333"), "east +"),
    key("station.height_m", Real(-500.0, 100_000.0), "m", Must("2225.0"), "above the ellipsoid"),
    key("station.pressure_hpa", Real(0.0, 1200.0), "hPa", From("780.0", "the standard atmosphere at height_m"), "air pressure at the site; 0 = no refraction"),
    key("station.temperature_c", Real(-100.0, 100.0), "deg C", Is("10.0"), "air temperature at the site"),
    key("station.humidity", Real(0.0, 1.0), "", Is("0.5"), "relative humidity"),
    key("station.seeing_arcsec", Above(0.0, 60.0), "arcsec", Must("2.2"), "FWHM at zenith, 550 nm; the frame's is this x airmass^0.6"),
    key("station.artificial_zenith_mcd_m2", Real(0.0, 1e6), "mcd/m^2", Is("0.0"), "zenith luminance, artificial part alone; 0 = none"),
    key("station.light_atlas", WordOrFile(&["none"], "an ESRI ASCII grid of artificial zenith mcd/m^2"), "", Is("\"none\""), "local tile of an atlas; its value at the station replaces artificial_zenith_mcd_m2"),
    key("station.light_domes", Domes, "deg, share", Is("[]"), "towns: azimuth, share of the artificial light that comes from there"),
    key("station.extinction", WordOrFile(EXTINCTION, "a CSV of nm, mag/airmass"), "", Is("\"kpno\""), "extinction curve; computed: from pressure and height"),
    key("station.ground_albedo", Real(0.0, 1.0), "", Is("0.15"), "of the ground around: it lights the sky from below; snow 0.8"),
    key("station.horizon_deg", Horizon, "deg", Is("[[0.0, 0.0], [360.0, 0.0]]"), "azimuth, lowest elevation; linear between"),
    key("station.scintillation", Flag, "", Is("true"), "log-normal, one factor an object and frame (Young 1967)"),
    key("station.scintillation_factor", Real(0.0, 10.0), "", Is("1.0"), "of the site, times Young's; medians of good sites 1.3 to 1.7 (Osborn et al. 2015)"),

    table("telescope", Section, "the optics"),
    key("telescope.aperture_m", Above(0.0, 100.0), "m", Must("0.3556"), "diameter"),
    key("telescope.obstruction_m", Real(0.0, 100.0), "m", Is("0.0"), "diameter of the central obstruction; 0 = none"),
    key("telescope.plate_scale_arcsec", Above(0.0, 3600.0), "arcsec/px", Must("0.725447016"), "per pixel; or give focal_length_m"),
    key("telescope.focal_length_m", Above(0.0, 10_000.0), "m", Must("2.559"), "instead of plate_scale_arcsec"),
    key("telescope.throughput", Above(0.0, 1.0), "", Must("0.5"), "mirrors, glass, losses; without QE, obstruction, atmosphere, filter"),
    key("telescope.filter", WordOrFile(&["none", "B", "V", "R", "I", "G"], "a CSV of nm, transmission"), "", Is("\"none\""), "filter"),
    key("telescope.position_angle_deg", Real(-360.0, 360.0), "deg", Is("0.0"), "of the +y axis, from north through east"),
    key("telescope.mirrored", Flag, "", Is("false"), "false: east to the left when north is up"),
    key("telescope.psf", WordOrFile(&["gaussian", "moffat", "airy", "kolmogorov"], "a FITS image"), "", Is("\"moffat\""), "shape of a star's image; airy: diffraction alone"),
    key("telescope.moffat_beta", Above(1.0, 100.0), "", Is("3.0"), "exponent of the Moffat profile").when("psf", "moffat"),
    key("telescope.vignetting", Real(0.0, 1.0), "", Is("0.0"), "share of light lost in the corner; falls with the square of the distance"),
    key("telescope.sip", WordOrFile(&["none"], "a file of SIP coefficients"), "", Is("\"none\""), "distortion: A_i_j and B_i_j about the centre, as in a FITS header"),
    key("telescope.tilt_deg", Reals(2, -45.0, 45.0), "deg", Is("[0.0, 0.0]"), "tilt of the chip about its y and x axes; no defocus"),

    table("detector", Section, "the chip and its electronics"),
    key("detector.size_px", Size, "px", Must("[4096, 4096]"), "width, height; one integer = a square"),
    key("detector.pixel_um", Above(0.0, 1000.0), "um", Must("9.0"), "side of a pixel"),
    key("detector.kind", Word(&["ccd", "cmos"]), "", Is("\"ccd\""), "cmos: rolling shutter, per-pixel read noise and gain"),
    key("detector.binning", Int(1, 64), "", Is("1"), "on-chip for \"ccd\", of the numbers read for \"cmos\"; size_px, pixel_um, plate_scale_arcsec count unbinned pixels"),
    key("detector.qe", WordOrFile(QE, "a CSV of nm, QE"), "", Must("\"kaf16803\""), "quantum efficiency"),
    key("detector.gain_e_per_adu", Above(0.0, 1e6), "e-/ADU", Must("1.5"), "gain"),
    key("detector.read_noise_e", Real(0.0, 1e6), "e-", Must("10.0"), "read noise, rms"),
    key("detector.dark_e_per_s", Real(0.0, 1e9), "e-/s/px", Must("0.05"), "dark current at dark_temperature_c"),
    key("detector.dark_temperature_c", Real(-273.15, 100.0), "deg C", Is("-20.0"), "where dark_e_per_s holds"),
    key("detector.temperature_c", Real(-273.15, 100.0), "deg C", Is("-20.0"), "of the chip; DARKCUR is the rate at this one"),
    key("detector.dark_doubling_c", Above(0.0, 100.0), "deg C", Is("6.3"), "warming that doubles the dark current"),
    key("detector.bias_adu", Real(0.0, 1e9), "ADU", Is("1000.0"), "bias level"),
    key("detector.bias_structure_adu", Real(0.0, 1e6), "ADU", Is("0.0"), "rms of a fixed pattern of columns and rows"),
    key("detector.full_well_e", Real(0.0, BIG), "e-", Must("100000.0"), "full well of a pixel"),
    key("detector.bits", IntOf(&[8, 10, 12, 14, 16, 32]), "", Is("16"), "of the converter"),
    key("detector.prnu", Real(0.0, 1.0), "", Is("0.0"), "pixel response non-uniformity, rms share; 0 = off"),
    key("detector.dsnu", Real(0.0, 10.0), "", Is("0.0"), "dark signal non-uniformity, rms share, log-normal; 0 = off"),
    key("detector.hot_pixel_fraction", Real(0.0, 1.0), "", Is("0.0"), "share of pixels with 10 to 1000 times the dark current"),
    key("detector.blooming", Flag, "", Is("false"), "charge above full well runs along the column; false: it is lost"),
    key("detector.cosmic_rays_per_cm2_s", Real(0.0, 1e6), "1/cm^2/s", Is("0.0"), "cosmic rays; 0.02 at sea level"),
    key("detector.cti", Real(0.0, 1.0), "", Is("0.0"), "charge left behind at each transfer, share"),
    key("detector.nonlinearity", Real(-1.0, 1.0), "", Is("0.0"), "at full well, share missing"),
    key("detector.overscan_px", Int(0, 4096), "px", Is("0"), "columns read beyond the pixels, stored to their right"),
    key("detector.shutter_s", Real(0.0, 60.0), "s", Is("0.0"), "ccd: travel of an iris from centre to corner; cmos: from the first row's opening to the last's; 0 = ideal"),
    key("detector.frame_transfer_s", Real(0.0, 60.0), "s", Is("0.0"), "time in which a frame is moved under its shield, in the light; 0 = none"),
    key("detector.cmos_read_noise_spread", Real(0.0, 2.0), "", Is("0.2"), "of the pixels' read noise, log-normal about read_noise_e").when("kind", "cmos"),
    key("detector.cmos_gain_spread", Real(0.0, 0.5), "", Is("0.01"), "of the pixels' gain, rms share").when("kind", "cmos"),
    key("detector.pattern_seed", Int(0, i64::MAX), "", Is("1"), "of the chip's fixed patterns; a chip keeps it from night to night"),

    table("pointing", Section, "where the frame's centre is at every mid-exposure"),
    key("pointing.at", Word(&["target", "radec", "azel"]), "", From("\"target\"", "\"target\" where there is one"), "what is pointed at"),
    key("pointing.target", Text, "", Optional("\"GOES 14\""), "which target; the first unless named").when("at", "target"),
    key("pointing.ra_deg", Real(-360.0, 360.0), "deg", Must("83.0"), "ICRS, as in the WCS").when("at", "radec"),
    key("pointing.dec_deg", Real(-90.0, 90.0), "deg", Must("8.0"), "ICRS, as in the WCS").when("at", "radec"),
    key("pointing.az_deg", Real(-360.0, 360.0), "deg", Must("190.0"), "apparent azimuth, from north through east").when("at", "azel"),
    key("pointing.el_deg", Real(-90.0, 90.0), "deg", Must("51.0"), "apparent elevation").when("at", "azel"),
    key("pointing.offset_px", Reals(2, -1e6, 1e6), "px", Is("[0.0, 0.0]"), "of the place pointed at, from the centre"),

    table("exposures", Section, "when the shutter is open, and how the mount moves meanwhile"),
    key("exposures.start", Time, "UTC", Must("2018-01-20T03:00:00Z"), "shutter opens for frame 0"),
    key("exposures.count", Int(1, COUNT), "", Is("1"), "number of exposures"),
    key("exposures.cadence_s", Real(0.0, 1e9), "s", From("2700.0", "duration_s"), "from opening to opening; at least duration_s"),
    key("exposures.duration_s", Real(0.0, 1e6), "s", Must("5.0"), "open shutter; 0 = instantaneous, for plan and lightcurve"),
    key("exposures.track", Word(&["target", "sidereal", "fixed", "rates"]), "", From("\"target\"", "\"target\" where there is one, else \"sidereal\""), "motion while the shutter is open"),
    key("exposures.rate_arcsec_s", Reals(2, -1e6, 1e6), "arcsec/s", Must("[15.04, 0.0]"), "(d RA/dt) cos Dec, d Dec/dt").when("track", "rates"),
    key("exposures.only_observable", Flag, "", Is("false"), "true: exposures that [plan] refuses are skipped"),

    table("plan", Section, "what `observable` means"),
    key("plan.min_el_deg", Real(-90.0, 90.0), "deg", Is("10.0"), "lowest elevation of the target"),
    key("plan.max_sun_el_deg", Real(-90.0, 90.0), "deg", Is("-12.0"), "highest elevation of the Sun"),
    key("plan.min_moon_sep_deg", Real(0.0, 180.0), "deg", Is("10.0"), "least distance from the Moon"),
    key("plan.sunlit", Flag, "", Is("true"), "whether the target must be lit"),
    key("plan.limit_mag_v", Real(-30.0, 40.0), "mag", Optional("16.0"), "faintest target"),
    key("plan.min_snr", Real(0.0, 1e9), "", Optional("5.0"), "least signal-to-noise ratio of the first target in an exposure"),

    table("target[]", Many, "an object in orbit; write one [[target]] for each"),
    key("target[].name", Text, "", Must("\"GOES 14\""), "unique name"),
    key("target[].shape", WordOrFile(SHAPES, "an OBJ or STL file in metres"), "", Optional("\"shapes/boxwing.obj\""), "closed parts are solids (their union counts); parts with open edges are sheets, lit from both sides"),
    key("target[].shape_size_m", Reals(3, 1e-9, 1e9), "m", Optional("[1.0, 1.0, 1.0]"), "extent along x, y, z of a built-in shape; 1 m, or its natural size"),
    key("target[].shape_scale", Above(0.0, 1e9), "", Is("1.0"), "factor on the shape's size; 0.001 of a file in millimetres"),
    key("target[].earthshine", Flag, "", Is("false"), "whether the shape is lit by the Earth too: a Lambert sphere of albedo 0.29"),
    table("target[].orbit", Section, "where it is: one of tle, omm, oem, state, kepler, fixed"),
    key("target[].orbit.tle", Tle, "", Must("[\"1 35491U ...\", \"2 35491 ...\"]"), "two-line elements, or a file"),
    key("target[].orbit.omm", File(Content::Omm), "", Optional("\"sat.json\""), "mean elements as a message"),
    key("target[].orbit.oem", File(Content::Oem), "", Optional("\"sat.oem\""), "an ephemeris, interpolated"),
    table("target[].orbit.fixed", Maybe, "a fixed place, topocentric astrometric ICRS"),
    key("target[].orbit.fixed.ra_deg", Real(-360.0, 360.0), "deg", Must("83.0"), "right ascension"),
    key("target[].orbit.fixed.dec_deg", Real(-90.0, 90.0), "deg", Must("8.0"), "declination"),
    key("target[].orbit.fixed.range_km", Above(0.0, BIG), "km", Optional("38000.0"), "distance; without it the target is never in shadow"),
    table("target[].orbit.state", Maybe, "a state vector, integrated numerically"),
    key("target[].orbit.state.epoch", Time, "UTC", Must("2018-01-15T00:00:00Z"), "epoch"),
    key("target[].orbit.state.frame", Word(&["gcrs"]), "", Is("\"gcrs\""), "axes"),
    key("target[].orbit.state.position_km", Reals(3, -BIG, BIG), "km", Must("[42164.0, 0.0, 0.0]"), "position"),
    key("target[].orbit.state.velocity_km_s", Reals(3, -3e5, 3e5), "km/s", Must("[0.0, 3.0747, 0.0]"), "velocity"),
    table("target[].orbit.kepler", Maybe, "osculating elements, integrated numerically"),
    key("target[].orbit.kepler.epoch", Time, "UTC", Must("2018-01-15T00:00:00Z"), "epoch"),
    key("target[].orbit.kepler.frame", Word(&["gcrs"]), "", Is("\"gcrs\""), "axes"),
    key("target[].orbit.kepler.a_km", Above(0.0, BIG), "km", Must("42164.0"), "semi-major axis"),
    key("target[].orbit.kepler.e", Real(0.0, 1.0), "", Must("0.0002"), "eccentricity"),
    key("target[].orbit.kepler.i_deg", Real(0.0, 180.0), "deg", Must("0.05"), "inclination"),
    key("target[].orbit.kepler.raan_deg", Real(-360.0, 360.0), "deg", Must("0.0"), "right ascension of the ascending node"),
    key("target[].orbit.kepler.argp_deg", Real(-360.0, 360.0), "deg", Must("0.0"), "argument of perigee"),
    key("target[].orbit.kepler.mean_anomaly_deg", Real(-360.0, 360.0), "deg", Must("9.0"), "mean anomaly"),
    table("target[].brightness", Maybe, "how bright it is, unless it has a shape"),
    key("target[].brightness.mag_v", Real(-30.0, 40.0), "mag", Must("11.8"), "outside the atmosphere while lit, at any range and phase"),
    table("target[].material", Maybe, "of faces whose MTL material and group tell none"),
    key("target[].material.brdf", WordOrFile(BRDFS, "a CSV of theta_s_deg, theta_o_deg, phi_deg, f_sr"), "", Is("\"lambert\""), "a model, or a preset from aluminium on"),
    key("target[].material.diffuse", Real(0.0, 1.0), "", Is("0.6"), "C_d: lambert f = C_d/pi").when("brdf", DIFFUSE),
    key("target[].material.specular", Real(0.0, 1.0), "", Is("0.0"), "C_s: blinn-phong f += C_s (n+2)/(8 pi) (N.H)^n; cook-torrance: Fresnel's share at 0 deg; with diffuse at most 1").when("brdf", SPECULAR),
    key("target[].material.exponent", Real(0.0, 1e6), "", Is("20.0"), "n of the lobe").when("brdf", EXPONENT),
    key("target[].material.roughness", Real(0.0, 1.0), "", Is("0.3"), "alpha of cook-torrance, sigma [rad] of oren-nayar").when("brdf", ROUGHNESS),
    table("target[].material.group", Named, "the same keys for one OBJ group or MTL material, [target.material.group.NAME]"),
    key("target[].material.group.*.brdf", WordOrFile(BRDFS, "a CSV of theta_s_deg, theta_o_deg, phi_deg, f_sr"), "", Is("\"lambert\""), "as in [target.material]"),
    key("target[].material.group.*.diffuse", Real(0.0, 1.0), "", Is("0.6"), "as in [target.material]").when("brdf", DIFFUSE),
    key("target[].material.group.*.specular", Real(0.0, 1.0), "", Is("0.0"), "as in [target.material]").when("brdf", SPECULAR),
    key("target[].material.group.*.exponent", Real(0.0, 1e6), "", Is("20.0"), "as in [target.material]").when("brdf", EXPONENT),
    key("target[].material.group.*.roughness", Real(0.0, 1.0), "", Is("0.3"), "as in [target.material]").when("brdf", ROUGHNESS),
    table("target[].part", Named, "a part that turns, [target.part.GROUP]: of an OBJ group"),
    key("target[].part.*.hinge_m", Reals(3, -1e9, 1e9), "m", Is("[0.0, 0.0, 0.0]"), "a point that stays where it is, body axes, before shape_scale"),
    key("target[].part.*.axis", Reals(3, -BIG, BIG), "", Optional("[0.0, 1.0, 0.0]"), "body axis it turns about; without it the part turns any way"),
    key("target[].part.*.face", Reals(3, -BIG, BIG), "", Must("[0.0, 0.0, 1.0]"), "direction of the part at rest that follows"),
    key("target[].part.*.point_to", Word(AXES), "", Is("\"sun\""), "what it follows, as near as the axis lets it"),
    table("target[].attitude", Maybe, "how it turns"),
    key("target[].attitude.mode", Word(ATTITUDES), "", Must("\"spin\""), "kind of motion"),
    key("target[].attitude.quaternion", Reals(4, -1.0, 1.0), "", Is("[1.0, 0.0, 0.0, 0.0]"), "scalar first, body to ICRS components; spin and tumble: at epoch").when("mode", "inertial|spin|tumble"),
    key("target[].attitude.axis", Reals(3, -BIG, BIG), "", Must("[0.0, 0.0, 1.0]"), "ICRS components, right-handed").when("mode", "spin"),
    key("target[].attitude.period_s", Above(0.0, 1e9), "s", Must("9700.0"), "of one turn").when("mode", "spin"),
    key("target[].attitude.phase_deg", Real(-360.0, 360.0), "deg", Is("0.0"), "turn already made at epoch").when("mode", "spin"),
    key("target[].attitude.epoch", Time, "UTC", From("2018-01-15T04:00:00Z", "exposures.start"), "when quaternion and phase hold").when("mode", "spin|tumble"),
    key("target[].attitude.inertia_kg_m2", Reals(3, 0.0, BIG), "kg m^2", Must("[1.0, 2.0, 3.0]"), "principal moments").when("mode", "tumble"),
    key("target[].attitude.rate_deg_s", Reals(3, -1e6, 1e6), "deg/s", Must("[0.0, 0.0, 1.0]"), "in body axes, at epoch").when("mode", "tumble"),
    key("target[].attitude.file", File(Content::Attitude), "", Must("\"attitude.csv\""), "attitudes at times, with the shortest turns between them").when("mode", "table"),
    key("target[].attitude.point_body", Reals(3, -BIG, BIG), "", Must("[0.0, 0.0, 1.0]"), "this body axis to point_to").when("mode", "aligned"),
    key("target[].attitude.point_to", Word(AXES), "", Must("\"earth\""), "where it points").when("mode", "aligned"),
    key("target[].attitude.turn_body", Reals(3, -BIG, BIG), "", Must("[1.0, 0.0, 0.0]"), "this body axis as near turn_to as it goes").when("mode", "aligned"),
    key("target[].attitude.turn_to", Word(AXES), "", Must("\"sun\""), "where it turns").when("mode", "aligned"),

    table("sky", Section, "diffuse light; a number is V mag/arcsec^2 of solar colour at the ground, the same over the frame"),
    key("sky.airglow", WordOrReal(&["auto", "off", "palace", "krag"], 0.0, 60.0), "mag/arcsec^2", Is("\"auto\""), "light of the upper atmosphere"),
    key("sky.pollution", WordOrReal(&["auto", "off", "draft"], 0.0, 60.0), "mag/arcsec^2", Is("\"auto\""), "scattered artificial light"),
    key("sky.twilight", WordOrReal(&["auto", "off", "patat", "yoachim", "draft"], 0.0, 60.0), "mag/arcsec^2", Is("\"auto\""), "scattered sunlight"),
    key("sky.starlight", WordOrReal(&["auto", "off"], 0.0, 60.0), "mag/arcsec^2", Is("\"auto\""), "stars fainter than stars.limit_mag_v only"),
    key("sky.moonlight", WordOrReal(&["auto", "off", "rolo", "krisciunas-schaefer", "draft"], 0.0, 60.0), "mag/arcsec^2", Is("\"auto\""), "scattered moonlight"),
    key("sky.zodiacal", WordOrReal(&["auto", "off", "leinert", "roach"], 0.0, 60.0), "mag/arcsec^2", Is("\"auto\""), "sunlight from interplanetary dust"),
    key("sky.f107_sfu", Real(0.0, 1000.0), "sfu", Is("130.0"), "solar radio flux at 10.7 cm; 70 at a minimum of the cycle, 200 at a maximum"),
    key("sky.tilt", Reals(2, -1.0, 1.0), "", Is("[0.0, 0.0]"), "of sources given as numbers: relative half-amplitude across x, y"),

    table("stars", Section, "stars drawn one by one"),
    key("stars.enabled", Flag, "", Is("true"), "false: none are drawn"),
    key("stars.catalog", WordOrFile(&["tycho2", "none"], "a file made by `catalog import`"), "", Is("\"tycho2\""), "catalogue"),
    key("stars.synthetic", Flag, "", Is("true"), "fill beyond the catalogue from counts"),
    key("stars.limit_mag_v", WordOrReal(&["auto"], -30.0, 60.0), "mag", Is("\"auto\""), "drawn down to here; \"auto\": while their clumping matters against the noise (accuracy.omit)"),
    key("stars.random_count", Int(0, COUNT), "", Is("0"), "benchmark fields: so many stars at random places instead of catalog and synthetic"),
    key("stars.random_mag_v", Reals(2, -30.0, 60.0), "mag", Is("[8.0, 17.0]"), "brightest, faintest; dN/dm ~ 10^(0.35 m)"),
    key("stars.random_seed", Int(0, i64::MAX), "", Is("1"), "of the random stars"),

    table("photometry", Section, "how light curves are measured from frames"),
    key("photometry.method", Word(&["optimal", "aperture", "joint"]), "", Is("\"optimal\""), "estimator of the flux: a fit of the image, a sum, a fit together with the stars beside"),
    key("photometry.aperture_px", WordOrReal(&["auto"], 0.5, 10_000.0), "px", Is("\"auto\""), "radius; a pill where something trails; a number asks for an aperture, whatever the method"),
    key("photometry.search_px", Above(0.0, 1e5), "px", Is("50.0"), "about the place predicted, or the frame's centre"),
    key("photometry.background_px", Int(4, 65_536), "px", Is("64"), "mesh of the background"),
    key("photometry.min_stars", Int(1, 1_000_000), "", Is("5"), "fewer: zero point borrowed from neighbours in time, flagged"),

    table("inversion", Section, "how shapes are sought in light curves"),
    key("inversion.enabled", Flag, "", Is("false"), "whether `run` goes on to the shapes of the targets that have one"),
    key("inversion.model", Word(MODELS), "", Is("\"auto\""), "method"),
    key("inversion.brdf", WordOrTable(&["as-target", "fit"], "target[].material"), "", Is("\"as-target\""), "or a table as [target.material]"),
    key("inversion.attitude", WordOrTable(&["as-target", "scan-pole", "scan-tumble"], "target[].attitude"), "", Is("\"as-target\""), "or a table as [target.attitude]"),
    key("inversion.truth", Path, "", Optional("\"shapes/boxwing.obj\""), "only compared with"),
    key("inversion.held_out", Real(0.0, 0.9), "", Is("0.2"), "share of epochs kept from the fit to test it, in stretches of time; 0 = none"),

    table("accuracy", Section, "tolerances; every one has a measured default"),
    key("accuracy.omit", Real(0.0, 1.0), "", Is("0.01"), "a source below this share of a pixel's noise is left out"),
    key("accuracy.brightness", Above(0.0, 1.0), "", Is("1e-4"), "relative, shape and time integration together; decides how shadows are found"),
    key("accuracy.sky", Above(0.0, 1.0), "", Is("1e-3"), "relative, of the field's representation"),
    key("accuracy.psf", Above(0.0, 0.5), "", Is("1e-4"), "share of flux outside the drawn stamp"),
    key("accuracy.trail_px", Above(0.0, 10.0), "px", Is("0.01"), "stars whose trails differ by less share one image"),
    key("accuracy.position_mas", Above(0.0, 1e6), "mas", Is("1.0"), "error of a computed place; forces on an integrated orbit below a tenth of it are left out"),

    table("output", Section, "what is written; changes no pixel and not SCENESHA"),
    key("output.format", Words(&["fits", "fits.fz", "exr", "png", "reg"]), "", Is("[\"fits\"]"), "of the frames; one of fits and fits.fz (Rice) at least; reg: DS9 regions"),
    key("output.planes", Words(&["mean", "variance"]), "", Is("[]"), "planes/mean_NNNN.fits, variance_NNNN.fits: f32 electrons"),
    key("output.star_table", Flag, "", Is("false"), "stars/stars_NNNN.ecsv: the stars drawn, their places and electrons"),
    key("output.crop", Crop, "px", Is("\"none\""), "the part of each frame that is written"),
    key("output.crop_px", Int(1, 65_536), "px", Is("256"), "side, with crop = \"target\""),
    key("output.full_every", Int(0, COUNT), "", Is("0"), "with crops: every n-th frame whole, from 0 on; 0 = none"),
    key("output.report", Flag, "", Is("true"), "whether `run` ends with report.html, one page of all it wrote"),
];

/// The keys of one table, in order.
pub(super) fn children(table: &str) -> impl Iterator<Item = &'static Key> + '_ {
    KEYS.iter().filter(move |key| key.parent() == table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_path_is_unique_and_has_its_table() {
        for (i, key) in KEYS.iter().enumerate() {
            assert!(KEYS[..i].iter().all(|other| other.path != key.path), "{} twice", key.path);
            let parent = key.parent().strip_suffix(".*").unwrap_or(key.parent());
            assert!(parent.is_empty() || KEYS.iter().any(|k| k.path == parent && k.is_table()), "{}", key.path);
            assert_eq!(key.is_table(), key.given == Given::Nothing, "{}", key.path);
        }
    }
}
