"""The page report.html in a browser: does it show what its files hold, and can it be used?"""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from astropy.io import fits
from astropy.table import Table
from playwright import sync_api
from support import tool

SCENE = """
schema_version = 1
seed = 20180120
[station]
preset = "pogs"
[detector]
size_px = [700, 600]
[exposures]
start = 2018-01-20T04:00:00Z
count = 4
cadence_s = 600.0
duration_s = 5.0
track = "target"
[[target]]
name = "GOES <14> & \\"co\\""
brightness.mag_v = 11.8
[target.orbit]
tle = ["1 35491U 09033A   18019.95817924 -.00000090  00000-0  00000-0 0  9991",
       "2 35491   0.0698 263.4367 0009544 339.3413 117.1094  1.00271818 31371"]
"""
# a box of two classes of facets, as `nightglass invert` writes it
OBJ = """# Lengths in metres.
mtllib shape.mtl
v -1 -0.5 -0.3
v 1 -0.5 -0.3
v 1 0.5 -0.3
v -1 0.5 -0.3
v -1 -0.5 0.3
v 1 -0.5 0.3
v 1 0.5 0.3
v -1 0.5 0.3
g part_0
usemtl sd_below_0.5_deg
f 4 3 2 1
f 5 6 7 8
f 1 2 6 5
usemtl unobserved
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
"""
SNR = """# %ECSV 1.0
# ---
# datatype:
# - {name: mag_v, unit: mag, datatype: float64}
# - {name: snr, datatype: float64}
# - {name: snr_mc, datatype: float64}
# schema: astropy-2.0
mag_v snr snr_mc
10.0 400.0 401.5
12.0 150.0 148.9
14.0 40.0 41.0
"""


@pytest.fixture(scope="module")
def run(produce, nightglass):
    """Output directory of a run with all that a page can show."""
    out = produce("run", SCENE)
    (out / "shape.obj").write_text(OBJ)
    (out / "snr.ecsv").write_text(SNR)
    facet = {"normal": [0, 0, 1], "area_m2": 2.0, "area_sd_m2": 0.1, "direction_sd_deg": 0.2}
    shape = {
        "chi2_reduced": 1.02,
        "convex": True,
        "n_parts": 1,
        "facets": [facet],
        "claims": ["1 of 1 facets is claimed <b>"],
        "unobserved_fraction": 0.3,
        "closure_defect": 0.01,
    }
    (out / "shape.json").write_text(json.dumps(shape))
    header = "approximation,setting,max_err,rms_err,unit,time_s,bytes,pareto,default\n"
    rows = "sky.nodes,2 x 2,1e-5,1e-6,relative,0.0005,72,True,True\nsky.nodes,4 x 4,4e-6,1e-6,relative,0.0015,200,True,False\n"
    (out / "accuracy.ecsv").write_text(header + rows)
    nightglass("report", out, "-q")
    return out


@pytest.fixture(scope="module")
def browser():
    path = tool("chromium")
    with sync_api.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture
def opened(browser):
    """Call as opened(directory, width=..., colour_scheme=...): its page; what the console says makes the test fail."""
    contexts, said = [], []

    def call(out, width=1280, height=900, **options):
        context = browser.new_context(viewport={"width": width, "height": height}, **options)
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda m: m.type in ("error", "warning") and said.append(m.text))
        page.on("pageerror", lambda e: said.append(str(e)))
        page.on("request", lambda r: r.url.startswith(("file:", "data:")) or said.append(r.url))
        page.goto((Path(out) / "report.html").as_uri())
        return page

    yield call
    for context in contexts:
        context.close()
    assert said == []


def picture(page, selector):
    """What a canvas shows: a hash of its pixels, the spread of their red, shares of opaque, blue and pink ones."""
    script = """c => {
        const copy = Object.assign(document.createElement("canvas"), { width: c.width, height: c.height });
        const g = copy.getContext("2d", { willReadFrequently: true });
        g.drawImage(c, 0, 0);
        const { data } = g.getImageData(0, 0, c.width, c.height);
        const n = data.length / 4;
        let [hash, sum, squares, opaque, blue, pink] = [17, 0, 0, 0, 0, 0];
        for (let i = 0; i < data.length; i += 4) {
            const [r, g, b] = [data[i], data[i + 1], data[i + 2]];
            hash = (Math.imul(hash, 31) + (r << 16) + (g << 8) + b) | 0;
            sum += r; squares += r * r;
            opaque += data[i + 3] > 0; blue += b - r > 60; pink += r - g > 30;
        }
        const spread = Math.sqrt(squares / n - (sum / n) ** 2);
        return { hash, spread, opaque: opaque / n, blue: blue / n, pink: pink / n };
    }"""
    return page.locator(selector).evaluate(script)


def test_numbers_are_those_of_the_files(run, opened):
    page = opened(run)
    curve = Table.read(run / "lightcurve.ecsv", format="ascii.ecsv")
    held = json.loads(page.locator("#data").text_content())
    for name in ("mjd_utc", "flux_e", "flux_err_e", "mag_v", "mag_err", "flags"):
        own = np.array([np.nan if v is None else v for v in held["curve"][name]])
        assert np.array_equal(own, np.asarray(curve[name], float), equal_nan=True), name
    assert held["curve"]["target"] == list(curve["target"])
    ledger = json.loads((run / "ledger.json").read_text())["rows"]
    shown = page.locator(".ledger tbody tr").evaluate_all(
        "rows => rows.map(r => [r.cells[0].textContent, r.cells[1].textContent, r.cells[2].querySelector('data').value, r.cells[4].textContent])"
    )
    assert len(shown) == len(ledger)
    for row, (name, verdict, mean, why) in zip(ledger, shown):
        assert (row["name"], row["verdict"], row["mean_e_px"], row["why"]) == (
            name,
            verdict,
            float(mean),
            why,
        )
    # the shown magnitudes are those of the file, rounded
    cells = page.locator("#curve table").first.locator("tbody tr").evaluate_all(
        "rows => rows.map(r => { const d = r.cells[3].querySelector('data'); return [Number(d.value), Number(d.textContent)]; })"
    )
    for (whole, short), mag in zip(cells, curve["mag_v"], strict=True):
        if np.isfinite(mag):
            assert whole == mag and abs(short - mag) <= 5.001e-4
        else:
            assert np.isnan(whole) and np.isnan(short)
    assert 'GOES <14> & "co"' in page.locator("#summary").inner_text()


def test_the_viewer_pans_zooms_blinks_and_changes_frames(run, opened):
    page = opened(run)
    view = page.locator("#sky-view")
    view.scroll_into_view_if_needed()
    first = picture(page, "#sky-view")
    assert first["spread"] > 3, "a picture, not a blank"
    page.locator("#zoom-in").click()
    zoomed = picture(page, "#sky-view")
    assert first != zoomed
    box = view.bounding_box()
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.move(*middle)
    page.mouse.down()
    page.mouse.move(middle[0] + 90, middle[1] + 40, steps=4)
    page.mouse.up()
    panned = picture(page, "#sky-view")
    assert zoomed != panned
    view.press("ArrowLeft")
    assert panned != picture(page, "#sky-view")
    label = page.locator("#frame-label").inner_text()
    page.locator("#frame").focus()
    page.keyboard.press("End")
    assert page.locator("#frame-label").inner_text() != label
    assert "Frame 3" in page.locator("#frame-label").inner_text()
    page.locator("#blink").click()
    sync_api.expect(page.locator("#frame-label")).not_to_contain_text("Frame 3")
    page.locator("#blink").click()
    # overlays and stretches each change the picture
    view.press("t")
    for act in ("#o-target", "#o-aperture", "#o-cut", "#o-stars", "#invert", "[value=log]", "[value=linear]"):
        before = picture(page, "#sky-view")
        page.locator(act).click()
        if act == "#o-cut":
            view.press("0")
        assert before != picture(page, "#sky-view"), act


def test_the_pixel_under_the_cursor_is_the_frame_s(run, opened):
    page = opened(run)
    view = page.locator("#sky-view")
    view.scroll_into_view_if_needed()
    page.locator("#target").click()
    box = view.bounding_box()
    number = int(page.locator("#frame-label").inner_text().split()[1])
    data = fits.getdata(run / "frames" / f"{number:04}.fits")
    for dx, dy in ((0, 0), (53, -31), (-88, 64)):
        page.mouse.move(box["x"] + box["width"] / 2 + dx, box["y"] + box["height"] / 2 + dy)
        words = page.locator("#pixel").inner_text()
        x, y = int(words.split()[1].strip(",")), int(words.split()[3].strip(":"))
        value = int(words.split(": ")[1].split()[0])
        assert value == data[y, x], words


def test_the_plan_shows_every_exposure_over_the_night_and_close_up(run, opened):
    page = opened(run)
    dots = page.locator("#plan-chart .exposure")

    def spread():
        boxes = [dots.nth(k).bounding_box()["x"] for k in range(dots.count())]
        return max(boxes) - min(boxes)

    assert dots.count() == 4
    night = spread()
    page.locator("[name=reach][value=exposures]").check()
    assert dots.count() == 4 and spread() > 5 * night
    page.locator("#plan-chart svg").focus()
    page.keyboard.press("Home")
    assert "Frame 0, 2018-01-20 04:00:02.5" in page.locator("#plan-read").inner_text()


def test_truth_is_switched_on_and_off(run, opened):
    page = opened(run)
    points = page.locator("#curve-chart .truth")
    assert points.count() == 4 and page.locator("#residual-chart .residual").count() == 4
    page.locator("#truth").uncheck()
    assert points.count() == 0 and page.locator("#residual-chart .residual").count() == 0
    page.locator("#truth").check()
    assert points.count() == 4
    page.locator("[name=unit][value=flux]").check()
    assert points.count() == 4 and page.locator("#curve-chart .measured").count() == 4
    # read by keyboard
    page.locator("#curve-chart svg").focus()
    page.keyboard.press("End")
    assert "frame 3" in page.locator("#curve-read").inner_text()


def test_the_shape_is_drawn_and_turns(run, opened):
    page = opened(run)
    solid = page.locator("#solid")
    solid.scroll_into_view_if_needed()
    first = picture(page, "#solid")
    assert 0.1 < first["opaque"] < 0.9, first
    # blue of what is well known, and pink of what was not observed
    assert first["blue"] > 0.02 and first["pink"] > 0.02, first
    box = solid.bounding_box()
    page.mouse.move(box["x"] + 200, box["y"] + 150)
    page.mouse.down()
    page.mouse.move(box["x"] + 260, box["y"] + 170, steps=3)
    page.mouse.up()
    page.wait_for_timeout(100)
    turned = picture(page, "#solid")
    assert first != turned
    solid.press("ArrowRight")
    page.wait_for_timeout(100)
    assert turned != picture(page, "#solid")
    assert "not observed: 3 facets" in page.locator("#solid-legend").inner_text()


@pytest.mark.parametrize("colour", ["light", "dark"])
@pytest.mark.parametrize("width", [375, 1280])
def test_layouts_need_no_scrolling_sideways(run, opened, width, colour):
    page = opened(run, width=width, color_scheme=colour)
    page.wait_for_timeout(100)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (ground == "rgb(255, 255, 255)") == (colour == "light")
    # the switch wins over the system
    page.locator("#theme").click()
    page.locator("#theme").click()
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") != "rgb(255, 255, 255)"


def test_paper_is_light_and_unfolded(run, opened):
    page = opened(run, color_scheme="dark")
    page.emulate_media(media="print")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    folded = page.locator("details:not([open]) > *:not(summary)")
    assert folded.count() >= 4
    assert all(folded.nth(k).bounding_box()["height"] > 10 for k in range(folded.count()))
    assert not page.locator(".controls").is_visible()
    assert len(page.pdf()) > 50_000


def test_a_page_without_its_program_still_tells(run, opened):
    page = opened(run, java_script_enabled=False)
    words = page.locator("main").inner_text()
    assert "Dominant noise" in words and "sky.airglow" in words
    assert page.locator("#strip img").count() == 4
    assert page.locator("noscript img").count() == 2
    assert not page.locator("#viewer").is_visible()


def test_everything_has_a_name_and_can_be_reached(run, opened):
    page = opened(run)
    unnamed = page.evaluate(
        """() => [...document.querySelectorAll("button, input, canvas, [tabindex='0'], img")].filter(e =>
            !(e.getAttribute("aria-label") || e.alt || e.textContent.trim() || (e.labels && e.labels.length))).map(e => e.outerHTML.slice(0, 80))"""
    )
    assert unnamed == []
    reached = set()
    for _ in range(80):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("document.activeElement.id || document.activeElement.tagName"))
        outline = page.evaluate("getComputedStyle(document.activeElement).outlineStyle")
        assert outline != "none" or page.evaluate("document.activeElement === document.body")
    assert {"theme", "sky-view", "frame", "blink", "black", "o-stars", "truth", "solid"} <= reached, reached


def test_sparse_directories_open_without_errors(run, opened, nightglass, tmp_path):
    shutil.copy(run / "lightcurve.ecsv", tmp_path)
    nightglass("report", tmp_path, "-q")
    page = opened(tmp_path)
    assert page.locator("#curve-chart .measured").count() == 4
    assert page.locator("#truth-label").is_hidden() and page.locator("#viewer").is_hidden()
    text = (run / "lightcurve.ecsv").read_text().splitlines()
    head = next(i for i, line in enumerate(text) if line.startswith("frame "))
    row = text[head + 1].split(" ")
    blank = " ".join(row[:4]) + ' "x"' + " nan" * 20 + " 192"
    (tmp_path / "lightcurve.ecsv").write_text("\n".join(text[: head + 1] + [blank]) + "\n")
    nightglass("report", tmp_path, "-q")
    page = opened(tmp_path)
    assert "no flux was measured" in page.locator("#curve-chart").inner_text()
