// Sliders that turn joints by hand while their drives are off.

import {post} from './api.js';
import {el, note, setText} from './dom.js';
import {fixed} from './format.js';
import {liveValues} from './live.js';
import {driveKey, driveOf, store} from './store.js';
import {t} from './words.js';

const kPeriod_ms = 40;   // a held joint is put back this often

/// Returns why the joint cannot be turned by hand; null: it can.
function obstacle({bus, id}) {
  if (!store.mayWrite) return t('page_only_looks');
  if (!store.connected) return t('lost');
  const drive = bus === null ? null : driveOf(driveKey(bus, id));
  const now = drive && liveValues(drive);
  return now && now.alive !== 0 && now.bridge_on !== 0 ? t('joint_driven', {id}) : null;
}

export class JointSliders {
  constructor(joints) {
    this.bus = joints.find(({bus}) => bus !== null)?.bus;
    this.held = new Map();  // angle in degrees by row
    this.rows = joints.map((joint) => this.row(joint));
    this.root = el('div', {class: 'robot-joints', role: 'group', tabindex: 0, 'aria-label': t('robot_joints')}, ...this.rows.map(({root}) => root));
  }

  row(joint) {
    const [from, to] = joint.range_deg ?? [-180, 180];
    const slider = el('input', {type: 'range', min: Math.ceil(from - 1e-6), max: Math.floor(to + 1e-6), step: 1, 'aria-label': joint.name});
    const angle = el('output', {class: 'mono'});
    const row = {joint, slider, angle, turns_deg: 0, root: el('div', {}, el('span', {text: joint.name}), slider, angle)};
    slider.addEventListener('input', () => {
      this.held.set(row, row.turns_deg + Number(slider.value));
      this.tell();
    });
    for (const end of ['change', 'blur']) slider.addEventListener(end, () => this.held.delete(row));
    return row;
  }

  /// Shows the angles of all joints, in degrees, and which can be turned.
  show(joints_deg) {
    this.rows.forEach((row, n) => {
      const why = obstacle(row.joint);
      row.slider.disabled = why !== null;
      row.root.title = why ?? '';
      if (why) this.held.delete(row);
      if (this.held.has(row)) return;
      row.turns_deg = row.joint.range_deg ? 0 : 360 * Math.round(joints_deg[n] / 360);
      row.slider.value = joints_deg[n] - row.turns_deg;
      setText(row.angle, `${fixed(joints_deg[n], 0)}°`);
    });
  }

  /// Sends the held angles until the sliders are released.
  async tell() {
    if (this.telling) return;
    this.telling = true;
    try {
      do {
        const joints_deg = Object.fromEntries([...this.held].map(([{joint}, angle_deg]) => [joint.name, angle_deg]));
        const next = performance.now() + kPeriod_ms;
        for (const [{angle}, angle_deg] of this.held) setText(angle, `${fixed(angle_deg, 0)}°`);
        await post('/directives', {bus: this.bus, pose: {joints_deg}});
        await new Promise((resolve) => setTimeout(resolve, next - performance.now()));
      } while (this.held.size);
    } catch (problem) {
      this.held.clear();
      note(problem.message, true);
    }
    this.telling = false;
  }
}
