// The path of a point of the robot over the last seconds, as a band that faces the camera and fades with age.

import {BufferAttribute, BufferGeometry, Color, DoubleSide, Mesh, MeshBasicMaterial, Quaternion, Vector3} from './vendor/three.module.min.js';
import {kPose, kRate_Hz} from './robot_record.js';

const kEvery = 3;               // frames from point to point
const kPoints = 5 * kRate_Hz / kEvery;
const kWidth_px = 3;

export class Trail {
  constructor(scene) {
    const geometry = new BufferGeometry();
    const faces = Array.from({length: kPoints - 1}, (_, n) => [0, 1, 2, 2, 1, 3].map((corner) => 2 * n + corner)).flat();
    geometry.setIndex(faces);
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(6 * kPoints), 3));
    geometry.setAttribute('color', new BufferAttribute(new Float32Array(8 * kPoints), 4));
    this.band = new Mesh(geometry, new MeshBasicMaterial({vertexColors: true, transparent: true, depthWrite: false, side: DoubleSide, fog: false}));
    this.band.frustumCulled = false;
    scene.add(this.band);
    this.colour = new Color();
    this.points = Array.from({length: kPoints}, () => new Vector3());
  }

  paint(colour) {
    this.colour.set(colour);
  }

  /// Shows the path of a point {body, at} until frame `end` of the record. `high_px` is the picture's height.
  show(record, end, point, camera, high_px) {
    const count = point ? this.collect(record, end, point) : 0;
    const {position, color} = this.band.geometry.attributes;
    const perPixel = 2 * Math.tan(camera.fov * Math.PI / 360) / high_px;  // width of a pixel at a distance of 1
    const [view, side] = [new Vector3(), new Vector3()];
    for (let n = 0; n < count; ++n) {
      const here = this.points[n];
      view.copy(camera.position).sub(here);
      const half = view.length() * perPixel * kWidth_px / 2;
      side.copy(this.points[Math.min(n + 1, count - 1)]).sub(this.points[Math.max(n - 1, 0)]).cross(view).setLength(half);
      position.setXYZ(2 * n, here.x + side.x, here.y + side.y, here.z + side.z);
      position.setXYZ(2 * n + 1, here.x - side.x, here.y - side.y, here.z - side.z);
      for (const corner of [0, 1]) color.setXYZW(2 * n + corner, this.colour.r, this.colour.g, this.colour.b, (n + 1) / count);
    }
    position.needsUpdate = color.needsUpdate = true;
    this.band.visible = count > 1;
    this.band.geometry.setDrawRange(0, 6 * Math.max(0, count - 1));
  }

  /// Takes frames whose number is a multiple of kEvery, then the newest. Returns the number of points.
  collect(record, end, {body, at}) {
    const turn = new Quaternion();
    let count = 0;
    const take = (number) => {
      const {poses} = record.frame(number);
      const [x, y, z, qw, qx, qy, qz] = poses.subarray(body * kPose, (body + 1) * kPose);
      const here = this.points[count].fromArray(at).applyQuaternion(turn.set(qx, qy, qz, qw));
      here.x += x;
      here.y += y;
      here.z += z;
      // A point at rest adds nothing.
      if (count === 0 || here.distanceToSquared(this.points[count - 1]) > 1e-10) ++count;
    };
    const first = Math.max(record.begin, (Math.floor(end / kEvery) - kPoints + 2) * kEvery);
    for (let number = Math.ceil(first / kEvery) * kEvery; number < end; number += kEvery) take(number);
    if (record.end > record.begin) take(end);
    return count;
  }
}
