
// --- plan --------------------------------------------------------------------------------------------------------------------
const planRows = rows(DATA.plan).filter((r) => finite(r.mjd_utc));
function drawPlan() {
  const night = DATA.night;
  const box = $("plan-chart");
  const shown = planRows.filter((r) => finite(r.el_deg));
  if (!shown.length && !night) { box.closest("figure").hidden = true; return; }
  let span = ends(planRows.map((r) => r.mjd_utc), 0.04);
  $("plan-tools").hidden = !night || !planRows.length;
  if (night && !(planRows.length && document.querySelector("input[name=reach]:checked").value === "exposures")) {
    const all = [crossing(night.sun, 0, 0), crossing(night.sun, 0, 1), ...planRows.map((r) => r.mjd_utc)];
    span = [Math.min(...all), Math.max(...all)];
    const room = 0.02 * (span[1] - span[0]) || 0.01;
    span = [Math.max(night.start, span[0] - room), Math.min(night.end, span[1] + room)];
  } else if (span[1] - span[0] < 1e-3) {
    span = [span[0] - 5e-3, span[1] + 5e-3];
  }
  const low = Math.min(0, ...shown.map((r) => r.el_deg));
  const strips = night ? night.targets.length : 0;
  const p = plot(box, {
    height: 320 + 14 * strips, bottom: 46 + 14 * strips,
    x: { ends: span, ticks: timeTicks, label: timeLabel(...span) },
    y: { ends: [low < 0 ? -30 : 0, 90], ticks: (a, b) => [-30, 0, 30, 60, 90].filter((v) => v >= a).map((v) => [v, minus(v)]), label: "altitude [deg]" },
  });
  p.floor = low < 0 ? -30 : 0;
  const entries = [];
  if (night) {
    const dark = night.sun.filter(([, v]) => v <= night.max_sun_el_deg).map(([t]) => t);
    if (dark.length) {
      const [a, b] = [crossing(night.sun, night.max_sun_el_deg, 0), crossing(night.sun, night.max_sun_el_deg, 1)];
      const [xa, xb] = [p.sx(clamp(a, ...span)), p.sx(clamp(b, ...span))];
      p.under.append(svg("rect", { x: xa, y: p.inner.y, width: Math.max(0, xb - xa), height: p.inner.h, fill: "var(--night)" }));
      entries.push([`Sun below ${minus(night.max_sun_el_deg)}°`, svg("rect", { width: 22, height: 12, fill: "var(--night)", stroke: "var(--line)" })]);
    }
    p.under.append(svg("line", { x1: p.inner.x, x2: p.inner.x + p.inner.w, y1: p.sy(night.min_el_deg), y2: p.sy(night.min_el_deg), stroke: "var(--soft)", "stroke-dasharray": "5 4" }));
    entries.push([`lowest altitude ${night.min_el_deg}°`, svg("line", { x1: 0, x2: 22, y1: 6, y2: 6, stroke: "var(--soft)", "stroke-dasharray": "5 4" })]);
    for (const [name, curve, css, dash] of [["Sun", night.sun, "var(--sun)", ""], ["Moon", night.moon, "var(--moon)", "6 3"]]) {
      const up = curve.some(([t, v], i) => finite(v) && v >= p.floor && (t >= span[0] || (i + 1 < curve.length && curve[i + 1][0] >= span[0])) && t <= span[1]);
      const d = path(p, curve);
      if (!d || !up) continue;
      p.under.append(svg("path", { d, fill: "none", stroke: css, "stroke-width": 1.5, "stroke-dasharray": dash }));
      entries.push([name, svg("line", { x1: 0, x2: 22, y1: 6, y2: 6, stroke: css, "stroke-width": 1.5, "stroke-dasharray": dash })]);
    }
    night.targets.forEach((t, k) => {
      p.under.append(svg("path", { d: path(p, t.curve), fill: "none", stroke: colour(k), "stroke-width": 1.5, opacity: 0.85 }));
      entries.push([t.name, svg("line", { x1: 0, x2: 22, y1: 6, y2: 6, stroke: colour(k), "stroke-width": 2 })]);
      const y = p.inner.y + p.inner.h + 27 + 14 * k;
      for (const w of t.windows.filter((w) => w.observable && w.to > span[0] && w.from < span[1])) {
        const [a, b] = [p.sx(Math.max(w.from, span[0])), p.sx(Math.min(w.to, span[1]))];
        p.over.append(svg("rect", { x: a, y, width: Math.max(1.5, b - a), height: 7, rx: 2, fill: colour(k) }, svg("title", {}, `${t.name}: observable ${utc(w.start_utc)} to ${utc(w.end_utc)}`)));
      }
      p.over.append(svg("text", { x: p.inner.x - 8, y: y + 8, "text-anchor": "end" }, k === 0 ? "windows" : ""));
    });
  }
  for (const r of shown) {
    const here = { transform: `translate(${p.sx(r.mjd_utc)},${p.sy(r.el_deg)})`, class: "exposure", stroke: colour(0), "stroke-width": 1.5 };
    p.over.append(svg("path", { ...here, d: shape(0, shown.length > 200 ? 2 : 3.5), fill: r.observable === "True" ? colour(0) : "var(--page)" }));
  }
  if (shown.length) entries.push(["exposure, observable", svg("path", { d: shape(0, 4), transform: "translate(11,6)", fill: colour(0) })]);
  if (shown.some((r) => r.observable !== "True")) entries.push(["not observable", svg("path", { d: shape(0, 4), transform: "translate(11,6)", fill: "none", stroke: colour(0), "stroke-width": 1.5 })]);
  legend($("plan-legend"), entries);
  const text = (r) => `Frame ${r.frame}, ${utc(r.time_utc)}: altitude ${fixed(r.el_deg, 2)}°, azimuth ${fixed(r.az_deg, 2)}°, Sun ${fixed(r.sun_el_deg, 1)}°, Moon ${fixed(r.moon_el_deg, 1)}°; ` + (r.observable === "True" ? "observable" : `not observable: ${r.why}`);
  readable(box, p, shown.map((r) => ({ x: r.mjd_utc, y: r.el_deg, text: text(r) })), $("plan-read"), "Exposures");
}
$("plan-tools").addEventListener("change", drawPlan);
/** When a curve goes below a level first (side 0), or is below it last (side 1). */
function crossing(curve, level, side) {
  const list = side ? [...curve].reverse() : curve;
  const k = list.findIndex(([, v]) => v !== null && v <= level);
  if (k <= 0) return (list[Math.max(k, 0)] || [0])[0];
  const [[t0, v0], [t1, v1]] = [list[k - 1], list[k]];
  return t0 + ((level - v0) / (v1 - v0)) * (t1 - t0);
}

// --- light curve -------------------------------------------------------------------------------------------------------------
const curveRows = rows(DATA.curve);
const truthRows = rows(DATA.truth);
const key = (r) => `${r.frame} ${r.target}`;
const truthOf = new Map(truthRows.map((r) => [key(r), r]));
const targetNames = [...new Set([...curveRows, ...truthRows].map((r) => String(r.target)))];
const flagWords = (bits) => DATA.flags.filter(([bit]) => bits & bit).map(([, word]) => word).join(", ");
function drawCurve() {
  const figure = $("curve-figure");
  if (!curveRows.length) { figure.hidden = true; return; }
  const flux = document.querySelector("input[name=unit]:checked").value === "flux";
  const withTruth = $("truth").checked;
  const value = (r) => (flux ? r.flux_e : r.mag_v), error = (r) => (flux ? r.flux_err_e : r.mag_err);
  const trueValue = (t) => (flux ? t.electrons : t.mag_v);
  const points = curveRows.filter((r) => finite(r.mjd_utc));
  const shown = points.filter((r) => finite(value(r)));
  const span = ends(points.map((r) => r.mjd_utc), 0.03);
  if (span[1] - span[0] < 2e-4) { span[0] -= 1e-4; span[1] += 1e-4; }
  const reach = shown.flatMap((r) => { const e = finite(error(r)) ? Math.min(error(r), flux ? Infinity : 1) : 0; return [value(r) - e, value(r) + e]; });
  const truth = withTruth ? truthRows.filter((t) => finite(trueValue(t)) && finite(t.mjd_utc)) : [];
  const yEnds = ends([...reach, ...truth.map(trueValue)]);
  const x = { ends: span, ticks: timeTicks };
  const p = plot($("curve-chart"), {
    height: 330, bottom: 30, x,
    y: { ends: yEnds, ticks, label: flux ? "flux [e⁻ in the exposure]" : "V [mag]", flip: !flux },
  });
  const size = points.length > 400 ? 2 : 4;
  const tell = [];
  for (const t of truth) {
    p.under.append(svg("path", { class: "truth", d: shape(3, size + 2), transform: `translate(${p.sx(t.mjd_utc)},${p.sy(trueValue(t))})`, fill: "none", stroke: "var(--truth)", "stroke-width": 1.5 }));
  }
  for (const r of shown) {
    const k = targetNames.indexOf(String(r.target));
    const [cx, cy] = [p.sx(r.mjd_utc), p.sy(value(r))];
    if (finite(error(r)) && error(r) > 0) {
      const [a, b] = [value(r) - error(r), value(r) + error(r)].map((v) => p.sy(clamp(v, ...yEnds)));
      p.over.append(svg("path", { d: `M${cx},${a}V${b}`, stroke: colour(k), "stroke-width": 1.4, opacity: 0.75 }));
    }
    p.over.append(svg("path", { class: "measured", d: shape(k, size), transform: `translate(${cx},${cy})`, fill: r.flags ? "var(--page)" : colour(k), stroke: colour(k), "stroke-width": 1.5 }));
    const t = truthOf.get(key(r));
    const sigma = t ? (r.flux_e - t.electrons) / r.flux_err_e : NaN;
    const text = `${r.target}, frame ${r.frame}, ${utc(r.time_utc)}: V ${fixed(r.mag_v, 3)} ± ${fixed(r.mag_err, 3)}, ${digits(r.flux_e, 6)} ± ${digits(r.flux_err_e, 3)} e⁻, SNR ${digits(r.flux_e / r.flux_err_e, 3)}` + (t ? `; truth V ${fixed(t.mag_v, 3)}, ${digits(t.electrons, 6)} e⁻ (${fixed(sigma, 2)} σ)` : "") + (r.flags ? `; flags: ${flagWords(r.flags)}` : "");
    tell.push({ x: r.mjd_utc, y: value(r), text });
  }
  if (!shown.length) p.over.append(svg("text", { x: p.inner.x + p.inner.w / 2, y: p.inner.y + p.inner.h / 2, "text-anchor": "middle" }, flux ? "no flux was measured" : "no magnitude is known: look at the flux and the flags"));
  readable($("curve-chart"), p, tell, $("curve-read"), "Light curve");
  const entries = targetNames.slice(0, 12).map((name, k) => [name, svg("path", { d: shape(k, 4), transform: "translate(11,6)", fill: colour(k) })]);
  if (points.some((r) => r.flags)) entries.push(["flagged", svg("path", { d: shape(0, 4), transform: "translate(11,6)", fill: "none", stroke: "var(--soft)", "stroke-width": 1.5 })]);
  if (withTruth && truth.length) entries.push(["truth", svg("path", { d: shape(3, 4.2), transform: "translate(11,6)", fill: "none", stroke: "var(--truth)", "stroke-width": 1.5 })]);
  legend($("curve-legend"), entries);
  drawResiduals(x, span, points, size);
}
function drawResiduals(x, span, points, size) {
  const box = $("residual-chart");
  const pairs = points.map((r) => [r, truthOf.get(key(r))]).filter(([r, t]) => t && finite(t.electrons) && finite(r.flux_e) && r.flux_err_e > 0);
  if (!$("truth").checked || !pairs.length) { box.replaceChildren(svg("svg", { height: 0 })); box.hidden = !truthRows.length; labelled(box, x, span); return; }
  box.hidden = false;
  const z = pairs.map(([r, t]) => (r.flux_e - t.electrons) / r.flux_err_e);
  const far = clamp(Math.max(3.4, ...z.map(Math.abs)) * 1.08, 3.5, 12);
  const p = plot(box, { height: 190, top: 16, x: { ...x, label: timeLabel(...span) }, y: { ends: [-far, far], ticks: (a, b) => ticks(a, b, 5), label: "(flux − truth) / σ" } });
  p.under.append(svg("rect", { x: p.inner.x, width: p.inner.w, y: p.sy(1), height: p.sy(-1) - p.sy(1), fill: "var(--night)" }));
  p.under.append(svg("line", { x1: p.inner.x, x2: p.inner.x + p.inner.w, y1: p.sy(0), y2: p.sy(0), stroke: "var(--soft)" }));
  const tell = pairs.map(([r], i) => {
    const k = targetNames.indexOf(String(r.target));
    const beyond = Math.abs(z[i]) > far;
    p.over.append(svg("path", { class: "residual", d: beyond ? shape(2, size) : shape(k, size), transform: `translate(${p.sx(r.mjd_utc)},${p.sy(clamp(z[i], -far, far))})${beyond && z[i] < 0 ? " rotate(180)" : ""}`, fill: r.flags ? "var(--page)" : colour(k), stroke: colour(k), "stroke-width": 1.5 }));
    return { x: r.mjd_utc, y: clamp(z[i], -far, far), text: `${r.target}, frame ${r.frame}: ${fixed(z[i], 2)} σ${r.flags ? `; flags: ${flagWords(r.flags)}` : ""}` };
  });
  const good = z.filter((_, i) => !pairs[i][0].flags);
  if (good.length > 1) {
    const mean = good.reduce((a, b) => a + b, 0) / good.length;
    const sd = Math.sqrt(good.reduce((a, b) => a + (b - mean) ** 2, 0) / (good.length - 1));
    p.over.append(svg("text", { x: p.inner.x + p.inner.w, y: 10, "text-anchor": "end" }, `without flags: ${good.length} points, mean ${fixed(mean, 2)}, width ${fixed(sd, 2)}`));
  }
  readable(box, p, tell, $("curve-read"), "Residuals");
}
/** The words of the time axis where no residuals stand below the curve. */
function labelled(box, x, span) {
  box.hidden = false;
  box.replaceChildren(svg("svg", { height: 18, viewBox: `0 0 ${box.clientWidth || 300} 18`, "aria-hidden": "true" }, svg("text", { x: (box.clientWidth || 300) / 2 + 25, y: 12, "text-anchor": "middle" }, timeLabel(...span))));
}
if (!truthRows.length) $("truth-label").hidden = true; else $("truth").checked = true;
$("curve-tools").addEventListener("change", drawCurve);
if (curveRows.length && !curveRows.some((r) => finite(r.mag_v))) document.querySelector("input[name=unit][value=flux]").checked = true;

// --- studies -----------------------------------------------------------------------------------------------------------------
const table = (study) => (study ? study.columns[study.names[0]] || [] : []).map((_, i) => Object.fromEntries(study.names.map((n) => [n, study.columns[n][i]])));
const log10 = (v) => (finite(v) && v > 0 ? Math.log10(v) : null);
const readLabel = (v) => (v >= 1 ? `${digits(v, 3)} s` : v >= 1e-3 ? `${digits(v * 1e3, 3)} ms` : v >= 1e-6 ? `${digits(v * 1e6, 3)} µs` : `${digits(v * 1e9, 3)} ns`);
function drawAccuracy() {
  const all = table(DATA.accuracy);
  const names = [...new Set(all.map((r) => String(r.approximation)))];
  const groups = names.map((name) => all.filter((r) => String(r.approximation) === name && r.time_s > 0)).filter((g) => g.length > 1 && g.some((r) => r.max_err > 0));
  const box = $("accuracy");
  box.replaceChildren();
  for (const group of groups.slice(0, 24)) {
    const inside = el("div", { class: "chart" }), read = el("p", { class: "read", "aria-live": "polite" });
    box.append(el("figure", {}, el("figcaption", {}, String(group[0].approximation)), inside, read));
    const errors = group.map((r) => log10(r.max_err)).filter(finite);
    const least = Math.min(...errors) - 0.7;
    const at = (r) => (r.max_err > 0 ? log10(r.max_err) : least);
    const p = plot(inside, {
      height: 210, left: 72,
      x: { ends: ends(group.map((r) => log10(r.time_s)), 0.12), ticks: logTicks, label: "run time [s]" },
      y: { ends: ends(group.filter((r) => finite(r.max_err)).map(at), 0.12), ticks: logTicks, label: `largest error [${group[0].unit}]` },
    });
    const front = group.filter((r) => r.pareto === "True" && finite(r.max_err)).sort((a, b) => a.time_s - b.time_s);
    p.under.append(svg("path", { d: path(p, front.map((r) => [log10(r.time_s), at(r)])), fill: "none", stroke: "var(--line)", "stroke-width": 1.5 }));
    const tell = group.filter((r) => finite(r.max_err)).map((r) => {
      const chosen = r.default === "True";
      p.over.append(svg("path", { d: shape(r.max_err > 0 ? 0 : 3, chosen ? 5.5 : 4), transform: `translate(${p.sx(log10(r.time_s))},${p.sy(at(r))})`, fill: chosen ? "var(--s1)" : "var(--page)", stroke: chosen ? "var(--s1)" : "var(--s0)", "stroke-width": 1.5 }));
      return { x: log10(r.time_s), y: at(r), text: `${r.setting}${chosen ? " (default)" : ""}: ${r.max_err > 0 ? `${digits(r.max_err, 3)} ${r.unit}` : "the reference itself"}, ${readLabel(r.time_s)}` };
    });
    const chosen = group.find((r) => r.default === "True");
    read.textContent = chosen ? `Default: ${chosen.setting}, ${digits(chosen.max_err, 3)} ${chosen.unit}, ${readLabel(chosen.time_s)}` : "";
    readable(inside, p, tell, read, String(group[0].approximation));
  }
  box.hidden = !groups.length;
}
function drawSnr() {
  const all = table(DATA.snr).filter((r) => r.snr > 0);
  $("snr-figure").hidden = !all.length;
  if (!all.length) return;
  const given = ["snr", "snr_mc", "snr_mc_err", "signal_e", "sky_e_px", "dark_e_px", "read_noise_e", "n_px"];
  const many = DATA.snr.names.filter((n) => !given.includes(n) && new Set(all.map((r) => r[n])).size > 1 && all.every((r) => finite(r[n])));
  // what was swept comes first; the magnitude is told in every row and is no sweep of its own where something else is
  const swept = [...many.filter((n) => n !== "mag_v"), ...many.filter((n) => n === "mag_v")];
  const xName = swept[0] || "mag_v";
  const series = swept.length > 1 && !(swept.length === 2 && swept[1] === "mag_v" && xName !== "mag_v") ? swept[1] : null;
  const values = all.map((r) => r[xName]);
  const wide = values.every((v) => v > 0) && Math.max(...values) / Math.min(...values) > 30;
  const at = (r) => (wide ? log10(r[xName]) : r[xName]);
  const unit = (n) => { const u = DATA.snr.units[DATA.snr.names.indexOf(n)]; return u ? ` [${u}]` : ""; };
  const p = plot($("snr-chart"), {
    height: 320,
    x: { ends: ends(all.map(at), 0.04), ticks: wide ? logTicks : ticks, label: xName + unit(xName) },
    y: { ends: ends(all.flatMap((r) => [log10(r.snr), log10(r.snr_mc)])), ticks: logTicks, label: "signal-to-noise ratio" },
  });
  const groups = series ? [...new Set(all.map((r) => r[series]))] : [null];
  const tell = [];
  groups.slice(0, 8).forEach((g, k) => {
    const own = all.filter((r) => g === null || r[series] === g).sort((a, b) => at(a) - at(b));
    p.under.append(svg("path", { d: path(p, own.map((r) => [at(r), log10(r.snr)])), fill: "none", stroke: colour(k), "stroke-width": 1.8 }));
    for (const r of own) {
      if (r.snr_mc > 0) p.over.append(svg("path", { d: shape(0, 3.5), transform: `translate(${p.sx(at(r))},${p.sy(log10(r.snr_mc))})`, fill: "var(--page)", stroke: colour(k), "stroke-width": 1.5 }));
      tell.push({ x: at(r), y: log10(r.snr), text: `${xName} ${digits(r[xName], 5)}${series ? `, ${series} ${digits(g, 5)}` : ""}: SNR ${digits(r.snr, 4)}${finite(r.snr_mc) ? `, Monte Carlo ${digits(r.snr_mc, 4)}` : ""}` });
    }
  });
  const entries = groups.slice(0, 8).map((g, k) => [g === null ? "analytic" : `${series} ${digits(g, 4)}`, svg("line", { x1: 0, x2: 22, y1: 6, y2: 6, stroke: colour(k), "stroke-width": 2 })]);
  if (all.some((r) => r.snr_mc > 0)) entries.push(["Monte Carlo", svg("path", { d: shape(0, 4), transform: "translate(11,6)", fill: "none", stroke: "var(--soft)", "stroke-width": 1.5 })]);
  legend($("snr-legend"), entries);
  readable($("snr-chart"), p, tell, $("snr-read"), "Signal-to-noise ratio");
}

// --- the page ----------------------------------------------------------------------------------------------------------------
let drawnAt = 0;
function drawCharts() {
  drawnAt = $("main").clientWidth;
  drawPlan();
  drawCurve();
  drawAccuracy();
  drawSnr();
}
addEventListener("resize", () => { if ($("main").clientWidth !== drawnAt) drawCharts(); });
const links = [...document.querySelectorAll("nav a")];
const watcher = new IntersectionObserver((entries) => {
  for (const e of entries) if (e.isIntersecting) links.forEach((a) => a.classList.toggle("here", a.getAttribute("href") === `#${e.target.id}`));
}, { rootMargin: "-20% 0px -70% 0px" });
document.querySelectorAll("main section").forEach((s) => watcher.observe(s));
// paper shows everything
let folded = [];
addEventListener("beforeprint", () => {
  folded = [...document.querySelectorAll("details:not([open])")];
  folded.forEach((d) => { d.open = true; });
});
addEventListener("afterprint", () => folded.forEach((d) => { d.open = false; }));
drawCharts();
