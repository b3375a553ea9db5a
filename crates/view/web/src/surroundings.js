// Box, floor grid and paths of one run.

import * as THREE from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import { theme } from "./colours.js";

/** Largest number of grains whose paths are drawn, and of segments of a path. */
const PATHS = 60;
const SEGMENTS = 600;

/** Edges of the box, and a grid on its floor. */
export class Box {
  constructor(run) {
    const { lower, size } = run.box;
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((n) =>
      size.map((s, axis) => lower[axis] + ((n >> axis) & 1) * s),
    );
    const edges = [];
    for (let n = 0; n < 8; n++) {
      for (let axis = 0; axis < 3; axis++) {
        if (!((n >> axis) & 1)) edges.push(...corners[n], ...corners[n | (1 << axis)]);
      }
    }
    const lines = new LineSegmentsGeometry().setPositions(edges);
    this.edges = new LineSegments2(lines, new LineMaterial({ linewidth: 1.3, transparent: true }));
    this.floor = this.grid(run);
    this.floor.renderOrder = -2;
    this.group = new THREE.Group();
    this.group.add(this.floor, this.edges);
  }

  /** Square grid on the face that is lowest along gravity. */
  grid(run) {
    const { lower, size } = run.box;
    const up = run.up.map(Math.abs);
    const axis = up.indexOf(Math.max(...up));
    const [a, b] = [0, 1, 2].filter((i) => i !== axis);
    const level = lower[axis] + (run.up[axis] < 0 ? size[axis] : 0);
    const step = Math.max(size[a], size[b]) / 12;
    const points = [];
    const line = (from, to) => points.push(...from, ...to);
    const point = (p, q) => {
      const out = [0, 0, 0];
      [out[axis], out[a], out[b]] = [level, lower[a] + p, lower[b] + q];
      return out;
    };
    for (let p = step; p < size[a] * 0.999; p += step) line(point(p, 0), point(p, size[b]));
    for (let q = step; q < size[b] * 0.999; q += step) line(point(0, q), point(size[a], q));
    const shape = new THREE.BufferGeometry();
    shape.setAttribute("position", new THREE.Float32BufferAttribute(points, 3));
    return new THREE.LineSegments(shape, new THREE.LineBasicMaterial({ transparent: true }));
  }

  update(state) {
    this.group.visible = state.box;
    const colour = theme("--line-3d");
    this.edges.material.color.set(colour);
    this.edges.material.opacity = 0.9;
    this.floor.material.color.set(colour);
    this.floor.material.opacity = 0.35;
  }

  dispose() {
    for (const part of [this.edges, this.floor]) {
      part.geometry.dispose();
      part.material.dispose();
    }
  }
}

/** Paths of the centroids; the part that lies ahead is faint. */
export class Paths {
  constructor(run) {
    this.run = run;
    this.group = new THREE.Group();
    this.lines = [];
    if (run.count > PATHS || run.rows < 2) return;
    const step = Math.max(1, Math.ceil(run.rows / SEGMENTS));
    this.rows = [];
    for (let row = 0; row < run.rows; row += step) this.rows.push(row);
    if (this.rows.at(-1) !== run.rows - 1) this.rows.push(run.rows - 1);
    for (let grain = 0; grain < run.count; grain++) this.add(grain);
  }

  add(grain) {
    const { run, rows } = this;
    const points = rows.map((row) => {
      const out = [0, 0, 0];
      return run.position(grain, { row, part: 0 }, out) ? out : null;
    });
    const segments = [];
    const ends = [];
    for (let i = 1; i < points.length; i++) {
      const [p, q] = [points[i - 1], points[i]];
      const jump = (axis) => run.periodic[axis] && Math.abs(q[axis] - p[axis]) > 0.5 * run.box.size[axis];
      if (!p || !q || [0, 1, 2].some(jump)) continue;
      segments.push(...p, ...q);
      ends.push(rows[i]);
    }
    if (!segments.length) return;
    const line = (width, opacity) => {
      const shape = new LineSegmentsGeometry().setPositions(segments);
      const material = new LineMaterial({ linewidth: width, transparent: true, opacity });
      material.depthWrite = false;
      const object = new LineSegments2(shape, material);
      object.frustumCulled = false;
      this.group.add(object);
      return object;
    };
    this.lines.push({ grain, ends, ahead: line(1, 0.35), done: line(2.6, 0.95) });
  }

  update(place, state, colours) {
    this.group.visible = state.paths;
    for (const { grain, ends, ahead, done } of this.lines) {
      const [r, g, b] = colours.line(this.run.rank(grain));
      ahead.material.color.setRGB(r, g, b, THREE.SRGBColorSpace);
      done.material.color.setRGB(r, g, b, THREE.SRGBColorSpace);
      done.geometry.instanceCount = ends.findLastIndex((row) => row <= place.row) + 1;
      done.visible = done.geometry.instanceCount > 0;
    }
  }

  dispose() {
    for (const { ahead, done } of this.lines) {
      for (const part of [ahead, done]) {
        part.geometry.dispose();
        part.material.dispose();
      }
    }
  }
}
