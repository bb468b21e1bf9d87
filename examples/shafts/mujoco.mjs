// A MuJoCo model in WebAssembly whose joints are driven by lk-emu:
//
//     npm install @mujoco/mujoco
//     lk-emu --config two_drives.toml --shafts unix:/tmp/shafts &
//     node mujoco.mjs unix:/tmp/shafts two_joints.xml 2 shoulder elbow > angles.csv
//
// The named joints get the drives in their order; the simulator owns the time. Prints for each step the positions of all
// hinges and slides in rad and m, and the sum of all normal contact forces. docs/guides/your-simulator.md defines the messages.
import {readFileSync} from "node:fs";
import {createConnection} from "node:net";

const [place, file, seconds, ...names] = process.argv.slice(2);
const HEAD = 32, OFFER = 1, ACCEPT = 2, STATES = 3, TORQUES = 4, END = 5;
const SIMULATORS_TIME = 1, OWNED_BY_SIMULATOR = 1;

/** Whole messages of a socket, one after the other. */
async function* messages(socket) {
  let bytes = Buffer.alloc(0);
  for await (const part of socket) {
    bytes = Buffer.concat([bytes, part]);
    while (bytes.length >= HEAD && bytes.length >= bytes.readUInt32LE(12)) {
      const size = bytes.readUInt32LE(12);
      yield bytes.subarray(0, size);
      bytes = bytes.subarray(size);
    }
  }
}

function message(kind, joints, recordBytes, what, number) {
  const bytes = Buffer.alloc(HEAD + joints * recordBytes);
  bytes.write("LKSH");
  [1, kind, bytes.length, joints, what].forEach((word, n) => bytes.writeUInt32LE(word, 4 + 4 * n));
  bytes.writeBigUInt64LE(number, 24);
  return bytes;
}

async function next(stream, kind) {
  const {value, done} = await stream.next();
  if (done) throw new Error("lk-emu closed the connection");
  if (value.readUInt32LE(8) === END) throw new Error("lk-emu: " + value.toString("utf8", HEAD, HEAD + value.readUInt32LE(20)));
  if (value.readUInt32LE(8) !== kind) throw new Error("lk-emu sent a message of kind " + value.readUInt32LE(8));
  return value;
}

const engineFile = process.env.MUJOCO_WASM ?? "@mujoco/mujoco";  // if not installed next to this file
const mujoco = await (await import(engineFile)).default();
const model = mujoco.MjModel.from_xml_string(readFileSync(file, "utf8"));
const data = new mujoco.MjData(model);
const dofs = names.map((name) => {
  const joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT.value, name);
  if (joint < 0) throw new Error(`${file} has no joint ${name}`);
  return {q: model.jnt_qposadr[joint], v: model.jnt_dofadr[joint]};
});
const row = new mujoco.DoubleBuffer(model.nv);

/** What the shaft of `dof` feels: 1 over its entry of the inverse of the mass matrix. */
function inertia(dof) {
  const unit = Array(model.nv).fill(0);
  unit[dof] = 1;
  mujoco.mj_solveM(model, data, row, unit);
  return 1 / row.GetView()[dof];
}

function states(number) {
  const bytes = message(STATES, dofs.length, 32, 0, number);
  dofs.forEach(({q, v}, n) => {
    const J = inertia(v);
    const others = J * data.qacc[v] - data.qfrc_applied[v];  // gravity and the rest of the arm
    [data.qpos[q], data.qvel[v], J, others].forEach((value, k) => bytes.writeDoubleLE(value, HEAD + 32 * n + 8 * k));
  });
  return bytes;
}

function setArmature(values) {
  if (dofs.every(({v}, n) => model.dof_armature[v] === values[n])) return;
  dofs.forEach(({v}, n) => { model.dof_armature[v] = values[n]; });
  mujoco.mj_setConst(model, new mujoco.MjData(model));
}

const force = new mujoco.DoubleBuffer(6);

function contactForce() {
  let sum = 0;
  for (let n = 0; n < data.ncon; ++n) {
    mujoco.mj_contactForce(model, data, n, force);
    sum += force.GetView()[0];
  }
  return sum;
}

const {mjJNT_SLIDE, mjJNT_HINGE} = mujoco.mjtJoint;
const shown = Array.from(model.jnt_type.keys()).filter(
    (joint) => [mjJNT_SLIDE.value, mjJNT_HINGE.value].includes(model.jnt_type[joint]));

function print() {
  console.log([data.time.toFixed(6), ...shown.map((joint) => data.qpos[model.jnt_qposadr[joint]]), contactForce()].join());
}

const tcp = /^tcp:(?:(.*):)?(\d+)$/.exec(place);
const socket = createConnection(tcp ? {host: tcp[1] ?? "127.0.0.1", port: Number(tcp[2]), noDelay: true}
                                    : {path: place.replace(/^unix:/, "")});
const stream = messages(socket);
const offer = await next(stream, OFFER);
if (offer.readUInt32LE(16) !== dofs.length) throw new Error(`${dofs.length} joints for ${offer.readUInt32LE(16)} drives`);
setArmature(dofs.map((_, n) => offer.readDoubleLE(HEAD + 80 * n + 64)));
const step = BigInt(Math.round(model.opt.timestep * 1e9));
const accept = message(ACCEPT, dofs.length, 8, SIMULATORS_TIME, step);
dofs.forEach((_, n) => accept.writeUInt32LE(OWNED_BY_SIMULATOR, HEAD + 8 * n));
socket.write(accept);

const nameOf = (joint) => mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT.value, joint);
console.log(["time_s", ...shown.map(nameOf), "contact_N"].join());
mujoco.mj_forward(model, data);
let number = 0n;
while (data.time < Number(seconds) - 0.5 * model.opt.timestep) {
  print();
  socket.write(states(number));
  const torques = await next(stream, TORQUES);
  number = torques.readBigUInt64LE(24);
  setArmature(dofs.map((_, n) => torques.readDoubleLE(HEAD + 40 * n + 16)));
  dofs.forEach(({v}, n) => { data.qfrc_applied[v] = torques.readDoubleLE(HEAD + 40 * n); });
  mujoco.mj_step(model, data);
  mujoco.mj_forward(model, data);
}
print();
socket.end();
