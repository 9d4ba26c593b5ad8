// Puts the sections on the page, keeps the chosen run, and says when everything is drawn.

const page = document.getElementById("page");
const table = buildTable();
const cloud = {};
const panel = el("aside", { class: "panel", hidden: true, "aria-label": "Chosen run" });
let cameFrom = 0; // where the reader was before a run was chosen

// ---- the chosen run ----------------------------------------------------------------------------------------------

/** Shows a run everywhere: its row, its path in the cloud, its shape. */
function choose(id) {
  const run = runById.get(id);
  if (!run) return;
  if (panel.hidden || !inTable()) cameFrom = scrollY;
  fillPanel(run);
  cloud.select?.(id);
  table.show(id, true);
}

const inTable = () => { const box = table.getBoundingClientRect(); return box.top < innerHeight / 2 && box.bottom > innerHeight / 2; };

function closePanel() {
  panel.hidden = true;
  cloud.select?.(null);
}

function fillPanel(run) {
  const key = `run:${run.id}`;
  panel.hidden = false;
  if (!panel.view) {
    panel.title_ = el("h3", {});
    panel.facts = el("dl", {});
    panel.view = shapeView(key, { group: "panel", label: "Shape of the chosen run" });
    panel.append(panel.title_, panel.view, panel.facts, el("div", { class: "controls" },
      el("button", { type: "button", onclick: () => { scrollTo({ top: cameFrom }); } }, "↩ back to where I was"), el("button", { type: "button", onclick: closePanel }, "close")));
  }
  panel.title_.replaceChildren(modeMark(run.mode, 16), run.id, el("small", {}, modeTitle(run.mode)));
  panel.view.show(key);
  panel.facts.replaceChildren(...runFacts(run));
}

document.addEventListener("click", (event) => {
  const link = event.target.closest?.("[data-run]");
  if (link) choose(link.dataset.run);
});
document.addEventListener("keydown", (event) => { if (event.key === "Escape" && !panel.hidden) closePanel(); });

// ---- the page ----------------------------------------------------------------------------------------------------

function showMode(name) {
  table.filterMode(name);
  document.getElementById("runs").scrollIntoView();
}

const later = []; // what can only be built once its place on the page is known
page.replaceChildren(...[
  headSection(),
  modesSection(showMode),
  cloudSection((build) => later.push(() => build(cloud)), choose),
  similaritySection(choose),
  rebuildSection(),
  trustSection(),
  section("runs", "All runs", "Click a column to sort by it; point at its title for what it means.", table),
  footSection(),
].filter(Boolean), panel);
later.forEach((build) => build());
document.querySelectorAll(".chart").forEach((holder) => holder.draw());

// ---- paper and dark ----------------------------------------------------------------------------------------------

/** Canvases hold colours of their own; on paper they are light, and the table shows all its rows. */
function paper(on) {
  if (printing === on) return;
  printing = on;
  root.classList.toggle("paper", on);
  cloud.restyle?.();
  table.paper(on);
  document.querySelectorAll(".chart").forEach((holder) => holder.draw());
  for (const details of document.querySelectorAll("details.warnings")) if (on) details.open = true;
  if (on && stage) for (const view of shapeViews) if (view.dirty) drawShape(view);
}
addEventListener("beforeprint", () => paper(true));
addEventListener("afterprint", () => paper(false));
matchMedia("print").addEventListener("change", (event) => paper(event.matches));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => cloud.restyle?.());

// ---- ready -------------------------------------------------------------------------------------------------------

/** Tests wait for this: every chart and every shape stands. */
function ready() {
  if (!shapesDrawn()) return void setTimeout(ready, 30);
  const shapes = [...shapeViews].filter((view) => hasShape(view.key) && view.canvas.width > 0).length;
  root.dataset.charts = drawnCharts.size;
  root.dataset.shapes = shapes;
  root.dataset.ready = "yes";
}
setTimeout(ready, 0);
