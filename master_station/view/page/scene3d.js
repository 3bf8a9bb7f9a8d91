// The scene as decoded, the tool, the handle's image, and the contacts as arrows whose length is their force.
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

const COLOURS = { good: 0x0072b2, doubt: 0xe69f00, outline: 0xcc79a7, leaving: 0x999999, handle: 0x009e73 };
const TILES = { here: [0x56b4e9, 0.25], lacking: [0xd55e00, 0.4] };
const STEEL = 0x9ea8b5, BRASS = 0xdba847;
const UP = new THREE.Vector3(0, 1, 0);  // of an arrow's geometry

export function qualityOf(push) {
  if (push.leaving) return "leaving";
  if (push.source === 1) return "outline";
  return push.doubts !== 0 ? "doubt" : "good";
}

export class Scene3d {
  constructor(element, onPick) {
    this.element = element;
    this.onPick = onPick;
    this.renderer = new THREE.WebGLRenderer({ antialias: true });
    element.appendChild(this.renderer.domElement);
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(40, 1, 1e-4, 100);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x555566, 2));
    this.sun = new THREE.DirectionalLight(0xffffff, 2);
    this.scene.add(this.sun);
    this.bodies = new Map();
    this.tool = null;
    this.handle = new THREE.Mesh(new THREE.OctahedronGeometry(1), new THREE.MeshLambertMaterial({ color: COLOURS.handle, transparent: true, opacity: 0.6, depthTest: false }));
    this.scene.add(this.handle);
    this.arrows = [];
    this.picked = -1;
    this.viewName = "orbit";
    this.radius = 0.1;
    this.centre = new THREE.Vector3();
    this.metresPerNewton = 0.01;
    this.tick = null;
    this.working = new THREE.Vector3();
    this.outwards = new THREE.Vector3(0, 0, -1);
    this.tiles = [];
    this.tilesShown = true;
    new ResizeObserver(() => this.resize()).observe(element);
    this.renderer.domElement.addEventListener("click", (event) => this.pickAt(event));
    this.resize();
  }

  setDark(dark) {
    this.scene.background = new THREE.Color(dark ? 0x14181d : 0xf4f5f7);
    this.draw();
  }

  resize() {
    const { clientWidth: w, clientHeight: h } = this.element;
    if (w === 0 || h === 0) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(w, h);
    this.camera.aspect = w / h;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  // Another session, or the same one again: what was drawn of the one before is taken away.
  begin(scene) {
    for (const mesh of this.bodies.values()) this.scene.remove(mesh);
    this.bodies.clear();
    this.tool = null;
    this.tiles = [];
    this.working.set(...scene.working);
    this.outwards.set(...scene.outwards);
    return scene;
  }

  addBody(body) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(body.positions, 3));
    geometry.setIndex(new THREE.BufferAttribute(body.corners, 1));
    if (body.colours) geometry.setAttribute("color", new THREE.BufferAttribute(linear(body.colours), 3, true));
    const color = body.colours ? 0xffffff : body.index === 0 ? BRASS : STEEL;
    const mesh = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ color, vertexColors: body.colours !== null, flatShading: true, side: THREE.DoubleSide }));
    place(mesh, body.pose);
    this.scene.add(mesh);
    this.bodies.set(body.index, mesh);
    if (body.index === 0) this.tool = mesh;
    if (this.tick) this.frame();
    this.draw();
  }

  // Over the surface that they lie on, and moving with it.
  addTiles({ body, count, tileOf, corners }) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(corners, 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(12 * tileOf.length), 4));
    const mesh = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({
      vertexColors: true, transparent: true, depthWrite: false, side: THREE.DoubleSide,
      polygonOffset: true, polygonOffsetFactor: -2, polygonOffsetUnits: -2,
    }));
    mesh.visible = this.tilesShown;
    this.bodies.get(body)?.add(mesh);
    this.tiles.push({ mesh, count, tileOf });
  }

  showPresence(here) {
    let first = 0;
    const shown = new THREE.Color();
    for (const { mesh, count, tileOf } of this.tiles) {
      const colour = mesh.geometry.getAttribute("color");
      tileOf.forEach((tile, i) => {
        const [hex, opacity] = here[first + tile] ? TILES.here : TILES.lacking;
        shown.setHex(hex);
        for (let corner = 3 * i; corner < 3 * i + 3; ++corner) colour.setXYZW(corner, shown.r, shown.g, shown.b, opacity);
      });
      colour.needsUpdate = true;
      first += count;
    }
  }

  toggleTiles() {
    this.tilesShown = !this.tilesShown;
    for (const { mesh } of this.tiles) mesh.visible = this.tilesShown;
    return this.tilesShown;
  }

  // How many tiles are drawn, and of these as here, read off their colours.
  shownTiles() {
    let all = 0, here = 0;
    for (const { mesh, count, tileOf } of this.tiles) {
      const colour = mesh.geometry.getAttribute("color"), drawn = new Set();
      tileOf.forEach((tile, i) => { if (colour.getW(3 * i) === Math.fround(TILES.here[1])) drawn.add(tile); });
      all += count;
      here += drawn.size;
    }
    return { all, here };
  }

  // Takes objects and tool into view.
  frame() {
    const box = new THREE.Box3();
    for (const mesh of this.bodies.values()) box.expandByObject(mesh);
    if (box.isEmpty()) return;
    const sphere = box.getBoundingSphere(new THREE.Sphere());
    this.radius = sphere.radius;
    this.centre.copy(sphere.center);
    this.metresPerNewton = this.radius / 10;  // 10 N are as long as half of the scene is wide
    this.handle.scale.setScalar(this.radius / 40);
    this.showArrows();  // in the new scale
    this.look(this.viewName);
  }

  // orbit and top stand still and can be turned. device: from behind the person's hand, along the device's axes as they are
  // turned now. tool: from where the hand holds it, out to where it works, through it. Both follow the motion.
  look(name) {
    this.viewName = name;
    const far = 2.8 * this.radius, from = { orbit: [0.6, -1, 0.7], top: [0, -0.001, 1] }[name];
    this.controls.enabled = from !== undefined;
    if (this.tool) Object.assign(this.tool.material, { transparent: name === "tool", opacity: name === "tool" ? 0.25 : 1, needsUpdate: true });
    this.camera.up.set(0, 0, 1);
    if (from) {
      this.controls.target.copy(this.centre);
      this.camera.position.copy(this.centre).addScaledVector(new THREE.Vector3(...from).normalize(), far);
      this.controls.update();
    }
    this.draw();
  }

  follow() {
    if (this.viewName === "device") {
      const hand = new THREE.Vector3(...this.tick.handle.p), turned = new THREE.Quaternion().setFromAxisAngle(this.camera.up, this.tick.yaw);
      this.camera.position.copy(hand).add(new THREE.Vector3(0, -1, 0.45).normalize().multiplyScalar(1.4 * this.radius).applyQuaternion(turned));
      this.camera.lookAt(hand);
    } else if (this.viewName === "tool" && this.tool) {
      const out = this.outwards.clone().applyQuaternion(this.tool.quaternion);
      const at = this.working.clone().applyQuaternion(this.tool.quaternion).add(this.tool.position);
      const across = new THREE.Vector3(0, 1, 0).applyQuaternion(this.tool.quaternion);
      if (across.cross(out).lengthSq() < 0.01) across.set(1, 0, 0).applyQuaternion(this.tool.quaternion);
      this.camera.up.copy(across.normalize());
      this.camera.position.copy(at).addScaledVector(out, -0.7 * this.radius);
      this.camera.lookAt(at);
    }
  }

  show(tick) {
    const isFirst = this.tick === null;
    this.tick = tick;
    if (this.tool) place(this.tool, tick.tool);
    for (const { body, there, pose } of tick.moving) {
      const mesh = this.bodies.get(body);
      if (!mesh) continue;
      place(mesh, pose);
      mesh.visible = there;
    }
    this.handle.position.set(...tick.handle.p);
    if (isFirst) this.frame();
    this.showArrows();
  }

  showArrows() {
    const tick = this.tick;
    tick.pushes.forEach((push, i) => this.setArrow(i, push));
    for (let i = tick.pushes.length; i < this.arrows.length; ++i) this.arrows[i].visible = false;
  }

  setArrow(i, push) {
    if (!this.arrows[i]) this.arrows[i] = this.makeArrow(i);
    const arrow = this.arrows[i], force = new THREE.Vector3(...push.force), newtons = force.length();
    arrow.visible = newtons > 0;
    arrow.position.set(...push.point);
    arrow.quaternion.setFromUnitVectors(UP, force.divideScalar(newtons || 1));
    arrow.scale.y = newtons * this.metresPerNewton;
    arrow.children[0].material.color.setHex(COLOURS[qualityOf(push)]);
    arrow.scale.x = arrow.scale.z = this.radius / (i === this.picked ? 35 : 60);
  }

  // One unit long and wide, along y: scaled by its force.
  makeArrow(i) {
    const arrow = new THREE.Group();
    const material = new THREE.MeshBasicMaterial({ depthTest: false, transparent: true });  // seen through the bodies that touch there
    const shaft = new THREE.Mesh(new THREE.CylinderGeometry(0.35, 0.35, 0.75, 12).translate(0, 0.375, 0), material);
    const tip = new THREE.Mesh(new THREE.ConeGeometry(1, 0.25, 16).translate(0, 0.875, 0), material);
    shaft.renderOrder = tip.renderOrder = 1;
    arrow.add(shaft, tip);
    arrow.userData.push = i;
    this.scene.add(arrow);
    return arrow;
  }

  // The forces that the arrows show, read off the arrows themselves [N].
  shownForces() {
    return this.arrows.filter((arrow) => arrow.visible).map((arrow) =>
      UP.clone().applyQuaternion(arrow.quaternion).multiplyScalar(arrow.scale.y / this.metresPerNewton).toArray());
  }

  pickAt(event) {
    const box = this.renderer.domElement.getBoundingClientRect();
    const at = new THREE.Vector2(2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height);
    const ray = new THREE.Raycaster();
    ray.setFromCamera(at, this.camera);
    const hit = ray.intersectObjects(this.arrows.filter((arrow) => arrow.visible), true)[0];
    this.pick(hit ? hit.object.parent.userData.push : -1);
  }

  pick(i) {
    this.picked = i;
    this.onPick(i);
  }

  draw() {
    if (this.tick) this.follow();
    this.sun.position.copy(this.camera.position);
    this.renderer.render(this.scene, this.camera);
  }
}

// Light, as three.js takes a vertex' colour, of what screens are told (sRGB).
function linear(colours) {
  const light = Uint8Array.from({ length: 256 }, (_, i) => Math.round(255 * new THREE.Color().setRGB(i / 255, 0, 0, THREE.SRGBColorSpace).r));
  return colours.map((channel) => light[channel]);
}

function place(mesh, pose) {
  mesh.position.set(...pose.p);
  mesh.quaternion.set(...pose.q);
}
