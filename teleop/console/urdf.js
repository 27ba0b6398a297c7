// The robot's picture from its URDF: collision primitives, moved by forward kinematics.
//
// The station knows no robot model; this page reads the same file that the robot reads. Links without a
// shape get a rod to their child joint, so that a chain is never invisible.
import { BoxGeometry, CylinderGeometry, Group, Mesh, MeshStandardMaterial, Quaternion, SphereGeometry, Vector3 } from './vendor/three.min.js';

const numbers = (text, fallback) => (text ? text.trim().split(/\s+/).map(Number) : fallback);
const child = (node, name) => [...node.children].find((c) => c.tagName === name);

/** Places `object` by a URDF <origin>: R = Rz(yaw) Ry(pitch) Rx(roll). */
function place(object, origin) {
  object.position.set(...numbers(origin?.getAttribute('xyz'), [0, 0, 0]));
  const [roll, pitch, yaw] = numbers(origin?.getAttribute('rpy'), [0, 0, 0]);
  object.rotation.set(roll, pitch, yaw, 'ZYX');
}

function shape(geometry, material) {
  const box = child(geometry, 'box');
  const cylinder = child(geometry, 'cylinder') ?? child(geometry, 'capsule');
  const sphere = child(geometry, 'sphere');
  if (box) return new Mesh(new BoxGeometry(...numbers(box.getAttribute('size'))), material);
  if (sphere) return new Mesh(new SphereGeometry(Number(sphere.getAttribute('radius')), 24, 16), material);
  if (!cylinder) return null;
  const radius = Number(cylinder.getAttribute('radius'));
  const mesh = new Mesh(new CylinderGeometry(radius, radius, Number(cylinder.getAttribute('length')), 24), material);
  mesh.rotation.x = Math.PI / 2; // three's cylinders stand along y, URDF's along z
  const turned = new Group();
  turned.add(mesh);
  return turned;
}

function rod(to, material) {
  const length = to.length();
  const mesh = new Mesh(new CylinderGeometry(0.011, 0.011, length, 12), material);
  mesh.position.copy(to).multiplyScalar(0.5);
  mesh.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), to.clone().normalize());
  return mesh;
}

/** Two jaws at the grasp centre, along -z of the end-effector link, opening along +-y. */
function jaws(material) {
  const pair = [1, -1].map((side) => {
    const hinge = new Group();
    hinge.position.set(0, side * 0.008, 0.03);
    const jaw = new Mesh(new BoxGeometry(0.022, 0.006, 0.055), material);
    jaw.position.z = -0.026;
    hinge.add(jaw);
    hinge.userData.side = side;
    return hinge;
  });
  const palm = new Mesh(new BoxGeometry(0.034, 0.03, 0.02), material);
  palm.position.z = 0.036;
  const group = new Group();
  group.add(palm, ...pair);
  group.userData.open = (opening) => pair.forEach((hinge) => { hinge.rotation.x = hinge.userData.side * 0.7 * opening; });
  group.userData.open(0);
  return group;
}

/** Joints in the order of the messages: legs FR, FL, RR, RL (hip, thigh, calf), then arms right, left. */
function order(names) {
  const find = (leg, part) => names.find((name) => name.includes(leg) && name.includes(part));
  const legs = ['FR', 'FL', 'RR', 'RL'].flatMap((leg) => ['hip', 'thigh', 'calf'].map((part) => find(leg, part)));
  const arms = ['FR', 'FL'].flatMap((leg) => ['joint_1', 'joint_2', 'joint_3'].map((part) => find(leg, part)));
  return [...legs, ...arms];
}

/** Reads the URDF; returns { root, setJoints(positions, openings) }. */
export function robotFromUrdf(text) {
  const xml = new DOMParser().parseFromString(text, 'application/xml').documentElement;
  const paint = {
    trunk: new MeshStandardMaterial({ color: 0xd8dee9, roughness: 0.55, metalness: 0.1 }),
    leg: new MeshStandardMaterial({ color: 0x8fa1ba, roughness: 0.6 }),
    arm: new MeshStandardMaterial({ color: 0x5cb8ff, roughness: 0.5 }),
    foot: new MeshStandardMaterial({ color: 0x333b47, roughness: 0.9 }),
  };
  const paintOf = (name) => /eef|link_\d/.test(name) ? paint.arm : /foot/.test(name) ? paint.foot : /hip|thigh|calf/.test(name) ? paint.leg : paint.trunk;
  const links = new Map();
  for (const node of xml.querySelectorAll('robot > link')) {
    const name = node.getAttribute('name');
    const group = new Group();
    group.userData.shapes = 0;
    for (const part of [...node.children].filter((c) => c.tagName === 'collision')) {
      const geometry = child(part, 'geometry');
      const mesh = geometry && shape(geometry, paintOf(name));
      if (!mesh) continue;
      const holder = new Group();
      place(holder, child(part, 'origin'));
      holder.add(mesh);
      group.add(holder);
      group.userData.shapes += 1;
    }
    links.set(name, group);
  }
  const joints = new Map();
  const children = new Set();
  for (const node of xml.querySelectorAll('robot > joint')) {
    const parent = links.get(child(node, 'parent').getAttribute('link'));
    const name = child(node, 'child').getAttribute('link');
    const link = links.get(name);
    const frame = new Group();
    place(frame, child(node, 'origin'));
    frame.add(link);
    parent.add(frame);
    children.add(name);
    const offset = frame.position.clone();
    if (parent.userData.shapes === 0 && offset.length() > 0.01 && !/rotor/.test(name)) parent.add(rod(offset, paintOf(name)));
    if (/revolute|continuous/.test(node.getAttribute('type'))) {
      const axis = new Vector3(...numbers(child(node, 'axis')?.getAttribute('xyz'), [1, 0, 0])).normalize();
      joints.set(node.getAttribute('name'), { link, axis });
    }
  }
  const rootName = [...links.keys()].find((name) => !children.has(name));
  const hands = ['FR', 'FL'].map((leg) => {
    const name = [...links.keys()].find((n) => n.includes(leg) && /eef|gripper$/.test(n));
    const hand = jaws(paint.arm);
    if (name) links.get(name).add(hand);
    return hand;
  });
  const ordered = order([...joints.keys()]).map((name) => joints.get(name));
  const feet = [...links].filter(([name]) => /foot$/.test(name)).map(([, link]) => link);
  const [turn, point] = [new Quaternion(), new Vector3()];
  return {
    root: links.get(rootName),
    /** Height of the lowest foot's centre in the scene. */
    lowestFoot() {
      return Math.min(...feet.map((foot) => foot.getWorldPosition(point).z));
    },
    setJoints(positions, openings) {
      ordered.forEach((joint, i) => joint && Number.isFinite(positions[i]) && joint.link.quaternion.copy(turn.setFromAxisAngle(joint.axis, positions[i])));
      hands.forEach((hand, i) => hand.userData.open(openings?.[i] ?? 0));
    },
  };
}
