// Shapes of the part. A browser allows few WebGL contexts, so one renderer that nobody sees draws every shape in turn,
// and each picture is copied into the two-dimensional canvas of its view, which prints like any image.

/** Base64 of little-endian numbers, as a typed array. */
function decode(text, Type) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Type(bytes.buffer);
}

const mesh = findings.mesh ?? { origin: [0, 0, 0], step: 1 };
const triangles = mesh.triangles ? decode(mesh.triangles, Uint32Array) : new Uint32Array(0);
const hasShape = (key) => !missing(key) && !missing(findings.shapes?.[key]);

/** Positions of a shape, 3N numbers in the model's length unit. */
function positionsOf(key) {
  const steps = decode(findings.shapes[key], Uint16Array);
  return Float32Array.from(steps, (s, i) => mesh.origin[i % 3] + mesh.step * s);
}
const referencePositions = hasShape("reference") ? positionsOf("reference") : null;

// ---- the view that all shapes start from --------------------------------------------------------------------------

const dot3 = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross3 = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit3 = (a) => { const size = Math.hypot(...a) || 1; return a.map((v) => v / size); };

/** Towards the viewer: the longest of x and y runs to the right, z is up, slightly from above. As in picture.rs. */
function defaultDirection(positions) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < positions.length; i++) {
    low[i % 3] = Math.min(low[i % 3], positions[i]);
    high[i % 3] = Math.max(high[i % 3], positions[i]);
  }
  const alongY = high[1] - low[1] > high[0] - low[0];
  return unit3(alongY ? [1, 0.4, 0.5] : [0.4, -1, 0.5]);
}

/** Middle and half sizes, as seen from `direction`, of what all the given shapes cover together. */
function frameOf(keys, direction) {
  const right = unit3(cross3([0, 0, 1], direction)), up = cross3(direction, right);
  const axes = [right, up, direction];
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (const key of keys) {
    const p = positionsOf(key);
    for (let v = 0; v < p.length; v += 3) {
      for (let a = 0; a < 3; a++) {
        const at = axes[a][0] * p[v] + axes[a][1] * p[v + 1] + axes[a][2] * p[v + 2];
        if (at < low[a]) low[a] = at;
        if (at > high[a]) high[a] = at;
      }
    }
  }
  const middle = low.map((l, a) => (l + high[a]) / 2), half = low.map((l, a) => Math.max((high[a] - l) / 2, 1e-9));
  const centre = [0, 1, 2].map((c) => axes.reduce((sum, axis, a) => sum + axis[c] * middle[a], 0));
  return { direction, centre, half };
}

/** The shape of a mode's typical run. */
const originalOf = (mode) => mode.descriptor?.shapes?.original ?? `run:${mode.medoid}`;
const originals = modes.map((mode) => originalOf(mode)).filter(hasShape);
const anyShape = Object.keys(findings.shapes ?? {}).find(hasShape);
// Pictures of the nearest runs share the frame, so they must fit into it.
const nearestShapes = modes.flatMap((mode) => [...(mode.descriptor?.nearest ?? []), ...(mode.descriptor?.nearest_paper ?? [])].map((near) => `run:${near.run}`)).filter(hasShape);
const framed = originals.length ? [...originals, ...nearestShapes] : anyShape ? [anyShape] : [];
const frame = framed.length ? frameOf(framed, defaultDirection(referencePositions ?? positionsOf(framed[0]))) : null;

/** The colours span −range … range: the largest z-displacement of the typical runs, rounded up to a plain number. */
const displacementRange = mesh.range ?? (() => {
  let most = 0;
  if (referencePositions) for (const key of framed) {
    const p = positionsOf(key);
    for (let i = 2; i < p.length; i += 3) most = Math.max(most, Math.abs(p[i] - referencePositions[i]));
  }
  const power = 10 ** Math.floor(Math.log10(most || 1));
  return ([1, 1.5, 2, 3, 4, 5, 6, 8, 10].find((m) => m * power >= most) ?? 10) * power;
})();

// ---- geometry ----------------------------------------------------------------------------------------------------

const CREASE = Math.cos((40 * Math.PI) / 180); // edges sharper than 40° stay sharp

/** Normals of the triangles (with the area as their length), and the triangles around each vertex. */
function facesOf(p) {
  const normals = new Float32Array(triangles.length);
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
    const u = [p[b] - p[a], p[b + 1] - p[a + 1], p[b + 2] - p[a + 2]];
    const v = [p[c] - p[a], p[c + 1] - p[a + 1], p[c + 2] - p[a + 2]];
    normals.set(cross3(u, v), t);
  }
  return normals;
}

/** For each vertex the list of its triangles: `start[v]` … `start[v + 1]` in `list`. The mesh is one for all shapes. */
const around = (() => {
  const start = new Uint32Array((mesh.vertices ?? 0) + 2), list = new Uint32Array(triangles.length);
  for (const v of triangles) start[v + 2]++;
  for (let v = 2; v < start.length; v++) start[v] += start[v - 1];
  triangles.forEach((v, corner) => { list[start[v + 1]++] = corner - (corner % 3); });
  return { start, list };
})();

/** Corner normals: the mean over the triangles around that are tilted by less than the crease. As in picture.rs. */
function cornerNormals(p) {
  const faces = facesOf(p), normals = new Float32Array(3 * triangles.length);
  for (let corner = 0; corner < triangles.length; corner++) {
    const own = corner - (corner % 3), v = triangles[corner];
    const [nx, ny, nz] = [faces[own], faces[own + 1], faces[own + 2]], size = Math.hypot(nx, ny, nz);
    let x = 0, y = 0, z = 0;
    for (let k = around.start[v]; k < around.start[v + 1]; k++) {
      const t = around.list[k], [fx, fy, fz] = [faces[t], faces[t + 1], faces[t + 2]];
      if (nx * fx + ny * fy + nz * fz >= CREASE * size * Math.hypot(fx, fy, fz)) { x += fx; y += fy; z += fz; }
    }
    const length = Math.hypot(x, y, z) || 1;
    normals.set([x / length, y / length, z / length], 3 * corner);
  }
  return normals;
}

/** What the renderer needs of a shape: three corners a triangle, each with place, normal and z-displacement. */
function buildGeometry(key) {
  const p = positionsOf(key), places = new Float32Array(3 * triangles.length), values = new Float32Array(triangles.length);
  triangles.forEach((v, corner) => {
    for (let c = 0; c < 3; c++) places[3 * corner + c] = p[3 * v + c];
    values[corner] = referencePositions ? p[3 * v + 2] - referencePositions[3 * v + 2] : 0;
  });
  const geometry = new vendor.BufferGeometry();
  geometry.setAttribute("position", new vendor.BufferAttribute(places, 3));
  geometry.setAttribute("normal", new vendor.BufferAttribute(cornerNormals(p), 3));
  geometry.setAttribute("value", new vendor.BufferAttribute(values, 1));
  return geometry;
}

const kept = new Map(); // geometries, least recently used first
const KEEP_CORNERS = 6e6; // about 170 MB

function geometryOf(key) {
  const geometry = kept.get(key) ?? buildGeometry(key);
  kept.delete(key);
  kept.set(key, geometry);
  for (const old of kept.keys()) {
    if (kept.size * triangles.length <= KEEP_CORNERS || old === key) break;
    kept.get(old).dispose();
    kept.delete(old);
  }
  return geometry;
}

// ---- the one renderer --------------------------------------------------------------------------------------------

// Light comes from beside the viewer and falls on both sides of a sheet. The same formula stands in picture.rs.
const VERTEX = `
  attribute float value; varying float v; varying vec3 n;
  void main() { v = value; n = normalMatrix * normal; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`;
const FRAGMENT = `
  uniform sampler2D map; uniform float range; varying float v; varying vec3 n;
  void main() {
    float steps = ${DIVERGING.length.toFixed(1)};
    float t = clamp(0.5 + 0.5 * v / range, 0.0, 1.0);
    vec3 colour = texture2D(map, vec2((t * (steps - 1.0) + 0.5) / steps, 0.5)).rgb;
    vec3 m = normalize(n); if (m.z < 0.0) m = -m;
    float light = 0.5 + 0.54 * max(dot(m, normalize(vec3(-0.35, 0.55, 0.76))), 0.0);
    gl_FragColor = vec4(min(colour * light, 1.0), 1.0);
  }`;

const stage = (() => {
  const canvas = document.createElement("canvas");
  // Asked for here, because three.js writes an error to the console where WebGL is missing.
  const context = frame && canvas.getContext("webgl2", { alpha: true, antialias: true, powerPreference: "low-power" });
  if (!context) return null;
  const renderer = new vendor.WebGLRenderer({ canvas, context, alpha: true, antialias: true });
  renderer.setClearColor(0, 0);
  const map = new vendor.DataTexture(Uint8Array.from(DIVERGING.flatMap((c) => [0, 2, 4].map((i) => parseInt(c.slice(i, i + 2), 16)).concat(255))), DIVERGING.length, 1);
  map.minFilter = map.magFilter = vendor.LinearFilter;
  map.needsUpdate = true;
  const material = new vendor.ShaderMaterial({
    vertexShader: VERTEX, fragmentShader: FRAGMENT, side: vendor.DoubleSide, uniforms: { map: { value: map }, range: { value: displacementRange || 1 } },
  });
  const scene = new vendor.Scene(), body = new vendor.Mesh(new vendor.BufferGeometry(), material);
  body.frustumCulled = false;
  scene.add(body);
  let size = [0, 0];
  return {
    /** Draws a shape of `width` × `height` device pixels and copies it into `target`. */
    draw(key, camera, target, width, height) {
      if (width > size[0] || height > size[1]) {
        size = [Math.max(size[0], width), Math.max(size[1], height)];
        renderer.setSize(size[0], size[1], false);
      }
      body.geometry = geometryOf(key);
      renderer.setViewport(0, 0, width, height);
      renderer.render(scene, camera);
      target.clearRect(0, 0, width, height);
      target.drawImage(canvas, 0, size[1] - height, width, height, 0, 0, width, height);
    },
  };
})();
root.dataset.webgl = stage ? "yes" : "no";

// ---- views -------------------------------------------------------------------------------------------------------

const shapeViews = new Set();
let turnAll = true; // turning one shape turns all of them; otherwise only those beside it

/** The embedded picture of a shape: of a typical run, or whatever `findings.pictures` holds. */
const pictureOf = (key) => findings.pictures?.[key] ?? modes.find((mode) => originalOf(mode) === key)?.picture;

/**
 * A shape that can be turned, or its embedded picture where the browser has no WebGL. `group`: the views that turn with
 * it where not all do. Returns an element; `element.show(key)` changes the shape.
 */
function shapeView(key, { group = key, label = "" } = {}) {
  const holder = el("div", { class: "shape" });
  if (!stage) {
    holder.show = (next) => {
      const picture = pictureOf(next);
      holder.replaceChildren(picture ? el("img", { src: picture, alt: label }) : el("p", { class: "none" }, hasShape(next) ? "Not drawn without WebGL." : "This shape is not embedded in the page."));
    };
    holder.show(key);
    return holder;
  }
  const canvas = el("canvas", { tabindex: 0, role: "img", "aria-label": label });
  const note = el("p", { class: "none", hidden: hasShape(key) }, "This shape is not embedded in the page.");
  holder.append(canvas, note);
  const camera = new vendor.OrthographicCamera();
  camera.up.set(0, 0, 1);
  placeCamera(camera);
  const view = { key, group, canvas, holder, camera, pen: canvas.getContext("2d"), dirty: true, controls: turnable(canvas, camera, () => follow(view)) };
  view.controls.target.set(...frame.centre);
  view.controls.update();
  canvas.addEventListener("dblclick", () => { placeCamera(camera); view.controls.target.set(...frame.centre); follow(view); });
  shapeViews.add(view);
  new ResizeObserver(() => redraw(view)).observe(holder);
  holder.show = (next) => {
    view.key = next;
    note.hidden = hasShape(next);
    canvas.hidden = !hasShape(next);
    redraw(view);
  };
  canvas.hidden = !hasShape(key);
  return holder;
}

function placeCamera(camera) {
  const distance = 4 * Math.max(...frame.half);
  camera.position.set(...frame.centre.map((c, i) => c + distance * frame.direction[i]));
  camera.zoom = 1;
  camera.near = 0.01 * distance;
  camera.far = 4 * distance;
  camera.lookAt(...frame.centre);
}

/** Orbit controls that leave the page's own scrolling alone: the wheel zooms only after a click, or with Ctrl. */
function turnable(canvas, camera, moved) {
  canvas.addEventListener("wheel", (event) => { controls.enableZoom = event.ctrlKey || document.activeElement === canvas; }, { capture: true, passive: true });
  const controls = new vendor.OrbitControls(camera, canvas);
  canvas.addEventListener("pointerdown", () => canvas.focus({ preventScroll: true }));
  canvas.style.touchAction = "pan-y";
  controls.listenToKeyEvents(canvas);
  controls.addEventListener("change", moved);
  return controls;
}

/** Others take over the camera of the view that was moved. */
function follow(moved) {
  for (const view of shapeViews) {
    if (view !== moved && !turnAll && view.group !== moved.group) continue;
    if (view !== moved) {
      view.camera.position.copy(moved.camera.position);
      view.camera.quaternion.copy(moved.camera.quaternion);
      view.camera.zoom = moved.camera.zoom;
      view.controls.target.copy(moved.controls.target);
    }
    redraw(view);
  }
}

function resetShapes() {
  for (const view of shapeViews) { placeCamera(view.camera); view.controls.target.set(...frame.centre); redraw(view); }
}

let waiting = false;
function redraw(view) {
  view.dirty = true;
  if (!waiting) { waiting = true; requestAnimationFrame(drawShapes); }
}

/** Draws what changed, what the reader sees first, for at most some milliseconds a frame. */
function drawShapes() {
  waiting = false;
  const until = performance.now() + 24;
  const seen = (view) => { const box = view.holder.getBoundingClientRect(); return box.bottom > 0 && box.top < innerHeight; };
  const dirty = [...shapeViews].filter((view) => view.dirty).map((view) => [seen(view), view]).sort((a, b) => b[0] - a[0]);
  for (const [, view] of dirty) {
    if (performance.now() > until) { waiting = true; requestAnimationFrame(drawShapes); return; }
    drawShape(view);
  }
}

function drawShape(view) {
  view.dirty = false;
  const { clientWidth, clientHeight } = view.holder;
  if (!clientWidth || !clientHeight || !hasShape(view.key)) return;
  const density = Math.min(3, Math.max(2, devicePixelRatio || 1)); // 2 at least, for print
  const [width, height] = [Math.round(clientWidth * density), Math.round(clientHeight * density)];
  if (view.canvas.width !== width || view.canvas.height !== height) Object.assign(view.canvas, { width, height });
  const aspect = width / height, half = 1.04 * Math.max(frame.half[1], frame.half[0] / aspect);
  Object.assign(view.camera, { top: half, bottom: -half, left: -half * aspect, right: half * aspect });
  view.camera.updateProjectionMatrix();
  stage.draw(view.key, view.camera, view.pen, width, height);
}

const shapesDrawn = () => [...shapeViews].every((view) => !view.dirty);

/** The scale of the colours, for the reader. */
function displacementLegend() {
  const end = withUnit(displacementRange);
  return el("div", { class: "scale", role: "img", "aria-label": `Colours: moved in z from −${end} (blue) to +${end} (red)` },
    el("span", {}, `−${end}`), el("i", { style: `background:linear-gradient(90deg,${DIVERGING.map((c) => `#${c}`).join(",")})` }), el("span", {}, `+${end}`),
    el("em", {}, "moved along z"));
}
