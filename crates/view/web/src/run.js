// One run: poses at any time, values of grains, curves and slices.

import { roundUp } from "./format.js";
import { unpack } from "./packed.js";

const FIELDS = {
  speed: { label: "speed |u|", unit: "m/s", signed: false },
  u: { label: "velocity u", unit: "m/s", signed: true },
  v: { label: "velocity v", unit: "m/s", signed: true },
  w: { label: "velocity w", unit: "m/s", signed: true },
  vorticity: { label: "vorticity ω", unit: "1/s", signed: true },
  pressure: { label: "dynamic pressure p", unit: "Pa", signed: true },
};
/** Names of the quantities of slices. */
export const QUANTITIES = Object.keys(FIELDS);

export class Run {
  constructor(number, document, redraw) {
    Object.assign(this, document);
    this.index = number;
    this.redraw = redraw;
    this.rows = this.poses ? this.poses.time.length : 0;
    this.count = this.poses ? this.poses.grains : 0;
    this.box = this.findBox();
    this.up = this.findUp();
    if (this.poses) this.wrap();
    this.columns = new Map(this.diagnostics.map((column) => [column.name, column.values]));
    this.scales = new Map();
    this.codes = new Map();
  }

  /** Lower corner and size of the box [m]; of the paths if the box is not known. */
  findBox() {
    if (this.size) return { lower: this.lower, size: this.size };
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    const at = this.poses?.position ?? [];
    for (let i = 0; i < at.length; i++) {
      if (Number.isFinite(at[i])) {
        low[i % 3] = Math.min(low[i % 3], at[i]);
        high[i % 3] = Math.max(high[i % 3], at[i]);
      }
    }
    if (!(low[0] <= high[0])) return { lower: [0, 0, 0], size: [1, 1, 1] };
    const widest = Math.max(...high.map((h, i) => h - low[i]));
    const margin = 0.05 * widest + Math.max(1e-6, ...this.grains.map((g) => g.scale));
    return {
      lower: low.map((l) => l - margin),
      size: high.map((h, i) => h - low[i] + 2 * margin),
    };
  }

  /** Unit vector against gravity; z without gravity. */
  findUp() {
    const g = this.gravity ?? [0, 0, -1];
    const length = Math.hypot(...g);
    return length > 0 ? g.map((c) => -c / length) : [0, 0, 1];
  }

  /** Moves positions into the box along periodic axes. */
  wrap() {
    const { position } = this.poses;
    const { lower, size } = this.box;
    for (let i = 0; i < position.length; i++) {
      const a = i % 3;
      if (this.periodic[a]) position[i] -= size[a] * Math.floor((position[i] - lower[a]) / size[a]);
    }
  }

  get start() {
    return this.rows ? this.poses.time[0] : 0;
  }

  get last() {
    return Math.max(this.end, this.rows ? this.poses.time[this.rows - 1] : 0);
  }

  /** Row at or before a time, and the part of the way to the next one. */
  locate(time) {
    const times = this.poses.time;
    let low = 0;
    let high = this.rows - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= time) low = middle;
      else high = middle - 1;
    }
    if (low + 1 >= this.rows) return { row: low, part: 0 };
    const part = (time - times[low]) / (times[low + 1] - times[low]);
    return { row: low, part: Math.min(1, Math.max(0, part)) };
  }

  /** Number of a grain in the cycle of colours, as in the report. */
  rank(grain) {
    return this.grains[grain]?.colour ?? grain;
  }

  /** Position of a grain [m]; false if it has none. A step over a periodic face is not smooth. */
  position(grain, { row, part }, out) {
    const { position } = this.poses;
    const a = 3 * (row * this.count + grain);
    const b = part > 0 ? a + 3 * this.count : a;
    for (let i = 0; i < 3; i++) {
      let step = position[b + i] - position[a + i];
      if (this.periodic[i] && Math.abs(step) > 0.5 * this.box.size[i]) step = 0;
      out[i] = position[a + i] + part * step;
    }
    return Number.isFinite(out[0] + out[1] + out[2]);
  }

  /** Orientation of a grain: normalised mean of the neighbouring rows' quaternions. */
  orientation(grain, { row, part }, out) {
    const { orientation: q } = this.poses;
    const a = 4 * (row * this.count + grain);
    const b = part > 0 ? a + 4 * this.count : a;
    let dot = 0;
    for (let i = 0; i < 4; i++) dot += q[a + i] * q[b + i];
    const sign = dot < 0 ? -1 : 1;
    let length = 0;
    for (let i = 0; i < 4; i++) {
      out[i] = (1 - part) * q[a + i] + sign * part * q[b + i];
      length += out[i] * out[i];
    }
    const factor = 1 / Math.sqrt(length || 1);
    for (let i = 0; i < 4; i++) out[i] *= factor;
  }

  /** Vector of a grain in the nearest row, such as `velocity`; null if unknown. */
  vector(name, grain, { row, part }) {
    const array = this.poses?.[name];
    if (!array) return null;
    const nearest = Math.min(this.rows - 1, row + (part > 0.5 ? 1 : 0));
    const first = 3 * (nearest * this.count + grain);
    // A grain that has left the box has no position.
    if (!Number.isFinite(this.poses.position[first])) return null;
    return Array.from(array.subarray(first, first + 3));
  }

  /** Number of a grain: speed, hydrodynamic force, contact force or contacts; null if unknown. */
  number(name, grain, place) {
    if (name === "speed" || name === "force") {
      const vector = this.vector(name === "speed" ? "velocity" : "force", grain, place);
      return vector && Math.hypot(...vector);
    }
    const array = this.poses?.[name];
    if (!array) return null;
    const nearest = Math.min(this.rows - 1, place.row + (place.part > 0.5 ? 1 : 0));
    const at = nearest * this.count + grain;
    return Number.isFinite(this.poses.position[3 * at]) ? array[at] : null;
  }

  /** Upper end of the colours of a grain quantity: the 99.5th percentile over the run. */
  grainScale(name) {
    if (!this.scales.has(name)) {
      const values = [];
      const step = Math.max(1, Math.floor((this.rows * this.count) / 20000));
      for (let i = 0; i < this.rows * this.count; i += step) {
        const place = { row: Math.floor(i / this.count), part: 0 };
        const value = this.number(name, i % this.count, place);
        if (value > 0) values.push(value);
      }
      values.sort((a, b) => a - b);
      this.scales.set(name, roundUp(values[Math.floor(0.995 * (values.length - 1))] ?? 0));
    }
    return this.scales.get(name);
  }

  /** Newest frame of a series at a time; the first one before it. */
  frame(series, time) {
    let found = series.frames[0];
    for (const frame of series.frames) {
      if (frame.time <= time + 1e-9) found = frame;
    }
    return found;
  }

  /** Codes of a frame, or null until they are unpacked. */
  frameCodes(frame) {
    const known = this.codes.get(frame);
    if (known instanceof Uint8Array) return known;
    if (!known) this.loadCodes(frame).then(this.redraw);
    return null;
  }

  loadCodes(frame) {
    const known = this.codes.get(frame);
    if (known) return Promise.resolve(known);
    const loading = unpack(frame.codes).then((codes) => {
      this.codes.set(frame, codes);
      return codes;
    });
    this.codes.set(frame, loading);
    return loading;
  }

  /** Label, unit and range of the colours of a quantity; null until they are known. */
  fieldScale(series, quantity) {
    const key = `${series.name} ${quantity}`;
    const known = this.scales.get(key);
    if (!known) this.findFieldScale(series, quantity, key).then(this.redraw);
    return known?.high === undefined ? null : known;
  }

  /** Scales end where the fluid's values end in eight frames; signed ones where 2 % lie beyond. */
  async findFieldScale(series, quantity, key) {
    this.scales.set(key, {});
    const step = Math.max(1, Math.floor(series.frames.length / 8));
    const frames = series.frames.filter((_, i) => i % step === 0 || i + 1 === series.frames.length);
    const field = series.fields.indexOf(quantity);
    const sizes = [];
    for (const frame of frames) {
      const codes = await this.loadCodes(frame);
      const count = frame.cells[0] * frame.cells[1];
      const [low, high] = frame.ranges[field];
      for (let i = 0; i < count; i++) {
        if (codes[6 * count + i] < 128) {
          sizes.push(Math.abs(low + ((high - low) * codes[field * count + i]) / 255));
        }
      }
    }
    const sorted = Float64Array.from(sizes).sort();
    const largest = sorted[sorted.length - 1] ?? 0;
    const { label, unit, signed } = FIELDS[quantity];
    let high = largest;
    if (signed) {
      const first = sorted.findIndex((v) => v >= 0.02 * largest);
      high = sorted[Math.floor(first + 0.98 * (sorted.length - 1 - first))] ?? 0;
    }
    high = high > 0 ? roundUp(high) : 1;
    this.scales.set(key, { label, unit, signed, low: signed ? -high : 0, high });
  }

  /** Reads a value of a frame at plane coordinates from 0 to 1. */
  valueAt(series, frame, codes, quantity, s, t) {
    const field = series.fields.indexOf(quantity);
    const [nx, ny] = frame.cells;
    const i = Math.min(nx - 1, Math.max(0, Math.floor(s * nx)));
    const j = Math.min(ny - 1, Math.max(0, Math.floor(t * ny)));
    const [low, high] = frame.ranges[field];
    return low + ((high - low) * codes[field * nx * ny + j * nx + i]) / 255;
  }
}
