// Time line: play, speed, slider, events.

import { el } from "./dom.js";
import { seconds, short } from "./format.js";

/** Seconds that a run takes at the speed 1. */
const NOMINAL = 14;
const PACES = [0.1, 0.25, 0.5, 1, 2, 4];

/** Name of an event, with its grains unless both grains of a pair take part. */
function eventName(event, count) {
  const [grain, other] = event.grains;
  if (event.event === "left") return `grain ${grain} left`;
  if (event.grains.length === 1) return `${event.label} of grain ${grain}`;
  return count > 2 ? `${event.label} of ${grain} and ${other}` : event.label;
}

export class Timeline {
  constructor(store, extent) {
    this.store = store;
    this.extent = extent;
    const { state } = store;
    this.play = el("button", { class: "play", "aria-label": "Play or pause", title: "Play or pause (space)", onclick: () => this.toggle() });
    this.slider = el("input", { type: "range", min: 0, max: 1, step: "any", "aria-label": "Time", oninput: () => this.slide() });
    this.marks = el("div", { class: "marks" });
    this.list = el("div", { class: "events", role: "list", "aria-label": "Events" });
    this.clock = el("output", { class: "clock" });
    this.pace = el("select", { "aria-label": "Speed of playing", title: "Speed", onchange: () => store.set({ pace: Number(this.pace.value) }) });
    for (const pace of PACES) this.pace.append(el("option", { value: pace, selected: pace === state.pace }, `${pace} ×`));
    this.element = el("footer", { class: "timeline" },
      el("div", { class: "row" }, this.play, el("div", { class: "track" }, this.slider, this.marks), this.clock, this.pace),
      this.list);
    store.listen(() => this.update());
  }

  toggle() {
    const [, end] = this.extent();
    const { state } = this.store;
    const restart = !state.playing && state.time >= end - 1e-12;
    this.store.set({ playing: !state.playing, ...(restart ? { time: this.extent()[0] } : {}) });
  }

  slide() {
    const [start, end] = this.extent();
    const time = start + Number(this.slider.value) * (end - start);
    this.store.set({ time, playing: false });
  }

  /** Advances the time by a real interval [s]. */
  advance(interval) {
    const [start, end] = this.extent();
    const { state } = this.store;
    let time = state.time + (interval * state.pace * (end - start)) / NOMINAL;
    if (time >= end) {
      if (!state.loop) {
        this.store.set({ time: end, playing: false });
        return;
      }
      time = start;
    }
    this.store.set({ time });
  }

  /** Shows the events of these runs. */
  show(runs) {
    const [start, end] = this.extent();
    this.marks.replaceChildren();
    this.list.replaceChildren();
    const several = runs.length > 1;
    for (const run of runs) {
      for (const event of run.events) {
        const [grain] = event.grains;
        const name = eventName(event, run.grains.length);
        const time = `${seconds(event.time, end - start)} s`;
        const jump = () => this.store.set({ time: event.time, playing: false });
        const details = [name, time, several ? run.name : null, Number.isFinite(event.gap) ? `gap ${short(event.gap)} m` : null];
        const title = details.filter(Boolean).join(", ");
        const mark = el("button", { class: `mark ${event.event}`, title, "aria-label": title, "data-event": event.event, onclick: jump });
        mark.style.left = `${(100 * (event.time - start)) / Math.max(1e-12, end - start)}%`;
        this.marks.append(mark);
        const label = several ? `${run.name}: ${name}` : name;
        this.list.append(el("button", { class: `chip ${event.event}`, role: "listitem", "data-event": event.event, "data-time": event.time, title, onclick: jump }, el("i"), label, el("span", {}, time)));
      }
    }
    this.list.hidden = !this.list.children.length;
    this.update();
  }

  update() {
    const { state } = this.store;
    const [start, end] = this.extent();
    this.slider.value = end > start ? (state.time - start) / (end - start) : 0;
    this.clock.textContent = `${seconds(state.time, end - start)} s`;
    this.play.classList.toggle("playing", state.playing);
    const rate = (state.pace * (end - start)) / NOMINAL;
    this.pace.title = `Speed: ${short(rate, 2)} of real time`;
    let current = null;
    for (const chip of this.list.children) {
      chip.classList.remove("current");
      if (Number(chip.dataset.time) <= state.time + 1e-9) current = chip;
    }
    current?.classList.add("current");
  }
}
