// The table of runs: sorted by any column, searched, shown a page at a time, so that thousands of runs stay quick.

const PAGE_ROWS = 50;
const PAPER_WIDTH = 912; // CSS pixels between the margins of a sheet
const PRINT_ROWS = 1000; // on paper all rows are shown, up to this many

/** The columns: title, hint, sort value, and what a cell shows. A column that no run fills is left out. */
function tableColumns() {
  const numeric = (title, hint, value, show) => ({ title, hint, value, show, numeric: true });
  const plain = (title, hint, value) => numeric(title, hint, value, columnFormat(runs.map(value)));
  const shares = (title, hint, value, decimals) => numeric(title, hint, value, (v) => shareText(v, decimals));
  const columns = [
    { title: "run", value: (run) => run.id, show: (run) => runLink(run.id), fixed: true },
    { title: "mode", value: (run) => run.mode, fixed: true, show: (run) => [modeMark(run.mode, 12), ` ${modeTitle(run.mode)}`, run.outlier ? el("span", { class: "flag", title: "Unlike the rest of its mode" }, "outlier") : null] },
    ...KINDS.flatMap((name, kind) => modes.map((mode) => numeric([kind ? "paper: like " : "like ", modeTitle(mode.name)].join(""), `Similarity to the typical run of ${modeTitle(mode.name)} by ${name}; 1 is the same`, (run) => run.similarity?.[mode.name]?.[kind], similarity))),
    plain("from typical run", "Distance to the typical run of its mode, over all coefficients", (run) => run.distance_to_medoid),
    numeric("silhouette", "1: surely in its mode; 0: between two modes; below 0: nearer to another mode", (run) => run.silhouette, columnFormat([0.99])),
    plain(`largest displacement${lengthUnit ? ` (${lengthUnit})` : ""}`, "The way of the vertex that moved furthest", (run) => run.max_displacement),
    shares("rigid share", "Share of the displacement that moves the part as a whole", (run) => run.rigid_share, 1),
    shares("captured", "Share of the displacement that the eigenvectors can express", (run) => run.captured, 2),
    shares("stretch", "How much the edges of the mesh change length", (run) => run.strain, 1),
    ...inputs.map((name, c) => (inputIsNumeric(c)
      ? numeric(inputTitle(name), "From the input table", (run) => { const v = asNumber(run.inputs?.[c]); return Number.isNaN(v) ? null : v; }, (v, run) => (missing(v) ? "–" : run.inputs[c].replace("-", "−")))
      : { title: inputTitle(name), hint: "From the input table", value: (run) => run.inputs?.[c] || null, show: (run) => (run.inputs?.[c] ? breakable(run.inputs[c]) : "–"), words: true })),
    { title: "notes", value: (run) => run.warnings?.join("; ") || null, show: (run) => el("span", { title: run.warnings?.join("; ") || null }, run.warnings?.join("; ") || ""), words: true },
  ];
  return columns.filter((column) => column.fixed || runs.some((run) => !missing(column.value(run))));
}

/** Per cent with fixed decimals; what is short of 100 % is not rounded up to it. */
function shareText(share, decimals) {
  if (missing(share)) return "–";
  const text = (100 * share).toFixed(decimals);
  return `${Number(text) === 100 && share < 1 ? (100 - 10 ** -decimals).toFixed(decimals) : text}\u00a0%`;
}

/** Lists in one word, "a@1-2;b@3-4", break between their items only. */
const breakable = (text) => String(text).split(/(?<=[;,|])/).flatMap((piece) => [el("span", { class: "item" }, piece), el("wbr")]);

/** Builds the table; returns its element with `show(id)`, `filterMode(name)` and `paper(on)`. */
function buildTable() {
  const columns = tableColumns();
  const state = { sort: 0, down: false, page: 0, words: "", mode: "", chosen: null, paper: false };
  const searchable = new Map(runs.map((run) => [run, [run.id, modeTitle(run.mode), run.outlier ? "outlier" : "", ...(run.inputs ?? []), ...(run.warnings ?? [])].join(" ").toLowerCase()]));
  const body = el("tbody"), heads = columns.map(headCell), status = el("span", { class: "status", "aria-live": "polite" });
  const search = el("input", { type: "search", placeholder: "Find a run, a mode or an input", "aria-label": "Find runs", oninput: () => { state.words = search.value.toLowerCase(); state.page = 0; fill(); } });
  const modeChoice = modes.length > 1 ? choice("Mode", [["", "all"], ...modes.map((mode) => [mode.name, modeTitle(mode.name)])], "", (value) => { state.mode = value; state.page = 0; fill(); }) : null;
  const back = el("button", { type: "button", onclick: () => turn(-1) }, "← previous"), next = el("button", { type: "button", onclick: () => turn(1) }, "next →");
  const pager = el("div", { class: "pager" }, back, next);
  const table = el("table", { class: "runs" }, el("thead", {}, el("tr", {}, heads)), body);
  const element = el("div", {}, el("div", { class: "controls" }, search, modeChoice, status, pager), el("div", { class: "scroll", tabindex: 0 }, table));
  let rows = [];

  function headCell(column, c) {
    return el("th", { scope: "col", class: column.numeric ? "number" : null, title: column.hint, "data-title": column.title }, el("button", { type: "button", onclick: () => {
      // numbers are first sorted from large to small, words from a to z
      state.down = state.sort === c ? !state.down : Boolean(column.numeric);
      Object.assign(state, { sort: c, page: 0 });
      fill();
    } }, column.title));
  }

  /** Rows that pass the filter, in order; empty cells last, ties by run. */
  function sorted() {
    const { value } = columns[state.sort], sign = state.down ? -1 : 1;
    return runs.filter((run) => (!state.mode || run.mode === state.mode) && (!state.words || searchable.get(run).includes(state.words)))
      .map((run) => [run, value(run)])
      .sort(([a, va], [b, vb]) => missing(va) - missing(vb) || (missing(va) ? 0 : sign * compare(va, vb)) || compare(a.id, b.id))
      .map(([run]) => run);
  }

  const compare = (a, b) => (typeof a === "string" && typeof b === "string" ? a.localeCompare(b, "en", { numeric: true }) : d3.ascending(a, b));

  function fill() {
    rows = sorted();
    const pages = Math.max(1, Math.ceil(rows.length / PAGE_ROWS));
    state.page = Math.min(state.page, pages - 1);
    const from = state.paper ? 0 : state.page * PAGE_ROWS, shown = rows.slice(from, state.paper ? PRINT_ROWS : from + PAGE_ROWS);
    body.replaceChildren(...shown.map(row));
    heads.forEach((head, c) => (c === state.sort ? head.setAttribute("aria-sort", state.down ? "descending" : "ascending") : head.removeAttribute("aria-sort")));
    status.textContent = rows.length === 0 ? "No run matches." : shown.length === runs.length ? `${plural(runs.length, "run")}` : `${count(from + 1)}–${count(from + shown.length)} of ${plural(rows.length, "run")}`;
    pager.hidden = pages === 1;
    back.disabled = state.page === 0;
    next.disabled = state.page === pages - 1;
  }

  function row(run) {
    return el("tr", { "data-row": run.id, class: run.id === state.chosen ? "chosen" : null },
      columns.map((column) => el("td", { class: column.numeric ? "number" : column.words ? "words" : null }, column.numeric ? column.show(column.value(run), run) : column.show(run))));
  }

  function turn(by) { state.page += by; fill(); element.scrollIntoView({ block: "start" }); }

  element.filterMode = (name) => { if (modeChoice) modeChoice.querySelector("select").value = name; Object.assign(state, { mode: name, page: 0 }); fill(); };
  element.paper = (on) => {
    state.paper = on;
    fill();
    // Browsers shrink the whole page to its widest piece; the table shrinks alone instead.
    table.style.zoom = "";
    table.style.width = on ? "min-content" : "";
    if (on) table.style.zoom = Math.min(1, PAPER_WIDTH / table.offsetWidth).toFixed(3);
    table.style.width = "";
  };
  element.show = (id, scroll) => {
    state.chosen = id;
    if (!rows.includes(runById.get(id))) { search.value = state.words = ""; element.filterMode(""); }
    state.page = Math.max(0, Math.floor(rows.indexOf(runById.get(id)) / PAGE_ROWS));
    fill();
    const line = body.querySelector("tr.chosen");
    if (line && scroll) line.scrollIntoView({ block: "center", behavior: matchMedia("(prefers-reduced-motion: reduce)").matches ? "auto" : "smooth" });
  };
  fill();
  return element;
}
