//! Physical and astronomical constants: value, unit, source.

/// Planck constant \[J s\]. SI Brochure, 9th edition (exact).
pub const PLANCK_J_S: f64 = 6.626_070_15e-34;

/// Speed of light in vacuum \[m/s\]. SI Brochure, 9th edition (exact).
pub const LIGHT_M_S: f64 = 299_792_458.0;

/// Astronomical unit \[m\]. IAU 2012 Resolution B2 (exact).
pub const AU_M: f64 = 149_597_870_700.0;

/// Seconds in a day \[s\].
pub const DAY_S: f64 = 86_400.0;

/// Rotation rate of the Earth \[rad/s\] per second of UT1. IERS Conventions 2010, eq. 5.15.
pub const EARTH_RATE_RAD_S: f64 = 7.292_115_146_706_979e-5;

/// Equatorial radius of the Earth \[m\]. WGS 84 (NIMA TR8350.2).
pub const EARTH_RADIUS_M: f64 = 6_378_137.0;

/// Flattening of the Earth. WGS 84 (NIMA TR8350.2).
pub const EARTH_FLATTENING: f64 = 1.0 / 298.257_223_563;

/// Gravitational parameter of the Earth \[m^3/s^2\] per second of TT. EGM2008 (Pavlis et al. 2012); IERS Conventions 2010,
/// table 1.1 has 3.986004418e14 for TCG.
pub const EARTH_GM: f64 = 3.986_004_415e14;

/// Gravitational parameter of the Sun \[m^3/s^2\]. IAU 2015 Resolution B3, nominal.
pub const SUN_GM: f64 = 1.327_124_4e20;

/// Gravitational parameter of the Moon \[m^3/s^2\]. IERS Conventions 2010, table 1.1: 0.0123000371 of the Earth's.
pub const MOON_GM: f64 = 0.012_300_037_1 * EARTH_GM;

/// Radius of the Sun's photosphere \[m\]. IAU 2015 Resolution B3, nominal.
pub const SUN_RADIUS_M: f64 = 6.957e8;

/// Visual magnitude of Vega in Johnson V. Bessell, Castelli & Plez 1998, A&A 333, 231.
pub const VEGA_V_MAG: f64 = 0.03;
