// The robot in 3D, drawn by three.js: meshes are built once, then only moved.

import {
  Box3, BoxGeometry, BufferAttribute, BufferGeometry, CapsuleGeometry, Color, ConeGeometry, CylinderGeometry, Group, InstancedMesh,
  Matrix4, Mesh, MeshLambertMaterial, MeshStandardMaterial, PCFShadowMap, PerspectiveCamera, PlaneGeometry, Quaternion, Raycaster,
  Scene, SphereGeometry, SRGBColorSpace, TetrahedronGeometry, Vector2, Vector3, WebGLRenderer,
} from './vendor/three.module.min.js';
import {kContact, kPose} from './robot_record.js';
import {RobotWorld} from './robot_world.js';

const kMaxArrows = 32;
const kNoise = 0.02;      // of the reach: smaller growth leaves the view as it is
const kMount = 3;         // in reaches: larger fixed objects are the robot's surroundings
const kRoughness = 0.55;  // assumed: painted metal, plastic
const kUp = new Vector3(0, 1, 0);  // axis of three.js cylinders

/// Rotates a geometry to the z axis, as in the program.
const alongZ = (geometry) => geometry.rotateX(Math.PI / 2);

const kGeometry = {
  sphere: ([r]) => new SphereGeometry(r, 24, 16),
  capsule: ([r, half]) => alongZ(new CapsuleGeometry(r, 2 * half, 8, 20)),
  cylinder: ([r, half]) => alongZ(new CylinderGeometry(r, r, 2 * half, 28)),
  box: ([x, y, z]) => new BoxGeometry(2 * x, 2 * y, 2 * z),
  ellipsoid: ([x, y, z]) => new SphereGeometry(1, 24, 16).scale(x, y, z),
  plane: ([x, y]) => new PlaneGeometry(2 * x, 2 * y),
};

/// Returns the markers of joints by state (robot_colours.js): turned bodies are good or free, a tetrahedron is a fault, a cube is bad.
function markersOf(size) {
  const round = new CylinderGeometry(size, size, size * 1.9, 24);
  return [round, round, new TetrahedronGeometry(size * 2), new BoxGeometry(size * 2, size * 2, size * 2)];
}

const isEndless = ({type, size_m}) => type === 'plane' && !(size_m[0] > 0 && size_m[1] > 0);

function release(one) {
  one.geometry?.dispose();
  one.material?.dispose?.();
}

function put(object, position, quaternion) {
  object.position.fromArray(position);
  if (quaternion) object.quaternion.set(quaternion[1], quaternion[2], quaternion[3], quaternion[0]);
}

/// Returns the geometry of a mesh of GET /body.
function meshGeometry({vertices_m, faces}) {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(vertices_m), 3));
  geometry.setIndex(new BufferAttribute(new Uint32Array(faces), 1));
  geometry.computeVertexNormals();
  return geometry;
}

export class RobotScene {
  /// Throws without WebGL.
  constructor(canvas, shape) {
    this.renderer = new WebGLRenderer({canvas, antialias: true});
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.camera = new PerspectiveCamera(40, 1, 0.01, 100);
    this.camera.up.set(0, 0, 1);
    this.scene = new Scene();
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.world = new RobotWorld(this.scene);
    this.bodies = shape.bodies.map(() => new Group());
    this.robot = new Group().add(...this.bodies);
    this.furniture = new Group();
    this.scene.add(this.robot, this.furniture);
    this.shape = shape;
    shape.geoms.forEach((geom) => this.addGeom(geom));
    this.boxes = this.bodies.map((body) => new Box3().setFromObject(body));  // in frames of the bodies
    this.extent = new Box3();     // of all poses so far, relative to the followed point
    this.centre = new Vector3();  // of the extent, in the world
    this.raycaster = new Raycaster();
  }

  addGeom(geom) {
    if (isEndless(geom)) return this.world.addGround(geom.position_m, geom.quaternion);
    const [r, g, b, a] = geom.colour;
    const ofMesh = geom.type === 'mesh';
    const material = new MeshStandardMaterial({
      color: new Color().setRGB(r, g, b, SRGBColorSpace), roughness: kRoughness, transparent: a < 1, opacity: a, flatShading: ofMesh});
    const mesh = new Mesh(ofMesh ? meshGeometry(this.shape.meshes[geom.mesh]) : kGeometry[geom.type](geom.size_m), material);
    mesh.castShadow = mesh.receiveShadow = a === 1;
    put(mesh, geom.position_m, geom.quaternion);
    mesh.userData.body = geom.body;
    (geom.body === null ? this.furniture : this.bodies[geom.body]).add(mesh);
  }

  /// Replaces the fixed objects of the world, except the ground.
  furnish(geoms) {
    for (const mesh of this.furniture.children) release(mesh);
    this.furniture.clear();
    for (const geom of geoms) if (geom.body === null && !isEndless(geom)) this.addGeom(geom);
  }

  /// Sizes joints, arrows and the ground by the robot's reach at its first pose.
  measure(poses) {
    this.pose(poses);
    this.robot.updateMatrixWorld(true);
    const box = new Box3().setFromObject(this.robot);
    const radius = Math.max(0.01, box.isEmpty() ? 1 : box.getSize(new Vector3()).length() / 2);
    this.radius = radius;
    const mount = new Box3().setFromObject(this.furniture);
    // The view of a fixed robot includes what it stands on.
    const fixed = !this.shape.bodies.some(({free}) => free) && mount.getSize(new Vector3()).length() < 2 * kMount * radius;
    if (fixed) this.extent.copy(mount);
    this.world.measure(radius, mount.clone().union(box).min.z, this.extent.isEmpty() ? 0 : mount.union(box).getSize(new Vector3()).length() / 2);
    this.camera.near = radius / 100;
    this.camera.far = radius * 60;
    this.markers = markersOf(radius * 0.055);
    this.joints = this.shape.joints.map((joint) => this.addJoint(joint));
    this.addArrows(radius);
  }

  /// Extends the extent by the present pose around the followed point; returns whether it has grown visibly.
  extend(point) {
    const shift = new Vector3(...point).negate();
    const now = new Box3();
    this.boxes.forEach((box, n) => {
      this.bodies[n].updateMatrix();
      now.union(box.clone().applyMatrix4(this.bodies[n].matrix));
    });
    now.translate(shift);
    const grows = !this.extent.containsBox(now.clone().expandByScalar(-kNoise * this.radius));
    if (grows) this.extent.union(now);
    this.extent.getCenter(this.centre).sub(shift);
    this.world.follow(this.centre, this.extent.min.z - shift.z);
    return grows;
  }

  /// Adds a marker, drawn over the bodies and sorted by distance.
  addJoint({body, axis, anchor_m}) {
    const mesh = new Mesh(this.markers[0], new MeshLambertMaterial({transparent: true, depthTest: false}));
    mesh.renderOrder = 1;
    mesh.position.fromArray(anchor_m);
    mesh.quaternion.setFromUnitVectors(kUp, new Vector3().fromArray(axis).normalize());
    mesh.userData.body = body;
    this.bodies[body].add(mesh);
    return mesh;
  }

  addArrows(radius) {
    const material = new MeshLambertMaterial();
    const width = radius * 0.012;
    this.shafts = new InstancedMesh(new CylinderGeometry(width, width, 1, 10).translate(0, 0.5, 0), material, kMaxArrows);
    this.heads = new InstancedMesh(new ConeGeometry(width * 3, width * 7, 14).translate(0, width * 3.5, 0), material, kMaxArrows);
    for (const mesh of [this.shafts, this.heads]) {
      mesh.frustumCulled = false;
      mesh.count = 0;
      this.scene.add(mesh);
    }
    this.placing = {from: new Vector3(), along: new Vector3(), turn: new Quaternion(), one: new Vector3(1, 1, 1), matrix: new Matrix4()};
  }

  /// Applies the colours of the page.
  paint(colours) {
    this.world.paint(colours);
    this.contactColour = new Color(colours.contact);
    this.handColour = new Color(colours.hand);
  }

  pose(poses) {
    this.bodies.forEach((body, n) => {
      const at = n * kPose;
      body.position.set(poses[at], poses[at + 1], poses[at + 2]);
      body.quaternion.set(poses[at + 4], poses[at + 5], poses[at + 6], poses[at + 3]);
    });
  }

  markJoint(n, colour, state) {
    this.joints[n].geometry = this.markers[state];
    this.joints[n].scale.setScalar(n === this.lit ? 1.7 : 1);
    const {material} = this.joints[n];
    material.color.copy(colour);
    material.emissive.copy(colour).multiplyScalar(n === this.lit ? 1 : 0.5);  // keeps the colour recognisable in shadow
  }

  /// Shows contact forces and that of the hand (or null) as arrows; `length_m_N` is their scale.
  arrows(contacts, hand, length_m_N) {
    const count = Math.min(contacts.length / kContact, kMaxArrows - 1);
    for (let n = 0; n < count; ++n) this.arrow(n, contacts, n * kContact, length_m_N, this.contactColour);
    if (hand) this.arrow(count, hand, 0, length_m_N, this.handColour);
    for (const mesh of [this.shafts, this.heads]) {
      mesh.count = count + (hand ? 1 : 0);
      mesh.instanceMatrix.needsUpdate = true;
      if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
    }
  }

  arrow(n, values, at, length_m_N, colour) {
    const {from, along, turn, one, matrix} = this.placing;
    from.fromArray(values, at);
    along.fromArray(values, at + 3).multiplyScalar(length_m_N);
    const length = along.length();
    turn.setFromUnitVectors(kUp, along.divideScalar(length || 1));
    this.shafts.setMatrixAt(n, matrix.compose(from, turn, one.set(1, length, 1)));
    from.addScaledVector(along, length);
    this.heads.setMatrixAt(n, matrix.compose(from, turn, one.set(1, length > 0 ? 1 : 0, 1)));
    this.shafts.setColorAt(n, colour);
    this.heads.setColorAt(n, colour);
  }

  resize(width, height) {
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
  }

  draw() {
    this.world.see(this.camera, this.centre);
    this.renderer.render(this.scene, this.camera);
  }

  /// Returns the moving body at a point of the picture (−1 to 1): {body, point}; null: none.
  pick(x, y) {
    this.raycaster.setFromCamera(new Vector2(x, y), this.camera);
    const hit = this.raycaster.intersectObject(this.robot, true)[0];
    return hit ? {body: hit.object.userData.body, point: hit.point} : null;
  }

  /// Returns the joint whose marker is at a point of the picture; -1: none.
  jointAt(x, y) {
    this.raycaster.setFromCamera(new Vector2(x, y), this.camera);
    return this.joints.indexOf(this.raycaster.intersectObjects(this.joints)[0]?.object);
  }

  /// Returns a joint or point of the robot, at a point of the picture, as {body, at} in the body's frame; null: none.
  pointAt(x, y) {
    const joint = this.shape.joints[this.jointAt(x, y)];
    if (joint) return {body: joint.body, at: joint.anchor_m};
    const hit = this.pick(x, y);
    return hit && {body: hit.body, at: this.inBody(hit.body, hit.point).toArray()};
  }

  /// Returns the intersection of the ray through a picture point with the plane through `point` that faces the camera.
  along(x, y, point) {
    this.raycaster.setFromCamera(new Vector2(x, y), this.camera);
    const {origin, direction} = this.raycaster.ray;
    const facing = this.camera.getWorldDirection(new Vector3());
    const far = point.clone().sub(origin).dot(facing) / direction.dot(facing);
    return origin.clone().addScaledVector(direction, far);
  }

  /// Projects a world point to the picture: −1 to 1, and depth.
  project(point) {
    return new Vector3().fromArray(point).project(this.camera).toArray();
  }

  vector(numbers) {
    return new Vector3().fromArray(numbers);
  }

  /// Converts a world point to coordinates of its body.
  inBody(body, point) {
    return this.bodies[body].worldToLocal(point.clone());
  }
  fromBody(body, point) {
    return this.bodies[body].localToWorld(point.clone());
  }

  close() {
    this.scene.traverse(release);
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }
}
