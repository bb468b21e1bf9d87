// Pulls at a body of the robot by mouse; the force is proportional to the distance.

import {post} from './api.js';
import {note} from './dom.js';
import {clockFactor} from './store.js';

const kPeriod_ms = 100;        // duration of a push; the next one replaces it, and none follows if the page closes
const kWeightsAtReach = 1;      // assumed: at a distance of the robot's reach the force is the robot's weight
const kGravity_m_s2 = 9.81;

export class Hand {
  /// `shape` is that of GET /body; `mayPush()` returns permission; `changed()` is called to request a redraw.
  constructor(scene, shape, canvas, {mayPush, changed}) {
    this.scene = scene;
    this.shape = shape;
    this.changed = changed;
    this.strength_N_m = kWeightsAtReach * kGravity_m_s2 * shape.mass_kg / scene.radius;
    this.bus = shape.joints.find(({bus}) => bus !== null)?.bus;
    this.held = null;
    this.telling = false;
    canvas.addEventListener('pointermove', (event) => this.held && event.pointerId === this.held.pointer && this.move(...this.place(canvas, event)));
    for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, () => this.release());
    this.take = (event) => {
      if (event.button !== 0 || event.shiftKey || !mayPush()) return false;
      const hit = scene.pick(...this.place(canvas, event));
      if (!hit || !shape.bodies[hit.body].name) return false;
      this.held = {pointer: event.pointerId, body: hit.body, at: scene.inBody(hit.body, hit.point), to: hit.point.clone()};
      canvas.setPointerCapture(event.pointerId);
      return true;
    };
  }

  place(canvas, event) {
    const box = canvas.getBoundingClientRect();
    return [2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height];
  }

  move(x, y) {
    this.held.to = this.scene.along(x, y, this.scene.fromBody(this.held.body, this.held.at));
    this.changed();
    this.tell();
  }

  release() {
    if (!this.held) return;
    this.held = null;
    this.changed();
  }

  /// Returns contact point and force in the world, x y z fx fy fz; null: no body is held.
  force() {
    if (!this.held) return null;
    const point = this.scene.fromBody(this.held.body, this.held.at);
    return [...point.toArray(), ...this.held.to.clone().sub(point).multiplyScalar(this.strength_N_m).toArray()];
  }

  /// Sends pushes while a body is held. The program takes forces at the centre of mass, so a torque is added.
  async tell() {
    if (this.telling) return;
    this.telling = true;
    try {
      while (this.held) {
        const {name, centre_m} = this.shape.bodies[this.held.body];
        const [x, y, z, ...force_N] = this.force();
        const centre = this.scene.fromBody(this.held.body, this.scene.vector(centre_m));
        const torque_Nm = this.scene.vector([x, y, z]).sub(centre).cross(this.scene.vector(force_N)).toArray();
        const next = performance.now() + kPeriod_ms;
        await post('/directives', {bus: this.bus, push: {body: name, force_N, torque_Nm, for_s: kPeriod_ms / 1000 * (clockFactor() || 1)}});
        await new Promise((resolve) => setTimeout(resolve, next - performance.now()));
      }
    } catch (problem) {
      this.release();
      note(problem.message, true);
    }
    this.telling = false;
  }
}
