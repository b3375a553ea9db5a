// Side view on a 2-D canvas, for browsers without WebGL 2.

import { GRAIN_MAP, onMap, theme } from "./colours.js";
import { context2d } from "./dom.js";

/** Has the methods of `Screen` that the page uses. */
export class FlatScreen {
  constructor(canvas) {
    this.canvas = canvas;
    this.flat = true;
    this.runs = [];
  }

  show(runs) {
    this.runs = runs;
  }

  home() {}

  get stages() {
    return this.runs.map((run) => ({ run, shownSlice: null }));
  }

  /** Axes of the view: across and up. */
  axes(run) {
    const up = run.up.map(Math.abs);
    const vertical = up.indexOf(Math.max(...up));
    return [vertical === 0 ? 1 : 0, vertical, run.up[vertical] < 0 ? -1 : 1];
  }

  project(position, i = 0) {
    const run = this.runs[i];
    const { clientWidth, clientHeight: height } = this.canvas;
    const width = clientWidth / this.runs.length;
    const [a, b, sign] = this.axes(run);
    const { lower, size } = run.box;
    const zoom = 0.86 * Math.min(width / size[a], height / size[b]);
    this.zoom = zoom;
    const x = position[a] - lower[a] - size[a] / 2;
    const y = position[b] - lower[b] - size[b] / 2;
    return [i * width + width / 2 + zoom * x, height / 2 - sign * zoom * y];
  }

  draw(state, colours) {
    this.time = state.time;
    const { context } = context2d(this.canvas);
    this.runs.forEach((run, i) => {
      const { lower, size } = run.box;
      const [x0, y0] = this.project(lower, i);
      const [x1, y1] = this.project(lower.map((l, n) => l + size[n]), i);
      context.strokeStyle = theme("--faint");
      context.strokeRect(Math.min(x0, x1), Math.min(y0, y1), Math.abs(x1 - x0), Math.abs(y1 - y0));
      if (!run.rows) return;
      const place = run.locate(Math.min(state.time, run.last));
      const at = [0, 0, 0];
      if (state.paths && run.count <= 60) this.drawPaths(context, run, i, colours);
      for (let grain = 0; grain < run.count; grain++) {
        if (!run.position(grain, place, at)) continue;
        const [x, y] = this.project(at, i);
        context.fillStyle = this.colour(run, grain, place, state, colours);
        context.beginPath();
        context.arc(x, y, Math.max(1.5, run.grains[grain].scale * this.zoom), 0, 2 * Math.PI);
        context.fill();
      }
    });
  }

  colour(run, grain, place, state, colours) {
    if (state.colour === "grain") return colours.css(run.rank(grain));
    const value = run.number(state.colour, grain, place) / (run.grainScale(state.colour) || 1);
    return `rgb(${onMap(GRAIN_MAP, value || 0).map((v) => Math.round(255 * v)).join(" ")})`;
  }

  drawPaths(context, run, i, colours) {
    const at = [0, 0, 0];
    const step = Math.max(1, Math.ceil(run.rows / 400));
    for (let grain = 0; grain < run.count; grain++) {
      context.strokeStyle = colours.css(run.rank(grain));
      context.beginPath();
      for (let row = 0; row < run.rows; row += step) {
        if (run.position(grain, { row, part: 0 }, at)) context.lineTo(...this.project(at, i));
      }
      context.stroke();
    }
  }

  pick(x, y) {
    const width = this.canvas.clientWidth / this.runs.length;
    const i = Math.min(this.runs.length - 1, Math.floor(x / width));
    const run = this.runs[i];
    const place = run.rows ? run.locate(Math.min(this.time ?? run.start, run.last)) : null;
    const at = [0, 0, 0];
    for (let grain = 0; place && grain < run.count; grain++) {
      if (!run.position(grain, place, at)) continue;
      const [px, py] = this.project(at, i);
      if (Math.hypot(px - x, py - y) < run.grains[grain].scale * this.zoom) return { run: run.index, grain };
    }
    return null;
  }
}
