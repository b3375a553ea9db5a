// Grains of one run: one instanced mesh per shape.

import * as THREE from "three";
import { mergeVertices } from "three/addons/utils/BufferGeometryUtils.js";
import { GRAIN_MAP, onMap } from "./colours.js";

/** From this number of grains on, meshes and lighting are simpler. */
const MANY = 300;

function geometry(mesh, count) {
  if (mesh.kind === "sphere") {
    const sphere = new THREE.IcosahedronGeometry(1, count > MANY ? 3 : count > 30 ? 5 : 12);
    sphere.deleteAttribute("uv");
    // Shared vertices are computed once instead of once for each of six triangles.
    return mergeVertices(sphere);
  }
  const shape = new THREE.BufferGeometry();
  shape.setAttribute("position", new THREE.BufferAttribute(mesh.points, 3));
  shape.setIndex(new THREE.BufferAttribute(mesh.triangles, 1));
  shape.computeVertexNormals();
  return shape;
}

export class Grains {
  constructor(run) {
    this.run = run;
    this.group = new THREE.Group();
    const members = run.meshes.map(() => []);
    run.grains.forEach((grain, i) => i < run.count && members[grain.mesh]?.push(i));
    this.parts = run.meshes.map((mesh, m) => {
      const material = run.count > MANY
        ? new THREE.MeshLambertMaterial()
        : new THREE.MeshStandardMaterial({ roughness: 0.62, metalness: 0 });
      const shape = geometry(mesh, members[m].length);
      const part = new THREE.InstancedMesh(shape, material, members[m].length);
      part.frustumCulled = false;
      part.userData.grains = members[m];
      this.group.add(part);
      return part;
    });
    this.scratch = { position: [0, 0, 0], orientation: [0, 0, 0, 1] };
  }

  /** Moves and colours the grains. */
  update(place, state, colours, high) {
    const { run, scratch } = this;
    const matrix = new THREE.Matrix4();
    const position = new THREE.Vector3();
    const turn = new THREE.Quaternion();
    const scale = new THREE.Vector3();
    const colour = new THREE.Color();
    for (const part of this.parts) {
      part.userData.grains.forEach((grain, i) => {
        const known = run.position(grain, place, scratch.position);
        run.orientation(grain, place, scratch.orientation);
        position.fromArray(scratch.position);
        turn.fromArray(scratch.orientation);
        scale.setScalar(known ? run.grains[grain].scale : 0);
        if (!known) position.set(0, 0, 0);
        part.setMatrixAt(i, matrix.compose(position, turn, scale));
        colour.setRGB(...this.colour(grain, place, state, colours, high), THREE.SRGBColorSpace);
        part.setColorAt(i, colour);
      });
      part.instanceMatrix.needsUpdate = true;
      if (part.instanceColor) part.instanceColor.needsUpdate = true;
      part.boundingSphere = null;
    }
  }

  colour(grain, place, state, colours, high) {
    if (state.colour === "grain") return colours.grain(this.run.rank(grain));
    const value = this.run.number(state.colour, grain, place);
    if (value === null || !Number.isFinite(value)) return [0.6, 0.6, 0.6];
    return onMap(GRAIN_MAP, high > 0 ? value / high : 0);
  }

  /** Grain under a ray, or null. */
  pick(raycaster) {
    const hit = raycaster.intersectObjects(this.parts, false)[0];
    return hit ? hit.object.userData.grains[hit.instanceId] : null;
  }

  dispose() {
    for (const part of this.parts) {
      part.geometry.dispose();
      part.material.dispose();
      part.dispose();
    }
  }
}
