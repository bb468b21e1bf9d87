// Camera of the robot: orbits a point by mouse, wheel, fingers and keys. The world's z is up.

const kSteps = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]};
const kStep_rad = Math.PI / 24;
const kTurn_rad_px = 0.008;
const kHighest_rad = Math.PI / 2 - 0.01;
const kZoomPerNotch = 1.15;
const kFarthest = 4;   // in default distances; the haze begins beyond the robot
const kFilled = 0.75;  // of the picture, by the robot

export class OrbitCamera {
  /// Moves `camera`, whose `up` is z; `moved()` is called after each move. `taken(event)`: another control has this drag.
  constructor(camera, canvas, {moved, taken}) {
    this.camera = camera;
    this.moved = moved;
    this.point = [0, 0, 0];  // of the robot, followed; the target is relative to it
    this.home = {distance: 2, azimuth: -8 * kStep_rad, elevation: 2 * kStep_rad, target: [0, 0, 0]};
    this.reset();
    this.listen(canvas, taken);
  }

  /// Fits the default view to the picture: it shows this box, around the followed point, as a whole. Leaves a view of the user.
  fit({min, max}) {
    const {azimuth, elevation} = this.home;
    const [ca, sa, ce, se] = [Math.cos(azimuth), Math.sin(azimuth), Math.cos(elevation), Math.sin(elevation)];
    const high = kFilled * Math.tan(this.camera.fov * Math.PI / 360);
    const half = [(max.x - min.x) / 2, (max.y - min.y) / 2, (max.z - min.z) / 2];
    let distance = 0;
    for (let corner = 0; corner < 8; ++corner) {
      const [x, y, z] = half.map((length, n) => (corner >> n & 1 ? length : -length));
      const [right, up, near] = [y * ca - x * sa, z * ce - (x * ca + y * sa) * se, (x * ca + y * sa) * ce + z * se];
      distance = Math.max(distance, near + Math.max(Math.abs(right) / (high * this.camera.aspect), Math.abs(up) / high));
    }
    Object.assign(this.home, {distance, target: [(min.x + max.x) / 2, (min.y + max.y) / 2, (min.z + max.z) / 2]});
    if (!this.ofUser) this.reset();
  }

  reset() {
    this.ofUser = false;
    Object.assign(this, this.home, {target: [...this.home.target]});
    this.place();
  }

  follow(...point) {
    this.point = point;
    this.place();
  }

  place() {
    const {camera, point, distance, azimuth, elevation} = this;
    const [x, y, z] = this.target.map((value, n) => value + point[n]);
    const flat = distance * Math.cos(elevation);
    camera.position.set(x + flat * Math.cos(azimuth), y + flat * Math.sin(azimuth), z + distance * Math.sin(elevation));
    camera.lookAt(x, y, z);
    camera.updateMatrixWorld();
    this.moved();
  }

  turn(right_rad, up_rad) {
    this.ofUser = true;
    this.azimuth += right_rad;
    this.elevation = Math.max(-kHighest_rad, Math.min(kHighest_rad, this.elevation + up_rad));
    this.place();
  }

  /// Pans by shares of the picture's height.
  pan(right, up) {
    this.ofUser = true;
    const scale = 2 * this.distance * Math.tan(this.camera.fov * Math.PI / 360);
    const m = this.camera.matrixWorld.elements;
    this.target = this.target.map((value, n) => value + scale * (right * m[n] + up * m[4 + n]));
    this.place();
  }

  zoom(factor) {
    this.ofUser = true;
    this.distance = Math.max(this.home.distance / 30, Math.min(this.home.distance * kFarthest, this.distance * factor));
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
