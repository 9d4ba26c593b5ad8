// The sections of the page, in reading order. Each takes what it needs and returns an element.

const section = (id, title, words, ...content) => el("section", { id }, el("h2", {}, title), words ? el("p", { class: "lead" }, words) : null, content);

const MEMBERS_SHOWN = 60; // of a mode; the table has them all
const NEAREST_SHOWN = 9;

// ---- the first screen: which modes, who belongs to them, who is like them --------------------------------------------

function headSection() {
  const n = modes.length;
  const states = study.states && runs.length && study.states > runs.length ? `, ${plural(study.states, "state")} in all` : "";
  const facts = [
    plural(runs.length, "simulation") + states,
    study.parts?.length ? `${study.parts.length === 1 ? "part" : "parts"} ${study.parts.join(", ")}` : null,
    study.vertices ? `${plural(study.vertices, "vertex", "vertices")}` : null,
  ].filter(Boolean);
  const sentence = n === 0 ? `${plural(runs.length, "run")}, not yet sorted into modes`
    : n === 1 ? `${plural(runs.length, "run")}, one way of deforming` : `${plural(runs.length, "run")} that deform in ${n <= 12 ? ["two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve"][n - 2] : n} ways`;
  return el("header", {}, el("p", { class: "study" }, findings.title), el("h1", {}, sentence), el("p", { class: "facts" }, facts.join(" · ")), warningsNote());
}

function warningsNote() {
  const warnings = findings.warnings ?? [];
  if (!warnings.length) return null;
  return el("details", { class: "warnings", open: warnings.length === 1 }, el("summary", {}, `${plural(warnings.length, "note")} on the data`), el("ul", {}, warnings.map((warning) => el("li", {}, warning))));
}

function modesSection(showMode) {
  if (!modes.length) return null;
  const controls = stage ? el("div", { class: "controls" }, displacementLegend(), tick("turn all shapes together", turnAll, (on) => { turnAll = on; }), el("button", { type: "button", onclick: resetShapes }, "reset view")) : el("div", { class: "controls" }, displacementLegend());
  return el("section", { id: "modes" },
    el("p", { class: "lead" }, (findings.alike_by === "rotation" ? "Runs that bend, fold and turn in the same way form a mode, wherever on the part they do it." : "Runs that end in a similar shape form a mode.") + " The picture is each mode’s most typical run" + (stage ? "; drag to turn it, click and scroll to zoom." : frame ? "; this browser has no WebGL, so it cannot be turned." : ".")),
    controls, el("div", { class: "cards" }, modes.map((mode) => modeCard(mode, showMode))));
}

function modeCard(mode, showMode) {
  const original = originalOf(mode);
  const nearest = (mode.descriptor?.nearest ?? []).slice(0, NEAREST_SHOWN), members = mode.members ?? [];
  return el("article", { class: "card", style: `--mode:${modeVariable(mode.name)}` },
    el("h3", {}, modeMark(mode.name, 16), modeTitle(mode.name), el("small", {}, `${count(members.length)} of ${plural(runs.length, "run")}`)),
    shapeView(original, { group: "cards", label: `${mode.medoid}, the typical run of ${modeTitle(mode.name)}` }),
    el("p", { class: "caption" }, "Typical run: ", runLink(mode.medoid)),
    mode.words ? el("p", { class: "words" }, mode.words) : null,
    nearest.length ? [el("h4", { title: "By the rotation spectrum of the typical run. A mark shows a run that belongs to another mode." }, "Most like it"), el("ol", { class: "nearest" }, nearest.map((near) => el("li", {}, runLink(near.run, " "), runById.get(near.run)?.mode && runById.get(near.run).mode !== mode.name ? modeMark(runById.get(near.run).mode, 11) : null, el("span", {}, similarity(near.similarity)))))] : null,
    el("h4", {}, members.length <= MEMBERS_SHOWN ? "All its runs" : `Its first ${MEMBERS_SHOWN} runs`),
    el("ul", { class: "members" }, members.slice(0, MEMBERS_SHOWN).map((id) => el("li", {}, runLink(id)))),
    members.length > MEMBERS_SHOWN ? el("button", { class: "more", type: "button", onclick: () => showMode(mode.name) }, `All ${count(members.length)} in the table`) : null);
}

// ---- the cloud -------------------------------------------------------------------------------------------------------

function cloudSection(keep, choose) {
  if (!runs.some((run) => run.cloud?.length)) return null;
  const which = findings.cloud?.eigenvector ? `eigenvector ${findings.cloud.eigenvector}${findings.cloud.label ? ` (${findings.cloud.label})` : ""}` : "one eigenvector";
  const holder = el("div", { class: "cloud" }), controls = el("div", { class: "controls" }), legend = el("div", { class: "under" }), beside = cloudSide();
  keep((api) => { Object.assign(api, buildCloud(holder, controls, legend, choose, beside.show)); drawnCharts.add(holder); });
  return section("cloud", "How the runs part ways", `One point for each state of each run, the last one larger. Its place is how much of the part’s longest wave, ${which}, stands in the shape along x, y and z; runs that deform alike stay together. Point at it for the run, click for its row.`,
    controls, el("div", { class: "beside" }, el("div", {}, holder, legend), beside));
}

/** Beside the cloud: the run under the pointer, its shape and what is known of it. */
function cloudSide() {
  const title = el("h3"), facts = el("dl"), first = runById.get(modes[0]?.medoid) ?? runs[0];
  const view = shapeView(`run:${first.id}`, { group: "panel", label: "Shape of the run under the pointer" });
  const side = el("div", { class: "card side" }, title, view, facts);
  side.show = (run) => {
    title.replaceChildren(modeMark(run.mode, 16), runLink(run.id), el("small", {}, modeTitle(run.mode)));
    view.show(`run:${run.id}`);
    facts.replaceChildren(...runFacts(run));
  };
  side.show(first);
  return side;
}

/** What is known of a run, as terms and values. */
function runFacts(run) {
  return [
    ...modes.map((mode) => [`like ${modeTitle(mode.name)}`, run.similarity?.[mode.name]?.[0], similarity]),
    ["largest displacement", run.max_displacement, (v) => withUnit(v)],
    ["states", run.times?.length ? run.times : null, (times) => `${count(run.states ?? times.length)}, to ${withUnit(times.at(-1), timeUnit)}`],
    ...inputs.map((name, c) => [inputTitle(name), run.inputs?.[c] || null, (v) => breakable(v)]),
    ["notes", run.warnings?.length ? run.warnings.join("; ") : null, (v) => v],
  ].filter(([, value]) => !missing(value)).flatMap(([name, value, show]) => [el("dt", {}, name), el("dd", {}, show(value))]);
}

// ---- similarity ------------------------------------------------------------------------------------------------------

function similaritySection(choose) {
  const ranked = modes.filter((mode) => runs.some((run) => !missing(run.similarity?.[mode.name])));
  if (!ranked.length) return null;
  return section("similarity", "How alike each run is", "One mark for each run, from most to least like the typical run (ringed). The colour is the mode the run belongs to, so a clean front of one colour means that the typical run finds its own kind.",
    el("div", { class: "legend" }, modes.map((mode) => el("span", {}, modeMark(mode.name, 12), modeTitle(mode.name)))),
    el("p", {}, "The rotation spectrum compares how the surface has turned, at which wavelengths and which way as a whole; a fold counts as the same fold wherever on the part it happens. The paper’s coefficients compare where every place of the part has gone, so the same fold elsewhere looks different."),
    KINDS.map((name, kind) => [el("h3", {}, `By ${name}`),
      el("div", { class: "columns" }, ranked.map((mode) => el("figure", {}, el("figcaption", {}, modeMark(mode.name), `Like ${modeTitle(mode.name)}`), similarityChart(mode, kind, choose), nearestPictures(mode, kind))))]));
}

/** The most similar runs as small shapes. */
function nearestPictures(mode, kind) {
  const near = ((kind === 0 ? mode.descriptor?.nearest : mode.descriptor?.nearest_paper) ?? []).slice(0, NEAREST_SHOWN).filter(({ run }) => hasShape(`run:${run}`));
  if (!stage || !near.length) return null;
  return el("div", { class: "thumbnails" }, near.map(({ run, similarity: value }) => el("div", {}, shapeView(`run:${run}`, { group: `near ${mode.name} ${kind}`, label: run }), el("p", {}, runLink(run), ` ${similarity(value)}`))));
}

// ---- reconstructions and spectrum ------------------------------------------------------------------------------------

function rebuildSection() {
  const described = modes.filter((mode) => mode.descriptor);
  if (!described.length) return null;
  return section("rebuild", "How few numbers describe a mode", "The part’s surface has its own wave patterns, from long to short: its eigenvectors. Every shape is a sum of them, each taken with a coefficient in x, y and z. The descriptor of a mode keeps the eigenvectors with the largest coefficients of its typical run; below, shapes rebuilt from them stand beside the original.",
    displacementLegend(), described.map(rebuildBlock));
}

function rebuildBlock(mode) {
  const { descriptor } = mode, shapes = descriptor.shapes ?? {}, size = descriptor.size ?? descriptor.eigenvectors?.length;
  const rival = (pattern) => (descriptor.rivals ?? []).find(({ method }) => pattern.test(method));
  const first = rival(new RegExp(`^first ${size}\\b`)), all = rival(new RegExp(`^first (?!${size}\\b)`));
  const views = [
    ["original", "As simulated", mode.medoid, null],
    ["first_k", `First ${count(all?.size ?? study.eigenpairs ?? 0)} eigenvectors`, null, all],
    ["descriptor", `Descriptor: ${plural(size, "eigenvector")}`, null, descriptor.errors],
    ["first_m", `First ${plural(size, "eigenvector")}`, null, first],
  ].filter(([which]) => shapes[which]);
  return el("div", { class: "rebuild", style: `--mode:${modeVariable(mode.name)}` },
    el("h3", {}, modeMark(mode.name, 16), modeTitle(mode.name), el("small", {}, `${plural(descriptor.numbers ?? 3 * size, "number")} instead of ${count(3 * (study.vertices ?? mesh.vertices ?? 0))}`)),
    el("div", { class: "shapes" }, views.map(([which, title, run, errors]) => el("figure", {}, shapeView(shapes[which], { group: `rebuild ${mode.name}`, label: `${modeTitle(mode.name)}: ${title}` }),
      el("figcaption", {}, el("b", {}, title), errors ? `off by ${withUnit(errors.rms)} on average` : run ? runLink(run) : "")))),
    el("div", { class: "columns two" }, spectrumFigure(mode), rivalsFigure(mode, size)));
}

function spectrumFigure(mode) {
  const { descriptor } = mode;
  if (!descriptor.spectrum?.length) return null;
  const of = descriptor.select === "difference" ? "the displacement" : "the shape";
  return el("figure", {}, el("figcaption", {}, "Coefficients and threshold"), spectrumChart(mode), directionLegend(),
    el("p", { class: "caption" }, `How much of each eigenvector ${of} contains. An eigenvector is kept when one of its three marks reaches the threshold${descriptor.rule ? ` (${descriptor.rule})` : ""}.`),
    descriptor.eigenvectors?.length ? el("p", { class: "caption" }, `Kept: ${shorten(descriptor.eigenvectors)}.`) : null);
}

/** "1–4, 7, 9": neighbours are joined; a very long list is cut. */
function shorten(numbers) {
  const pieces = [];
  for (let i = 0; i < numbers.length;) {
    let j = i;
    while (numbers[j + 1] === numbers[j] + 1) j++;
    pieces.push(j > i + 1 ? `${numbers[i]}–${numbers[j]}` : numbers.slice(i, j + 1).join(", "));
    i = j + 1;
  }
  return pieces.length > 40 ? `${pieces.slice(0, 40).join(", ")} … (${count(numbers.length)} in all)` : pieces.join(", ");
}

function rivalsFigure(mode, size) {
  const { descriptor } = mode;
  const rows = [descriptor.errors && { method: "descriptor", size, own: true, ...descriptor.errors }, ...(descriptor.rivals ?? [])].filter(Boolean);
  if (!rows.length) return null;
  const average = columnFormat(rows.map((row) => row.rms)), largest = columnFormat(rows.map((row) => row.max));
  const words = (method) => method.replace(/^first (\d+)$/, (_, n) => `first ${count(n)} eigenvectors`);
  return el("figure", {}, el("figcaption", {}, "How far rebuilt shapes are off"),
    el("div", { class: "scroll" }, el("table", { class: "plain" }, el("thead", {}, el("tr", {}, ["rebuilt from", "numbers", `average (${lengthUnit})`, `largest (${lengthUnit})`, "of the displacement"].map((title, c) => el("th", { scope: "col", class: c ? "number" : null }, title)))),
      el("tbody", {}, rows.map((row) => el("tr", { class: row.own ? "own" : null }, el("td", {}, words(row.method)), [missing(row.size) ? "–" : count(row.method === "PCA" ? row.size : 3 * row.size), average(row.rms), largest(row.max), missing(row.relative) ? "–" : `${(100 * row.relative).toFixed(1)}\u00a0%`].map((text, c) => el("td", { class: "number" }, c === 1 ? bar(row.rms, d3.max(rows, (r) => r.rms)) : null, el("span", {}, text)))))))),
    el("p", { class: "caption" }, "Average is the root mean square distance over the surface; the last column sets it against the root mean square displacement of the run. Principal components (PCA) are learnt from these very runs, eigenvectors from the undeformed part alone."));
}

const bar = (value, most) => (missing(value) || !most ? null : el("i", { class: "bar", style: `--share:${(100 * value / most).toFixed(1)}%` }));

// ---- how sure, and how it was made -----------------------------------------------------------------------------------

function countSection() {
  const rows = findings.silhouettes ?? [];
  if (rows.length < 2) return null;
  const by = findings.count_chosen_by === "given" ? `The number of modes, ${modes.length}, was given.` : d3.max(rows, (row) => row.silhouette) === rows.find((row) => row.count === modes.length)?.silhouette ? `The highest point chose ${plural(modes.length, "mode")}.` : `${plural(modes.length, "mode")} were chosen.`;
  return el("figure", { class: "card" }, el("h3", {}, "How many modes?"), silhouetteChart(), el("p", { class: "caption" }, `The silhouette says how much closer a run is to its own mode than to the next one: 1 is well apart, 0 is no border at all. ${by}`));
}

function studyFacts() {
  const rows = [
    ["Reference", study.reference && runById.has(study.reference) ? runLink(study.reference) : study.reference],
    ["Mesh", study.vertices && `${plural(study.vertices, "vertex", "vertices")}, ${plural(study.triangles ?? 0, "triangle")}${missing(study.area) ? "" : `, area ${withUnit(study.area, lengthUnit && `${lengthUnit}²`, 6)}`}`],
    ["Separate pieces", missing(study.components) ? null : `${study.components}${study.joined ? `; vertices of different pieces up to ${withUnit(study.joined)} apart were joined` : study.joined_by_deck ? `; ${study.joined_by_deck}` : study.components > 1 ? ", not joined" : ""}`],
    ["Joining", study.join_advice],
    ["Operator", study.operator && `${study.operator}, ${study.mass} mass`],
    ["Eigenvectors", study.eigenpairs && `${count(study.eigenpairs)}${study.complete === true ? ", certified: none is missing" : study.complete === false ? "; some may be missing" : ""}`],
    ["Accuracy", missing(study.residual) ? null : `largest residual ${number(study.residual, 2)} as stored, in single precision${missing(study.orthogonality) ? "" : `, orthogonal within ${number(study.orthogonality, 2)}`}`],
    ["Captured", missing(study.captured_min) ? null : `at least ${shareText(study.captured_min, 2)} of the displacement of each run`],
    ["Surface", study.isometry],
  ].filter(([, value]) => value);
  return el("div", { class: "card" }, el("h3", {}, "How far to trust it"), el("dl", {}, rows.map(([name, value]) => [el("dt", {}, name), el("dd", {}, value)])));
}

const trustSection = () => el("section", { id: "study", class: "columns two" }, countSection(), studyFacts());

function footSection() {
  const how = el("details", {}, el("summary", {}, "Licences of the software in this page"), el("p", {}, "Charts by Observable Plot and D3 (ISC), shapes by three.js (MIT). Their full licence texts stand at the head of the library script in the source of this page."));
  return el("footer", {}, el("p", {}, `Made by crumple ${findings.version ?? ""} with the method of Sible, Iza-Teran, Garcke, Aulig and Wollstadt, `, el("i", {}, "A Compact Spectral Descriptor for Shape Deformations"), "."), how);
}
