
// --- frames ------------------------------------------------------------------------------------------------------------------
const frames = DATA.frames.map((f, k) => ({ ...f, image: document.querySelectorAll("#strip img.frame")[k] }));
const view = { at: 0, x: 0, y: 0, scale: 1, black: 0, white: 1000, stretch: "asinh", invert: false, version: 0, held: false };
const canvas = $("sky-view");

/** A frame's codes, values and cut-outs, when they are first needed. */
function decoded(f) {
  if (f.ready) return f.ready;
  const out = { codes: null, cuts: [] };
  const o = f.overview;
  if (o && f.image.complete && f.image.naturalWidth) {
    const c = el("canvas", { width: o.columns, height: o.rows });
    const g = c.getContext("2d", { willReadFrequently: true });
    g.drawImage(f.image, 0, 0);
    const rgba = g.getImageData(0, 0, o.columns, o.rows).data;
    out.codes = new Uint8Array(o.columns * o.rows);
    for (let i = 0; i < out.codes.length; i++) out.codes[i] = rgba[4 * i];
  }
  for (const cut of f.cuts) {
    const text = atob(cut.data);
    const values = new Float64Array(cut.width * cut.height);
    for (let i = 0; i < values.length; i++) {
      const n = text.charCodeAt(2 * i) + 256 * text.charCodeAt(2 * i + 1);
      values[i] = cut.blank && n === 65535 ? NaN : cut.offset + cut.step * n;
    }
    out.cuts.push({ ...cut, values });
  }
  if (out.codes || !o) f.ready = out;
  return out;
}
const scaleOf = (f) => f.overview || { zero: 32, gain: 18, median: 0, unit: 4 * (f.noise || 1), low: 0, high: 100 };
const valueOf = (f, code) => { const o = scaleOf(f); return o.median + o.unit * Math.sinh((code - o.zero) / o.gain); };
const codeOf = (f, v) => { const o = scaleOf(f); return o.zero + o.gain * Math.asinh((v - o.median) / o.unit); };
const sliderCode = (position) => (position / 1000) * 255;
function resetStretch(f) {
  const o = scaleOf(f);
  const black = o.median - 1.5 * (f.noise || o.unit / 4), white = Math.max(o.high, o.median + 30 * (f.noise || o.unit / 4));
  view.black = clamp(Math.round((codeOf(f, black) / 255) * 1000), 0, 990);
  view.white = clamp(Math.round((codeOf(f, white) / 255) * 1000), view.black + 5, 1000);
  $("black").value = view.black;
  $("white").value = view.white;
}
/** From a value to a shade of grey, 0 to 255. */
function shader(f) {
  const black = valueOf(f, sliderCode(view.black)), white = valueOf(f, sliderCode(view.white));
  const span = Math.max(white - black, 1e-9);
  const curve = { linear: (t) => t, log: (t) => Math.log1p(1000 * t) / Math.log(1001), asinh: (t) => Math.asinh(20 * t) / Math.asinh(20) }[view.stretch];
  return (v) => {
    if (Number.isNaN(v)) return 0;
    const s = 255 * curve(clamp((v - black) / span, 0, 1));
    return view.invert ? 255 - s : s;
  };
}
function painted(width, height, shadeAt) {
  const c = el("canvas", { width, height });
  const g = c.getContext("2d"), image = g.createImageData(width, height);
  const out = new Uint32Array(image.data.buffer);
  for (let i = 0; i < out.length; i++) { const s = shadeAt(i) | 0; out[i] = 0xff000000 | (s << 16) | (s << 8) | s; }
  g.putImageData(image, 0, 0);
  return c;
}
/** The pictures of a frame in the stretch chosen. */
function pictures(f) {
  const stamp = `${view.black} ${view.white} ${view.stretch} ${view.invert}`;
  if (f.pictures && f.pictures.stamp === stamp) return f.pictures;
  const ready = decoded(f), shade = shader(f), o = f.overview;
  let whole = null;
  if (ready.codes) {
    const table = Uint8Array.from({ length: 256 }, (_, code) => shade(valueOf(f, code)));
    whole = painted(o.columns, o.rows, (i) => table[ready.codes[i]]);
  }
  const cuts = ready.cuts.map((c) => painted(c.width, c.height, (i) => shade(c.values[(c.height - 1 - Math.floor(i / c.width)) * c.width + (i % c.width)])));
  const made = { stamp, whole, cuts };
  if (whole || !o) f.pictures = made;
  return made;
}
const size = () => ({ w: canvas.clientWidth || 300, h: canvas.clientHeight || 300 });
const toScreen = (x, y) => { const { w, h } = size(); return [w / 2 + (x - view.x) * view.scale, h / 2 - (y - view.y) * view.scale]; };
const toFrame = (sx, sy) => { const { w, h } = size(); return [view.x + (sx - w / 2) / view.scale, view.y - (sy - h / 2) / view.scale]; };
function showWhole() {
  const f = frames[view.at], { w, h } = size();
  Object.assign(view, { x: (f.width - 1) / 2, y: (f.height - 1) / 2, scale: Math.min(w / f.width, h / f.height), mode: "whole" });
  drawFrame();
}
function showTarget() {
  const f = frames[view.at], { w, h } = size();
  const t = f.targets[0], c = f.cuts[0];
  const [x, y] = t ? [t.x, t.y] : c ? [c.x0 + c.width / 2 - 0.5, c.y0 + c.height / 2 - 0.5] : [(f.width - 1) / 2, (f.height - 1) / 2];
  Object.assign(view, { x, y, scale: Math.min(w, h) / Math.min(c ? c.width : f.width, 64), mode: "target" });
  drawFrame();
}
function zoom(by, sx, sy) {
  const f = frames[view.at], { w, h } = size();
  const [px, py] = [sx === undefined ? w / 2 : sx, sy === undefined ? h / 2 : sy];
  const [x, y] = toFrame(px, py);
  const least = 0.5 * Math.min(w / f.width, h / f.height);
  view.scale = clamp(view.scale * by, least, 64);
  view.x = x - (px - w / 2) / view.scale;
  view.y = y + (py - h / 2) / view.scale;
  view.mode = "own";
  drawFrame();
}
function pan(dx, dy) {
  const f = frames[view.at];
  view.x = clamp(view.x - dx / view.scale, 0, f.width - 1);
  view.y = clamp(view.y + dy / view.scale, 0, f.height - 1);
  view.mode = "own";
  drawFrame();
}
function drawFrame() {
  const f = frames[view.at];
  if (!f || canvas.closest("[hidden]")) return;
  const { w, h } = size(), ratio = Math.min(devicePixelRatio || 1, 2.5);
  if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
    canvas.width = Math.round(w * ratio);
    canvas.height = Math.round(h * ratio);
  }
  const g = canvas.getContext("2d");
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.fillStyle = "#07090b";
  g.fillRect(0, 0, w, h);
  const p = pictures(f), o = f.overview;
  const [left, bottom] = toScreen(-0.5, -0.5), [right, above] = toScreen(f.width - 0.5, f.height - 0.5);
  g.save();
  g.beginPath();
  g.rect(left, above, right - left, bottom - above);
  g.clip();
  if (p.whole) {
    const [, top] = toScreen(0, o.rows * o.bin - 0.5);
    g.imageSmoothingEnabled = view.scale * o.bin < 1;
    g.drawImage(p.whole, left, top, o.columns * o.bin * view.scale, o.rows * o.bin * view.scale);
  }
  // between its pixels and the binned ones a cut-out would look like a patch of noise: it stands in once its pixels can be seen
  if (view.scale * (o ? o.bin : 1) > 2 || !p.whole) {
    f.cuts.forEach((c, k) => {
      const [x, y] = toScreen(c.x0 - 0.5, c.y0 + c.height - 0.5);
      g.imageSmoothingEnabled = view.scale < 1;
      g.drawImage(p.cuts[k], x, y, c.width * view.scale, c.height * view.scale);
    });
  }
  g.restore();
  g.strokeStyle = "#39434d";
  g.lineWidth = 1;
  g.strokeRect(left, above, right - left, bottom - above);
  overlays(g, f);
  compass(g, f, w);
  $("black-value").textContent = digits(valueOf(f, sliderCode(view.black)), 4);
  $("white-value").textContent = digits(valueOf(f, sliderCode(view.white)), 4);
}
function overlays(g, f) {
  const on = (id) => $(id).checked;
  if (on("o-cut")) {
    g.strokeStyle = "#8a94a0";
    g.setLineDash([4, 4]);
    for (const c of f.cuts) {
      const [x, y] = toScreen(c.x0 - 0.5, c.y0 + c.height - 0.5);
      g.strokeRect(x, y, c.width * view.scale, c.height * view.scale);
    }
    g.setLineDash([]);
  }
  if (on("o-stars")) {
    g.strokeStyle = "#2cc295";
    g.lineWidth = 1;
    for (const [x0, y0, x1, y1, mag] of f.stars) {
      if (![x0, y0, x1, y1].every(finite)) continue;
      const [a, b] = toScreen(x0, y0), [c, d] = toScreen(x1, y1);
      const r = clamp(14 - (finite(mag) ? mag : 12) * 0.6, 4, 12);
      const turn = Math.atan2(d - b, c - a);
      g.beginPath();
      g.arc(a, b, r, turn + Math.PI / 2, turn + 1.5 * Math.PI);
      g.arc(c, d, r, turn - Math.PI / 2, turn + Math.PI / 2);
      g.closePath();
      g.stroke();
    }
  }
  f.targets.forEach((t) => {
    const [x, y] = toScreen(t.x, t.y);
    if (on("o-trail") && t.trail) {
      const [a, b] = toScreen(t.trail[0], t.trail[1]), [c, d] = toScreen(t.trail[2], t.trail[3]);
      g.strokeStyle = "#d55e00";
      g.lineWidth = 2.5;
      g.beginPath();
      g.moveTo(a, b);
      g.lineTo(c, d);
      g.stroke();
      g.fillStyle = "#d55e00";
      for (const [px, py] of [[a, b], [c, d]]) { g.beginPath(); g.arc(px, py, 3, 0, 7); g.fill(); }
    }
    if (on("o-aperture") && apertureOf(f, t)) {
      g.strokeStyle = "#56b4e9";
      g.lineWidth = 1.2;
      const r = apertureOf(f, t) * view.scale;
      const half = t.trail ? [(t.trail[2] - t.trail[0]) / 2, (t.trail[3] - t.trail[1]) / 2] : [0, 0];
      const [a, b] = toScreen(t.x - half[0], t.y - half[1]), [c, d] = toScreen(t.x + half[0], t.y + half[1]);
      const turn = Math.atan2(d - b, c - a);
      g.beginPath();
      g.arc(a, b, r, turn + Math.PI / 2, turn + 1.5 * Math.PI);
      g.arc(c, d, r, turn - Math.PI / 2, turn + Math.PI / 2);
      g.closePath();
      g.stroke();
    }
    if (on("o-target")) {
      const r = Math.max(14, (apertureOf(f, t) || 4) * view.scale * 1.4);
      g.strokeStyle = "#e69f00";
      g.lineWidth = 2;
      for (const q of [0, 1, 2, 3]) {
        g.beginPath();
        g.arc(x, y, r, q * Math.PI / 2 + 0.35, (q + 1) * Math.PI / 2 - 0.35);
        g.stroke();
      }
      g.font = "12px system-ui, sans-serif";
      g.fillStyle = "#f2b632";
      g.shadowColor = "#000";
      g.shadowBlur = 4;
      // beside the ring, on the side where there is room
      const room = x + r + 5 + g.measureText(t.name).width < size().w;
      g.textAlign = room ? "start" : "end";
      g.fillText(t.name, room ? x + r + 5 : x - r - 5, y - r * 0.5);
      g.textAlign = "start";
      g.shadowBlur = 0;
    }
  });
}
/** Radius [px]: of the table, else one and a half widths of a point's image. */
const apertureOf = (f, t) => (finite(t.aperture) ? t.aperture : finite(f.fwhm) ? 1.5 * f.fwhm : null);
function compass(g, f, w) {
  const c = f.wcs;
  if (!c) return;
  const [a, b, d, e] = c.cd, det = a * e - b * d;
  if (!det) return;
  // pixel directions of north (0, 1) and east (1, 0) of the plane of the sky
  const arrows = [["N", [-d / det, a / det]], ["E", [e / det, -b / det]]];
  const [x0, y0] = [w - 44, 44];
  g.strokeStyle = g.fillStyle = "#c3cad1";
  g.lineWidth = 1.3;
  g.font = "12px system-ui, sans-serif";
  g.textAlign = "center";
  g.textBaseline = "middle";
  for (const [name, [px, py]] of arrows) {
    const n = Math.hypot(px, py) || 1, [ux, uy] = [px / n, -py / n];
    g.beginPath();
    g.moveTo(x0, y0);
    g.lineTo(x0 + 20 * ux, y0 + 20 * uy);
    g.stroke();
    g.fillText(name, x0 + 30 * ux, y0 + 30 * uy);
  }
  const bar = [0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200, 18000].filter((s) => (s / c.scale) * view.scale <= 130).pop();
  if (bar) {
    const length = (bar / c.scale) * view.scale;
    g.beginPath();
    g.moveTo(14, 22); g.lineTo(14 + length, 22);
    g.moveTo(14, 18); g.lineTo(14, 26);
    g.moveTo(14 + length, 18); g.lineTo(14 + length, 26);
    g.stroke();
    g.textAlign = "left";
    g.fillText(bar >= 3600 ? `${bar / 3600}°` : bar >= 60 ? `${bar / 60}′` : `${bar}″`, 14, 36);
  }
  g.textAlign = "start";
  g.textBaseline = "alphabetic";
}
function celestial(c, x, y) {
  const rad = Math.PI / 180, [dx, dy] = [x - c.x, y - c.y];
  const xi = (c.cd[0] * dx + c.cd[2] * dy) * rad, eta = (c.cd[1] * dx + c.cd[3] * dy) * rad;
  const [ra0, dec0] = [c.ra * rad, c.dec * rad];
  const under = Math.cos(dec0) - eta * Math.sin(dec0);
  const ra = ra0 + Math.atan2(xi, under);
  const dec = Math.atan2(Math.sin(dec0) + eta * Math.cos(dec0), Math.hypot(under, xi));
  return [((ra / rad) % 360 + 360) % 360, dec / rad];
}
function readPixel(sx, sy) {
  const f = frames[view.at], [fx, fy] = toFrame(sx, sy), [x, y] = [Math.round(fx), Math.round(fy)];
  if (x < 0 || y < 0 || x >= f.width || y >= f.height) { $("pixel").textContent = ""; return; }
  const ready = decoded(f), o = f.overview;
  const cut = ready.cuts.find((c) => x >= c.x0 && y >= c.y0 && x < c.x0 + c.width && y < c.y0 + c.height);
  let text = `x ${x}, y ${y}: `;
  if (cut) {
    const v = cut.values[(y - cut.y0) * cut.width + (x - cut.x0)];
    const step = cut.step === 1 ? "" : ` (to ${digits(cut.step, 2)})`;
    text += (Number.isNaN(v) ? "no number" : `${Number.isInteger(v) ? v : digits(v, 7)} ${f.unit}`) + step;
  } else if (ready.codes) {
    const code = ready.codes[(o.rows - 1 - Math.floor(y / o.bin)) * o.columns + Math.floor(x / o.bin)];
    text += `≈ ${digits(valueOf(f, code), 5)} ${f.unit}` + (o.bin > 1 ? `, mean of ${o.bin} × ${o.bin} px` : "");
  }
  if (f.wcs) { const [ra, dec] = celestial(f.wcs, fx, fy); text += ` · RA ${ra.toFixed(4)}°, Dec ${minus(dec.toFixed(4))}°`; }
  $("pixel").textContent = text;
}
function chooseFrame(k) {
  if (!frames.length) return;
  view.at = (k + frames.length) % frames.length;
  const f = frames[view.at];
  $("frame").value = view.at;
  $("frame-label").textContent = `Frame ${f.number} (${view.at + 1} of ${frames.length} here), ${f.time ? `${utc(f.time)} UTC` : f.name}`;
  $("frame").setAttribute("aria-valuetext", `frame ${f.number}`);
  document.querySelectorAll("#strip button").forEach((b, i) => b.setAttribute("aria-current", String(i === view.at)));
  $("stars-word").textContent = f.stars.length ? `${f.stars.length}, of ${f.origin}` : "none known";
  $("aperture-word").textContent = f.targets.some((t) => finite(t.aperture)) ? "aperture" : "circle of 1.5 FWHM";
  if (!view.held) resetStretch(f);
  if (view.mode === "target") showTarget(); else if (view.mode === "whole") showWhole(); else drawFrame();
}
function startViewer() {
  if (!frames.length) return;
  $("frame").max = frames.length - 1;
  for (const id of ["prev", "next", "frame", "blink"]) $(id).disabled = frames.length < 2;
  // the pictures below become buttons
  document.querySelectorAll("#strip figure").forEach((figure, k) => {
    const button = el("button", { type: "button", "aria-label": `Show frame ${frames[k].number}` });
    button.append(figure.querySelector("img"));
    figure.prepend(button);
    figure.querySelector("figcaption").textContent = `Frame ${frames[k].number}`;
    button.addEventListener("click", () => chooseFrame(k));
  });
  if (!frames.some((f) => f.targets.some((t) => t.trail))) $("o-trail").closest("label").hidden = true;
  if (!frames.some((f) => f.stars.length)) $("o-stars").closest("label").hidden = true;
  $("frame").addEventListener("input", () => chooseFrame(Number($("frame").value)));
  $("prev").addEventListener("click", () => chooseFrame(view.at - 1));
  $("next").addEventListener("click", () => chooseFrame(view.at + 1));
  let timer = null;
  $("blink").addEventListener("click", () => {
    if (timer) { clearInterval(timer); timer = null; } else timer = setInterval(() => chooseFrame(view.at + 1), 600);
    $("blink").setAttribute("aria-pressed", String(Boolean(timer)));
  });
  $("whole").addEventListener("click", showWhole);
  $("target").addEventListener("click", showTarget);
  $("zoom-in").addEventListener("click", () => zoom(1.5));
  $("zoom-out").addEventListener("click", () => zoom(1 / 1.5));
  document.querySelectorAll("input[name=stretch]").forEach((r) => r.addEventListener("change", () => { view.stretch = r.value; drawFrame(); }));
  $("black").addEventListener("input", () => { view.held = true; view.black = Math.min(Number($("black").value), 995); view.white = Math.max(view.white, view.black + 5); $("white").value = view.white; drawFrame(); });
  $("white").addEventListener("input", () => { view.held = true; view.white = Math.max(Number($("white").value), 5); view.black = Math.min(view.black, view.white - 5); $("black").value = view.black; drawFrame(); });
  $("auto").addEventListener("click", () => { view.held = false; resetStretch(frames[view.at]); drawFrame(); });
  $("invert").addEventListener("change", () => { view.invert = $("invert").checked; drawFrame(); });
  for (const id of ["o-target", "o-aperture", "o-trail", "o-stars", "o-cut"]) $(id).addEventListener("change", drawFrame);
  const held = new Map();
  const local = (e) => { const r = canvas.getBoundingClientRect(); return [e.clientX - r.left, e.clientY - r.top]; };
  canvas.addEventListener("pointerdown", (e) => { canvas.setPointerCapture(e.pointerId); held.set(e.pointerId, local(e)); });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (e) => held.delete(e.pointerId));
  canvas.addEventListener("pointermove", (e) => {
    const now = local(e), before = held.get(e.pointerId);
    readPixel(...now);
    if (!before) return;
    if (held.size === 2) {
      const other = [...held].find(([id]) => id !== e.pointerId)[1];
      const far = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]) || 1;
      zoom(far(now) / far(before), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
    } else pan(now[0] - before[0], now[1] - before[1]);
    held.set(e.pointerId, now);
  });
  canvas.addEventListener("pointerleave", () => { $("pixel").textContent = ""; });
  canvas.addEventListener("wheel", (e) => {
    if (document.activeElement !== canvas && !e.ctrlKey) return;
    e.preventDefault();
    zoom(Math.exp(-clamp(e.deltaY, -120, 120) * 0.004), ...local(e));
  }, { passive: false });
  canvas.addEventListener("keydown", (e) => {
    const step = 40;
    const action = {
      ArrowLeft: () => pan(step, 0), ArrowRight: () => pan(-step, 0), ArrowUp: () => pan(0, step), ArrowDown: () => pan(0, -step),
      "+": () => zoom(1.5), "=": () => zoom(1.5), "-": () => zoom(1 / 1.5), 0: showWhole, t: showTarget, ",": () => chooseFrame(view.at - 1), ".": () => chooseFrame(view.at + 1),
    }[e.key];
    if (!action || e.ctrlKey || e.metaKey || e.altKey) return;
    e.preventDefault();
    action();
  });
  view.mode = "whole";
  // pictures that are not decoded yet are drawn when they are
  frames.forEach((f, k) => { if (!f.image.complete) f.image.addEventListener("load", () => { if (k === view.at) chooseFrame(k); }); });
  chooseFrame(Math.floor((frames.length - 1) / 2));
  addEventListener("resize", () => (view.mode === "whole" ? showWhole() : drawFrame()));
  addEventListener("beforeprint", drawFrame);
}
startViewer();
