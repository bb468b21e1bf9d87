// The robot next to the dials, if drives move the joints of a body (GET /body): live, or a replay of the last minute.

import {get, stream} from './api.js';
import {el, setText} from './dom.js';
import {drawing} from './drawing.js';
import {fixed} from './format.js';
import {OrbitCamera} from './robot_camera.js';
import {JointSliders} from './robot_joints.js';
import {kRate_Hz, RobotRecord} from './robot_record.js';
import {driveKey, on, store} from './store.js';
import {t} from './words.js';

const kWords_ms = 200;          // between updates of texts, so that people can read them
const kArrowsAtWeight = 0.6;    // assumed: arrow length of the robot's weight, as a share of the robot's reach
const kClick_px = 4;            // longer movements are drags

let view = null;                // of the current program
let visible = false;

/// Returns the colours of the page for code that style sheets cannot reach.
function pageColours() {
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(`--${name}`).trim();
  return {sky: colour('sky'), haze: colour('haze'), floor: colour('floor'), floor2: colour('floor-2'), contact: colour('zero'), hand: colour('target'), trail: colour('accent'), good: colour('good'),
    warn: colour('warn'), bad: colour('bad'), dim: colour('dim')};
}

class RobotView {
  /// `onJoints` is called with the joints, `onPoint` with the drive (or null) under the mouse, `onPick` with a clicked one.
  constructor(links) {
    this.links = links;
    this.canvas = el('canvas', {tabindex: 0, 'aria-label': t('robot_keys')});
    this.box = el('div', {class: 'robot-box'}, this.canvas);
    this.root = el('section', {class: 'panel robot', id: 'robot', 'aria-label': t('robot')}, this.box);
    this.dirty = true;
    this.cursor = null;         // frame on display while paused; null: the newest
    this.playing = false;
    this.trailed = null;        // point whose path is drawn, {body, at} in the body's frame
    this.sliders = null;
    this.drawn = 0;             // frames drawn
    this.work_ms = 0;           // total CPU time of all frames, without WebGL
    this.run = drawing((at) => this.frame(at));
  }

  /// Loads three.js and its users only if there is a robot.
  async begin() {
    const [shape, {RobotScene}, {Trail}, {Colouring, jointValues, kColourings}, {Hand}] = await Promise.all(
      [get('/body'), import('./robot_scene.js'), import('./robot_trail.js'), import('./robot_colours.js'), import('./robot_push.js')]);
    Object.assign(this, {shape, jointValues, kColourings});
    try {
      this.scene = new RobotScene(this.canvas, shape);
    } catch (problem) {
      console.debug(problem);
      this.box.replaceWith(el('p', {class: 'dim', text: t('robot_no_webgl')}));
      return;
    }
    this.record = new RobotRecord(shape.bodies.length, shape.joints.length, kColourings.length);
    this.colouring = new Colouring(shape.joints);
    this.scene.measure(shape.poses.flat());
    this.path = new Trail(this.scene.scene);
    this.paint();
    this.hand = new Hand(this.scene, shape, this.canvas, {
      mayPush: () => store.mayWrite && store.connected && this.cursor === null, changed: () => (this.dirty = true)});
    this.camera = new OrbitCamera(this.scene.camera, this.canvas, {moved: () => (this.dirty = true), taken: (event) => this.hand.take(event)});
    this.follows = shape.bodies.findIndex((body) => body.free);  // -1: a fixed robot, the camera stays
    this.followIt(Float32Array.from(shape.poses.flat()));
    this.buildControls();
    this.links.onJoints(shape.joints);
    this.linkJoints();
    this.resizes = new ResizeObserver(() => this.resize());
    this.resizes.observe(this.box);
    this.resize();
    this.look();
  }

  paint() {
    const colours = pageColours();
    this.scene.paint(colours);
    this.path.paint(colours.trail);
    this.colouring.paint(colours);
    this.dirty = true;
  }

  buildControls() {
    const button = (text, onclick, attributes = {}) => el('button', {type: 'button', onclick, ...attributes}, text);
    this.ways = this.kColourings.map((what) => button(t(`robot_${what}`), () => this.colourBy(what)));
    this.arrows = button(t('robot_contacts'), () => {
      this.arrows.setAttribute('aria-pressed', this.arrows.getAttribute('aria-pressed') !== 'true');
      this.dirty = true;
    }, {'aria-pressed': 'true', title: t('robot_contacts_about')});
    this.trailing = button(t('robot_trail'), () => this.trail(this.trailed ? null : this.lastTrailed), {'aria-pressed': 'false', title: t('robot_trail_about')});
    this.lastTrailed = {body: this.follows < 0 ? this.shape.bodies.length - 1 : this.follows, at: [0, 0, 0]};
    this.turning = button(t('robot_joints'), () => this.turnJoints(!this.sliders), {'aria-expanded': 'false', title: t('robot_joints_about')});
    this.legend = el('p', {class: 'robot-legend dim'});
    this.hint = el('p', {class: 'robot-hint dim'});
    this.play = button('▶', () => this.togglePlay(), {'aria-label': t('robot_play'), title: t('robot_play')});
    this.live = button(t('robot_live'), () => this.hold(null), {'aria-pressed': 'true'});
    this.slider = el('input', {type: 'range', min: 0, max: 0, step: 1, 'aria-label': t('robot_slider'),
      oninput: () => this.hold(this.record.begin + Number(this.slider.value))});
    this.when = el('span', {class: 'robot-when mono'});
    this.box.append(el('div', {class: 'robot-notes'}, this.legend, this.hint));
    this.root.prepend(el('div', {class: 'row', role: 'group', 'aria-label': t('robot_colours')}, el('span', {class: 'dim', text: t('robot_colours')}),
      ...this.ways, this.arrows, this.trailing, this.turning, button(t('robot_home'), () => this.camera.reset())));
    this.root.append(el('div', {class: 'row robot-replay'}, this.play, this.slider, this.when, this.live));
    this.colourBy(this.kColourings[0]);
    this.applyWanted();
  }

  /// Returns the key of the drive whose joint is under the mouse; null: none.
  driveAt(event) {
    const {bus = null, id} = this.shape.joints[this.scene.jointAt(...this.hand.place(this.canvas, event))] ?? {};
    return bus === null ? null : driveKey(bus, id);
  }

  linkJoints() {
    let pressed = null;
    this.canvas.addEventListener('pointerdown', (event) => { pressed = event; });
    this.canvas.addEventListener('pointermove', (event) => {
      const key = event.buttons ? this.pointed : this.driveAt(event);
      if (key === this.pointed) return;
      this.pointed = key;
      const joint = this.shape.joints.find(({bus, id}) => driveKey(bus, id) === key);
      this.canvas.title = joint ? `${joint.name}, ${t('drive', {name: key})}` : '';
      this.links.onPoint(key);
    });
    this.canvas.addEventListener('pointerleave', () => this.links.onPoint(this.pointed = null));
    this.canvas.addEventListener('pointerup', (event) => {
      if (!pressed || Math.hypot(event.clientX - pressed.clientX, event.clientY - pressed.clientY) >= kClick_px) return;
      const key = this.driveAt(event);
      if (key) this.links.onPick(key);
      const point = this.scene.pointAt(...this.hand.place(this.canvas, event));
      if (point) this.trail(point);
    });
  }

  /// Draws the path of a point {body, at}; null: none.
  trail(point) {
    this.trailed = point;
    this.lastTrailed = point ?? this.lastTrailed;
    this.trailing.setAttribute('aria-pressed', point !== null);
    this.dirty = true;
  }

  /// Shows the sliders of the joints, or removes them.
  turnJoints(yes) {
    this.sliders?.root.remove();
    this.sliders = yes ? new JointSliders(this.shape.joints) : null;
    if (yes) this.box.append(this.sliders.root);
    this.turning.setAttribute('aria-expanded', yes);
    this.wordsAt = 0;
  }

  mark(key) {
    if (!this.scene?.joints) return;
    this.scene.lit = this.shape.joints.findIndex(({bus, id}) => driveKey(bus, id) === key);
    this.dirty = true;
  }

  colourBy(what) {
    this.colouring.what = what;
    this.ways.forEach((way, n) => way.setAttribute('aria-pressed', this.kColourings[n] === what));
    this.dirty = true;
    this.wordsAt = 0;
  }

  /// Applies the address, once the controls exist.
  applyWanted() {
    if (!this.wanted || !this.arrows) return;
    const {joints, contacts, trail, sliders} = this.wanted;
    const [body, ...at] = trail?.split(',').map(Number) ?? [];
    if (this.shape.bodies[body] && at.length === 3 && at.every(Number.isFinite)) this.trail({body, at});
    if (sliders) this.turnJoints(true);
    this.colourBy(this.kColourings.includes(joints) ? joints : this.colouring.what);
    if (contacts) this.arrows.setAttribute('aria-pressed', contacts !== 'off');
    this.wanted = null;
  }

  /// Pauses at the frame with this number; null: live.
  hold(number) {
    this.playing = false;
    this.cursor = number;
    this.live.setAttribute('aria-pressed', number === null);
    this.dirty = true;
    this.wordsAt = 0;
  }

  togglePlay() {
    const {record, cursor} = this;
    if (!this.playing && (cursor === null || cursor >= record.end - 1)) this.hold(record.begin);
    this.playing = !this.playing;
    this.wordsAt = 0;
  }

  /// Streams poses while visible.
  look() {
    const looked = visible && !document.hidden && this.slider !== undefined && this.root.isConnected;
    if (looked && !this.poses) {
      this.poses = stream('/body', {onMessage: (message) => this.take(message)});
    } else if (!looked && this.poses) {
      this.poses.close();
      this.poses = null;
    }
    this.run(looked);
  }

  take(message) {
    if (message.shape_changes !== this.shape.shape_changes) this.lookAtWorld();
    const values = this.jointValues(this.shape.joints);
    this.colouring.heed(values);
    this.record.add(message, values);
    this.joints_deg = message.joints_deg;
    if (this.cursor === null) this.dirty = true;
  }

  /// Shows the state of the drives also if no more poses come, since time stands.
  showState() {
    this.record?.revise(this.jointValues(this.shape.joints));
    if (this.record && this.cursor === null) this.dirty = true;
  }

  /// Reloads the world's geometry, e.g. after a new step on the floor. After a failure the next message retries.
  async lookAtWorld() {
    if (this.looking) return;
    this.looking = true;
    try {
      const {geoms, shape_changes} = await get('/body');
      if (!this.poses) return;
      this.scene.furnish(geoms);
      this.shape.shape_changes = shape_changes;
      this.dirty = true;
    } catch (problem) {
      console.debug(problem);
    } finally {
      this.looking = false;
    }
  }

  resize() {
    const {clientWidth: width, clientHeight: height} = this.box;
    if (!width || !height) return;
    this.high_px = height;
    this.scene.resize(width, height);
    this.camera.fit(this.scene.extent);
    this.dirty = true;
  }

  frame(at) {
    const began = performance.now();
    if (this.playing) this.goOn((at - this.drawnAt) * kRate_Hz / 1000);
    this.drawnAt = at;
    if (at - (this.wordsAt ?? 0) > kWords_ms) {
      this.wordsAt = at;
      this.say();
    }
    if (!this.dirty) return;
    this.show(this.record.frame(this.cursor === null ? this.record.end - 1 : Math.floor(this.cursor)));
    this.dirty = false;  // following has moved the camera
    this.work_ms += performance.now() - began;
    this.scene.draw();
    ++this.drawn;
  }

  /// Advances the replay; at its end it becomes live.
  goOn(frames) {
    this.cursor = Math.max(this.record.begin, this.cursor + Math.max(0, frames));
    this.dirty = true;
    if (this.cursor >= this.record.end - 1) this.hold(null);
  }

  show(frame) {
    const {scene, shape} = this;
    if (frame) {
      scene.pose(frame.poses);
      this.followIt(frame.poses);
    }
    const values = frame?.joints ?? [];
    for (let n = 0; n < shape.joints.length; ++n) scene.markJoint(n, this.colouring.colour(values, n), this.colouring.state(values, n));
    this.path.show(this.record, this.cursor === null ? this.record.end - 1 : Math.floor(this.cursor), this.trailed, scene.camera, this.high_px);
    const shown = frame && this.arrows.getAttribute('aria-pressed') === 'true' ? frame.contacts : [];
    scene.arrows(shown, this.hand.force(), kArrowsAtWeight * scene.radius / (9.81 * shape.mass_kg));
  }

  followIt(poses) {
    const at = this.follows * 7;
    const point = at < 0 ? [0, 0, 0] : [...poses.subarray(at, at + 3)];
    if (this.scene.extend(point)) this.camera.fit(this.scene.extent);
    this.camera.follow(...point);
  }

  say() {
    const {record} = this;
    const frame = record.frame(this.cursor === null ? record.end - 1 : Math.floor(this.cursor));
    this.slider.max = Math.max(0, record.end - record.begin - 1);
    this.slider.value = this.cursor === null ? this.slider.max : Math.floor(this.cursor) - record.begin;
    setText(this.when, frame ? `${fixed(frame.time_s, 2)} s` : '–');
    setText(this.play, this.playing ? '⏸' : '▶');
    if (this.joints_deg) this.sliders?.show(this.joints_deg);
    const ends = this.colouring.ends();
    if (ends) setText(this.legend, ends.join(' – '));
    else if (!this.legend.firstElementChild) this.legend.replaceChildren(...t('robot_error_legend').split('|').map((word) => el('span', {}, word)));
    this.legend.classList.toggle('scale', ends !== null);
    setText(this.hint, store.mayWrite ? t('robot_hint_push') : t('robot_hint'));
  }

  close() {
    this.run(false);
    this.poses?.close();
    this.resizes?.disconnect();
    this.scene?.close();
  }
}

/// Returns the panel of the robot; null if the drives move no body.
export function robotPanel(links) {
  view?.close();
  view = store.status.body ? new RobotView(links) : null;
  if (!view) return null;
  const mine = view;
  mine.begin().catch((problem) => {
    console.debug(problem);
    mine.box.replaceWith(el('p', {class: 'dim', text: t('robot_unknown', {why: problem.message})}));
  });
  return mine.root;
}

/// Marks the joint of a drive; null: none.
export const markDrive = (key) => view?.mark(key);

/// State of the robot in the address.
export const robotState = () => (view?.arrows ? {trail: view.trailed ? [view.trailed.body, ...view.trailed.at.map((value) => +value.toFixed(3))].join() : '',
  sliders: view.sliders ? 'on' : '', joints: view.colouring.what === view.kColourings[0] ? '' : view.colouring.what,
  contacts: view.arrows.getAttribute('aria-pressed') === 'true' ? '' : 'off'} : view?.wanted ?? {});

export function visitRobot(query) {
  if (!view) return;
  view.wanted = Object.fromEntries(query);
  view.applyWanted();
}

export function showRobot(yes) {
  visible = yes;
  view?.look();
}

/// State for tests.
export const inspectRobot = () => view && {
  frames: view.record ? [view.record.begin, view.record.end] : null, drawn: view.drawn, work_ms: view.work_ms, cursor: view.cursor,
  streams: view.poses ? 1 : 0, project: (point) => view.scene.project(point), camera: view.scene?.camera.position.toArray(),
  scene: view.scene, time_s: view.record?.frame(view.cursor === null ? view.record.end - 1 : Math.floor(view.cursor))?.time_s ?? null, record: view.record,
};

document.addEventListener('visibilitychange', () => view?.look());
document.addEventListener('theme', () => {
  if (view?.record) view.paint();
});
on('change', () => {
  if (!store.connected) view?.hand?.release();
  view?.showState();
});
