// Curves against time, linked to the time cursor.

import { theme } from "./colours.js";
import { context2d, el } from "./dom.js";
import { axisFactor, lengthUnit, ticks } from "./format.js";

/** Largest number of grains with a curve each; further ones are summed up by their range. */
const EACH = 6;
const MARGIN = { left: 40, right: 10, top: 20, bottom: 20 };

/** Curves of a run: title and lists of times, values and colours. */
export function curves(run, colours) {
  const plots = [];
  const gap = run.columns.get("gap");
  const time = run.columns.get("time");
  if (gap && time && gap.some(Number.isFinite)) {
    const [unit, metres] = lengthUnit(Math.max(...gap.filter(Number.isFinite)));
    const values = Array.from(gap, (g) => g / metres);
    plots.push({ title: `gap [${unit}]`, lines: [{ time, values, colour: "--accent" }], zero: true });
  }
  if (run.rows > 1) {
    plots.push(ofGrains(run, colours, "velocity along gravity [m/s]", (v) => -dot(v, run.up)));
    plots.push(ofGrains(run, colours, "velocity across gravity [m/s]", (v) => {
      const along = dot(v, run.up);
      return Math.sqrt(Math.max(0, dot(v, v) - along * along));
    }));
  }
  return plots;
}

/** Units of the columns of the diagnostics; the other columns are numbers. */
const UNITS = {
  dt: "s", max_divergence: "1/s", max_velocity: "m/s", slip: "m/s",
  fluid_kinetic_energy: "J", grain_kinetic_energy: "J",
  momentum_x: "kg m/s", momentum_y: "kg m/s", momentum_z: "kg m/s",
};

/** Curve of a column of the diagnostics. */
export function diagnosticsCurve(run, name) {
  const [time, values] = [run.columns.get("time"), run.columns.get(name)];
  const unit = UNITS[name] ? ` [${UNITS[name]}]` : "";
  return { title: name.replaceAll("_", " "), unit, lines: [{ time, values, colour: "--accent" }] };
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

function ofGrains(run, colours, title, value) {
  const { time } = run.poses;
  const at = (grain) =>
    Array.from(time, (_, row) => {
      const velocity = run.vector("velocity", grain, { row, part: 0 });
      return velocity ? value(velocity) : NaN;
    });
  if (run.count <= EACH) {
    const lines = Array.from({ length: run.count }, (_, grain) => ({
      time, values: at(grain), colour: colours.css(run.rank(grain)), grain,
    }));
    return { title, lines, zero: true };
  }
  const mean = new Float64Array(run.rows);
  const counts = new Float64Array(run.rows);
  const high = new Float64Array(run.rows).fill(-Infinity);
  const low = new Float64Array(run.rows).fill(Infinity);
  for (let grain = 0; grain < run.count; grain++) {
    at(grain).forEach((v, row) => {
      if (!Number.isFinite(v)) return;
      mean[row] += v;
      counts[row] += 1;
      high[row] = Math.max(high[row], v);
      low[row] = Math.min(low[row], v);
    });
  }
  for (let row = 0; row < run.rows; row++) mean[row] /= counts[row];
  const line = (values, colour) => ({ time, values, colour });
  const lines = [line(low, "--faint"), line(high, "--faint"), line(mean, "--accent")];
  return { title: `${title}: least, mean, largest`, lines, zero: true };
}

/** A canvas with curves; a click or drag moves the time. */
export class Plot {
  constructor(run, plot, seek) {
    this.run = run;
    this.plot = plot;
    this.canvas = el("canvas", { class: "plot", role: "img", "aria-label": plot.title });
    const move = (event) => {
      const box = this.canvas.getBoundingClientRect();
      const part = (event.clientX - box.left - MARGIN.left) / (box.width - MARGIN.left - MARGIN.right);
      seek(run.start + Math.min(1, Math.max(0, part)) * (run.last - run.start));
    };
    this.canvas.addEventListener("pointerdown", (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      move(event);
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (event.buttons) move(event);
    });
  }

  range() {
    let [low, high] = this.plot.zero ? [0, 0] : [Infinity, -Infinity];
    for (const { values } of this.plot.lines) {
      for (const v of values) {
        if (Number.isFinite(v)) [low, high] = [Math.min(low, v), Math.max(high, v)];
      }
    }
    if (!(high > low)) [low, high] = [Number.isFinite(low) ? low - 1 : 0, Number.isFinite(high) ? high + 1 : 1];
    const margin = 0.06 * (high - low);
    return [low - (low === 0 ? 0 : margin), high + margin];
  }

  draw(state) {
    const { context, width, height } = context2d(this.canvas);
    if (!width) return;
    const { run, plot } = this;
    this.limits ??= this.range();
    const [low, high] = this.limits;
    const [start, end] = [run.start, Math.max(run.last, run.start + 1e-12)];
    const x = (t) => MARGIN.left + ((t - start) / (end - start)) * (width - MARGIN.left - MARGIN.right);
    const y = (v) => height - MARGIN.bottom - ((v - low) / (high - low)) * (height - MARGIN.top - MARGIN.bottom);
    context.font = "10.5px system-ui, sans-serif";
    context.lineWidth = 1;
    const [factor, name] = axisFactor(Math.max(Math.abs(low), Math.abs(high)));
    for (const v of ticks(low, high, 3)) {
      context.strokeStyle = theme("--grid");
      context.beginPath();
      context.moveTo(MARGIN.left, Math.round(y(v)) + 0.5);
      context.lineTo(width - MARGIN.right, Math.round(y(v)) + 0.5);
      context.stroke();
      context.fillStyle = theme("--faint");
      context.textAlign = "right";
      context.fillText(Number((v / factor).toPrecision(6)).toString().replace("-", "−"), MARGIN.left - 6, y(v) + 3.5);
    }
    context.textAlign = "center";
    for (const t of ticks(start, end, 4)) {
      context.textAlign = x(t) > width - 18 ? "right" : "center";
      context.fillText(String(t).replace("-", "−"), context.textAlign === "right" ? width - 2 : x(t), height - 6);
    }
    context.setLineDash([2, 3]);
    context.strokeStyle = theme("--faint");
    for (const event of run.events) {
      context.beginPath();
      context.moveTo(x(event.time), MARGIN.top);
      context.lineTo(x(event.time), height - MARGIN.bottom);
      context.stroke();
    }
    context.setLineDash([]);
    context.lineWidth = 1.7;
    context.lineJoin = "round";
    for (const line of plot.lines) {
      context.strokeStyle = line.colour.startsWith("--") ? theme(line.colour) : line.colour;
      context.beginPath();
      let down = false;
      const step = Math.max(1, Math.floor(line.time.length / (2 * width)));
      for (let i = 0; i < line.time.length; i += step) {
        const known = Number.isFinite(line.values[i]);
        if (known) context[down ? "lineTo" : "moveTo"](x(line.time[i]), y(line.values[i]));
        down = known;
      }
      context.stroke();
    }
    context.fillStyle = theme("--ink");
    context.textAlign = "left";
    context.font = "500 12px system-ui, sans-serif";
    context.fillText(plot.title + name + (plot.unit ?? ""), 8, 12);
    const now = Math.min(state.time, run.last);
    context.strokeStyle = theme("--cursor");
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(x(now), MARGIN.top - 4);
    context.lineTo(x(now), height - MARGIN.bottom);
    context.stroke();
  }
}
