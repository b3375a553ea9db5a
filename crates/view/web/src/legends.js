// Colour bars, time and labels; drawn on a 2-D canvas over the scene and into exported pictures.

import { GRAIN_MAP, theme } from "./colours.js";
import { lengthUnit, plain, seconds } from "./format.js";

/** Quantities by which grains are coloured. */
export const GRAIN_QUANTITIES = {
  grain: { label: "grain" },
  speed: { label: "grain speed", unit: "m/s" },
  force: { label: "hydrodynamic force", unit: "N" },
  contact_force: { label: "contact force", unit: "N" },
};

function bar(context, x, y, width, map, low, high, title) {
  const height = 9;
  for (let i = 0; i < width; i++) {
    const at = 4 * Math.round((255 * i) / Math.max(1, width - 1));
    context.fillStyle = `rgb(${map[at]} ${map[at + 1]} ${map[at + 2]})`;
    context.fillRect(x + i, y, 1.5, height);
  }
  context.strokeStyle = theme("--line");
  context.lineWidth = 1;
  context.strokeRect(x - 0.5, y - 0.5, width + 1, height + 1);
  context.fillStyle = theme("--ink");
  context.font = "500 12px system-ui, sans-serif";
  context.textAlign = "left";
  context.fillText(title, x, y - 7);
  context.font = "11px system-ui, sans-serif";
  context.fillStyle = theme("--faint");
  const marks = low < 0 ? [low, 0, high] : [low, 0.5 * (low + high), high];
  marks.forEach((value, i) => {
    context.textAlign = ["left", "center", "right"][i];
    context.fillText(plain(value), x + (i * width) / 2, y + height + 13);
  });
}

/** Draws the legends of all parts of the screen. */
export function drawLegends(context, width, height, { state, colours, screen, runs }) {
  const part = width / runs.length;
  const barWidth = Math.round(Math.min(190, part - 48));
  runs.forEach((run, i) => {
    const left = i * part;
    context.save();
    context.beginPath();
    context.rect(left, 0, part, height);
    context.clip();
    const duration = run.last - run.start;
    context.textAlign = "left";
    context.fillStyle = theme("--ink");
    context.font = "600 19px system-ui, sans-serif";
    context.fillText(`t = ${seconds(Math.min(state.time, run.last), duration)} s`, left + 18, 32);
    context.font = "12px system-ui, sans-serif";
    context.fillStyle = theme("--faint");
    const [unit, metres] = lengthUnit(Math.max(...run.box.size));
    const size = run.box.size.map((s) => Number((s / metres).toPrecision(4))).join(" × ");
    const lines = runs.length > 1 ? [run.name, `box ${size} ${unit}`] : [`box ${size} ${unit}`];
    lines.forEach((line, n) => context.fillText(line, left + 18, 52 + 17 * n));
    let y = height - 34;
    const { map, scale, time } = sliceBar(run, screen.stages[i], colours);
    if (scale) {
      const component = scale.label.startsWith("vorticity") ? ["x", "y", "z"][run.slices[Math.min(state.plane, run.slices.length - 1)].axis] : "";
      const sub = component ? `${scale.label}_${component}` : scale.label;
      bar(context, left + 18, y, barWidth, map, scale.low, scale.high, `${sub} [${scale.unit}], slice at ${seconds(time, duration)} s`);
      y -= 52;
    }
    const { label, unit: of } = GRAIN_QUANTITIES[state.colour];
    if (of && run.rows) bar(context, left + 18, y, barWidth, GRAIN_MAP, 0, screen.colourScales?.grain || run.grainScale(state.colour) || 1, `${label} [${of}]`);
    if (i > 0) {
      context.fillStyle = theme("--line");
      context.fillRect(left, 0, 1, height);
    }
    context.restore();
  });
  if (state.box && !screen.flat) axisNames(context, runs, screen);
}

function sliceBar(run, stage, colours) {
  const shown = stage?.shownSlice;
  return shown ? { map: colours.map(shown.signed), scale: shown, time: shown.time } : {};
}

/** Names of the axes at the lower ends of the box. */
function axisNames(context, runs, screen) {
  context.font = "italic 13px Georgia, serif";
  context.fillStyle = theme("--faint");
  context.textAlign = "center";
  runs.forEach((run, i) => {
    const { lower, size } = run.box;
    ["x", "y", "z"].forEach((name, axis) => {
      const end = lower.map((l, n) => (n === axis ? l + size[n] + 0.03 * Math.max(...size) : l));
      const [x, y] = screen.project(end, i);
      context.fillText(name, x, y + 4);
    });
  });
}
