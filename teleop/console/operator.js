// The operator as the tracker has it: the corners and edges of all tags, carried by the shells' poses, with axes; and
// the cameras that look. What is seen now is bright: accepted tags white, refused ones red, unseen ones dim.
import { AxesHelper, BufferAttribute, BufferGeometry, Color, Group, LineBasicMaterial, LineSegments, Points, PointsMaterial } from './vendor/three.min.js';
import { shellColor } from './curves.js';

const REFUSED = new Color('#ff5c57');
const UNSEEN_SHARE = 0.28;
const AXES_M = { torso: 0.22, palm: 0.11, thumb: 0.06 };
const CAMERA = { there: '#6f86a6', silent: '#ff5c57' };
/** A square as four edges. */
const EDGES = [0, 1, 1, 2, 2, 3, 3, 0];

/** Lines and points at the corners of quads, with one colour a quad. */
function quads(corners) {
  const order = corners.flatMap((quad) => EDGES.map((i) => quad[i]));
  const buffer = (points, material, Kind) => {
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(points.flat()), 3));
    const colors = new BufferAttribute(new Float32Array(points.length * 3), 3);
    geometry.setAttribute('color', colors);
    const object = new Kind(geometry, material);
    // Moved by its parent: the culling would look at the wrong place only after a resize of the geometry.
    object.frustumCulled = false;
    return { object, colors, each: points.length / corners.length };
  };
  const parts = [
    buffer(order, new LineBasicMaterial({ vertexColors: true }), LineSegments),
    buffer(corners.flat(), new PointsMaterial({ vertexColors: true, size: 3.5, sizeAttenuation: false }), Points),
  ];
  return {
    objects: parts.map((part) => part.object),
    paint(colorOf) {
      for (const { colors, each } of parts) {
        corners.forEach((_, quad) => {
          const color = colorOf(quad);
          for (let i = 0; i < each; i += 1) colors.setXYZ(quad * each + i, color.r, color.g, color.b);
        });
        colors.needsUpdate = true;
      }
    },
  };
}

function shellGroup({ name, tags }) {
  const group = new Group();
  group.visible = false;
  const cloud = quads(tags.map((tag) => tag.corners));
  const axes = new AxesHelper(AXES_M[name.split('_').pop()] ?? 0.1);
  axes.renderOrder = 1;
  group.add(...cloud.objects, axes);
  const own = new Color(shellColor(name));
  const dim = own.clone().multiplyScalar(UNSEEN_SHARE);
  return {
    group,
    paint(accepted, refused) {
      cloud.paint((i) => (accepted.has(tags[i].id) ? own : refused.has(tags[i].id) ? REFUSED : dim));
    },
  };
}

function frustum({ center, corners }) {
  const lines = corners.flatMap((corner, i) => [center, corner, corner, corners[(i + 1) % 4]]);
  // A little roof tells which side is up.
  const [left, right] = corners;
  const top = left.map((value, k) => (value + right[k]) / 2 + 0.35 * (left[k] - corners[3][k]));
  lines.push(left, top, top, right);
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(lines.flat()), 3));
  return new LineSegments(geometry, new LineBasicMaterial({ color: CAMERA.there }));
}

/** Draws into a group of the room's frame; `false` without a tracker. */
export async function makeOperator(room) {
  const answer = await fetch('operator.json');
  const view = answer.ok ? await answer.json() : null;
  if (!view) return null;
  const shells = new Map(view.shells.map((shell) => [shell.name, shellGroup(shell)]));
  const frusta = new Map(view.cameras.map((camera) => [camera.id, frustum(camera)]));
  room.add(...[...shells.values()].map((shell) => shell.group), ...frusta.values());
  return {
    /** Poses of the shells, and what each camera sees. */
    show(reports, cameras) {
      const accepted = new Set(cameras.flatMap((camera) => (camera.silent ? [] : camera.seen.accepted)));
      const refused = new Set(cameras.flatMap((camera) => (camera.silent ? [] : camera.seen.refused)));
      for (const report of reports) {
        const shell = shells.get(report.name);
        if (!shell) continue;
        shell.group.visible = report.verdict !== 'lost' && Boolean(report.pose);
        if (!shell.group.visible) continue;
        shell.group.position.set(...report.pose.p);
        const [w, x, y, z] = report.pose.q;
        shell.group.quaternion.set(x, y, z, w);
        shell.paint(accepted, refused);
      }
      for (const camera of cameras) frusta.get(camera.name)?.material.color.set(camera.silent ? CAMERA.silent : CAMERA.there);
    },
  };
}
