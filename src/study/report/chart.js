"use strict";
// The page's program: charts first, then the frame viewer, then the shape. Texts of the data reach the page as text only.
const DATA = JSON.parse(document.getElementById("data").textContent);
const $ = (id) => document.getElementById(id);
document.documentElement.classList.add("js");

function el(name, attributes, ...children) {
  const node = document.createElement(name);
  for (const [k, v] of Object.entries(attributes || {})) node.setAttribute(k, v);
  node.append(...children);
  return node;
}
function svg(name, attributes, ...children) {
  const node = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [k, v] of Object.entries(attributes || {})) node.setAttribute(k, v);
  node.append(...children);
  return node;
}
const finite = (v) => typeof v === "number" && Number.isFinite(v);
const clamp = (v, low, high) => Math.min(Math.max(v, low), high);
const minus = (text) => String(text).replace(/-/g, "\u2212");
/** A number of so many significant digits. */
function digits(v, count = 4) {
  if (!finite(v)) return "–";
  if (v === 0) return "0";
  const power = Math.floor(Math.log10(Math.abs(v)));
  if (power < -3 || power > 6) return minus(v.toExponential(count - 1).replace(/\.?0*e\+?/, "e"));
  const text = v.toFixed(Math.max(0, count - 1 - power));
  return minus(text.includes(".") ? text.replace(/\.?0+$/, "") : text);
}
const fixed = (v, n) => (finite(v) ? minus(v.toFixed(n)) : "–");

// --- colours -----------------------------------------------------------------------------------------------------------------
const themes = ["auto", "light", "dark"];
let theme = "auto";
try { theme = localStorage.getItem("nightglass-theme") || "auto"; } catch { /* files may have no storage */ }
const redrawn = [];
function applyTheme() {
  const root = document.documentElement;
  if (theme === "auto") root.removeAttribute("data-theme"); else root.setAttribute("data-theme", theme);
  const word = theme[0].toUpperCase() + theme.slice(1);
  $("theme").textContent = word;
  $("theme").setAttribute("aria-label", `Colours: ${theme === "auto" ? "as the system" : theme}; press to change`);
  redrawn.forEach((draw) => draw());
}
$("theme").addEventListener("click", () => {
  theme = themes[(themes.indexOf(theme) + 1) % 3];
  try { localStorage.setItem("nightglass-theme", theme); } catch { /* as above */ }
  applyTheme();
});

// --- ticks -------------------------------------------------------------------------------------------------------------------
function ticks(low, high, most) {
  const raw = (high - low) / Math.max(most, 1);
  if (!(raw > 0) || !finite(raw)) return [];
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].find((m) => m * power >= raw * 0.999) * power;
  const decimals = clamp(Math.ceil(-Math.log10(step) - 1e-9), 0, 12);
  const out = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + step * 1e-9 && out.length < 50; k++) {
    const v = k * step;
    const big = Math.max(Math.abs(low), Math.abs(high)) >= 1e6;
    out.push([v, minus(big ? (v === 0 ? "0" : v.toExponential(2).replace(/\.?0+e\+?/, "e")) : (v + 0).toFixed(decimals))]);
  }
  return out;
}
const superscript = (n) => String(n).replace("-", "⁻").replace(/\d/g, (d) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[d]);
function logTicks(low, high, most) {
  const first = Math.ceil(low - 1e-9), last = Math.floor(high + 1e-9);
  const step = Math.max(1, Math.ceil((last - first + 1) / Math.max(most, 1)));
  const out = [];
  for (let p = first; p <= last; p += step) out.push([p, p >= -2 && p <= 4 ? String(10 ** p).slice(0, 6) : `10${superscript(p)}`]);
  if (out.length > 1) return out;
  // less than a decade or two: round numbers between
  const fine = ticks(10 ** low, 10 ** high, 4).filter(([v]) => v > 0);
  return fine.map(([v]) => [Math.log10(v), digits(v, 3)]);
}
const STEPS = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 10800, 21600, 43200, 86400, 172800, 432000, 864000, 2592000, 7776000, 31536000];
const date = (mjd) => new Date(Math.round((mjd - 40587) * 86400e3));
const two = (n) => String(n).padStart(2, "0");
const dayOf = (mjd) => date(mjd).toISOString().slice(0, 10);
function timeTicks(low, high, most) {
  const seconds = (high - low) * 86400;
  if (seconds < 4 || !finite(seconds)) return seconds > 0 ? ticks(0, seconds, most).map(([v, l]) => [low + v / 86400, `+${l} s`]) : [];
  const step = STEPS.find((s) => seconds / s <= most) || Math.ceil(seconds / most / 31536000) * 31536000;
  const out = [];
  // of whole days: a common zero keeps midnight a tick
  for (let k = Math.ceil((low * 86400) / step - 1e-6); (k * step) / 86400 <= high + 1e-9 && out.length < 60; k++) {
    const mjd = (k * step) / 86400;
    const d = date(mjd);
    const clock = `${two(d.getUTCHours())}:${two(d.getUTCMinutes())}` + (step < 60 ? `:${two(d.getUTCSeconds())}` : "");
    out.push([mjd, step >= 86400 ? d.toISOString().slice(0, 10) : clock]);
  }
  return out;
}
function timeLabel(low, high) {
  const [a, b] = [dayOf(low), dayOf(high)];
  return a === b ? `UTC, ${a}` : `UTC, ${a} to ${b}`;
}

// --- charts ------------------------------------------------------------------------------------------------------------------
/** Ends of values with room around them. */
function ends(values, room = 0.06) {
  let low = Infinity, high = -Infinity;
  for (const v of values) if (finite(v)) { low = Math.min(low, v); high = Math.max(high, v); }
  if (low > high) return [0, 1];
  const gap = high > low ? (high - low) * room : Math.max(Math.abs(low) * 1e-3, 1e-3);
  return [low - gap, high + gap];
}
let charts = 0;
/** Axes with grid, labels and units. `x` and `y`: { ends, ticks(low, high, most), label, flip }. */
function plot(box, { height, x, y, left = 64, right = 14, top = 10, bottom = 46 }) {
  const width = Math.max(box.clientWidth || 300, 240);
  const inner = { x: left, y: top, w: width - left - right, h: height - top - bottom };
  const sx = (v) => inner.x + ((v - x.ends[0]) / (x.ends[1] - x.ends[0])) * inner.w;
  const up = (v) => (v - y.ends[0]) / (y.ends[1] - y.ends[0]);
  const sy = (v) => inner.y + (y.flip ? up(v) : 1 - up(v)) * inner.h;
  const root = svg("svg", { viewBox: `0 0 ${width} ${height}`, height, "aria-hidden": "true" });
  for (const [v, label] of y.ticks(...y.ends, Math.max(2, inner.h / 46))) {
    root.append(svg("line", { class: "grid", x1: inner.x, x2: inner.x + inner.w, y1: sy(v), y2: sy(v) }));
    root.append(svg("text", { x: inner.x - 8, y: sy(v) + 4, "text-anchor": "end" }, label));
  }
  const inside = `inside-${++charts}`;
  root.append(svg("clipPath", { id: inside }, svg("rect", { x: inner.x, y: inner.y, width: inner.w, height: inner.h })));
  const under = svg("g", { "clip-path": `url(#${inside})` }), over = svg("g");
  root.append(under);
  const base = inner.y + inner.h;
  for (const [v, label] of x.ticks(...x.ends, Math.max(2, inner.w / 84))) {
    root.append(svg("line", { class: "axis", x1: sx(v), x2: sx(v), y1: base, y2: base + 5 }));
    root.append(svg("text", { x: sx(v), y: base + 19, "text-anchor": "middle" }, label));
  }
  root.append(svg("path", { class: "axis", d: `M${inner.x},${inner.y}V${base}H${inner.x + inner.w}` }));
  if (x.label) root.append(svg("text", { x: inner.x + inner.w / 2, y: height - 6, "text-anchor": "middle" }, x.label));
  root.append(svg("text", { transform: `translate(13,${inner.y + inner.h / 2}) rotate(-90)`, "text-anchor": "middle" }, y.label));
  root.append(over);
  box.replaceChildren(root);
  return { root, under, over, inner, sx, sy };
}
/** A polyline with gaps where there are no numbers. */
function path(p, points) {
  let d = "", pen = false;
  for (const [a, b] of points) {
    const on = finite(a) && finite(b);
    if (on) d += `${pen ? "L" : "M"}${p.sx(a).toFixed(1)},${p.sy(b).toFixed(1)}`;
    pen = on;
  }
  return d;
}
const SHAPES = [
  (s) => `M${-s},0a${s},${s} 0 1,0 ${2 * s},0a${s},${s} 0 1,0 ${-2 * s},0`,
  (s) => `M${-s},${-s}H${s}V${s}H${-s}Z`,
  (s) => `M0,${-1.3 * s}L${1.2 * s},${0.9 * s}H${-1.2 * s}Z`,
  (s) => `M0,${-1.4 * s}L${1.4 * s},0L0,${1.4 * s}L${-1.4 * s},0Z`,
];
const shape = (k, size) => SHAPES[k % 4](size);
const colour = (k) => `var(--s${k % 8})`;
function legend(box, entries) {
  box.replaceChildren(...entries.map(([text, draw]) => el("span", {}, svg("svg", { viewBox: "0 0 22 12", "aria-hidden": "true" }, draw), text)));
}
/** Pointer and arrow keys over points: the nearest is told in `out`. `points`: { x, y, text }. */
function readable(box, p, points, out, name) {
  if (!points.length) return;
  const ordered = [...points].sort((a, b) => a.x - b.x);
  const mark = svg("g", { visibility: "hidden" });
  const line = svg("line", { class: "cross", y1: p.inner.y, y2: p.inner.y + p.inner.h });
  const ring = svg("circle", { r: 7, fill: "none", stroke: "var(--ink)", "stroke-width": 1.5 });
  mark.append(line, ring);
  p.over.append(mark);
  let at = -1;
  const show = (k) => {
    at = k;
    const q = ordered[k];
    mark.setAttribute("visibility", "visible");
    for (const a of ["x1", "x2"]) line.setAttribute(a, p.sx(q.x));
    ring.setAttribute("cx", p.sx(q.x));
    ring.setAttribute("cy", p.sy(q.y));
    out.textContent = q.text;
  };
  const nearest = (event) => {
    const r = p.root.getBoundingClientRect(), k = p.root.viewBox.baseVal.width / r.width;
    const [mx, my] = [(event.clientX - r.left) * k, (event.clientY - r.top) * k];
    let best = 0, least = Infinity;
    ordered.forEach((q, i) => {
      const d = (p.sx(q.x) - mx) ** 2 + 0.15 * (p.sy(q.y) - my) ** 2;
      if (d < least) [best, least] = [i, d];
    });
    show(best);
  };
  p.root.addEventListener("pointermove", nearest);
  p.root.addEventListener("pointerdown", nearest);
  p.root.addEventListener("pointerleave", () => mark.setAttribute("visibility", "hidden"));
  p.root.setAttribute("tabindex", "0");
  p.root.setAttribute("role", "img");
  p.root.removeAttribute("aria-hidden");
  p.root.setAttribute("aria-label", `${name}: ${ordered.length} points; left and right arrow keys read them`);
  p.root.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1, Home: -1e9, End: 1e9 }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    show(clamp(at + step, 0, ordered.length - 1));
  });
}
const rows = (columns) => (columns && columns.frame ? columns.frame.map((_, i) => Object.fromEntries(Object.entries(columns).map(([k, v]) => [k, v[i]]))) : []);
const utc = (text) => String(text || "").replace("T", " ").replace(/(\.\d)\d+$/, "$1");

