// Camera of the robot: orbits a point by mouse, wheel, fingers and keys. The world's z is up.

const kSteps = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]};
const kStep_rad = Math.PI / 24;
const kTurn_rad_px = 0.008;
const kHighest_rad = Math.PI / 2 - 0.01;
const kZoomPerNotch = 1.15;

export class OrbitCamera {
  /// Moves `camera`, whose `up` is z; `moved()` is called after each move. `taken(event)`: another control has this drag.
  constructor(camera, canvas, {moved, taken}) {
    this.camera = camera;
    this.moved = moved;
    this.centre = {x: 0, y: 0, z: 0};  // of the robot, followed
    this.shift = {x: 0, y: 0, z: 0};   // of the target, relative to `centre`
    this.home = {distance: 2, azimuth: -8 * kStep_rad, elevation: 3 * kStep_rad};
    this.reset();
    this.listen(canvas, taken);
  }

  /// Sets the default distance, from which a sphere of this radius is visible as a whole.
  setHome(radius) {
    this.home.distance = radius / Math.sin(this.camera.fov * Math.PI / 360);
    this.reset();
  }

  reset() {
    Object.assign(this, this.home);
    this.shift = {x: 0, y: 0, z: 0};
    this.place();
  }

  follow(x, y, z) {
    this.centre = {x, y, z};
    this.place();
  }

  place() {
    const {camera, centre, shift, distance, azimuth, elevation} = this;
    const [x, y, z] = [centre.x + shift.x, centre.y + shift.y, centre.z + shift.z];
    const flat = distance * Math.cos(elevation);
    camera.position.set(x + flat * Math.cos(azimuth), y + flat * Math.sin(azimuth), z + distance * Math.sin(elevation));
    camera.lookAt(x, y, z);
    camera.updateMatrixWorld();
    this.moved();
  }

  turn(right_rad, up_rad) {
    this.azimuth += right_rad;
    this.elevation = Math.max(-kHighest_rad, Math.min(kHighest_rad, this.elevation + up_rad));
    this.place();
  }

  /// Pans by shares of the picture's height.
  pan(right, up) {
    const scale = 2 * this.distance * Math.tan(this.camera.fov * Math.PI / 360);
    const m = this.camera.matrixWorld.elements;
    for (const [n, axis] of ['x', 'y', 'z'].entries()) this.shift[axis] += scale * (right * m[n] + up * m[4 + n]);
    this.place();
  }

  zoom(factor) {
    this.distance = Math.max(this.home.distance / 30, Math.min(this.home.distance * 10, this.distance * factor));
    this.place();
  }

  listen(canvas, taken) {
    let last = null;
    canvas.addEventListener('pointerdown', (event) => {
      canvas.focus();
      if (event.defaultPrevented || taken(event)) return;
      last = event;
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener('pointermove', (event) => {
      if (!last || event.pointerId !== last.pointerId) return;
      const [x, y] = [event.clientX - last.clientX, event.clientY - last.clientY];
      last = event;
      if (event.shiftKey || event.buttons & 6) this.pan(-x / canvas.clientHeight, y / canvas.clientHeight);
      else this.turn(-x * kTurn_rad_px, y * kTurn_rad_px);
    });
    for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, () => (last = null));
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('wheel', (event) => {
      event.preventDefault();
      this.zoom(kZoomPerNotch ** Math.max(-3, Math.min(3, event.deltaY / 100)));
    }, {passive: false});
    canvas.addEventListener('keydown', (event) => this.press(event));
  }

  press(event) {
    const step = kSteps[event.key];
    if (step && event.shiftKey) this.pan(step[0] / 20, step[1] / 20);
    else if (step) this.turn(step[0] * kStep_rad, step[1] * kStep_rad);
    else if (event.key === '+' || event.key === '=') this.zoom(1 / kZoomPerNotch);
    else if (event.key === '-') this.zoom(kZoomPerNotch);
    else if (event.key === '0' || event.key === 'Home') this.reset();
    else return;
    event.preventDefault();
  }
}
