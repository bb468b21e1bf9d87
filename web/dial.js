// Dial of a shaft seen from its end: position, target, and encoder zero.

import {el, svg} from './dom.js';
import {fixed} from './format.js';
import {t} from './words.js';

const kTicks = 12;
const kTrailStep_deg = 3;

function ticks() {
  const group = svg('g', {class: 'ticks'});
  for (let n = 0; n < kTicks; ++n) {
    const long = n % 3 === 0;
    group.append(svg('path', {d: `M0 ${long ? -46 : -47.5}V-50`, transform: `rotate(${n * 360 / kTicks})`}));
  }
  return group;
}

/// Returns the positions on the dial in degrees of the output shaft, clockwise; null: not shown.
export function shaftOf(drive, now) {
  const gear = drive.built?.gear_ratio ?? 1;
  const shaft = now.true_angle_deg;
  const alive = now.alive !== 0;
  // GET /drives says whether there is a target; the stream has its newest value.
  const following = alive && drive.setpoint?.angle_deg !== undefined;
  const counts = drive.built?.encoder_counts ?? 65536;
  const perCount = 360 * (drive.built?.encoder_turns ?? 1) / counts / gear;
  return {
    shaft,
    target: following ? shaft + (now.angle_ref_deg - now.angle_deg) / gear : null,
    zero: shaft - now.encoder * perCount,
    speed: now.true_speed_dps,
    alive,
    bridge: now.bridge_on !== 0,
  };
}

/// Rotates by style, not by attribute: hands are separate layers (views.css), so the browser need not redraw them.
/// Skips invisible changes.
function turn(node, deg) {
  const rounded = Math.round((deg ?? 0) * 5) / 5;
  if (node.shownAt === rounded) return;
  node.shownAt = rounded;
  node.style.transform = `rotate(${rounded}deg)`;
}

/// With `onTurn(degrees)` the dial can be turned by mouse or arrow keys while `mayTurn()` is true.
export class Dial {
  constructor({onTurn = null, mayTurn = () => true, label}) {
    this.zero = svg('g', {class: 'zero'}, svg('path', {d: 'M0 -41L-4 -49H4Z'}));
    this.target = svg('g', {class: 'target'}, svg('path', {d: 'M0 -22V-44'}), svg('circle', {cy: -40, r: 3.4}));
    this.trail = svg('path', {class: 'trail'});
    this.shaft = svg('g', {class: 'shaft'}, this.trail, svg('path', {class: 'hand', d: 'M0 -8V-30'}), svg('circle', {class: 'hub', r: 5}));
    this.face = svg('svg', {viewBox: '-52 -52 104 104', 'aria-hidden': 'true'},
      svg('circle', {class: 'rim', r: 50}), ticks(), svg('circle', {class: 'disc', r: 30}), this.zero, this.shaft, this.target);
    this.root = el('div', {class: 'dial', role: onTurn ? 'slider' : 'img', 'aria-label': label}, this.face);
    this.label = label;
    if (onTurn) this.makeTurnable(onTurn, mayTurn);
  }

  show({shaft, target, zero, speed, alive, bridge}) {
    turn(this.shaft, shaft);
    turn(this.zero, zero);
    if (target !== null) turn(this.target, target);
    const look = `${alive ? '' : 'dead '}${alive && !bridge ? 'free ' : ''}${target === null ? 'aimless' : ''}`;
    if (look !== this.look) this.face.setAttribute('class', look);
    this.look = look;
    this.drawTrail(speed);
  }

  /// Draws an arc behind the pointer, as long as its motion in 60 ms, to show the speed.
  drawTrail(speed) {
    const sweep = Math.max(-300, Math.min(300, Math.round((speed ?? 0) * 0.06 / kTrailStep_deg) * kTrailStep_deg));
    if (sweep === this.sweep) return;
    this.sweep = sweep;
    if (sweep === 0) {
      this.trail.removeAttribute('d');
      return;
    }
    const at = (deg) => {
      const angle = (deg - 90) * Math.PI / 180;
      return `${(30 * Math.cos(angle)).toFixed(2)} ${(30 * Math.sin(angle)).toFixed(2)}`;
    };
    const large = Math.abs(sweep) > 180 ? 1 : 0;
    this.trail.setAttribute('d', `M${at(-sweep)}A30 30 0 ${large} ${sweep > 0 ? 1 : 0} ${at(0)}`);
  }

  /// Describes the dial for screen readers; not called for every frame.
  say({shaft}) {
    const angle = `${fixed(((shaft % 360) + 360) % 360, 1)}°`;
    if (this.root.getAttribute('role') === 'slider') {
      this.root.setAttribute('aria-valuenow', (((shaft % 360) + 360) % 360).toFixed(0));
      this.root.setAttribute('aria-valuetext', angle);
    } else {
      this.root.setAttribute('aria-label', t('shaft_at', {label: this.label, angle}));
    }
  }

  makeTurnable(onTurn, mayTurn) {
    const root = this.root;
    root.classList.add('turnable');
    root.tabIndex = 0;
    root.setAttribute('aria-valuemin', '0');
    root.setAttribute('aria-valuemax', '360');
    root.title = t('turn_hint');
    let last = null;
    const angleAt = (event) => {
      const box = this.face.getBoundingClientRect();
      return Math.atan2(event.clientX - (box.left + box.width / 2), (box.top + box.height / 2) - event.clientY) * 180 / Math.PI;
    };
    root.addEventListener('pointerdown', (event) => {
      if (!mayTurn()) return;
      last = angleAt(event);
      root.setPointerCapture(event.pointerId);
      root.classList.add('held');
      event.preventDefault();
      root.focus();
    });
    root.addEventListener('pointermove', (event) => {
      if (last === null) return;
      const angle = angleAt(event);
      onTurn(((angle - last + 540) % 360) - 180);
      last = angle;
    });
    const release = () => {
      last = null;
      root.classList.remove('held');
    };
    root.addEventListener('pointerup', release);
    root.addEventListener('pointercancel', release);
    root.addEventListener('keydown', (event) => {
      const step = {ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 15, PageDown: -15}[event.key];
      if (!step) return;
      event.preventDefault();
      if (mayTurn()) onTurn(event.shiftKey ? step / 10 : step);
    });
  }
}
