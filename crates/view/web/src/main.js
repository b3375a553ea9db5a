// The page: reads the data, builds the elements, draws on change.

import { Recorder, savePicture } from "./capture.js";
import { Colours } from "./colours.js";
import { context2d, el, icon } from "./dom.js";
import { FlatScreen } from "./flat.js";
import { helpOverlay, listenToKeys } from "./keys.js";
import { drawLegends } from "./legends.js";
import { Panel } from "./panel.js";
import { Pictures } from "./pictures.js";
import { Run } from "./run.js";
import { Screen } from "./screen.js";
import { follow, readIndex, readRun } from "./source.js";
import { Store, initial } from "./store.js";
import { studyOverlay, toggleRun } from "./study.js";
import { Timeline } from "./timeline.js";

/** Runs shown at first: those that were asked for, as far as the window has room for them. */
const firstShown = (count) => [...Array(Math.max(1, Math.min(count, 4, Math.floor(innerWidth / 500)))).keys()];

const STATES = { finished: "finished", failed: "failed", unfinished: "not finished" };

class Page {
  constructor(index) {
    this.index = index;
    this.colours = new Colours(index);
    const shown = index.study ? [0] : firstShown(index.runs.length);
    this.store = new Store({ ...initial, shown, table: Boolean(index.study) });
    this.known = new Map();
    this.runs = [];
    this.draw = this.draw.bind(this);
    this.redraw = this.redraw.bind(this);
    this.build();
    this.store.listen((state, changed) => {
      if (changed.includes("shown")) this.load().catch((error) => this.say(error.message));
      if (changed.includes("shown") || changed.includes("table")) this.showChips();
      this.redraw();
    });
    this.colours.query.addEventListener("change", () => {
      if (this.runs.length) this.panel.showCurves(this.runs[0]);
      this.redraw();
    });
    addEventListener("resize", this.redraw);
  }

  build() {
    const { store } = this;
    this.title = el("h1");
    this.badge = el("span", { class: "badge" });
    this.chips = el("nav", { class: "chips", "aria-label": "Runs" });
    const tool = (label, title, onclick) => el("button", { class: "tool", title, "aria-label": title, onclick }, label);
    const tools = el("div", { class: "tools" },
      tool("PNG", "Save a picture (I)", () => this.picture()),
      tool("WebM", "Record a video (W)", () => this.video()),
      tool(icon("M4 10a6 6 0 1 0 2-4.5M6 2v4h4"), "Camera to its first place (R)", () => this.screen.home()),
      tool(icon("M3 7V3h4M13 3h4v4M17 13v4h-4M7 17H3v-4"), "Full screen (X)", () => this.fullScreen()),
      tool("?", "Help (?)", () => store.set({ help: !store.state.help })));
    const header = el("header", {}, this.title, this.badge, this.chips, tools);
    this.canvas = el("canvas", { class: "scene", tabindex: 0, role: "img", "aria-label": "Grains in their box" });
    this.legends = el("canvas", { class: "legends", "aria-hidden": "true" });
    this.message = el("div", { class: "message", role: "status", title: "Click to close", hidden: true, onclick: () => this.say("") });
    this.view = el("main", { class: "view" }, this.canvas, this.legends, this.message);
    this.timeline = new Timeline(store, () => this.extent());
    this.panel = new Panel(store, this.colours);
    this.app = el("div", { class: "app" }, header, this.view, this.timeline.element, this.panel.element, helpOverlay(store, this.index.program));
    this.pictures = new Pictures(this.colours);
    if (this.index.study) this.app.append(studyOverlay(this.index.study, store, this.pictures));
    document.body.append(this.app);
    try {
      this.screen = new Screen(this.canvas, this.redraw);
    } catch {
      // A canvas that was asked for WebGL gives no 2-D context afterwards.
      const plain = el("canvas", { class: "scene" });
      this.canvas.replaceWith(plain);
      this.canvas = plain;
      this.screen = new FlatScreen(plain);
      this.say("This browser has no WebGL 2: a flat side view replaces the 3-D view. Grains are circles of their size; curves and events work as usual.");
    }
    this.listenToPicks();
    listenToKeys(store, {
      run: () => this.runs[0] ?? {},
      play: () => this.timeline.toggle(),
      step: (n) => this.step(n),
      event: (n) => this.event(n),
      home: () => this.screen.home(),
      pace: (n) => this.pace(n),
      fullScreen: () => this.fullScreen(),
      picture: () => this.picture(),
      video: () => this.video(),
    });
  }

  /** A press without movement picks the grain under the pointer. */
  listenToPicks() {
    let down = null;
    this.canvas.addEventListener("pointerdown", (event) => (down = [event.clientX, event.clientY]));
    this.canvas.addEventListener("pointerup", (event) => {
      if (!down || Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 5) return;
      const box = this.canvas.getBoundingClientRect();
      this.store.set({ picked: this.screen.pick(event.clientX - box.left, event.clientY - box.top) });
    });
  }

  /** First and last time of the runs shown [s]. */
  extent() {
    if (!this.runs.length) return [0, 1];
    return [Math.min(...this.runs.map((r) => r.start)), Math.max(...this.runs.map((r) => r.last))];
  }

  async read(number) {
    if (!this.known.has(number)) this.known.set(number, new Run(number, await readRun(number), this.redraw));
    return this.known.get(number);
  }

  /** Reads and shows the chosen runs. */
  async load() {
    const { shown } = this.store.state;
    const runs = await Promise.all(shown.map((number) => this.read(number)));
    if (shown !== this.store.state.shown) return;
    const wasAtEnd = this.runs.length > 0 && this.store.state.time >= this.extent()[1] - 1e-12;
    this.runs = runs;
    this.screen.show(runs);
    const [start, end] = this.extent();
    const goesOn = this.index.live && runs.some((run) => run.state === "unfinished");
    const time = wasAtEnd && goesOn ? end : Math.min(end, Math.max(start, this.store.state.time));
    this.title.textContent = runs.length > 1 ? "Comparison" : (!this.index.study && runs[0].title) || runs[0].name;
    document.title = `${this.title.textContent} – Grainwake`;
    const states = new Set(runs.map((run) => run.state));
    const state = ["failed", "unfinished", "finished"].find((s) => states.has(s));
    this.badge.textContent = goesOn ? "following" : STATES[state];
    this.badge.className = `badge ${goesOn ? "live" : state}`;
    this.timeline.show(runs);
    this.panel.show(runs, this.screen.flat);
    this.store.set({ time, plane: Math.min(this.store.state.plane, Math.max(0, runs[0].slices.length - 1)) });
    this.showChips();
    this.redraw();
  }

  /** Buttons of the runs; a study has its table instead. */
  showChips() {
    const { shown } = this.store.state;
    if (this.index.study) {
      const open = () => this.store.set({ table: !this.store.state.table });
      this.chips.replaceChildren(el("button", { class: "run", onclick: open }, `Runs (${this.index.study.rows.length})`));
      return;
    }
    this.chips.hidden = this.index.runs.length < 2;
    this.chips.replaceChildren(...this.index.runs.map((name, number) => {
      const button = el("button", { class: "run", title: "Click: show beside the others; double click: show alone", onclick: () => toggleRun(this.store, number), ondblclick: () => this.store.set({ shown: [number] }) }, name);
      button.setAttribute("aria-pressed", shown.includes(number));
      return button;
    }));
  }

  /** Reads runs again that have gone on. */
  async refresh(numbers) {
    for (const number of numbers) this.known.delete(number);
    this.pictures.forget(numbers);
    if (numbers.some((number) => this.store.state.shown.includes(number))) await this.load();
  }

  step(count) {
    const run = this.runs.find((r) => r.rows);
    if (!run) return;
    const { row, part } = run.locate(this.store.state.time);
    const from = count > 0 || part === 0 ? row : row + 1;
    const target = Math.min(run.rows - 1, Math.max(0, from + count));
    this.store.set({ time: run.poses.time[target], playing: false });
  }

  event(direction) {
    const times = this.runs.flatMap((run) => run.events.map((event) => event.time)).sort((a, b) => a - b);
    const { time } = this.store.state;
    const target = direction > 0 ? times.find((t) => t > time + 1e-9) : times.findLast((t) => t < time - 1e-9);
    if (target !== undefined) this.store.set({ time: target, playing: false });
  }

  pace(direction) {
    const { pace } = this.timeline;
    const at = Math.min(pace.options.length - 1, Math.max(0, pace.selectedIndex + direction));
    pace.selectedIndex = at;
    this.store.set({ pace: Number(pace.value) });
  }

  fullScreen() {
    if (document.fullscreenElement) document.exitFullscreen();
    else this.app.requestFullscreen?.().catch(() => this.say("The browser refuses full screen here."));
  }

  name() {
    return this.runs.map((run) => run.name).join("-").replaceAll(/[^\w.-]+/g, "_") || "grainwake";
  }

  picture() {
    this.draw();
    savePicture([this.canvas, this.legends], `${this.name()}-${this.store.state.time.toPrecision(5)}s`);
  }

  /** Records the run from start to end at the chosen speed; a second call ends it. */
  video() {
    if (this.recorder) {
      this.endVideo();
      return;
    }
    this.store.set({ time: this.extent()[0] });
    this.draw();
    this.recorder = Recorder.start([this.canvas, this.legends], this.name());
    if (!this.recorder) {
      this.say("This browser cannot record videos.");
      return;
    }
    this.say("Recording… press W to stop.");
    this.looped = this.store.state.loop;
    this.store.set({ loop: false, playing: true });
  }

  endVideo() {
    this.recorder.stop();
    this.recorder = null;
    this.say("");
    this.store.set({ loop: this.looped, playing: false });
  }

  say(text) {
    this.message.textContent = text;
    this.message.hidden = !text;
  }

  /** Draws with the next frame of the browser. */
  redraw() {
    this.pending ||= requestAnimationFrame((now) => {
      this.pending = 0;
      if (this.store.state.playing) {
        if (this.before) {
          this.timeline.advance(Math.min(0.25, (now - this.before) / 1000));
          this.adapt(now - this.before);
        }
        this.before = now;
      } else {
        this.before = 0;
        this.adapt(0);
      }
      this.draw();
      if (this.recorder) {
        this.recorder.frame();
        if (!this.store.state.playing) this.endVideo();
      }
      if (this.store.state.playing) this.redraw();
    });
  }

  /** Lowers the resolution while frames take long [ms]; at rest it is full again. */
  adapt(interval) {
    this.slow = interval > 45 && !this.recorder ? (this.slow ?? 0) + 1 : 0;
    if (!interval || this.recorder) this.screen.quality = this.recorder ? 1 : this.screen.full;
    else if (this.screen.quality > 1) this.screen.quality = 1;
    else if (this.slow >= 2) [this.screen.quality, this.slow] = [Math.max(0.5, this.screen.quality - 0.25), 0];
  }

  draw() {
    if (!this.runs.length) return;
    const { state } = this.store;
    this.screen.draw(state, this.colours);
    const { context, width, height } = context2d(this.legends);
    drawLegends(context, width, height, { state, colours: this.colours, screen: this.screen, runs: this.runs });
    this.panel.draw();
    this.frames = (this.frames ?? 0) + 1;
    document.documentElement.dataset.ready ??= performance.now().toFixed(0);
  }
}

async function start() {
  const page = new Page(await readIndex());
  window.grainwake = page;
  await page.load();
  if (page.index.live) {
    follow((numbers) => page.refresh(numbers), (lost) => page.badge.classList.toggle("lost", lost));
  }
}

start().catch((error) => {
  document.body.append(el("p", { class: "failure", role: "alert" }, `The data cannot be shown: ${error.message}`));
});
