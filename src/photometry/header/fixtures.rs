//! Headers as programs lay them out, for tests; places, names and numbers are made up where they carry no meaning.

use super::Header;
pub(crate) use super::fixtures_more::*;
use std::collections::BTreeMap;

#[derive(Debug, Clone)]
pub(crate) enum Value {
    Number(f64),
    Text(String),
    Flag(bool),
}

/// Cards in memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cards(pub BTreeMap<String, Value>);

impl Header for Cards {
    fn number(&self, keyword: &str) -> Option<f64> {
        if let Value::Number(x) = self.0.get(keyword)? { Some(*x) } else { None }
    }

    fn text(&self, keyword: &str) -> Option<String> {
        if let Value::Text(s) = self.0.get(keyword)? { Some(s.clone()) } else { None }
    }

    fn flag(&self, keyword: &str) -> Option<bool> {
        if let Value::Flag(b) = self.0.get(keyword)? { Some(*b) } else { None }
    }
}

impl Cards {
    /// Cards from lines `KEYWORD = value`.
    pub fn of(text: &str) -> Self {
        let card = |line: &str| {
            let (keyword, value) = line.split_once('=')?;
            let value = match value.trim() {
                "T" => Value::Flag(true),
                "F" => Value::Flag(false),
                v => match v.strip_prefix('\'') {
                    Some(rest) => Value::Text(rest.strip_suffix('\'').unwrap_or(rest).to_owned()),
                    None => Value::Number(v.parse().expect("a number in a fixture")),
                },
            };
            Some((keyword.trim().to_owned(), value))
        };
        Self(text.lines().filter_map(card).collect())
    }

    /// The same with further or other cards.
    pub fn with(mut self, text: &str) -> Self {
        self.0.extend(Self::of(text).0);
        self
    }

    /// The same without some cards.
    pub fn without(mut self, keywords: &[&str]) -> Self {
        self.0.retain(|k, _| !keywords.contains(&k.as_str()));
        self
    }
}

/// MaxIm DL 5 with ACP and PinPoint's cards behind it, calibrated.
pub(crate) const MAXIM_ACP: &str = "BITPIX = 16
NAXIS1 = 4864
NAXIS2 = 3232
BSCALE = 1.0
BZERO = 32768.0
DATE-OBS = '2018-07-04T14:03:03'
EXPTIME = 300.0
EXPOSURE = 300.0
SET-TEMP = -35.0
CCD-TEMP = -34.99380225
XPIXSZ = 7.4
YPIXSZ = 7.4
XBINNING = 1
YBINNING = 1
XORGSUBF = 0
READOUTM = 'Monochrome'
FILTER = 'V       '
IMAGETYP = 'Light Frame'
SITELAT = '-31 16 24'
SITELONG = '149 03 52'
JD = 2458304.0854513887
JD-HELIO = 2458304.0910000000
FOCALLEN = 1425.0
APTDIA = 392.0
APTAREA = 120687.4267
SWCREATE = 'MaxIm DL Version 5.24 140126 0KJR5'
SBSTDVER = 'SBFITSEXT Version 1.0'
OBJECT = 'm17     '
INSTRUME = 'Apogee USB/Net'
NOTES = '        '
FLIPSTAT = '        '
CBLACK = 59
CWHITE = 981
PEDESTAL = -100
CALSTAT = 'BDF     '
PA = '270.693881052116'
DATE = '04/07/18'
TIME-OBS = '14:03:03'
UT = '14:03:03'
TIMESYS = 'UTC     '
RADECSYS = 'FK5     '
AIRMASS = 1.0416255
LAT-OBS = -31.2736111111
LONG-OBS = 149.064444444
ALT-OBS = 1165.0
RA = '18 20 48.12'
DEC = '-16 10 58.8'
OBJCTRA = '18 20 48.12'
OBJCTDEC = '-16 10 58.8'
";

/// MaxIm DL 6, as read from the camera, binned 2 x 2.
pub(crate) const MAXIM_RAW: &str = "BITPIX = 16
BZERO = 32768
BSCALE = 1
DATE-OBS = '2022-11-25T04:30:12.47'
EXPTIME = 5.0
EXPOSURE = 5.0
EGAIN = 1.37
CCD-TEMP = -20.0
XPIXSZ = 18.0
YPIXSZ = 18.0
XBINNING = 2
YBINNING = 2
IMAGETYP = 'Light Frame'
SITELAT = '+40 25 26'
SITELONG = '-86 54 50'
JD = 2459908.687644329
FOCALLEN = 2563.0
APTDIA = 355.6
APTAREA = 88700.0
SWCREATE = 'MaxIm DL Version 6.26 210330 1ABCD'
SBSTDVER = 'SBFITSEXT Version 1.0'
OBJECT = 'GEO 41866'
OBJCTRA = '02 14 33'
OBJCTDEC = '-05 52 10'
OBJCTALT = ' 41.2334'
OBJCTAZ = '155.7011'
OBJCTHA = ' -1.3201'
INSTRUME = 'FLI PL16803'
FLIPSTAT = 'Flip/Mirror'
DATAMAX = 65000
PEDESTAL = 0
SNAPSHOT = 1
ROWORDER = 'TOP-DOWN'
";

/// TheSkyX with a solved image.
pub(crate) const THESKYX: &str = "BITPIX = 16
BZERO = 32768.0
DATE-OBS = '2019-03-12T03:15:44.213'
EXPTIME = 10.0
EXPOSURE = 10.0
EGAIN = 0.92
GAIN = 0.92
PEDESTAL = 0
XPIXSZ = 9.0
YPIXSZ = 9.0
XBINNING = 1
YBINNING = 1
CCD-TEMP = -15.1
SITELAT = '+34 01 12.00'
SITELONG = '+117 23 45.00'
FOCALLEN = 1900.0
APTDIA = 356.0
APTAREA = 78000.0
SWCREATE = 'TheSkyX Version 10.5.0 Build 11360'
SBSTDVER = 'SBFITSEXT Version 1.0'
OBJCTRA = '09 55 33.20'
OBJCTDEC = '+69 03 55.0'
CENTALT = '55.22'
CENTAZ = '15.10'
CTYPE1 = 'RA---TAN'
CTYPE2 = 'DEC--TAN'
CRVAL1 = 148.8883
CRVAL2 = 69.0653
CRPIX1 = 2048.5
CRPIX2 = 2048.5
CDELT1 = -2.7140e-4
CDELT2 = 2.7140e-4
CROTA1 = 12.5
CROTA2 = 12.5
EQUINOX = 2000.0
";

/// N.I.N.A. 3 with a camera of ZWO.
pub(crate) const NINA: &str = "BITPIX = 16
BZERO = 32768
IMAGETYP = 'LIGHT'
EXPOSURE = 30.0
EXPTIME = 30.0
DATE-LOC = '2023-03-02T21:19:00.455'
DATE-OBS = '2023-03-02T20:19:00.455'
DATE-AVG = '2023-03-02T20:19:15.4557'
MJD-OBS = 60005.8465330440
MJD-AVG = 60005.8467066632
XBINNING = 1
YBINNING = 1
GAIN = 100
OFFSET = 30
EGAIN = 0.249
XPIXSZ = 3.76
YPIXSZ = 3.76
INSTRUME = 'ZWO ASI2600MM Pro'
SET-TEMP = -10.0
CCD-TEMP = -10.0
FOCALLEN = 530.0
FOCRATIO = 5.0
RA = 283.395539831101
DEC = 33.0340625
SITEELEV = 25.0
SITELAT = 51.05
SITELONG = 3.72
OBJCTRA = '18 53 35'
OBJCTDEC = '+33 02 02'
OBJCTROT = 90.0
ROWORDER = 'TOP-DOWN'
EQUINOX = 2000.0
AIRMASS = 1.11
SWCREATE = 'N.I.N.A. 3.0.0.9001 (x64)'
";

/// SharpCap 4 without telescope.
pub(crate) const SHARPCAP: &str = "BITPIX = 16
BZERO = 32768
SWCREATE = 'SharpCap v4.1.11817.0, 64 bit'
CCD-TEMP = 12.7
YBINNING = 1
XBINNING = 1
EXPTIME = 0.5
EXPOSURE = 0.5
DATE-OBS = '2024-04-29T20:25:29.8219583'
DATE-AVG = '2024-04-29T20:25:30.0719583'
DATE-END = '2024-04-29T20:25:30.3219583'
INSTRUME = 'ZWO ASI290MM Mini'
XPIXSZ = 2.9
YPIXSZ = 2.9
GAIN = 200
BLKLEVEL = 10
EGAIN = 0.45
";

/// SharpCap 3, solved afterwards by AstroImageJ through astrometry.net.
pub(crate) const SHARPCAP_SOLVED: &str = "BITPIX = 16
BZERO = 32768.0
SWCREATE = 'SharpCap'
EXPTIME = 2
DATE-OBS = '2019-04-29T20:25:29.8219583'
XPIXSZ = 2.90000009536743
INSTRUME = 'ZWO ASI290MM Mini'
CTYPE1 = 'RA---TAN-SIP'
CTYPE2 = 'DEC--TAN-SIP'
CUNIT1 = 'deg     '
CUNIT2 = 'deg     '
EQUINOX = 2000.0
LONPOLE = 180.0
LATPOLE = 0.0
CRVAL1 = 251.337418297
CRVAL2 = 89.049177068
CRPIX1 = 969
CRPIX2 = 545
CD1_1 = 0.000389383715878
CD1_2 = 0.000788738076566
CD2_1 = -0.000787298612487
CD2_2 = 0.000389062499079
A_ORDER = 2
A_0_2 = 5.53957795846E-07
A_1_1 = -1.23639820451E-06
A_2_0 = 3.75738837922E-07
B_ORDER = 2
B_0_2 = -9.07325128016E-07
B_1_1 = -8.18595386612E-07
B_2_0 = 6.70695855884E-08
AP_ORDER = 2
AP_0_1 = -4.22921490886E-07
";

/// FireCapture: a planetary camera, little else.
pub(crate) const FIRECAPTURE: &str = "BITPIX = 8
SWCREATE = 'FireCapture v2.7.14'
INSTRUME = 'ZWO ASI174MM'
DATE-OBS = '2023-09-10T22:15:07.123'
EXPTIME = 0.02
GAIN = 298
XPIXSZ = 5.86
FOCALLEN = 2800
";

/// Astro Photography Tool.
pub(crate) const APT: &str = "BITPIX = 16
BZERO = 32768
BSCALE = 1
OBJECT = 'TEST    '
TELESCOP = 'EQMOD HEQ5/6'
INSTRUME = 'ZWO ASI294MC Pro'
DATE-OBS = '2018-09-17T21:04:46'
EXPTIME = 240.0
XPIXSZ = 4.63
YPIXSZ = 4.63
XBINNING = 1
EGAIN = 1.00224268436432
FOCALLEN = 400
JD = 2458379.37831019
SWCREATE = 'Astro Photography Tool - APT v.3.54.1'
SBSTDVER = 'SBFITSEXT Version 1.0'
SNAPSHOT = 1
OBJCTRA = '01 35 00'
OBJCTDEC = '+30 44 25'
SITELAT = '+51 03 00.000'
SITELONG = '+03 41 00.000'
GAIN = 120
";

/// Sequence Generator Pro: the cards of world coordinates, but no matrix.
pub(crate) const SGP: &str = "BITPIX = 16
BZERO = 32768
CRPIX1 = 2072
CRPIX2 = 1411
CTYPE1 = 'RA---TAN'
CTYPE2 = 'DEC--TAN'
DATE-LOC = '2020-05-30T02:22:49.0968820'
DATE-OBS = '2020-05-30T00:22:49.0968820'
CREATOR = 'Sequence Generator Pro v3.1.0.479'
INSTRUME = 'ZWO ASI294MC Pro'
SITEELEV = 10
SITELAT = '51 3 0.000'
SITELONG = '3 43 0.000'
EXPOSURE = 30
RA = 283.395539831101
DEC = 33.0340625
CRVAL1 = 283.395539831101
CRVAL2 = 33.0340625
OBJCTRA = '18 53 34.930'
OBJCTDEC = '+33 02 02.625'
AIRMASS = 1.1136910218553
FOCALLEN = 1480
FLIPPED = F
ANGLE = 258.37
SCALE = 0.65415
PIXSCALE = 0.65415
POSANGLE = 258.369995117188
GAIN = 120
EGAIN = 3.99000000953674
OFFSET = 30
";

/// All of them, by name.
pub(crate) const ALL: [(&str, &str); 15] = [
    ("MAXIM_ACP", MAXIM_ACP),
    ("MAXIM_RAW", MAXIM_RAW),
    ("THESKYX", THESKYX),
    ("NINA", NINA),
    ("SHARPCAP", SHARPCAP),
    ("SHARPCAP_SOLVED", SHARPCAP_SOLVED),
    ("FIRECAPTURE", FIRECAPTURE),
    ("APT", APT),
    ("SGP", SGP),
    ("IRAF", IRAF),
    ("LCO", LCO),
    ("TPV", TPV),
    ("OLD", OLD),
    ("GPS", GPS),
    ("OURS", OURS),
];
