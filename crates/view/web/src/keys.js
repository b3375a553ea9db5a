// Keyboard shortcuts and their overlay.

import { el } from "./dom.js";
import { QUANTITIES } from "./run.js";

const HELP = [
  ["space", "play or pause"],
  ["← →", "step by an output time; with shift by ten"],
  ["home end", "first or last time"],
  ["E, shift E", "next or previous event"],
  ["1 … 6", "speed, u, v, w, vorticity, pressure"],
  ["C", "next colour of the grains"],
  ["S V P B", "slice, arrows, paths, box"],
  ["N", "next plane"],
  ["F", "follow the next grain"],
  ["R", "camera to its first place"],
  ["+ −", "faster or slower"],
  ["X", "full screen"],
  ["I, W", "save a picture (PNG) or a video (WebM)"],
  ["?", "this help"],
];

export function helpOverlay(store, program) {
  const rows = HELP.map(([keys, text]) => el("tr", {}, el("th", {}, ...keys.split(" ").map((key) => (key === "…" ? "…" : el("kbd", {}, key.replace(",", ""))))), el("td", {}, text)));
  const close = () => store.set({ help: false });
  const card = el("div", { class: "card", role: "dialog", "aria-label": "Help", onclick: (event) => event.stopPropagation() },
    el("h2", {}, "Keyboard, mouse and touch", el("button", { "aria-label": "Close", onclick: close }, "×")),
    el("table", {}, ...rows),
    el("p", {}, "Drag to orbit, wheel or pinch to zoom, right button or two fingers to move. Click a grain for its numbers, an event or a curve for its time."),
    el("p", { class: "faint" }, `${program}. 3-D by three.js (MIT licence).`));
  const overlay = el("div", { class: "overlay", hidden: true, onclick: close }, card);
  store.listen((state) => (overlay.hidden = !state.help));
  return overlay;
}

/** Connects the keys; `actions` does what is not a change of the state. */
export function listenToKeys(store, actions) {
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (["INPUT", "SELECT", "TEXTAREA"].includes(event.target.tagName) && event.key !== "Escape") return;
    const { state } = store;
    const run = actions.run();
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const next = (list, value) => list[(list.indexOf(value) + 1) % list.length];
    const known = {
      " ": actions.play,
      ArrowLeft: () => actions.step(event.shiftKey ? -10 : -1),
      ArrowRight: () => actions.step(event.shiftKey ? 10 : 1),
      Home: () => store.set({ time: run.start, playing: false }),
      End: () => store.set({ time: run.last, playing: false }),
      e: () => actions.event(event.shiftKey ? -1 : 1),
      c: () => store.set({ colour: next(["grain", "speed", "force", "contact_force"].filter((n) => n === "grain" || n === "speed" || run.poses?.[n]), state.colour) }),
      s: () => store.set({ slice: !state.slice }),
      v: () => store.set({ arrows: !state.arrows }),
      p: () => store.set({ paths: !state.paths }),
      b: () => store.set({ box: !state.box }),
      n: () => store.set({ plane: run.slices.length ? (state.plane + 1) % run.slices.length : 0 }),
      f: () => store.set({ follow: run.count ? next([null, ...Array(run.count).keys()], state.follow) : null }),
      r: actions.home,
      "+": () => actions.pace(1),
      "-": () => actions.pace(-1),
      x: actions.fullScreen,
      i: actions.picture,
      w: actions.video,
      "?": () => store.set({ help: !state.help }),
      Escape: () => store.set({ help: false, table: false, picked: null }),
    };
    QUANTITIES.forEach((quantity, i) => (known[i + 1] = () => store.set({ quantity, slice: true })));
    if (!known[key]) return;
    // A button that has the focus would be pressed too.
    event.preventDefault();
    known[key]();
  });
}
