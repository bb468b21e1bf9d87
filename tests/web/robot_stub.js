// A robot for a page whose program has none, with the interface of GET /body and its stream. It has two legs, or
// window.robotLegs. window.pushes collects pushes; window.robot.height_m and window.robot.forward_m position the trunk.

// window.robot.step_m: a step of the floor, from x = 0.5 on.
window.robot = {height_m: 0.5, forward_m: 0, swing: 0.3, contacts: true, step_m: 0, shape_changes: 0, opened: 0, closed: 0, time_s: 0, rate_Hz: 60};
window.pushes = [];

const drive = (id) => ({bus: window.robotBus, id});
const legs = Array.from({length: window.robotLegs ?? 2}, (_, n) => ({name: n ? `right ${n}` : 'left', x: -0.1 * Math.floor(n / 2), y: n % 2 ? -0.15 : 0.15}));
const kShape = {
  mass_kg: 10,
  bodies: [{name: 'trunk', free: true, mass_kg: 6, centre_m: [0, 0, 0]},
    ...legs.map(({name}) => ({name, free: false, mass_kg: 4 / legs.length, centre_m: [0, 0, -0.2]}))],
  geoms: [
    {body: null, type: 'plane', size_m: [0, 0, 0.1], position_m: [0, 0, 0], quaternion: [1, 0, 0, 0], colour: [0.5, 0.5, 0.5, 1]},
    {body: null, type: 'cylinder', size_m: [0.1, 0.05], position_m: [0, 1, 0.05], quaternion: [1, 0, 0, 0], colour: [0, 0, 1, 1]},
    {body: 0, type: 'box', size_m: [0.25, 0.12, 0.06], position_m: [0, 0, 0], quaternion: [1, 0, 0, 0], colour: [1, 0, 1, 1]},
    {body: 0, type: 'ellipsoid', size_m: [0.06, 0.05, 0.04], position_m: [0.28, 0, 0.05], quaternion: [1, 0, 0, 0], colour: [1, 0, 1, 1]},
    ...legs.map((_, n) => n + 1).flatMap((body) => [
      {body, type: 'capsule', size_m: [0.03, 0.2], position_m: [0, 0, -0.2], quaternion: [1, 0, 0, 0], colour: [0.6, 0.6, 0.65, 1]},
      {body, type: 'sphere', size_m: [0.045], position_m: [0, 0, -0.4], quaternion: [1, 0, 0, 0], colour: [0.2, 0.2, 0.2, 1]}])],
  joints: legs.map(({name}, n) => ({name, body: n + 1, axis: [0, 1, 0], anchor_m: [0, 0, 0], ...drive(n + 1)})),
};

function poses() {
  const {height_m, forward_m, swing, time_s} = window.robot;
  return [[forward_m, 0, height_m, 1, 0, 0, 0], ...legs.map(({x, y}, n) => {
    const half = swing * Math.sin(2 * Math.PI * time_s + Math.PI * n) / 2;
    return [forward_m + x, y, height_m, Math.cos(half), 0, Math.sin(half), 0];
  })];
}

/// Next to the feet, where they are visible, each with its share of the weight.
const contacts = () => (window.robot.contacts ? legs.map(({x, y}) => [window.robot.forward_m + x, 2 * y, 0, 0, 0, 98 / legs.length]) : []);

const step = () => (window.robot.step_m > 0 ? [
  {body: null, type: 'box', size_m: [10, 10, window.robot.step_m], position_m: [10.5, 0, 0], quaternion: [1, 0, 0, 0], colour: [1, 1, 0, 1]}] : []);

class PoseStream {
  constructor() {
    ++window.robot.opened;
    setTimeout(() => this.onopen());
    this.timer = setInterval(() => {
      window.robot.time_s += 1 / window.robot.rate_Hz;
      this.onmessage({data: JSON.stringify({time_s: window.robot.time_s, shape_changes: window.robot.shape_changes, poses: poses(), contacts: contacts()})});
    }, 1000 / window.robot.rate_Hz);
  }
  close() {
    ++window.robot.closed;
    clearInterval(this.timer);
  }
}

const PlainSocket = window.WebSocket;
window.WebSocket = function (address, ...rest) {
  return new URL(address).pathname.endsWith('/body') ? new PoseStream() : new PlainSocket(address, ...rest);
};
const fetchBeforeRobot = window.fetch;
window.fetch = async (address, ...rest) => {
  const path = String(address);
  const json = (what) => new Response(JSON.stringify(what));
  if (path.endsWith('/body')) return json({...kShape, geoms: [...kShape.geoms, ...step()], shape_changes: window.robot.shape_changes, poses: poses()});
  if (path.endsWith('/directives') && JSON.parse(rest[0].body).push) {
    window.pushes.push(JSON.parse(rest[0].body).push);
    return json({time_s: 0, faults: []});
  }
  const answer = await fetchBeforeRobot(address, ...rest);
  return path.endsWith('/status') ? json({...await answer.json(), body: true}) : answer;
};
