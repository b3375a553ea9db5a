// Slice of a field, with arrows of the velocity in its plane.

import * as THREE from "three";

const PLANE_AXES = [[1, 2], [0, 2], [0, 1]];
/** Arrows along the shorter edge of a slice. */
const ARROWS = 11;
/** Up to this number of grains the slice is drawn behind all of them. */
const BACKDROP = 12;

const vertexShader = `
  varying vec2 place;
  void main() {
    place = uv;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  }`;

const fragmentShader = `
  uniform sampler2D codes, solid, map;
  uniform vec2 range, scale;
  uniform vec3 grey;
  varying vec2 place;
  void main() {
    float value = mix(range.x, range.y, texture2D(codes, place).r);
    float s = clamp((value - scale.x) / (scale.y - scale.x), 0.0, 1.0);
    vec3 fluid = texture2D(map, vec2((s * 255.0 + 0.5) / 256.0, 0.5)).rgb;
    // Grains at the time of the slice are grey, as in the figures of the report.
    float part = smoothstep(0.35, 0.65, texture2D(solid, place).r);
    gl_FragColor = vec4(mix(fluid, grey, part), 1.0);
  }`;

function texture(width, height, format = THREE.RedFormat) {
  const bytes = new Uint8Array(width * height * (format === THREE.RedFormat ? 1 : 4));
  const image = new THREE.DataTexture(bytes, width, height, format);
  image.minFilter = THREE.LinearFilter;
  image.magFilter = THREE.LinearFilter;
  image.unpackAlignment = 1;
  return image;
}

/** Flat arrow of length 1 along x, centred, in the plane z = 0. */
function arrowShape() {
  const shape = new THREE.Shape();
  const outline = [[-0.5, -0.03], [0.16, -0.03], [0.16, -0.13], [0.5, 0], [0.16, 0.13], [0.16, 0.03], [-0.5, 0.03]];
  outline.forEach(([x, y], i) => (i ? shape.lineTo(x, y) : shape.moveTo(x, y)));
  return new THREE.ShapeGeometry(shape);
}

export class Slice {
  constructor(run, series) {
    this.run = run;
    this.series = series;
    const [nx, ny] = series.frames[0].cells;
    const uniforms = {
      codes: { value: texture(nx, ny) },
      solid: { value: texture(nx, ny) },
      map: { value: texture(256, 1, THREE.RGBAFormat) },
      range: { value: new THREE.Vector2() },
      scale: { value: new THREE.Vector2(0, 1) },
      grey: { value: new THREE.Vector3() },
    };
    const material = new THREE.ShaderMaterial({
      uniforms, vertexShader, fragmentShader,
      side: THREE.DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
    });
    this.plane = new THREE.Mesh(this.geometry(series.frames[0]), material);
    this.plane.frustumCulled = false;
    // Few grains are never hidden by the slice; many would hide it, if they lay behind.
    material.depthWrite = run.count > BACKDROP;
    this.plane.renderOrder = -1;
    const ink = new THREE.MeshBasicMaterial({ side: THREE.DoubleSide, transparent: true, opacity: 0.8, depthWrite: false });
    this.arrows = new THREE.InstancedMesh(arrowShape(), ink, 4000);
    this.arrows.frustumCulled = false;
    this.group = new THREE.Group();
    this.group.add(this.plane, this.arrows);
  }

  /** Rectangle in the plane, with texture coordinates along its two axes. */
  geometry(frame) {
    const [a, b] = PLANE_AXES[this.series.axis];
    const corners = [[0, 0], [1, 0], [0, 1], [1, 1]];
    const points = corners.flatMap(([s, t]) => {
      const point = [0, 0, 0];
      point[a] = s * frame.cells[0] * frame.spacing[0];
      point[b] = t * frame.cells[1] * frame.spacing[1];
      return point;
    });
    const shape = new THREE.BufferGeometry();
    shape.setAttribute("position", new THREE.Float32BufferAttribute(points, 3));
    shape.setAttribute("uv", new THREE.Float32BufferAttribute(corners.flat(), 2));
    shape.setIndex([0, 1, 2, 1, 3, 2]);
    return shape;
  }

  /** Shows a quantity at a time; returns the scale and the time of the frame, or null. */
  update(time, state, colours, scale) {
    const { run, series, plane } = this;
    const frame = run.frame(series, time);
    const codes = run.frameCodes(frame);
    this.group.visible = Boolean(scale && codes);
    if (!this.group.visible) return null;
    const { uniforms } = plane.material;
    const count = frame.cells[0] * frame.cells[1];
    const field = series.fields.indexOf(state.quantity);
    const shown = [series.frames.indexOf(frame), field, colours.dark, scale.high].join(" ");
    if (shown !== this.shown) {
      this.shown = shown;
      uniforms.codes.value.image.data = codes.subarray(field * count, (field + 1) * count);
      uniforms.solid.value.image.data = codes.subarray(6 * count, 7 * count);
      uniforms.map.value.image.data = colours.map(scale.signed);
      for (const name of ["codes", "solid", "map"]) uniforms[name].value.needsUpdate = true;
      uniforms.range.value.fromArray(frame.ranges[field]);
      uniforms.scale.value.set(scale.low, scale.high);
      uniforms.grey.value.setScalar(colours.dark ? 0.3 : 0.85);
      const corner = [...frame.corner];
      this.group.position.fromArray(corner);
      this.placeArrows(frame, codes);
    }
    this.arrows.visible = state.arrows;
    this.arrows.material.color.set(colours.dark ? 0xffffff : 0x1c2733);
    return { ...scale, time: frame.time };
  }

  placeArrows(frame, codes) {
    const { run, series, arrows } = this;
    const [a, b] = PLANE_AXES[series.axis];
    const names = ["u", "v", "w"];
    const size = [0, 1].map((i) => frame.cells[i] * frame.spacing[i]);
    const step = Math.min(...size) / ARROWS;
    const counts = size.map((s) => Math.max(1, Math.round(s / step)));
    const field = (name) => Math.max(...series.frames.map((f) => Math.max(...f.ranges[series.fields.indexOf(name)].map(Math.abs))));
    this.largest ??= field("speed") || 1;
    const normal = [0, 0, 0];
    normal[series.axis] = 1;
    const [x, y, z] = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3(...normal)];
    const matrix = new THREE.Matrix4();
    let n = 0;
    for (let j = 0; j < counts[1]; j++) {
      for (let i = 0; i < counts[0]; i++) {
        const [s, t] = [(i + 0.5) / counts[0], (j + 0.5) / counts[1]];
        if (run.valueAt(series, frame, codes, "solid", s, t) > 0.1 || n >= 4000) continue;
        const [p, q] = [a, b].map((axis) => run.valueAt(series, frame, codes, names[axis], s, t));
        const part = Math.hypot(p, q) / this.largest;
        if (part < 0.03) continue;
        const direction = [0, 0, 0];
        [direction[a], direction[b]] = [p, q];
        x.fromArray(direction).normalize();
        y.crossVectors(z, x);
        // The square root keeps slow regions visible.
        const length = 1.15 * step * Math.sqrt(Math.min(1, part));
        matrix.makeBasis(x.clone().multiplyScalar(length), y.clone().multiplyScalar(length), z);
        const point = [0, 0, 0];
        [point[a], point[b]] = [s * size[0], t * size[1]];
        matrix.setPosition(...point);
        arrows.setMatrixAt(n++, matrix);
      }
    }
    arrows.count = n;
    arrows.instanceMatrix.needsUpdate = true;
  }

  dispose() {
    const { codes, solid, map } = this.plane.material.uniforms;
    for (const one of [codes.value, solid.value, map.value, this.plane.geometry, this.plane.material, this.arrows.geometry, this.arrows.material, this.arrows]) one.dispose();
  }
}
