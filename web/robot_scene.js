// The robot in 3D, drawn by three.js: meshes are built once, then only moved.

import {
  BoxGeometry, CapsuleGeometry, CircleGeometry, Color, ConeGeometry, CylinderGeometry, DataTexture, DirectionalLight, Fog,
  Group, HemisphereLight, InstancedMesh, LinearMipmapLinearFilter, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial,
  PerspectiveCamera, PlaneGeometry, Quaternion, Raycaster, RepeatWrapping, Scene, SphereGeometry, SRGBColorSpace, TetrahedronGeometry,
  Vector2, Vector3, WebGLRenderer,
} from './vendor/three.module.min.js';
import {kContact, kPose} from './robot_record.js';

const kMaxArrows = 32;
const kGround = 20;  // in reaches of the robot; the fog hides the edge
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

/// Returns the bounding sphere of the robot's first pose: centre and radius in metres.
function reachOf(robot) {
  const box = [[Infinity, -Infinity], [Infinity, -Infinity], [Infinity, -Infinity]];
  const at = new Vector3();
  robot.updateMatrixWorld(true);
  robot.traverse((one) => {
    if (!one.isMesh) return;
    one.geometry.computeBoundingSphere();
    const {radius} = one.geometry.boundingSphere;
    at.setFromMatrixPosition(one.matrixWorld).toArray().forEach((value, n) => {
      box[n] = [Math.min(box[n][0], value - radius), Math.max(box[n][1], value + radius)];
    });
  });
  const centre = box.map(([from, to]) => (from + to) / 2);
  if (!centre.every(Number.isFinite)) return {centre: [0, 0, 0], radius: 1};
  return {centre, radius: Math.max(0.01, Math.hypot(...box.map(([from, to]) => to - from)) / 2)};
}

export class RobotScene {
  /// Throws without WebGL.
  constructor(canvas, shape) {
    this.renderer = new WebGLRenderer({canvas, antialias: true});
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.camera = new PerspectiveCamera(40, 1, 0.01, 100);
    this.camera.up.set(0, 0, 1);
    this.scene = new Scene();
    this.scene.add(new HemisphereLight(0xffffff, 0x8090a0, 1.9));
    const sun = new DirectionalLight(0xffffff, 1.9);
    sun.position.set(-2, -3, 5);
    this.scene.add(sun);
    this.ground = [];  // meshes that take the page's colours
    this.bodies = shape.bodies.map(() => new Group());
    this.robot = new Group().add(...this.bodies);
    this.furniture = new Group();
    this.scene.add(this.robot, this.furniture);
    this.shape = shape;
    shape.geoms.forEach((geom) => this.addGeom(geom));
    this.raycaster = new Raycaster();
  }

  addGeom(geom) {
    if (isEndless(geom)) return this.addGround(geom);
    const [r, g, b, a] = geom.colour;
    const material = new MeshLambertMaterial({color: new Color().setRGB(r, g, b, SRGBColorSpace), transparent: a < 1, opacity: a});
    const mesh = new Mesh(kGeometry[geom.type](geom.size_m), material);
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

  /// Adds an infinite plane as a chequered board in the page's colours.
  addGround(geom) {
    const mesh = new Mesh(undefined, new MeshBasicMaterial());
    put(mesh, geom.position_m, geom.quaternion);
    this.scene.add(mesh);
    this.ground.push(mesh);
  }

  /// Makes the texture of the board, `cells` of its four fields across the ground.
  board(colours, cells) {
    const [one, other] = [colours.panel, colours.grid].map((colour) => [...new Color(colour).convertLinearToSRGB().toArray().map((part) => Math.round(part * 255)), 255]);
    const texture = new DataTexture(new Uint8Array([...one, ...other, ...other, ...one]), 2, 2);
    texture.colorSpace = SRGBColorSpace;
    texture.wrapS = texture.wrapT = RepeatWrapping;
    texture.repeat.set(cells / 2, cells / 2);
    texture.generateMipmaps = true;
    texture.minFilter = LinearMipmapLinearFilter;
    texture.anisotropy = 8;
    texture.needsUpdate = true;
    return texture;
  }

  /// Sizes joints, arrows and the ground by the robot's reach at its first pose.
  measure(poses) {
    this.pose(poses);
    const {centre, radius} = reachOf(this.robot);
    this.radius = radius;
    this.camera.near = radius / 100;
    this.camera.far = radius * 60;
    this.markers = markersOf(radius * 0.055);
    this.joints = this.shape.joints.map((joint) => this.addJoint(joint));
    this.addArrows(radius);
    for (const mesh of this.ground) mesh.geometry = new CircleGeometry(kGround * radius, 48);
    this.scene.fog = new Fog(0, radius * 5, radius * kGround);
    return centre;
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

  /// Applies the colours of the page: {panel, line, grid, arrow}.
  paint(colours) {
    this.scene.background = new Color(colours.panel);
    this.scene.fog.color.set(colours.panel);
    this.contactColour = new Color(colours.contact);
    this.handColour = new Color(colours.hand);
    const field_m = 10 ** Math.round(Math.log10(this.radius)) / 2;
    for (const {material} of this.ground) {
      material.map?.dispose();
      material.map = this.board(colours, 2 * Math.round(kGround * this.radius / field_m));
      material.needsUpdate = true;
    }
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
