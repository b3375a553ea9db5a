// Side panel: what is shown, the picked grain, curves, notes.

import { el } from "./dom.js";
import { short } from "./format.js";
import { GRAIN_QUANTITIES } from "./legends.js";
import { Plot, curves, diagnosticsCurve } from "./plots.js";
import { QUANTITIES } from "./run.js";

const NAMES = { speed: "speed", u: "u (along x)", v: "v (along y)", w: "w (along z)", vorticity: "vorticity", pressure: "pressure" };

export class Panel {
  constructor(store, colours) {
    this.store = store;
    this.colours = colours;
    this.controls = el("section", { class: "controls" });
    this.picked = el("section", { class: "picked", hidden: true });
    this.curves = el("section", { class: "curves" });
    this.notes = el("section", { class: "notes", hidden: true });
    this.element = el("aside", { class: "panel" }, this.controls, this.picked, this.curves, this.notes);
    this.plots = [];
    store.listen((_, changed) => this.update(changed));
  }

  select(key, label, options) {
    const parse = (text) => (text === "" ? null : /^\d+$/.test(text) ? Number(text) : text);
    const list = el("select", { "data-key": key, onchange: () => this.store.set({ [key]: parse(list.value) }) });
    for (const [value, name] of options) list.append(el("option", { value: value ?? "" }, name));
    list.value = this.store.state[key] ?? "";
    return el("label", {}, el("span", {}, label), list);
  }

  toggle(key, label, shortcut) {
    const button = el("button", { class: "toggle", "data-key": key, title: `${label} (${shortcut})`, onclick: () => this.store.set({ [key]: !this.store.state[key] }) }, label);
    button.setAttribute("aria-pressed", this.store.state[key]);
    return button;
  }

  /** Shows controls, curves and notes of the runs. */
  show(runs, flat) {
    this.runs = runs;
    const [run] = runs;
    const grains = Object.entries(GRAIN_QUANTITIES).filter(([name]) => name === "grain" || name === "speed" || runs.some((r) => r.poses?.[name]));
    const slices = !flat && run.slices.length > 0;
    const planes = run.slices.map((series, i) => [i, series.name]);
    const follow = [[null, "no grain"], ...run.grains.slice(0, Math.min(200, run.count)).map((_, i) => [i, `grain ${i}`])];
    const rows = [
      run.rows > 0 && this.select("colour", "Grains by", grains.map(([name, { label }]) => [name, label])),
      slices && this.select("quantity", "Slice of", QUANTITIES.map((name) => [name, NAMES[name]])),
      slices && planes.length > 1 && this.select("plane", "Plane", planes),
      !flat && run.rows > 0 && this.select("follow", "Follow", follow),
    ];
    this.controls.replaceChildren(
      el("div", { class: "selects" }, ...rows.filter(Boolean)),
      el("div", { class: "toggles" }, ...[
        slices && this.toggle("slice", "Slice", "S"),
        slices && this.toggle("arrows", "Arrows", "V"),
        run.rows > 0 && this.toggle("paths", "Paths", "P"),
        this.toggle("box", "Box", "B"),
      ].filter(Boolean)),
    );
    this.showCurves(run);
    this.showNotes(runs);
    this.showPicked();
  }

  showCurves(run) {
    const seek = (time) => this.store.set({ time, playing: false });
    this.plots = curves(run, this.colours).map((plot) => new Plot(run, plot, seek));
    const children = this.plots.map((plot) => plot.canvas);
    const names = [...run.columns.keys()].filter((name) => !["time", "step", "gap"].includes(name));
    if (names.length && run.columns.get("time")?.length > 1) {
      const chosen = names.includes(this.diagnostic) ? this.diagnostic : names.includes("fluid_kinetic_energy") ? "fluid_kinetic_energy" : names[0];
      const list = el("select", { onchange: () => { this.diagnostic = list.value; this.showCurves(run); this.draw(); } });
      for (const name of names) list.append(el("option", { value: name, selected: name === chosen }, name.replaceAll("_", " ")));
      list.value = chosen;
      const plot = new Plot(run, diagnosticsCurve(run, chosen), seek);
      this.plots.push(plot);
      children.push(el("label", { class: "diagnostics" }, el("span", {}, "Diagnostics"), list), plot.canvas);
    }
    if (this.runs.length > 1 && children.length) children.unshift(el("h2", {}, run.name));
    this.curves.replaceChildren(...children);
    this.curves.hidden = !children.length;
  }

  showNotes(runs) {
    const of = (run) => {
      const list = [...run.notes];
      if (run.state === "failed") list.unshift(`This run failed: ${run.failure}.`);
      return list.map((note) => el("li", {}, runs.length > 1 ? `${run.name}: ${note}` : note));
    };
    const items = runs.flatMap(of);
    this.notes.hidden = !items.length;
    this.notes.replaceChildren(el("h2", {}, "Notes"), el("ul", {}, ...items));
  }

  /** Numbers of the picked grain. */
  showPicked() {
    const { picked, time } = this.store.state;
    const run = picked && this.runs.find((r) => r.index === picked.run);
    this.picked.hidden = !run;
    if (!run) return;
    const place = run.locate(Math.min(time, run.last));
    const { grain } = picked;
    const facts = run.grains[grain] ?? {};
    const position = [0, 0, 0];
    run.position(grain, place, position);
    const list = (name) => run.vector(name, grain, place)?.map((v) => short(v)).join(", ");
    const rows = [
      ["position [m]", position.map((v) => short(v, 4)).join(", ")],
      ["velocity [m/s]", list("velocity")],
      ["speed [m/s]", short(run.number("speed", grain, place))],
      ["angular velocity [rad/s]", list("spin")],
      ["hydrodynamic force [N]", list("force")],
      ["contact force [N]", run.poses.contact_force && short(run.number("contact_force", grain, place))],
      ["contacts", run.poses.contacts && String(run.number("contacts", grain, place) ?? "–")],
      ["diameter [m]", facts.diameter && short(facts.diameter, 4)],
      ["density [kg/m³]", facts.density && short(facts.density, 4)],
      ["shape", facts.shape],
    ];
    const swatch = el("i");
    swatch.style.background = this.colours.css(run.rank(grain));
    const buttons = el("span", { class: "buttons" },
      el("button", { onclick: () => this.store.set({ follow: this.store.state.follow === grain ? null : grain }) }, this.store.state.follow === grain ? "Stop following" : "Follow"),
      el("button", { "aria-label": "Close", onclick: () => this.store.set({ picked: null }) }, "×"));
    this.picked.replaceChildren(
      el("h2", {}, swatch, `Grain ${grain}`, buttons),
      el("table", {}, ...rows.filter(([, text]) => text).map(([name, text]) => el("tr", {}, el("th", {}, name), el("td", {}, text)))),
    );
  }

  update(changed) {
    const { state } = this.store;
    for (const node of this.controls.querySelectorAll("[data-key]")) {
      const value = state[node.dataset.key];
      if (node.tagName === "SELECT") node.value = value ?? "";
      else node.setAttribute("aria-pressed", value);
    }
    if (changed.some((key) => ["picked", "time", "follow"].includes(key)) && (state.picked || changed.includes("picked"))) this.showPicked();
  }

  draw() {
    for (const plot of this.plots) plot.draw(this.store.state);
  }
}
