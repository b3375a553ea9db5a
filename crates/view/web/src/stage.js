// Scene of one run.

import * as THREE from "three";
import { Grains } from "./grains.js";
import { Slice } from "./slice.js";
import { Box, Paths } from "./surroundings.js";

export class Stage {
  /** `unit` is the number of metres in a unit of the scene, common to all runs. */
  constructor(run, unit) {
    this.run = run;
    this.scene = new THREE.Scene();
    this.world = new THREE.Group();
    this.world.scale.setScalar(1 / unit);
    this.centre = new THREE.Vector3(...run.box.lower.map((l, i) => l + 0.5 * run.box.size[i]));
    this.world.position.copy(this.centre).multiplyScalar(-1 / unit);
    this.scene.add(this.world);
    this.unit = unit;
    this.grains = run.rows ? new Grains(run) : null;
    this.paths = new Paths(run);
    this.box = new Box(run);
    this.slices = new Map();
    this.world.add(this.box.group, this.paths.group);
    if (this.grains) this.world.add(this.grains.group);
    this.light(run.up);
  }

  light(up) {
    const sky = new THREE.HemisphereLight(0xffffff, 0x59606b, 1.9);
    sky.position.set(...up);
    this.scene.add(sky);
    this.lamp = new THREE.DirectionalLight(0xffffff, 1.9);
    this.scene.add(this.lamp, this.lamp.target);
  }

  /** Slices along the chosen plane; the last ones if there are fewer planes. */
  series(state) {
    const { slices } = this.run;
    return state.slice ? slices[Math.min(state.plane, slices.length - 1)] : undefined;
  }

  /** Brings everything to a time; `scales` are the ranges of the colours, common to all runs. */
  update(state, colours, scales) {
    const { run } = this;
    const time = Math.min(state.time, run.last);
    const place = run.rows ? run.locate(time) : { row: 0, part: 0 };
    this.grains?.update(place, state, colours, scales.grain);
    this.paths.update(place, state, colours);
    this.box.update(state);
    for (const slice of this.slices.values()) slice.group.visible = false;
    this.shownSlice = null;
    const series = this.series(state);
    if (!series) return;
    if (!this.slices.has(series)) {
      this.slices.set(series, new Slice(run, series));
      this.world.add(this.slices.get(series).group);
    }
    this.shownSlice = this.slices.get(series).update(time, state, colours, scales.field);
  }

  /** Lights from behind the viewer's left shoulder. */
  turnLight(camera) {
    const right = new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 0);
    const up = new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 1);
    const back = new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 2);
    this.lamp.position.copy(back.multiplyScalar(2)).addScaledVector(up, 1.6).addScaledVector(right, -1.3);
    this.lamp.target.position.set(0, 0, 0);
  }

  /** Position of a grain in the scene, or null. */
  grainPosition(grain, time) {
    const { run } = this;
    if (!run.rows || grain === null || grain >= run.count) return null;
    const out = [0, 0, 0];
    const known = run.position(grain, run.locate(Math.min(time, run.last)), out);
    return known ? new THREE.Vector3(...out).sub(this.centre).divideScalar(this.unit) : null;
  }

  dispose() {
    this.grains?.dispose();
    this.paths.dispose();
    this.box.dispose();
    for (const slice of this.slices.values()) slice.dispose();
  }
}
