"""Photometry of one frame of 4096 x 4096: nightglass, Source Extractor, sep and photutils, whole processes, side by side.

    cargo build --release
    apt-get install source-extractor; pip install sep photutils astropy scipy
    python3 benches/compare_photometry.py [--python PYTHON] [--crops 1000]

nightglass measures the target and the zero point; the others find the sources and sum apertures of 8 px, as their users do. Runs
alternate, so that a machine that slows down slows all; the figures are medians of the wall-clock and processor times and the largest resident
memory. What is not installed is left out.
"""
import argparse, shutil, statistics, sys, tempfile
from pathlib import Path

from compare import HERE, run

SEP = """
import sys, numpy as np, sep
from astropy.io import fits
data = fits.getdata(sys.argv[1]).astype(np.float32)
back = sep.Background(data, bw=64, bh=64)
clean = data - back
found = sep.extract(clean, 3.0, err=back.globalrms)
flux, err, flag = sep.sum_circle(clean, found["x"], found["y"], 4.0, err=back.globalrms, gain=1.0)
print(len(found), flux.sum())
"""
PHOTUTILS = """
import sys, numpy as np
from astropy.io import fits
from photutils.aperture import CircularAperture, aperture_photometry
from photutils.background import Background2D, MedianBackground
from photutils.detection import DAOStarFinder
data = fits.getdata(sys.argv[1]).astype(float)
back = Background2D(data, 64, bkg_estimator=MedianBackground())
clean = data - back.background
found = DAOStarFinder(threshold=5 * back.background_rms_median, fwhm=3.5)(clean)
places = np.transpose([found[found.colnames[1]], found[found.colnames[2]]])
print(len(found), aperture_photometry(clean, CircularAperture(places, 4.0))["aperture_sum"].sum())
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=7)
    parser.add_argument("--crops", type=int, default=0, help="also measure as many crops of 256 x 256")
    parser.add_argument("--python", default=sys.executable)
    parser.add_argument("--binary", type=Path, default=HERE.parent / "target/release/nightglass")
    args = parser.parse_args()
    work, binary = Path(tempfile.mkdtemp()), args.binary.resolve()
    run([binary, "render", "pogs-geo", "--frames", "0", "-o", work / "one", "-q"], work)
    frame = work / "one/frames/0000.fits"
    (work / "sex.param").write_text("NUMBER\nX_IMAGE\nY_IMAGE\nFLUX_APER(1)\nFLUXERR_APER(1)\n")
    (work / "sex.conv").write_text("CONV NORM\n1 2 1\n2 4 2\n1 2 1\n")
    sextractor = ["source-extractor", frame, "-c", "/dev/null", "-PARAMETERS_NAME", "sex.param", "-FILTER_NAME", "sex.conv", "-CATALOG_NAME",
                  "sex.cat", "-DETECT_THRESH", "3", "-ANALYSIS_THRESH", "3", "-DETECT_MINAREA", "5", "-PHOT_APERTURES", "8", "-BACK_SIZE",
                  "64", "-GAIN", "1", "-SATUR_LEVEL", "65000", "-VERBOSE_TYPE", "QUIET"]
    programs = {"nightglass": [binary, "photometry", frame, "-q"]}
    if shutil.which("source-extractor"):
        programs["Source Extractor"] = sextractor
    for name, text in [("sep", SEP), ("photutils", PHOTUTILS)]:
        script = work / f"{name}_phot.py"
        script.write_text(text)
        try:
            run([args.python, script, frame], work)
            programs[name] = [args.python, script, frame]
        except SystemExit:
            print(f"{name}: not installed", file=sys.stderr)
    times = {name: [] for name in programs}
    for _ in range(args.runs):
        for name, command in programs.items():
            times[name].append(run(command, work))
    own = statistics.median(t[0] for t in times["nightglass"])
    print("| program | wall, s | processor, s | MiB | wall over nightglass |\n|---|---|---|---|---|")
    for name, all_runs in times.items():
        wall, cpu, memory = (statistics.median(column) for column in zip(*all_runs))
        print(f"| {name} | {wall:.2f} | {cpu:.2f} | {memory:.0f} | {wall / own:.1f} |")
    if args.crops:
        sets = ["--set", f"exposures.count={args.crops}", "--set", "exposures.cadence_s=20"]
        run([binary, "render", "pogs-geo", "--crop", "1920,1920,256,256", "-o", work / "crops", "-q", *sets], work)
        frames = sorted((work / "crops/frames").glob("*.fits"))
        wall, cpu, memory = run([binary, "photometry", *frames, "-q"], work)
        print(f"\n{len(frames)} crops of 256 x 256: {wall:.2f} s, {cpu:.2f} s of processors, {memory:.0f} MiB")
    shutil.rmtree(work)


if __name__ == "__main__":
    main()
