// Table of the runs of a study.

import { el } from "./dom.js";
import { plain } from "./format.js";

const UNITS = [["_m_per_s", "m/s"], ["_deg", "deg"], ["_m", "m"], ["_s", "s"]];

/** Heading of a column: words, and the unit that ends its name in brackets. */
function heading(name) {
  const [end, unit] = UNITS.find(([end]) => name.endsWith(end)) ?? ["", ""];
  const words = name.slice(0, name.length - end.length).replaceAll("_", " ");
  return unit ? `${words} [${unit}]` : words;
}

/** Value of a cell: numbers have four significant digits, words and whole numbers stay. */
const shown = (text) => (/^-?\d*\.?\d+(e[-+]?\d+)?$/i.test(text) && !/^-?\d+$/.test(text) ? plain(Number(text), 4) : text);

/** Overlay with the table and small pictures of the runs; a click on a row opens its run, a box adds it beside the others. */
export function studyOverlay(study, store, pictures) {
  // Columns without any value are left out, as those of pairs in a study of single grains.
  const columns = study.columns.map((_, i) => i).filter((i) => study.rows.some((row) => row.values[i]));
  const head = ["", "", "run", "state", ...columns.map((i) => study.columns[i])];
  let sorted = null;
  let down = false;
  const body = el("tbody");
  const unfilled = [];
  const value = (row, i) => (i === 2 ? row.name : i === 3 ? row.state : row.values[columns[i - 4]] ?? "");
  const fill = () => {
    const rows = [...study.rows];
    if (sorted !== null) {
      rows.sort((a, b) => {
        const [x, y] = [value(a, sorted), value(b, sorted)];
        const numbers = [Number(x), Number(y)];
        const order = x !== "" && y !== "" && numbers.every(Number.isFinite) ? numbers[0] - numbers[1] : x.localeCompare(y);
        return down ? -order : order;
      });
    }
    unfilled.length = 0;
    body.replaceChildren(...rows.map(line));
    unfilled.forEach(([run, cell]) => pictures.show(run, cell));
  };
  const line = (row) => {
    const open = row.run !== null;
    const chosen = open && store.state.shown.includes(row.run);
    const box = open && el("input", { type: "checkbox", checked: chosen, "aria-label": `Show ${row.name}`, onclick: (event) => {
      event.stopPropagation();
      toggleRun(store, row.run);
      fill();
    } });
    const picture = el("td", { class: "pictures" });
    if (open) unfilled.push([row.run, picture]);
    const values = columns.map((i) => row.values[i] ?? "");
    const cells = values.map((text) => el("td", { class: Number.isFinite(Number(text)) ? "number" : null, title: text }, shown(text)));
    return el("tr", { class: open ? (chosen ? "open shown" : "open") : null, onclick: () => open && store.set({ shown: [row.run], picked: null, follow: null, table: false }) },
      el("td", {}, box || ""), picture, el("th", {}, row.name), el("td", {}, row.state), ...cells);
  };
  const heads = head.map((name, i) => el("th", { onclick: () => {
    if (i < 2) return;
    down = sorted === i && !down;
    sorted = i;
    fill();
  } }, heading(name)));
  const close = () => store.set({ table: false });
  const card = el("div", { class: "card wide", role: "dialog", "aria-label": "Runs of the study", onclick: (event) => event.stopPropagation() },
    el("h2", {}, study.title, el("button", { "aria-label": "Close", onclick: close }, "×")),
    el("p", { class: "faint" }, "Click a run to see it; tick up to four runs to see them beside each other. The pictures show the grains from the side at key instants."),
    el("div", { class: "scroll" }, el("table", { class: "study" }, el("thead", {}, el("tr", {}, ...heads)), body)));
  const overlay = el("div", { class: "overlay", hidden: true, onclick: close }, card);
  const update = (state) => {
    if (state.table && overlay.hidden) fill();
    overlay.hidden = !state.table;
  };
  store.listen(update);
  update(store.state);
  return overlay;
}

/** Adds a run to those shown, or removes it; at least one and at most four are shown. */
export function toggleRun(store, number) {
  const { shown } = store.state;
  if (shown.includes(number)) {
    if (shown.length > 1) store.set({ shown: shown.filter((n) => n !== number) });
  } else {
    store.set({ shown: [...shown, number].slice(-4) });
  }
}
