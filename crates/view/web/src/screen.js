// Canvas with one or several runs beside each other, one camera for all.

import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { theme } from "./colours.js";
import { Stage } from "./stage.js";

/** Whether the processor draws: the browser found no graphics card. */
function drawsInSoftware() {
  const probe = document.createElement("canvas").getContext("webgl2");
  if (!probe) return false;
  const names = probe.getExtension("WEBGL_debug_renderer_info");
  const name = names ? probe.getParameter(names.UNMASKED_RENDERER_WEBGL) : "";
  probe.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|basic render/i.test(name);
}

/** Height of the labels above and below the box [CSS px]. */
const LABELS = 72;

export class Screen {
  /** Throws if the browser has no WebGL 2. */
  constructor(canvas, changed) {
    // Multisampling is slow in software: there, pictures at rest have more pixels instead.
    const software = drawsInSoftware();
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: !software, alpha: true });
    this.full = software ? 1.5 : 1;
    this.canvas = canvas;
    this.stages = [];
    /** Part of the full resolution; lower while a slow machine plays. */
    this.quality = this.full;
    this.camera = new THREE.PerspectiveCamera(30, 1, 0.005, 50);
    this.changed = changed;
    canvas.addEventListener("webglcontextrestored", changed);
  }

  /** Shows these runs; the camera stays if one of them was there before. */
  show(runs) {
    const before = this.stages;
    const unit = Math.max(...runs.map((run) => Math.max(...run.box.size)));
    this.stages = runs.map((run) => {
      const known = before.find((stage) => stage.run === run && stage.unit === unit);
      return known ?? new Stage(run, unit);
    });
    for (const stage of before) if (!this.stages.includes(stage)) stage.dispose();
    const same = before.length === runs.length && before[0].unit === unit;
    if (!this.controls || !same) this.home();
  }

  /** Places the camera so that every box fits its part of the canvas. */
  home() {
    const { run } = this.stages[0];
    this.camera.up.set(...run.up);
    this.controls?.dispose();
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener("change", () => this.changed());
    const up = this.camera.up;
    const side = Math.abs(up.y) > 0.9 ? new THREE.Vector3(0, 0, 1) : new THREE.Vector3(0, -1, 0);
    const across = new THREE.Vector3().crossVectors(side, up);
    const direction = side.addScaledVector(across, -0.42).addScaledVector(up, 0.2).normalize();
    const distance = this.fittingDistance(direction);
    this.camera.position.copy(direction.multiplyScalar(distance));
    this.controls.target.set(0, 0, 0);
    this.controls.minDistance = 0.02;
    this.controls.maxDistance = 20;
    this.controls.update();
    this.followed = null;
    this.changed();
  }

  fittingDistance(direction) {
    const [width, height] = this.partSize();
    const tangent = Math.tan((this.camera.fov * Math.PI) / 360);
    const view = new THREE.Matrix4().lookAt(direction, new THREE.Vector3(), this.camera.up);
    const [x, y] = [0, 1].map((i) => new THREE.Vector3().setFromMatrixColumn(view, i));
    let distance = 0;
    for (const { run, unit } of this.stages) {
      for (let n = 0; n < 8; n++) {
        const corner = new THREE.Vector3(
          ...run.box.size.map((s, axis) => ((((n >> axis) & 1) - 0.5) * s) / unit),
        );
        const [high, wide] = [Math.abs(corner.dot(y)) / tangent, Math.abs(corner.dot(x)) / (tangent * (width / height))];
        // In a narrow part the box stands between the time above and the colour bar below.
        const margin = width < 600 ? height / Math.max(0.5 * height, height - 2 * LABELS) : 1.09;
        distance = Math.max(distance, Math.max(margin * high, 1.09 * wide) + corner.dot(direction));
      }
    }
    return distance;
  }

  partSize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    return [Math.max(1, width / Math.max(1, this.stages.length)), Math.max(1, height)];
  }

  /** Moves the camera along with a grain of the first run. */
  follow(state) {
    const target = this.stages[0]?.grainPosition(state.follow, state.time);
    if (!target) {
      this.followed = null;
      return;
    }
    const step = target.clone().sub(this.followed ?? this.controls.target);
    if (!this.followed) {
      const offset = this.camera.position.clone().sub(this.controls.target);
      const near = (14 * this.stages[0].run.grains[state.follow].scale) / this.stages[0].unit;
      offset.setLength(Math.min(offset.length(), Math.max(near, 0.05)));
      this.camera.position.copy(target).add(offset);
      this.controls.target.copy(target);
    } else {
      this.camera.position.add(step);
      this.controls.target.add(step);
    }
    this.followed = target;
    this.controls.update();
  }

  /** Ranges of the colours that cover all runs; no range of the slices until all are known. */
  scales(state) {
    const grain = Math.max(...this.stages.map(({ run }) => (run.rows && state.colour !== "grain" ? run.grainScale(state.colour) : 0)));
    const shown = this.stages.filter((stage) => stage.series(state));
    const fields = shown.map((stage) => stage.run.fieldScale(stage.series(state), state.quantity));
    if (!fields.length || fields.includes(null)) return { grain, field: null };
    const high = Math.max(...fields.map((scale) => scale.high));
    return { grain, field: { ...fields[0], low: fields[0].signed ? -high : 0, high } };
  }

  /** Draws all runs. */
  draw(state, colours) {
    const { renderer, camera, canvas } = this;
    const { clientWidth: width, clientHeight: height } = canvas;
    if (!width || !height || !this.stages.length) return;
    const ratio = this.quality * Math.min(2, window.devicePixelRatio || 1);
    const size = renderer.getSize(new THREE.Vector2());
    if (size.x !== width || size.y !== height || renderer.getPixelRatio() !== ratio) {
      renderer.setPixelRatio(ratio);
      renderer.setSize(width, height, false);
    }
    this.follow(state);
    renderer.setScissorTest(true);
    renderer.setClearColor(new THREE.Color(theme("--canvas")), 1);
    const part = width / this.stages.length;
    camera.aspect = part / height;
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    this.colourScales = this.scales(state);
    this.stages.forEach((stage, i) => {
      stage.update(state, colours, this.colourScales);
      stage.turnLight(camera);
      renderer.setViewport(i * part, 0, part, height);
      renderer.setScissor(i * part, 0, part, height);
      renderer.render(stage.scene, camera);
    });
  }

  /** Part of the canvas at a point, and the point in device coordinates of that part. */
  locate(x, y) {
    const [width, height] = this.partSize();
    const i = Math.min(this.stages.length - 1, Math.floor(x / width));
    return { i, point: new THREE.Vector2((2 * (x - i * width)) / width - 1, 1 - (2 * y) / height) };
  }

  /** Run and grain at a point of the canvas [CSS px], or null. */
  pick(x, y) {
    const { i, point } = this.locate(x, y);
    const ray = new THREE.Raycaster();
    ray.setFromCamera(point, this.camera);
    this.stages[i].scene.updateMatrixWorld();
    const grain = this.stages[i].grains?.pick(ray) ?? null;
    return grain === null ? null : { run: this.stages[i].run.index, grain };
  }

  /** Point of the canvas [CSS px] at a position in metres of the i-th run shown. */
  project(position, i = 0) {
    const [width, height] = this.partSize();
    const stage = this.stages[i];
    const point = new THREE.Vector3(...position).sub(stage.centre).divideScalar(stage.unit);
    point.project(this.camera);
    return [i * width + (0.5 + 0.5 * point.x) * width, (0.5 - 0.5 * point.y) * height];
  }
}
