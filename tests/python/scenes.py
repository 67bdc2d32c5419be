"""Scene texts of the cross-checks; the station is the Purdue Optical Ground Station."""

GOES_14 = (
    "1 35491U 09033A   18019.95817924 -.00000090  00000-0  00000-0 0  9991",
    "2 35491   0.0698 263.4367 0009544 339.3413 117.1094  1.00271818 31371",
)
ISS = (
    "1 25544U 98067A   18020.89808844  .00002078  00000-0  38550-4 0  9992",
    "2 25544  51.6424  32.9776 0003646  28.7227  39.5332 15.54190080 95614",
)
MOLNIYA_3_50 = (  # eccentricity 0.72 and half a sidereal day: deep-space resonance
    "1 25847U 99036A   18019.09360018  .00000372  00000-0 -46919-2 0  9993",
    "2 25847  62.1153 216.6069 7199874 268.4889  15.8601  2.00655512135800",
)


def target(tle, mag_v=12.5):
    return f"""
[[target]]
name = "satellite"
[target.orbit]
tle = ["{tle[0]}", "{tle[1]}"]
[target.brightness]
mag_v = {mag_v}
"""


def scene(exposures, pointing, targets="", station="", telescope="", detector="", rest=""):
    """One scene; each argument is the body of its table."""
    return f"""schema_version = 1
seed = 20180120

[station]
preset = "pogs"
pressure_hpa = 780.0
temperature_c = 10.0
humidity = 0.5
{station}

[telescope]
{telescope}

[detector]
{detector}

[pointing]
{pointing}

[exposures]
{exposures}

{rest}
{targets}
"""


def sidereal_field(size=2048, duration_s=2.0, station="", rest=""):
    """Stars as points in the Milky Way of Perseus, 70 deg high; 2 arcsec a pixel, FWHM 2.5 px."""
    return scene(
        exposures=f"""start = 2018-01-20T03:00:00Z
count = 1
cadence_s = 60.0
duration_s = {duration_s}
track = "sidereal\"""",
        pointing="""at = "radec"
ra_deg = 60.0
dec_deg = 50.0""",
        station=f"seeing_arcsec = 4.8\n{station}",
        telescope='plate_scale_arcsec = 2.0\npsf = "moffat"\nmoffat_beta = 3.0',
        detector=f"size_px = {size}",
        rest=rest + "\n[output]\nstar_table = true\n",
    )


def flat_patch(count=2, duration_s=60.0, size=1024, sky="", station=""):
    """Sky and detector alone: no stars, no target."""
    return scene(
        exposures=f"""start = 2018-01-20T03:00:00Z
count = {count}
cadence_s = {duration_s + 1.0}
duration_s = {duration_s}
track = "sidereal\"""",
        pointing="""at = "radec"
ra_deg = 60.0
dec_deg = 50.0""",
        station=station,
        detector=f"size_px = {size}",
        rest=f"[stars]\nenabled = false\n\n[sky]\n{sky}\n",
    )


def geostationary_night(count=120, mag_v=12.5):
    """GOES 14 tracked for two hours: point target, star trails of 10 px, 3 arcsec a pixel."""
    return scene(
        exposures=f"""start = 2018-01-20T03:00:00Z
count = {count}
cadence_s = 60.0
duration_s = 2.0
track = "target\"""",
        pointing='at = "target"',
        targets=target(GOES_14, mag_v),
        station="seeing_arcsec = 7.0",
        telescope="plate_scale_arcsec = 3.0",
        detector="size_px = 1024",
    )
