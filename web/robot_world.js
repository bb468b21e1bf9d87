// The robot's surroundings: sky, ground, sun and its shadow, in the colours of the page.

import {
  BackSide, BufferAttribute, CircleGeometry, Color, DataTexture, DirectionalLight, Fog, HemisphereLight, LinearMipmapLinearFilter,
  Mesh, MeshBasicMaterial, MeshLambertMaterial, Quaternion, RepeatWrapping, SphereGeometry, SRGBColorSpace, Vector3,
} from './vendor/three.module.min.js';

// Lengths are in reaches of the robot.
const kGround = 30;    // the haze hides the edge
const kSky = 50;
const kShadow = 1.7;   // half side of the square with shadows: small, since its pixels cost most
const kShadow_px = 1024;
const kSun = new Vector3(-2, -3, 5).normalize();
const kGap = 0.05;     // below the lowest point, of a ground that the model lacks
const kHighHaze = 0.5; // sine of the elevation at which the haze ends

export class RobotWorld {
  constructor(scene) {
    this.scene = scene;
    this.sun = new DirectionalLight(0xffffff, 2.4);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(kShadow_px, kShadow_px);
    this.sun.shadow.radius = 3;
    this.sky = new Mesh(new SphereGeometry(1, 24, 48).rotateX(Math.PI / 2),
      new MeshBasicMaterial({vertexColors: true, side: BackSide, fog: false, depthWrite: false}));
    this.sky.renderOrder = -1;
    scene.fog = new Fog(0);
    scene.add(new HemisphereLight(0xffffff, 0x8090a0, 1.25), this.sun, this.sun.target, this.sky);
    this.grounds = [];
  }

  /// Adds an infinite plane.
  addGround(position_m, [w, x, y, z]) {
    const mesh = new Mesh(undefined, new MeshLambertMaterial());
    mesh.receiveShadow = true;
    mesh.quaternion.set(x, y, z, w);
    this.scene.add(mesh);
    this.grounds.push({mesh, origin: new Vector3().fromArray(position_m)});
  }

  /// Sets all lengths; shadows reach at least `shadow_m`. A world without ground gets one below `lowest_m`, to carry the shadow.
  measure(radius_m, lowest_m, shadow_m) {
    this.radius_m = radius_m;
    this.field_m = 10 ** Math.round(Math.log10(radius_m)) / 2;
    this.floats = this.grounds.length === 0;
    if (this.floats) this.addGround([0, 0, lowest_m - kGap * radius_m], [1, 0, 0, 0]);
    for (const {mesh} of this.grounds) mesh.geometry = new CircleGeometry(kGround * radius_m, 64);
    this.sky.scale.setScalar(kSky * radius_m);
    const {camera} = this.sun.shadow;
    const half = Math.max(kShadow * radius_m, shadow_m);
    Object.assign(camera, {left: -half, right: half, top: half, bottom: -half, near: radius_m, far: 20 * radius_m});
    camera.updateProjectionMatrix();
    this.sun.shadow.normalBias = 4 * half / kShadow_px;
  }

  /// Keeps the shadow at the robot's centre, and the ground around it, by whole fields.
  follow(centre, lowest_m) {
    this.sun.target.position.copy(centre);
    this.sun.position.copy(centre).addScaledVector(kSun, 8 * this.radius_m);
    if (this.floats) this.grounds[0].origin.z = Math.min(this.grounds[0].origin.z, lowest_m - kGap * this.radius_m);
    const step = (length) => 2 * this.field_m * Math.round(length / (2 * this.field_m));
    for (const {mesh, origin} of this.grounds) {
      const turn = new Quaternion().copy(mesh.quaternion);
      const {x, y} = centre.clone().sub(origin).applyQuaternion(turn.clone().invert());
      mesh.position.set(step(x), step(y), 0).applyQuaternion(turn).add(origin);
    }
  }

  /// Places sky and haze for a camera.
  see(camera, centre) {
    this.sky.position.copy(camera.position);
    this.scene.fog.near = camera.position.distanceTo(centre) + 2 * this.radius_m;
    this.scene.fog.far = Math.max(kGround * this.radius_m, this.scene.fog.near + this.radius_m);
  }

  paint({sky, haze, floor, floor2}) {
    const [from, to] = [new Color(haze), new Color(sky)];
    this.scene.fog.color.copy(from);
    const {position} = this.sky.geometry.attributes;
    const colours = new Float32Array(position.count * 3);
    for (let n = 0; n < position.count; ++n) {
      const share = Math.min(1, Math.max(0, position.getZ(n) / kHighHaze));
      from.clone().lerp(to, share * (2 - share)).toArray(colours, 3 * n);
    }
    this.sky.geometry.setAttribute('color', new BufferAttribute(colours, 3));
    const fields = 2 * kGround * this.radius_m / this.field_m;
    for (const {mesh: {material}} of this.grounds) {
      material.map?.dispose();
      material.map = this.board([floor, floor2], fields);
      material.needsUpdate = true;
    }
  }

  /// Makes the texture of a chequered board with so many fields across.
  board(colours, fields) {
    const [one, other] = colours.map((colour) => [...new Color(colour).convertLinearToSRGB().toArray().map((part) => Math.round(part * 255)), 255]);
    const texture = new DataTexture(new Uint8Array([...one, ...other, ...other, ...one]), 2, 2);
    texture.colorSpace = SRGBColorSpace;
    texture.wrapS = texture.wrapT = RepeatWrapping;
    texture.repeat.set(fields / 2, fields / 2);
    texture.offset.set(-fields / 4 % 1, -fields / 4 % 1);  // a corner is at the middle
    texture.generateMipmaps = true;
    texture.minFilter = LinearMipmapLinearFilter;
    texture.anisotropy = 4;
    texture.needsUpdate = true;
    return texture;
  }
}
