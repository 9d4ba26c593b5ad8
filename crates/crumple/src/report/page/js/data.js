// First of the page's scripts. They are concatenated in this order and share one scope:
//   data.js      the findings, numbers in words, elements, colours
//   shapes.js    shapes of the part in three dimensions
//   cloud.js     the cloud of coefficients
//   charts.js    two-dimensional charts
//   table.js     the table of runs
//   sections.js  the sections of the page, in reading order
//   main.js      puts them on the page, selection, readiness
"use strict";

const findings = JSON.parse(document.getElementById("findings").textContent);
const Plot = vendor, d3 = vendor; // one bundle holds Observable Plot, D3 and three.js
const root = document.documentElement;
const study = findings.study ?? {};
const runs = findings.runs ?? [];
const modes = findings.modes ?? [];
const inputs = findings.inputs ?? [];
const lengthUnit = study.length_unit ?? "";
const timeUnit = study.time_unit ?? "";
const runById = new Map(runs.map((run) => [run.id, run]));
let printing = false; // true while the page is laid out for paper, which is always light
const modeByName = new Map(modes.map((mode, index) => [mode.name, { ...mode, index }]));

// ---- numbers and words -------------------------------------------------------------------------------------------

const missing = (value) => value === null || value === undefined || Number.isNaN(value);

/** A number with `digits` significant digits, thousands apart, a real minus sign; "–" where there is none. */
function number(value, digits = 3) {
  if (missing(value) || !Number.isFinite(Number(value))) return "–";
  value = Number(value);
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e7)) return scientific(value, digits);
  const decimals = size === 0 ? 0 : Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
  return value.toLocaleString("en", { maximumFractionDigits: decimals }).replace("-", "−").replace(/,/g, "\u202f");
}

/** 1.2 × 10⁻¹² */
function scientific(value, digits) {
  const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
  const raised = [...String(Number(exponent))].map((c) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[c] ?? "⁻").join("");
  return `${Number(mantissa)} × 10${raised}`.replace(/-/g, "−");
}

const count = (value) => Number(value).toLocaleString("en").replace(/,/g, "\u202f");
const percent = (share, digits = 3) => (missing(share) ? "–" : `${number(100 * share, digits)}\u00a0%`);
const plural = (n, one, many = `${one}s`) => `${count(n)} ${n === 1 ? one : many}`;
const withUnit = (value, unit = lengthUnit, digits = 3) => (missing(value) ? "–" : `${number(value, digits)}\u00a0${unit}`.trim());

/** Similarities crowd near 1: three decimals, and as many more as it takes not to round up to 1. */
function similarity(value) {
  if (missing(value)) return "–";
  let decimals = 3;
  while (decimals < 6 && value < 1 - 1e-6 && Number(value.toFixed(decimals)) === 1) decimals++;
  return value.toFixed(decimals).replace("-", "−");
}

/** One format for a column of numbers, so that their points stand below each other: three digits of the largest. */
function columnFormat(values, digits = 3) {
  const sizes = values.filter((value) => !missing(value) && Number.isFinite(value)).map(Math.abs), most = Math.max(...sizes, 0);
  if (most === 0 || most >= 1e7 || most < 1e-3) return (value) => number(value, digits);
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(most)));
  const fixed = { minimumFractionDigits: decimals, maximumFractionDigits: decimals };
  return (value) => (missing(value) ? "–" : value.toLocaleString("en", fixed).replace("-", "−").replace(/,/g, "\u202f"));
}

/** "mode-1" is said as "Mode 1", with a space that does not break; a name that a person gave stays. */
const modeTitle = (name) => (name ? name.replace(/^mode-(\d+)$/, "Mode\u00a0$1") : "no mode");

/** An input is a number when its text is one. */
const asNumber = (text) => (missing(text) || String(text).trim() === "" ? NaN : Number(text));
const inputIsNumeric = (column) => {
  const texts = runs.map((run) => run.inputs?.[column]).filter((text) => !missing(text) && String(text).trim() !== "");
  return texts.length > 0 && texts.every((text) => Number.isFinite(Number(text)));
};
/** "thickness_mm" is said as "thickness (mm)"; a table's own words stay otherwise. */
const unitWords = { mm_per_ms: "mm/ms", mm: "mm", ms: "ms", kg: "kg", kN: "kN", GPa: "GPa", MPa: "MPa", deg: "°" };
function inputTitle(name) {
  const unit = Object.keys(unitWords).find((unit) => name.endsWith(`_${unit}`));
  return (unit ? `${name.slice(0, -unit.length - 1)} (${unitWords[unit]})` : name).replace(/_/g, " ");
}

// ---- elements ----------------------------------------------------------------------------------------------------

/** An element with attributes and children. Text goes in as text, so a run may be called anything. */
function el(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && !missing(value)) element.setAttribute(name, value);
  }
  element.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

/** A button that leads to a run. */
const runLink = (id, ...more) => el("button", { class: "run", type: "button", "data-run": id, title: `Show ${id}` }, id, ...more);

/** A labelled choice; `options` are [value, text] pairs. */
function choice(label, options, selected, changed) {
  const select = el("select", { onchange: () => changed(select.value) },
    options.map(([value, text]) => el("option", { value, selected: value === selected }, text)));
  return el("label", { class: "choice" }, `${label} `, select);
}

/** A labelled box to tick. */
function tick(label, checked, changed) {
  const box = el("input", { type: "checkbox", checked, onchange: () => changed(box.checked) });
  return el("label", { class: "choice" }, box, ` ${label}`);
}

// ---- colours -----------------------------------------------------------------------------------------------------

// z-displacement: the diverging map of Moreland 2009, made for shaded surfaces (its ends stay light enough to show
// relief). Seventeen steps, straight lines between. The same table stands in ../../picture.rs; a test there compares.
const DIVERGING = [
  "3b4cc0", "4e68d7", "6282ea", "779af7", "8db0fe", "a3c2ff", "b8d0f9", "ccd9ee", "dddddd",
  "ecd3c6", "f5c4ad", "f7b194", "f49a7b", "ec7f63", "de614c", "cb3e38", "b40426",
];

// Modes differ in colour and in symbol, so that eight of them stay apart in print and for the colour-blind.
const MODE_COLOURS = 8;
const MODE_SYMBOLS = [
  d3.symbolCircle, d3.symbolSquare, d3.symbolTriangle, d3.symbolDiamond, d3.symbolCross, d3.symbolWye, d3.symbolStar,
];
const colourIndex = (name) => { const mode = modeByName.get(name); return mode ? mode.color ?? mode.index : null; };
const modeVariable = (name) => { const i = colourIndex(name); return i === null ? "var(--quiet)" : `var(--mode-${i % MODE_COLOURS})`; };
const modeSymbol = (name) => { const i = colourIndex(name); return i === null ? d3.symbolCircle : MODE_SYMBOLS[i % MODE_SYMBOLS.length]; };

/** The value of a style variable, for canvases, which cannot use `var()`. */
const styleValue = (name) => getComputedStyle(root).getPropertyValue(name).trim();
const modeColour = (name) => styleValue(modeVariable(name).slice(4, -1));

/** Path of a symbol of the given area around the origin, as text of an SVG path. */
function symbolPath(symbol, area) {
  const path = [];
  const put = (letter) => (...values) => { path.push(letter + values.map((v) => +v.toFixed(2)).join(",")); };
  const pen = { moveTo: put("M"), lineTo: put("L"), closePath: () => path.push("Z"),
    rect: (x, y, w, h) => path.push(`M${x},${y}h${w}v${h}h${-w}Z`),
    arc: (x, y, r) => path.push(`M${x + r},${y}A${r},${r} 0 1 1 ${x - r},${y}A${r},${r} 0 1 1 ${x + r},${y}Z`) };
  symbol.draw(pen, area);
  return path.join("");
}

/** The mark of a mode: its symbol in its colour. */
function modeMark(name, size = 14) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  for (const [key, value] of Object.entries({ class: "mark", width: size, height: size, viewBox: "-7 -7 14 14", "aria-hidden": "true" })) svg.setAttribute(key, value);
  path.setAttribute("d", symbolPath(modeSymbol(name), 80));
  path.style.fill = modeVariable(name);
  svg.append(path);
  return svg;
}
