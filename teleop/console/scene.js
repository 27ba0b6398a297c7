// The 3D view: the robot with its targets, and beside it the operator as the tracker has it.
import { AmbientLight, AxesHelper, BoxGeometry, Color, DirectionalLight, EdgesGeometry, Fog, GridHelper, Group, HemisphereLight, LineBasicMaterial, LineSegments, Mesh, MeshStandardMaterial, OrbitControls, PerspectiveCamera, Scene, SphereGeometry, WebGLRenderer } from './vendor/three.min.js';
import { makeOperator } from './operator.js';
import { robotFromUrdf } from './urdf.js';

// Standing, arms stowed along the calves: what is shown before any robot has spoken.
const STAND = [0, 0.9, -1.8, 0, 0.9, -1.8, 0, 0.9, -1.8, 0, 0.9, -1.8, 0, 0, 0, 0, 0, 0];
const STAND_HEIGHT_M = 0.285;
const FOOT_RADIUS_M = 0.02;
const TARGET = 0xffb454;
const BACKGROUND = 0x151b24;

/** Without a GPU drawing takes the processor away from tracking, on the same computer: draw seldom. */
const SOFTWARE_FPS = 8;
function isSoftware(gl) {
  const info = gl.getExtension('WEBGL_debug_renderer_info');
  return /swiftshader|llvmpipe|software/i.test(info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : '');
}

function setPose(object, pose) {
  object.visible = Boolean(pose);
  if (!pose) return;
  object.position.set(...pose.p);
  const [w, x, y, z] = pose.q;
  object.quaternion.set(x, y, z, w);
}

function ghostBox(x, y, z) {
  const box = new BoxGeometry(x, y, z);
  const group = new Group();
  group.add(new LineSegments(new EdgesGeometry(box), new LineBasicMaterial({ color: TARGET })));
  group.add(new Mesh(box, new MeshStandardMaterial({ color: TARGET, transparent: true, opacity: 0.12, depthWrite: false })));
  return group;
}

function targetPoint(radius) {
  return new Mesh(new SphereGeometry(radius, 16, 12), new MeshStandardMaterial({ color: TARGET, emissive: 0x553300 }));
}

function targetFrame() {
  const group = new Group();
  group.add(new AxesHelper(0.09), targetPoint(0.013));
  return group;
}

/** Where the operator's room is drawn: at the robot's left, turned to face the same way. */
const ROOM = { at: [0, 0.7, -0.1], scale: 0.5 }; // a person is four times as tall as the robot
const VIEWS = {
  both: { from: [1.45, -0.95, 0.8], to: [0.1, 0.16, 0.22] },
  operator: { from: [0.62, 0.12, 0.86], to: [0.2, 0.7, 0.5] },
};

export async function makeScene(canvas) {
  const renderer = new WebGLRenderer({ canvas, antialias: true });
  const slow = isSoftware(renderer.getContext());
  renderer.setPixelRatio(slow ? 1 : Math.min(window.devicePixelRatio, 1.5));
  const framePeriodMs = 1000 / (slow ? SOFTWARE_FPS : 60);
  const scene = new Scene();
  scene.background = new Color(BACKGROUND);
  scene.fog = new Fog(BACKGROUND, 3, 8);
  scene.add(new AmbientLight(0xffffff, 0.5), new HemisphereLight(0xcfe3ff, 0x30343c, 1.3));
  const sun = new DirectionalLight(0xffffff, 1.8);
  sun.position.set(1.5, -2, 3);
  scene.add(sun);
  const ground = new GridHelper(6, 30, 0x3a4656, 0x242d3a);
  ground.rotation.x = Math.PI / 2;
  scene.add(ground);
  const camera = new PerspectiveCamera(42, 1, 0.02, 30);
  camera.up.set(0, 0, 1);
  const controls = new OrbitControls(camera, canvas);
  const look = (view) => {
    camera.position.set(...VIEWS[view].from);
    controls.target.set(...VIEWS[view].to);
    controls.update();
  };
  look('both');

  // Estimates count from the torso frame at the last reset, which is not the ground: the feet are.
  const world = new Group();
  world.position.z = STAND_HEIGHT_M;
  scene.add(world);
  const torso = new Group();
  world.add(torso);
  const torsoTarget = ghostBox(0.3762, 0.0935, 0.114);
  const gripperTargets = [targetFrame(), targetFrame()];
  const footTargets = [targetPoint(FOOT_RADIUS_M + 0.004), targetPoint(FOOT_RADIUS_M + 0.004)];
  world.add(torsoTarget, ...gripperTargets, ...footTargets);
  [torsoTarget, ...gripperTargets, ...footTargets].forEach((object) => { object.visible = false; });
  const room = new Group();
  room.position.set(...ROOM.at);
  room.scale.setScalar(ROOM.scale);
  scene.add(room);
  const operator = await makeOperator(room).catch((error) => { console.warn('no picture of the operator:', error); return null; });

  let robot = null;
  try {
    const answer = await fetch('robot.urdf');
    if (!answer.ok) throw new Error(await answer.text());
    robot = robotFromUrdf(await answer.text());
    torso.add(robot.root);
    robot.setJoints(STAND, [0, 0]);
  } catch (error) {
    console.warn('no picture of the robot:', error);
  }

  let dirty = true;
  controls.addEventListener('change', () => { dirty = true; });
  const resize = () => {
    const { clientWidth: w, clientHeight: h } = canvas.parentElement;
    renderer.setSize(w, h, false);
    camera.aspect = w / Math.max(h, 1);
    camera.updateProjectionMatrix();
    dirty = true;
  };
  new ResizeObserver(resize).observe(canvas.parentElement);
  resize();
  let drawn = -Infinity;
  const draw = (now) => {
    requestAnimationFrame(draw);
    if (!dirty || now - drawn < framePeriodMs) return;
    [dirty, drawn] = [false, now];
    renderer.render(scene, camera);
  };
  requestAnimationFrame(draw);

  return {
    robot(state) {
      if (!state) return;
      robot?.setJoints(state.joints, state.openings);
      setPose(torso, state.torso);
      torso.visible = true;
      // Whatever the robot's frame is, its lowest foot stands on the ground.
      if (robot) world.position.z += 0.2 * (FOOT_RADIUS_M - robot.lowestFoot());
      setPose(torsoTarget, state.torso_target);
      setPose(gripperTargets[0], state.gripper_targets[0]);
      setPose(gripperTargets[1], state.gripper_targets[1]);
      ['right_foot', 'left_foot'].forEach((mode, i) => setPose(footTargets[i], state.mode === mode ? state.foot_targets[i] : null));
      dirty = true;
    },
    operator(shells, cameras) { operator?.show(shells, cameras); dirty = true; },
    /** `both` or `operator`. */
    look(view) { look(view); dirty = true; },
    hasOperator: Boolean(operator),
  };
}
