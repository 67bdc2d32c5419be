
// --- shape -------------------------------------------------------------------------------------------------------------------
// A shape is drawn with a depth buffer of its own: parts may reach into each other, and no graphics processor is needed.
const body = DATA.solid;
const stand = { turn: [1, 0, 0, 0, 1, 0, 0, 0, 1], zoom: 1, ids: null, width: 0, height: 0, seen: -1 };
const product = (a, b) => Array.from({ length: 9 }, (_, k) => { const [i, j] = [Math.floor(k / 3), k % 3]; return a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j]; });
const about = (axis, angle) => {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return axis === "x" ? [1, 0, 0, 0, c, -s, 0, s, c] : axis === "y" ? [c, 0, s, 0, 1, 0, -s, 0, c] : [c, -s, 0, s, c, 0, 0, 0, 1];
};
const apply = (m, [x, y, z]) => [m[0] * x + m[1] * y + m[2] * z, m[3] * x + m[4] * y + m[5] * z, m[6] * x + m[7] * y + m[8] * z];
const isometric = () => product(about("x", -1.1), about("z", 0.62));
/** Normal of a planar polygon, by Newell's formula. */
function normalOf(corners) {
  const n = [0, 0, 0];
  corners.forEach((a, i) => {
    const b = corners[(i + 1) % corners.length];
    n[0] += (a[1] - b[1]) * (a[2] + b[2]);
    n[1] += (a[2] - b[2]) * (a[0] + b[0]);
    n[2] += (a[0] - b[0]) * (a[1] + b[1]);
  });
  const length = Math.hypot(...n) || 1;
  return n.map((v) => v / length);
}
function startSolid() {
  if (!body) return;
  $("solid-figure").hidden = false;
  const plate = $("solid");
  const facets = body.facets.map(([material, part, area, corners]) => ({ material, part, area, corners, normal: normalOf(corners.map((c) => body.vertices[c])) }));
  const claimed = (DATA.facets || []).filter((f) => Array.isArray(f.normal));
  const lines = facets.length <= 600;
  stand.turn = isometric();
  function draw() {
    // twice as fine as a plain screen: edges look smooth
    const ratio = 2;
    const w = Math.round((plate.clientWidth || 400) * ratio), h = Math.round((plate.clientHeight || 350) * ratio);
    plate.width = w;
    plate.height = h;
    const g = plate.getContext("2d"), image = g.createImageData(w, h);
    const out = new Uint32Array(image.data.buffer), depth = new Float32Array(w * h).fill(-1e9), ids = new Int32Array(w * h).fill(-1);
    const unit = 0.44 * Math.min(w, h) * stand.zoom;
    const spots = body.vertices.map((v) => { const [x, y, z] = apply(stand.turn, v); return [w / 2 + x * unit, h / 2 - y * unit, z]; });
    const shades = facets.map((f) => {
      const [x, y, z] = apply(stand.turn, f.normal);
      // light from above the reader's left shoulder; sheets are lit from both sides
      const lit = 0.5 + 0.5 * Math.abs(-0.35 * x + 0.45 * y + 0.82 * z);
      const [r, gr, b] = body.materials[f.material].colour.map((c) => Math.round(c * Math.min(lit, 1)));
      return 0xff000000 | (b << 16) | (gr << 8) | r;
    });
    facets.forEach((f, k) => {
      for (let i = 1; i + 1 < f.corners.length; i++) fillTriangle(spots[f.corners[0]], spots[f.corners[i]], spots[f.corners[i + 1]], k);
    });
    function fillTriangle(a, b, c, id) {
      const det = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
      if (!(Math.abs(det) > 1e-9)) return;
      const x0 = Math.max(0, Math.floor(Math.min(a[0], b[0], c[0]))), x1 = Math.min(w - 1, Math.ceil(Math.max(a[0], b[0], c[0])));
      const y0 = Math.max(0, Math.floor(Math.min(a[1], b[1], c[1]))), y1 = Math.min(h - 1, Math.ceil(Math.max(a[1], b[1], c[1])));
      for (let y = y0; y <= y1; y++) {
        for (let x = x0; x <= x1; x++) {
          const u = ((x + 0.5 - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y + 0.5 - a[1])) / det;
          const v = ((b[0] - a[0]) * (y + 0.5 - a[1]) - (x + 0.5 - a[0]) * (b[1] - a[1])) / det;
          if (u < -1e-6 || v < -1e-6 || u + v > 1 + 1e-6) continue;
          const z = a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2]), at = y * w + x;
          if (z > depth[at]) { depth[at] = z; ids[at] = id; }
        }
      }
    }
    const differ = (i, j) => i !== j && (i < 0 || j < 0 || lines || facets[i].material !== facets[j].material || facets[i].part !== facets[j].part);
    for (let y = 0; y < h; y++) {
      for (let x = 0; x < w; x++) {
        const at = y * w + x, id = ids[at];
        const edge = (x + 1 < w && differ(id, ids[at + 1])) || (y + 1 < h && differ(id, ids[at + w]));
        if (edge) out[at] = id === stand.seen && id >= 0 ? 0xff000000 : 0xff2a2f36; else if (id >= 0) out[at] = shades[id];
      }
    }
    g.putImageData(image, 0, 0);
    Object.assign(stand, { ids, width: w, height: h });
    axes(g, w, h, ratio);
  }
  function axes(g, w, h, ratio) {
    const [x0, y0, length] = [46 * ratio, h - 46 * ratio, 28 * ratio];
    const ink = getComputedStyle(document.documentElement).getPropertyValue("--soft").trim() || "#666";
    g.strokeStyle = g.fillStyle = ink;
    g.lineWidth = 1.4 * ratio;
    g.font = `${12 * ratio}px system-ui, sans-serif`;
    g.textAlign = "center";
    g.textBaseline = "middle";
    for (const [name, axis] of [["x", [1, 0, 0]], ["y", [0, 1, 0]], ["z", [0, 0, 1]]]) {
      const [x, y] = apply(stand.turn, axis);
      g.beginPath();
      g.moveTo(x0, y0);
      g.lineTo(x0 + x * length, y0 - y * length);
      g.stroke();
      g.fillText(name, x0 + x * length * 1.35, y0 - y * length * 1.35);
    }
  }
  let asked = false;
  const soon = () => { if (!asked) { asked = true; requestAnimationFrame(() => { asked = false; draw(); }); } };
  const turnBy = (dx, dy) => { stand.turn = product(product(about("y", dx), about("x", dy)), stand.turn); soon(); };
  const tell = (id) => {
    if (id < 0) { $("solid-read").textContent = ""; return; }
    const f = facets[id], m = body.materials[f.material];
    const near = claimed.map((c) => [c.normal.reduce((sum, v, i) => sum + v * f.normal[i], 0), c]).sort((a, b) => b[0] - a[0])[0];
    let text = `${m.words}; area ${digits(f.area, 4)}${body.relative ? "" : " m²"}, normal (${f.normal.map((v) => fixed(v, 3)).join(", ")})`;
    if (near && near[0] > 0.9998) text += `; facet of shape.json: ${digits(near[1].area_m2, 4)} ± ${digits(near[1].area_sd_m2, 2)} m², direction ± ${digits(near[1].direction_sd_deg, 3)}°`;
    if (f.part) text += `; ${f.part}`;
    $("solid-read").textContent = text;
  };
  let spin = null;
  const stop = () => { if (spin) { cancelAnimationFrame(spin); spin = null; } $("solid-turn").setAttribute("aria-pressed", "false"); };
  const held = new Map();
  plate.addEventListener("pointerdown", (e) => { stop(); plate.setPointerCapture(e.pointerId); held.set(e.pointerId, [e.clientX, e.clientY]); });
  for (const name of ["pointerup", "pointercancel"]) plate.addEventListener(name, (e) => held.delete(e.pointerId));
  plate.addEventListener("pointermove", (e) => {
    const r = plate.getBoundingClientRect(), before = held.get(e.pointerId);
    const k = stand.width / r.width;
    const at = Math.floor((e.clientY - r.top) * k) * stand.width + Math.floor((e.clientX - r.left) * k);
    if (stand.ids && !before) tell(stand.ids[at] === undefined ? -1 : stand.ids[at]);
    if (!before) return;
    const now = [e.clientX, e.clientY];
    if (held.size === 2) {
      const other = [...held].find(([id]) => id !== e.pointerId)[1];
      const far = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]) || 1;
      stand.zoom = clamp((stand.zoom * far(now)) / far(before), 0.4, 8);
      soon();
    } else turnBy((now[0] - before[0]) * 0.01, (now[1] - before[1]) * 0.01);
    held.set(e.pointerId, now);
  });
  plate.addEventListener("wheel", (e) => {
    if (document.activeElement !== plate && !e.ctrlKey) return;
    e.preventDefault();
    stand.zoom = clamp(stand.zoom * Math.exp(-clamp(e.deltaY, -120, 120) * 0.003), 0.4, 8);
    soon();
  }, { passive: false });
  const reset = () => { stop(); stand.turn = isometric(); stand.zoom = 1; soon(); };
  plate.addEventListener("keydown", (e) => {
    const by = 0.12;
    const action = {
      ArrowLeft: () => turnBy(-by, 0), ArrowRight: () => turnBy(by, 0), ArrowUp: () => turnBy(0, -by), ArrowDown: () => turnBy(0, by), 0: reset,
      "+": () => { stand.zoom = Math.min(stand.zoom * 1.2, 8); soon(); }, "=": () => { stand.zoom = Math.min(stand.zoom * 1.2, 8); soon(); }, "-": () => { stand.zoom = Math.max(stand.zoom / 1.2, 0.4); soon(); },
    }[e.key];
    if (!action || e.ctrlKey || e.metaKey || e.altKey) return;
    e.preventDefault();
    stop();
    action();
  });
  $("solid-reset").addEventListener("click", reset);
  $("solid-turn").addEventListener("click", () => {
    if (spin) { stop(); return; }
    $("solid-turn").setAttribute("aria-pressed", "true");
    let last = performance.now();
    const step = (now) => { stand.turn = product(stand.turn, about("z", (now - last) * 4e-4)); last = now; draw(); spin = requestAnimationFrame(step); };
    spin = requestAnimationFrame(step);
  });
  const list = el("ul", { "aria-label": "How sure the facets are" });
  for (const m of body.materials) {
    const swatch = el("i", { "aria-hidden": "true" });
    swatch.style.background = `rgb(${m.colour.join(",")})`;
    list.append(el("li", {}, swatch, el("span", {}, `${m.words}: ${m.facets} facet${m.facets === 1 ? "" : "s"}`), el("span", {}, `${fixed(100 * m.share, 1)} %`)));
  }
  $("solid-legend").append(list);
  if (body.found > facets.length) $("solid-legend").append(el("p", {}, `The ${facets.length} largest of ${body.found} facets are drawn.`));
  redrawn.push(soon);
  addEventListener("resize", soon);
  draw();
}
startSolid();
applyTheme();
