// Two-dimensional charts, as SVG: they take their colours from the style sheet, so they follow dark mode and print.

// On paper a chart is drawn for its column, so that its words keep their size: two and three columns of a sheet of A4 or Letter, in CSS pixels.
const PAPER_TWO = 418, PAPER_THREE = 262;

const drawnCharts = new Set(); // charts that stand on the page, for the test hook

/** A chart that is drawn again when its column changes width. `make(width)` returns an SVG; `chosen` gets a datum. */
function chart(label, make, chosen) {
  const holder = el("div", { class: "chart", role: "img", "aria-label": label });
  let drawnAt = 0;
  function draw() {
    const width = printing ? (holder.closest(".two") ? PAPER_TWO : PAPER_THREE) : Math.max(240, holder.clientWidth || 600);
    if (width === drawnAt) return;
    drawnAt = width;
    const svg = make(width);
    if (chosen) svg.addEventListener("click", () => { if (svg.value) chosen(svg.value); });
    holder.replaceChildren(svg);
    drawnCharts.add(holder);
  }
  holder.draw = draw;
  new ResizeObserver(() => { if (holder.clientWidth) draw(); }).observe(holder);
  return holder;
}

/** Bubbles of the charts. */
const TIP = { fill: "var(--card)", stroke: "var(--quiet)", lineHeight: 1.35, textPadding: 9 };

/** What all charts share. */
const chartStyle = (width, height, more) => ({
  width, height, marginLeft: 48, marginRight: 12, marginTop: 30, marginBottom: 36,
  style: { fontFamily: "inherit", fontSize: "12px", overflow: "visible", background: "none" }, ...more,
});

// ---- similarity --------------------------------------------------------------------------------------------------

/** The two kinds of similarity, in the order in which a run has them. */
const KINDS = ["rotation spectrum", "the paper’s coefficients"];

/** Runs from most to least similar to a mode's descriptor, by one kind. */
function ranking(mode, kind) {
  return runs.filter((run) => !missing(run.similarity?.[mode.name]?.[kind]))
    .map((run) => ({ id: run.id, mode: run.mode, value: run.similarity[mode.name][kind] }))
    .sort((a, b) => b.value - a.value || d3.ascending(a.id, b.id))
    .map((row, index) => ({ ...row, rank: index + 1 }));
}

function similarityChart(mode, kind, choose) {
  const rows = ranking(mode, kind), crowd = rows.length > 400 ? 2.2 : rows.length > 150 || (printing && rows.length > 40) ? 3 : 4;
  const medoid = rows.filter((row) => row.id === mode.medoid);
  return chart(`Similarity of all runs to ${modeTitle(mode.name)} by ${KINDS[kind]}`, (width) => Plot.plot(chartStyle(width, Math.min(300, Math.max(210, width * 0.55)), {
    x: { label: "runs, most similar first →", labelAnchor: "right", labelArrow: "none", domain: [0, rows.length + 1], ticks: Math.min(6, width / 80), tickFormat: (v) => (Number.isInteger(v) && v > 0 ? count(v) : "") },
    y: { label: "↑ similarity", labelArrow: "none", nice: true, ticks: 5, tickFormat: (v) => String(+v.toFixed(4)).replace("-", "−") },
    marks: [
      Plot.gridY({ stroke: "var(--line)", strokeOpacity: 1, ticks: 5 }),
      Plot.dot(rows, { x: "rank", y: "value", fill: (row) => modeVariable(row.mode), symbol: (row) => modeSymbol(row.mode), r: crowd, stroke: "var(--card)", strokeWidth: crowd > 3 ? 0.6 : 0 }),
      Plot.dot(medoid, { x: "rank", y: "value", r: crowd + 4, stroke: "var(--ink)", strokeWidth: 1.5 }),
      Plot.tip(rows, Plot.pointer({ ...TIP, x: "rank", y: "value", title: (row) => `${row.id}\n${modeTitle(row.mode)}${row.id === mode.medoid ? ", the typical run itself" : ""}\nsimilarity ${similarity(row.value)}, number ${count(row.rank)}` })),
    ],
  })), (row) => choose(row.id));
}

// ---- spectrum ----------------------------------------------------------------------------------------------------

const DIRECTIONS = [
  { name: "x", colour: "var(--axis-x)", symbol: d3.symbolCircle },
  { name: "y", colour: "var(--axis-y)", symbol: d3.symbolSquare },
  { name: "z", colour: "var(--axis-z)", symbol: d3.symbolTriangle },
];

/** 1, 2, 5, 10, 20, … up to `most`. */
function decades(most) {
  const ticks = [];
  for (let power = 1; power <= most; power *= 10) ticks.push(...[1, 2, 5].map((m) => m * power).filter((t) => t <= most));
  return ticks;
}

function spectrumChart(mode) {
  const { spectrum, threshold, eigenvectors } = mode.descriptor, kept = new Set(eigenvectors ?? []);
  const rows = spectrum.flatMap((triple, k) => triple.map((value, d) => ({ number: k + 1, value, d, kept: kept.has(k + 1) }))).filter((row) => row.value > 0);
  const highest = d3.max(rows, (row) => row.value) ?? 1, low = d3.quantileSorted(rows.map((row) => row.value).sort(d3.ascending), 0.02) ?? highest / 1e4;
  const floor = Math.max(Math.min(low, (threshold || highest) / 10), highest / 1e6);
  const powers = d3.range(Math.ceil(Math.log10(floor)), Math.log10(highest * 1.5)).map((e) => 10 ** e), sizeLabel = `↑ size of coefficient${lengthUnit ? ` (${lengthUnit}²)` : ""}`;
  const paint = { x: "number", y: (row) => Math.max(row.value, floor), fill: (row) => DIRECTIONS[row.d].colour, symbol: (row) => DIRECTIONS[row.d].symbol };
  return chart(`Coefficients of ${modeTitle(mode.name)} with the threshold`, (width) => Plot.plot(chartStyle(width, 270, {
    x: { type: "log", domain: [0.9, spectrum.length * 1.06], axis: null },
    y: { type: "log", domain: [floor, highest * 1.5], axis: null },
    marks: [
      Plot.gridY(powers, { stroke: "var(--line)", strokeOpacity: 1 }),
      Plot.axisY(powers, { text: (v) => number(v), label: sizeLabel, labelArrow: "none" }),
      Plot.axisX(decades(spectrum.length).filter((t, i) => width > 420 || i % 3 === 0), { text: (v) => count(v), label: "eigenvector, long waves to short →", labelAnchor: "right", labelArrow: "none" }),
      Plot.dot(rows.filter((row) => !row.kept), { ...paint, r: 1.9, fillOpacity: 0.35 }),
      Plot.dot(rows.filter((row) => row.kept), { ...paint, r: 4, stroke: "var(--card)", strokeWidth: 0.6 }),
      threshold > 0 ? Plot.ruleY([threshold], { stroke: "var(--ink)", strokeWidth: 1.5, strokeDasharray: "5 3" }) : null,
      threshold > 0 ? Plot.text([threshold], { y: (t) => t, frameAnchor: "right", text: (t) => `threshold ${number(t)}`, dy: -8, fill: "var(--ink)", stroke: "var(--card)", strokeWidth: 4, fontWeight: 600 }) : null,
      Plot.tip(rows, Plot.pointer({ ...TIP, x: "number", y: paint.y, title: (row) => `eigenvector ${row.number}, ${DIRECTIONS[row.d].name}\n${number(row.value)}${row.kept ? "\nkept" : ""}` })),
    ],
  })));
}

function directionLegend() {
  return el("div", { class: "legend" }, DIRECTIONS.map(({ name, colour, symbol }) => {
    const mark = modeMark(null, 12);
    mark.firstChild.setAttribute("d", symbolPath(symbol, 80));
    mark.firstChild.style.fill = colour;
    return el("span", {}, mark, `in ${name}`);
  }), el("span", {}, "large marks: kept"));
}

// ---- how many modes ----------------------------------------------------------------------------------------------

function silhouetteChart() {
  const rows = findings.silhouettes, chosen = rows.filter((row) => row.count === modes.length);
  return chart("How clearly the runs fall apart, by number of modes", (width) => Plot.plot(chartStyle(width, 210, {
    x: { label: "number of modes →", labelAnchor: "right", labelArrow: "none", domain: [d3.min(rows, (r) => r.count) - 0.3, d3.max(rows, (r) => r.count) + 0.3], ticks: rows.map((row) => row.count), tickFormat: (v) => String(v) },
    y: { label: "↑ mean silhouette", labelArrow: "none", domain: [Math.min(0, d3.min(rows, (r) => r.silhouette)), Math.max(0.5, d3.max(rows, (r) => r.silhouette) * 1.15)], ticks: 5, tickFormat: (v) => number(v) },
    marks: [
      Plot.gridY({ stroke: "var(--line)", strokeOpacity: 1, ticks: 5 }),
      Plot.lineY(rows, { x: "count", y: "silhouette", stroke: "var(--muted)", strokeWidth: 1.5 }),
      Plot.dot(rows, { x: "count", y: "silhouette", r: 3.5, fill: "var(--muted)" }),
      Plot.dot(chosen, { x: "count", y: "silhouette", r: 6, fill: "var(--accent)", stroke: "var(--card)" }),
      Plot.text(chosen, { x: "count", y: "silhouette", text: (row) => number(row.silhouette), dy: -14, fontWeight: 600, fill: "var(--ink)" }),
      Plot.tip(rows, Plot.pointerX({ ...TIP, x: "count", y: "silhouette", title: (row) => `${row.count} modes\nsilhouette ${number(row.silhouette)}` })),
    ],
  })));
}
