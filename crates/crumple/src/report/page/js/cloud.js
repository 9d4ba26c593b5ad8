// The cloud: every state of every run as a point, its three coefficients of one eigenvector as place. three.js keeps the
// camera; the drawing is flat, so the cloud needs no WebGL, stays sharp in print and carries text.

const CLOUD_EYE = [4, -8, 3.2]; // where the reader stands at first
const PAPER_CLOUD = [610, 480]; // size on paper, CSS pixels; its proportions stand in the style sheet too
const POINTS_AT_ONCE = 60000; // above this, only the last state of each run is drawn at first

/** All points, flat: place (3 numbers), run, state, and the time of the state as a share of the longest time. */
function cloudPoints(lastOnly) {
  const places = [], owner = [], state = [], time = [];
  runs.forEach((run, r) => {
    const states = run.cloud ?? [];
    states.forEach((place, s) => {
      if (lastOnly && s < states.length - 1) return;
      if (!place || !place.every(Number.isFinite)) return;
      places.push(...place);
      owner.push(r);
      state.push(s);
      time.push(run.times?.[s] ?? s);
    });
  });
  return { places: Float64Array.from(places), owner, state, time, length: owner.length };
}

/** Smallest and largest of each coordinate, a little widened; flat directions get a share of the largest. */
function cloudBox(points, sameScale) {
  const box = [0, 1, 2].map((a) => {
    let low = Infinity, high = -Infinity;
    for (let i = a; i < points.places.length; i += 3) { low = Math.min(low, points.places[i]); high = Math.max(high, points.places[i]); }
    return points.length ? [low, high] : [0, 1];
  });
  const widest = Math.max(...box.map(([low, high]) => high - low)) || 1;
  const sides = box.map(([low, high]) => Math.max(high - low, sameScale ? 0.12 * widest : 1e-6 * widest) * 1.08);
  const scale = sides.map((side) => 2 / (sameScale ? Math.max(...sides) : side));
  return box.map(([low, high], a) => ({ low: (low + high - sides[a]) / 2, high: (low + high + sides[a]) / 2, middle: (low + high) / 2, scale: scale[a] }));
}

/** Ways to colour the points: [value, text, function of (run, state time) → colour, legend]. */
function cloudColourings(points) {
  const dark = matchMedia("(prefers-color-scheme: dark)").matches && !printing;
  const ramp = dark ? (t) => d3.interpolateViridis(0.3 + 0.7 * t) : (t) => d3.interpolateViridis(0.92 - 0.92 * t);
  const continuous = (text, of, unit) => {
    const [low, high] = d3.extent(points.owner.map((r, i) => of(runs[r], i)).filter((v) => Number.isFinite(v)));
    const at = (v) => (Number.isFinite(v) ? ramp(high > low ? (v - low) / (high - low) : 0.5) : styleValue("--quiet"));
    return { text, of: (run, i) => at(of(run, i)), low, high, unit, ramp };
  };
  const ways = new Map();
  if (modes.length) ways.set("mode", { text: "mode", of: (run) => modeColour(run.mode), swatches: [...modes.map((m) => [m.name, modeTitle(m.name)]), ...(runs.some((run) => !modeByName.has(run.mode)) ? [[null, "no mode"]] : [])] });
  ways.set("time", continuous("time", (run, i) => points.time[i], timeUnit));
  if (runs.some((run) => !missing(run.max_displacement))) ways.set("reach", continuous("largest displacement", (run) => run.max_displacement ?? NaN, lengthUnit));
  inputs.forEach((name, column) => {
    if (inputIsNumeric(column)) ways.set(`input ${column}`, continuous(inputTitle(name), (run) => asNumber(run.inputs?.[column]), ""));
    else {
      const common = commonest(runs.map((run) => run.inputs?.[column] || "none"), MODE_COLOURS - 1);
      const colour = (text) => { const i = common.indexOf(text || "none"); return i < 0 ? styleValue("--quiet") : styleValue(`--mode-${i}`); };
      ways.set(`input ${column}`, { text: inputTitle(name), of: (run) => colour(run.inputs?.[column]), plain: [...common.map((text, i) => [`var(--mode-${i})`, text]), ...(new Set(runs.map((run) => run.inputs?.[column] || "none")).size > common.length ? [["var(--quiet)", "others"]] : [])] });
    }
  });
  return ways;
}

/** The `most` values that occur most often. */
function commonest(values, most) {
  const times = new Map();
  for (const value of values) times.set(value, (times.get(value) ?? 0) + 1);
  return [...times].sort((a, b) => b[1] - a[1]).slice(0, most).map(([value]) => value);
}

/**
 * Builds the cloud into `holder`; `choose(id)` is called with the run that is clicked, `point(run)` with
 * the one under the pointer. Returns what others may ask of it.
 */
function buildCloud(holder, controlsHolder, legendHolder, choose, point) {
  const settings = { colour: modes.length ? "mode" : "time", last: false, paths: true, sameScale: true };
  let all = cloudPoints(false);
  if (all.length > POINTS_AT_ONCE) Object.assign(settings, { last: true, paths: false });
  let points = settings.last ? cloudPoints(true) : all;
  let box = cloudBox(points, settings.sameScale);
  let screen = new Float32Array(0), hovered = -1, selected = null, colours = [], symbols = [];

  const canvas = el("canvas", { tabindex: 0, role: "img", "aria-label": "Cloud of coefficients, one point for each state of each run" });
  const bubble = el("div", { class: "bubble", hidden: true });
  holder.append(canvas, bubble);
  const pen = canvas.getContext("2d");
  const camera = new vendor.OrthographicCamera(-1, 1, 1, -1, 0.1, 40);
  camera.up.set(0, 0, 1);
  const start = () => { camera.position.set(...CLOUD_EYE); camera.zoom = 1; camera.lookAt(0, 0, 0); };
  start();
  let turning = false;
  const controls = turnable(canvas, camera, () => draw());
  controls.addEventListener("start", () => { turning = true; });
  controls.addEventListener("end", () => { turning = false; draw(); });
  canvas.addEventListener("dblclick", () => { start(); controls.target.set(0, 0, 0); draw(); });

  /** Place of data in the picture, in CSS pixels, and its depth. */
  const vector = new vendor.Vector3();
  let width = 1, height = 1;
  function project(x, y, z) {
    vector.set((x - box[0].middle) * box[0].scale, (y - box[1].middle) * box[1].scale, (z - box[2].middle) * box[2].scale).project(camera);
    return [(vector.x + 1) * 0.5 * width, (1 - vector.y) * 0.5 * height, vector.z];
  }

  function recolour() {
    const ways = cloudColourings(points), way = ways.get(settings.colour) ?? ways.get("time");
    colours = points.owner.map((r, i) => way.of(runs[r], i));
    symbols = points.owner.map((r) => runs[r].mode);
    legendHolder.replaceChildren(cloudLegend(way));
  }

  function rebuild() {
    points = settings.last ? cloudPoints(true) : all;
    box = cloudBox(points, settings.sameScale);
    hovered = -1;
    recolour();
    draw();
  }

  let pending = false;
  function draw() {
    if (pending) return;
    pending = true;
    requestAnimationFrame(paint);
  }

  function paint() {
    pending = false;
    [width, height] = printing ? PAPER_CLOUD : [holder.clientWidth, holder.clientHeight];
    if (!width) return;
    const density = Math.max(2, devicePixelRatio || 1);
    if (canvas.width !== Math.round(width * density) || canvas.height !== Math.round(height * density)) Object.assign(canvas, { width: Math.round(width * density), height: Math.round(height * density) });
    pen.setTransform(density, 0, 0, density, 0, 0);
    pen.clearRect(0, 0, width, height);
    fitCamera();
    const style = { ink: styleValue("--ink"), quiet: styleValue("--muted"), line: styleValue("--line"), page: styleValue("--card") };
    drawAxes(pen, box, project, camera, style, holder);
    screen = new Float32Array(3 * points.length);
    for (let i = 0; i < points.length; i++) screen.set(project(points.places[3 * i], points.places[3 * i + 1], points.places[3 * i + 2]), 3 * i);
    if (settings.paths) drawPaths();
    drawMarks(style);
    for (const run of new Set([selected, hovered >= 0 ? points.owner[hovered] : null])) if (run !== null) drawRun(run, style);
  }

  /** The box of the data fills the picture whatever its proportions; zoom and turning come on top. */
  function fitCamera() {
    const aspect = width / height, half = [0, 1, 2].map((a) => ((box[a].high - box[a].low) / 2) * box[a].scale);
    const right = unit3(cross3([0, 0, 1], CLOUD_EYE)), upward = cross3(unit3(CLOUD_EYE), right);
    // how far the box reaches along an axis of the picture, however it is turned about z
    const reach = (axis) => Math.hypot(axis[0], axis[1]) * Math.hypot(half[0], half[1]) + Math.abs(axis[2]) * half[2];
    const [beside, below] = [Math.min(84, width / 6), 52]; // pixels kept for numbers on each side
    const size = Math.max(reach(upward) / (1 - (2 * below) / height), reach(right) / (1 - (2 * beside) / width) / aspect);
    Object.assign(camera, { top: size, bottom: -size, left: -size * aspect, right: size * aspect });
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
  }

  /** Runs of consecutive points of one run, as [first, last]. */
  function* stretches() {
    for (let i = 0; i < points.length;) {
      let j = i;
      while (j + 1 < points.length && points.owner[j + 1] === points.owner[i]) j++;
      yield [i, j];
      i = j + 1;
    }
  }

  function polyline(i, j) {
    pen.beginPath();
    for (let k = i; k <= j; k++) pen.lineTo(screen[3 * k], screen[3 * k + 1]);
    pen.stroke();
  }

  function drawPaths() {
    pen.lineWidth = 1;
    pen.globalAlpha = runs.length > 500 ? 0.1 : 0.28;
    for (const [i, j] of stretches()) { pen.strokeStyle = colours[j]; polyline(i, j); }
    pen.globalAlpha = 1;
  }

  /** Marks from far to near; the last state of a run is larger than those before. */
  function drawMarks(style) {
    if (turning && points.length > 12000) { // small dots follow the hand; the marks come back when it rests
      for (let i = 0; i < points.length; i++) { pen.fillStyle = colours[i]; pen.fillRect(screen[3 * i] - 1, screen[3 * i + 1] - 1, 2, 2); }
      return;
    }
    const order = Uint32Array.from(points.owner.keys()).sort((a, b) => screen[3 * b + 2] - screen[3 * a + 2]);
    const crowd = points.length > 8000 ? 0.45 : points.length > 3000 ? 0.7 : 1;
    const shapes = new Map([...new Set(symbols)].map((mode) => [mode, [22, 52].map((area) => new Path2D(symbolPath(modeSymbol(mode), area * crowd)))]));
    pen.strokeStyle = style.page;
    pen.lineWidth = 0.75;
    for (const i of order) {
      const last = i + 1 === points.length || points.owner[i + 1] !== points.owner[i];
      const path = shapes.get(symbols[i])[last ? 1 : 0];
      pen.translate(screen[3 * i], screen[3 * i + 1]);
      pen.fillStyle = colours[i];
      pen.fill(path);
      if (crowd === 1) pen.stroke(path);
      pen.translate(-screen[3 * i], -screen[3 * i + 1]);
    }
  }

  /** One run in front of all others. */
  function drawRun(r, style) {
    for (const [i, j] of stretches()) {
      if (points.owner[i] !== r) continue;
      for (const [stroke, line] of [[style.page, 5], [style.ink, 2]]) { pen.strokeStyle = stroke; pen.lineWidth = line; polyline(i, j); }
      for (let k = i; k <= j; k++) {
        pen.beginPath();
        pen.arc(screen[3 * k], screen[3 * k + 1], k === j || k === hovered ? 6 : 3.5, 0, 7);
        pen.fillStyle = colours[k];
        pen.fill();
        pen.stroke();
      }
    }
  }

  /** The point nearest to the pointer, within 12 pixels. */
  function pick(event) {
    const bounds = canvas.getBoundingClientRect(), [x, y] = [event.clientX - bounds.left, event.clientY - bounds.top];
    let best = -1, least = 144;
    for (let i = 0; i < points.length; i++) {
      const d = (screen[3 * i] - x) ** 2 + (screen[3 * i + 1] - y) ** 2;
      if (d < least || (d === least && screen[3 * i + 2] < screen[3 * best + 2])) { least = d; best = i; }
    }
    return best;
  }

  canvas.addEventListener("pointermove", (event) => {
    const now = event.buttons ? -1 : pick(event);
    if (now !== hovered) { hovered = now; describe(); draw(); }
  });
  canvas.addEventListener("pointerleave", () => { if (hovered !== -1) { hovered = -1; describe(); draw(); } });
  let pressed = null;
  canvas.addEventListener("pointerdown", (event) => { pressed = [event.clientX, event.clientY]; });
  canvas.addEventListener("click", (event) => {
    if (pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 4) return; // that was a turn
    const i = pick(event);
    if (i >= 0) choose(runs[points.owner[i]].id);
  });

  function describe() {
    bubble.hidden = hovered < 0;
    canvas.style.cursor = hovered < 0 ? "grab" : "pointer";
    if (hovered < 0) return;
    const run = runs[points.owner[hovered]];
    bubble.replaceChildren(el("b", {}, run.id), ` ${modeTitle(run.mode)}, at ${withUnit(points.time[hovered], timeUnit)}`);
    point(run);
    const [x, y] = [screen[3 * hovered], screen[3 * hovered + 1]];
    bubble.style.left = `${Math.max(0, Math.min(x + 14, width - bubble.offsetWidth - 4))}px`;
    bubble.style.top = `${Math.max(0, y - bubble.offsetHeight - 10)}px`;
  }

  const ways = [...cloudColourings(points)].map(([value, way]) => [value, way.text]);
  controlsHolder.append(
    choice("Colour", ways, settings.colour, (value) => { settings.colour = value; recolour(); draw(); }),
    choice("Show", [["all", "every state"], ["last", "last states"]], settings.last ? "last" : "all", (value) => { settings.last = value === "last"; rebuild(); }),
    tick("paths over time", settings.paths, (on) => { settings.paths = on; draw(); }),
    tick("same scale on all axes", settings.sameScale, (on) => { settings.sameScale = on; rebuild(); }));
  new ResizeObserver(draw).observe(holder);
  recolour();
  paint();
  return {
    select(id) { selected = runs.indexOf(runById.get(id)); if (selected < 0) selected = null; draw(); },
    restyle() { recolour(); paint(); },
  };
}

/** Legend of a colouring: a ramp with its ends, or marks with names. */
function cloudLegend(way) {
  if (way.swatches) return el("div", { class: "legend" }, way.swatches.map(([name, text]) => el("span", {}, modeMark(name, 12), text)));
  if (way.plain) return el("div", { class: "legend" }, way.plain.map(([colour, text]) => el("span", {}, el("i", { style: `background:${colour}` }), text)));
  const stops = Array.from({ length: 9 }, (_, i) => way.ramp(i / 8));
  return el("div", { class: "scale" }, el("span", {}, withUnit(way.low, way.unit)), el("i", { style: `background:linear-gradient(90deg,${stops.join(",")})` }), el("span", {}, withUnit(way.high, way.unit)), el("em", {}, way.text));
}

// ---- axes --------------------------------------------------------------------------------------------------------

/** The three far sides of the box with their grid, and numbers along its near edges. */
function drawAxes(pen, box, project, camera, style, holder) {
  const towards = new vendor.Vector3();
  camera.getWorldDirection(towards).negate(); // from the box to the eye
  const facing = [towards.x, towards.y, towards.z];
  const far = facing.map((f, a) => (f > 0 ? box[a].low : box[a].high)), near = facing.map((f, a) => (f > 0 ? box[a].high : box[a].low));
  const ticks = box.map((side) => niceTicks(side.low, side.high, side.scale));
  pen.lineWidth = 1;
  pen.strokeStyle = style.line;
  const line = (a, b) => { const [p, q] = [project(...a), project(...b)]; pen.beginPath(); pen.moveTo(p[0], p[1]); pen.lineTo(q[0], q[1]); pen.stroke(); };
  for (let a = 0; a < 3; a++) for (const b of [(a + 1) % 3, (a + 2) % 3]) { // on the far side across c, lines of constant a along b
    const from = [...far], to = [...far];
    [from[b], to[b]] = [box[b].low, box[b].high];
    for (const value of [box[a].low, ...ticks[a], box[a].high]) { from[a] = to[a] = value; line(from, to); }
  }
  for (let a = 0; a < 3; a++) labelEdge(a);

  /** Numbers stand on the outline of the box, at the bottom for x and y and at the left for z. */
  function labelEdge(a) {
    const [b, c] = [(a + 1) % 3, (a + 2) % 3];
    const edges = [[near[b], far[c]], [far[b], near[c]]].map(([vb, vc]) => {
      const end = (value) => { const p = []; p[a] = value; p[b] = vb; p[c] = vc; return p; };
      return { end, middle: project(...end(box[a].middle)) };
    });
    const better = a === 2 ? edges[0].middle[0] < edges[1].middle[0] : edges[0].middle[1] > edges[1].middle[1];
    const { end, middle } = edges[better ? 0 : 1];
    const centre = project(box[0].middle, box[1].middle, box[2].middle);
    const [p, q] = [project(...end(box[a].low)), project(...end(box[a].high))];
    const length = Math.hypot(q[0] - p[0], q[1] - p[1]);
    if (length < 30) return; // seen along the axis
    let normal = [-(q[1] - p[1]) / length, (q[0] - p[0]) / length];
    if (normal[0] * (middle[0] - centre[0]) + normal[1] * (middle[1] - centre[1]) < 0) normal = normal.map((v) => -v);
    const align = normal[0] > 0.5 ? "left" : normal[0] < -0.5 ? "right" : "center";
    pen.fillStyle = style.quiet;
    pen.textAlign = align;
    pen.textBaseline = "middle";
    pen.font = `11px ${getComputedStyle(holder).fontFamily}`;
    let widest = 0;
    const room = Math.floor(length / (align === "center" ? 46 : 16)), every = Math.max(1, Math.ceil(ticks[a].length / Math.max(1, room)));
    ticks[a].forEach((value, i) => {
      if (i % every) return;
      const at = project(...end(value)), text = tickText(value);
      widest = Math.max(widest, pen.measureText(text).width);
      pen.fillText(text, at[0] + 10 * normal[0], at[1] + 10 * normal[1]);
    });
    const away = 12 + (align === "center" ? 14 : widest * Math.abs(normal[0]) + 12);
    pen.fillStyle = style.ink;
    pen.font = `600 12px ${getComputedStyle(holder).fontFamily}`;
    pen.fillText(`${"xyz"[a]}${align === "center" ? " coefficient" : ""}`, middle[0] + away * normal[0], middle[1] + away * normal[1]);
  }
}

/** Round numbers inside a range; fewer where the side is short. */
function niceTicks(low, high, scale) {
  const wanted = Math.max(1, Math.round(((high - low) * scale) / 2 * 5));
  const raw = (high - low) / wanted, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].find((m) => m * power >= raw) * power, ticks = [];
  for (let k = Math.ceil(low / step); k * step <= high; k++) ticks.push(k * step);
  return ticks;
}

const tickText = (value) => (Math.abs(value) >= 10000 ? `${number(value / 1000)}k` : number(value)).replace(/^−0$/, "0");
