"""nightglass and its peers on the same scenes: whole processes, side by side.

    cargo build --release
    python3 benches/compare.py --install ~/peers        # virtual environments with numpy, GalSim, SatSim; once
    python3 benches/compare.py --peers ~/peers          # prints the table of docs/performance.md

Runs alternate between the programs, so that a machine that slows down slows all of them; the figure is the median of the wall-clock times,
and the largest resident memory. A peer that is not installed is left out. Only the standard library is used here.
"""
import argparse, os, shutil, statistics, subprocess, sys, tempfile, time
from pathlib import Path

HERE = Path(__file__).resolve().parent
PEERS = {"numpy": ["numpy", "scipy", "astropy"], "galsim": ["galsim", "numpy", "astropy"], "satsim": ["satsim"]}


def install(folder):
    for name, packages in PEERS.items():
        subprocess.run([sys.executable, "-m", "venv", folder / f"venv-{name}"], check=True)
        subprocess.run([folder / f"venv-{name}/bin/pip", "-q", "install", *packages], check=True)
    subprocess.run(
        ["gcc", "-O3", "-march=native", "-ffast-math", "-fopenmp", HERE / "peers/noise_limit.c", "-o", folder / "noise_limit", "-lm"],
        check=True,
    )


def run(command, cwd):
    """Wall time [s], CPU time [s], largest resident memory [MiB]."""
    began = time.perf_counter()
    child = subprocess.Popen([str(part) for part in command], cwd=cwd, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    told = child.stderr.read()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise SystemExit(f"{command}: {told.decode(errors='replace')[-2000:]}")
    return time.perf_counter() - began, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--install", type=Path, metavar="DIR")
    parser.add_argument("--peers", type=Path, metavar="DIR")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--binary", type=Path, default=HERE.parent / "target/release/nightglass")
    args = parser.parse_args()
    if args.install:
        return install(args.install.expanduser().resolve())
    peers = args.peers.expanduser().resolve() if args.peers else None
    work = Path(tempfile.mkdtemp())

    def own(scene, frames, *sets):
        more = [part for pair in sets for part in ("--set", pair)]
        return [args.binary.resolve(), "render", HERE.parent / f"examples/bench/{scene}.toml", "--frames", frames, "-o", work / "own", "-q", *more]

    def peer(name, *more):
        python = peers / f"venv-{name}/bin/python" if peers else None
        if python and python.exists():
            return [python, HERE / f"peers/{name}_sim.py", "--out", work / f"{name}.fits", *more]
        return None

    two = ["--streak", "60"]
    rows = [
        ("S1", "nightglass", own("s1", "0")),
        ("S1", "numpy", peer("numpy")),
        ("S1", "galsim", peer("galsim")),
        ("S1", "satsim epsf", peer("satsim", "--mode", "epsf")),
        ("S2", "nightglass", own("s2", "0")),
        ("S2", "numpy", peer("numpy", *two)),
        ("S2", "galsim", peer("galsim", *two)),
        ("S2", "satsim epsf", peer("satsim", "--mode", "epsf", *two)),
        ("S3", "nightglass", own("s2", "0..20")),
        ("S2 x 3", "numpy", peer("numpy", *two, "--frames", "3")),
        ("S2, 20000 stars", "nightglass", own("s2", "0", "stars.random_count=20000")),
        ("S2, no stars", "nightglass", own("s2", "0", "stars.random_count=0", "stars.enabled=false")),
        ("S1, side 1024", "nightglass", own("s1", "0", "detector.size_px=1024", "stars.random_count=125")),
        ("S1, side 2048", "nightglass", own("s1", "0", "detector.size_px=2048", "stars.random_count=500")),
        ("S2, 256 x 256 crop", "nightglass", own("s2", "0") + ["--crop", "1900,1900,256,256"]),
        ("D1", "nightglass", own("d1", "0")),
        ("D1 x 20", "nightglass", own("d1", "0..20")),
    ]
    rows = [row for row in rows if row[2]]
    results = {row[:2]: [] for row in rows}
    for round_ in range(args.runs):
        for scene, name, command in rows:
            # the slow ones need fewer runs
            if round_ < 3 or name == "nightglass" or name == "numpy":
                # what an earlier run left to be written or removed is not this one's
                shutil.rmtree(work / "own", ignore_errors=True)
                os.sync()
                results[scene, name].append(run(command, HERE / "peers"))
    shutil.rmtree(work)
    print(f"{'scene':20} {'program':12} {'wall s':>8} {'min':>8} {'max':>8} {'cpu s':>8} {'MiB':>6} runs")
    median = {}
    for key, measured in results.items():
        wall = [m[0] for m in measured]
        median[key] = statistics.median(wall)
        print(f"{key[0]:20} {key[1]:12} {median[key]:8.3f} {min(wall):8.3f} {max(wall):8.3f} {statistics.median(m[1] for m in measured):8.3f} {max(m[2] for m in measured):6.0f} {len(wall)}")

    def ratio(what, above, below, goal):
        if above and below:
            print(f"{what:60} {above / below:8.2f}   goal {goal}")

    get = median.get
    ratio("S1: numpy / nightglass", get(("S1", "numpy")), get(("S1", "nightglass")), ">= 12")
    ratio("S2: galsim / nightglass", get(("S2", "galsim")), get(("S2", "nightglass")), ">= 25")
    ratio("S2: satsim epsf / nightglass", get(("S2", "satsim epsf")), get(("S2", "nightglass")), ">= 60")
    own_marginal = (get(("S3", "nightglass")) - get(("S2", "nightglass"))) / 19
    if ("S2 x 3", "numpy") in median:
        ratio("S3, marginal frame: numpy / nightglass", (get(("S2 x 3", "numpy")) - get(("S2", "numpy"))) / 2, own_marginal, ">= 15")
    ratio("S2: 20000 / 2000 stars", get(("S2, 20000 stars", "nightglass")), get(("S2", "nightglass")), "<= 2")
    ratio("S1: side 2048 / 1024", get(("S1, side 2048", "nightglass")), get(("S1, side 1024", "nightglass")), "<= 4")
    ratio("S1: side 4096 / 2048", get(("S1", "nightglass")), get(("S1, side 2048", "nightglass")), "<= 4")
    print(f"marginal frame of S3: {own_marginal:.4f} s")


if __name__ == "__main__":
    main()
