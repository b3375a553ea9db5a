// Small pictures of the runs of a study.

import { svg } from "./dom.js";
import { readPicture } from "./source.js";

/** Pictures by run, read one after the other. */
export class Pictures {
  constructor(colours) {
    this.colours = colours;
    this.known = new Map();
    this.waiting = [];
    this.reading = false;
  }

  /** Fills a cell of the table with the picture of a run, at once or later. */
  show(number, cell) {
    if (this.known.has(number)) this.fill(cell, this.known.get(number));
    else {
      this.waiting.push([number, cell]);
      this.read();
    }
  }

  /** Reads the pictures of runs again that have gone on. */
  forget(numbers) {
    for (const number of numbers) this.known.delete(number);
  }

  async read() {
    if (this.reading) return;
    this.reading = true;
    // The table is not yet in the page when its first rows are made.
    await null;
    while (this.waiting.length) {
      const [number, cell] = this.waiting.shift();
      // A table that was sorted again has new cells.
      if (!cell.isConnected) continue;
      if (!this.known.has(number)) this.known.set(number, await readPicture(number).catch(() => null));
      this.fill(cell, this.known.get(number));
    }
    this.reading = false;
  }

  fill(cell, picture) {
    const frames = picture?.frames ?? [];
    cell.replaceChildren(...frames.map((frame) => this.draw(frame)));
  }

  draw({ name, grains, trails }) {
    const colour = (n) => this.colours.css(n);
    return svg("svg", { viewBox: "0 0 100 100", role: "img", "aria-label": name },
      svg("title", {}, name),
      ...trails.map((line) => svg("path", { d: line.path, fill: "none", stroke: colour(line.colour), "stroke-width": 2, "stroke-opacity": 0.45 })),
      ...grains.map((line) => svg("path", { d: line.path, fill: colour(line.colour), "fill-opacity": 0.85 })));
  }
}
