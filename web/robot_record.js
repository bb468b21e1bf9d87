// Ring buffer with the robot's last minute: poses, contacts and joint values for colours.

export const kRate_Hz = 60;       // frames per second of real time
const kFrames = 60 * kRate_Hz;
const kMaxContacts = 32;          // kept per frame

export const kPose = 7;           // x y z qw qx qy qz
export const kContact = 6;        // x y z fx fy fz

/// Frame numbers increase for ever; frames `begin` to `end` - 1 are stored.
export class RobotRecord {
  constructor(bodies, joints, valuesOfJoint) {
    this.parts = {poses: bodies * kPose, joints: joints * valuesOfJoint, contacts: kMaxContacts * kContact};
    this.stride = this.parts.poses + this.parts.joints + this.parts.contacts;
    this.values = new Float32Array(kFrames * this.stride);
    this.times = new Float64Array(kFrames);
    this.contacts = new Uint8Array(kFrames);
    this.begin = 0;
    this.end = 0;
  }

  /// Adds a frame; `jointValues` in the order of joints. If time went back (a restart), clears the buffer first.
  add({time_s, poses, contacts}, jointValues) {
    if (this.end > this.begin && time_s < this.times[(this.end - 1) % kFrames]) this.begin = this.end;
    const slot = this.end % kFrames;
    this.times[slot] = time_s;
    let at = slot * this.stride;
    for (const pose of poses) {
      this.values.set(pose, at);
      at += kPose;
    }
    this.values.set(jointValues, at);
    at += this.parts.joints;
    const count = Math.min(contacts.length, kMaxContacts);
    for (let n = 0; n < count; ++n) this.values.set(contacts[n], at + n * kContact);
    this.contacts[slot] = count;
    ++this.end;
    this.begin = Math.max(this.begin, this.end - kFrames);
  }

  /// Replaces the joint values of the newest frame.
  revise(jointValues) {
    if (this.begin < this.end) this.values.set(jointValues, (this.end - 1) % kFrames * this.stride + this.parts.poses);
  }

  /// Returns the frame `number` or the nearest stored one, as views; null: the buffer is empty.
  frame(number) {
    if (this.begin === this.end) return null;
    const slot = Math.max(this.begin, Math.min(this.end - 1, number)) % kFrames;
    const at = slot * this.stride;
    const {poses, joints} = this.parts;
    return {
      time_s: this.times[slot],
      poses: this.values.subarray(at, at + poses),
      joints: this.values.subarray(at + poses, at + poses + joints),
      contacts: this.values.subarray(at + poses + joints, at + poses + joints + this.contacts[slot] * kContact),
    };
  }
}
