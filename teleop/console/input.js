// Keyboard, mouse and gamepad to one state: { held, drive, target, linear, angular, opening }.
//
// The station takes silence for release: while the dead-man is held the state is sent at 25 Hz, from a
// timer that browsers stop for hidden pages; leaving the page, losing focus or a hidden tab release at once.
const SEND_MS = 40;
const KEYS = {
  KeyW: ['linear', 0, 1], KeyS: ['linear', 0, -1], KeyA: ['linear', 1, 1], KeyD: ['linear', 1, -1],
  KeyR: ['linear', 2, 1], KeyF: ['linear', 2, -1], KeyL: ['angular', 0, 1], KeyJ: ['angular', 0, -1],
  KeyI: ['angular', 1, 1], KeyK: ['angular', 1, -1], KeyU: ['angular', 2, 1], KeyO: ['angular', 2, -1],
  KeyV: ['opening', 0, 1], KeyC: ['opening', 0, -1],
};
const MODE_KEYS = { Digit1: 'stance', Digit2: 'right_gripper', Digit3: 'left_gripper', Digit4: 'lie_down', Digit5: 'right_foot', Digit6: 'left_foot', Digit7: 'locomotion', Digit8: 'right_loco_manipulation', Digit9: 'left_loco_manipulation', Digit0: 'loco_manipulation', Minus: 'bimanual' };
// Standard mapping of the Gamepad API.
const PAD = { a: 0, b: 1, x: 2, y: 3, rb: 5, lt: 6, rt: 7, back: 8, start: 9, l3: 10, r3: 11, up: 12, down: 13, left: 14, right: 15, lb: 4, guide: 16 };
const PAD_MODES = [[PAD.a, 'stance'], [PAD.b, 'right_gripper'], [PAD.x, 'left_gripper'], [PAD.right, 'right_foot'], [PAD.left, 'left_foot'], [PAD.y, 'locomotion'], [PAD.up, 'loco_manipulation'], [PAD.down, 'bimanual'], [PAD.start, 'lie_down']];

export function makeInput({ engageButton, send, requestMode, stop, changed }) {
  const down = new Set();
  const state = { drive: 'sticks', target: 'effector' };
  let [mouse, sentHeld, padBefore] = [false, false, []];

  const pad = () => [...(navigator.getGamepads?.() ?? [])].find((p) => p && p.connected);
  const pressed = (p, i) => Boolean(p?.buttons[i]?.pressed);

  function sample() {
    const input = { held: down.has('Space') || mouse, ...state, linear: [0, 0, 0], angular: [0, 0, 0], opening: 0 };
    for (const code of down) {
      const [kind, index, sign] = KEYS[code] ?? [];
      if (kind === 'opening') input.opening += sign;
      else if (kind) input[kind][index] += sign;
    }
    const p = pad();
    if (p) {
      input.held ||= pressed(p, PAD.rb);
      const value = (i) => p.buttons[i]?.value ?? 0;
      input.linear[0] -= p.axes[1]; input.linear[1] -= p.axes[0];
      input.linear[2] += value(PAD.rt) - value(PAD.lt);
      input.angular[1] -= p.axes[3];
      if (pressed(p, PAD.lb)) input.angular[0] += p.axes[2];
      else input.angular[2] -= p.axes[2];
      input.opening += value(PAD.l3) - value(PAD.r3);
      const edge = (i) => pressed(p, i) && !padBefore[i];
      for (const [button, mode] of PAD_MODES) if (edge(button)) requestMode(mode);
      if (edge(PAD.back)) stop();
      if (edge(PAD.guide)) set('target', state.target === 'torso' ? 'effector' : 'torso');
      padBefore = p.buttons.map((b) => b.pressed);
    }
    const clamp = (v) => Math.max(-1, Math.min(1, v));
    return { ...input, linear: input.linear.map(clamp), angular: input.angular.map(clamp), opening: clamp(input.opening) };
  }

  function tick() {
    const input = sample();
    if (input.held || sentHeld) send({ hand: input });
    sentHeld = input.held;
    engageButton.classList.toggle('held', input.held);
  }

  function release() { down.clear(); mouse = false; tick(); }
  function set(key, value) { state[key] = value; changed(state); }

  const typing = (event) => event.target.closest?.('input, textarea, select') || event.ctrlKey || event.metaKey || event.altKey;
  addEventListener('keydown', (event) => {
    if (typing(event)) return;
    if (event.code === 'Space') event.preventDefault(); // would press the focused button
    if (event.repeat) return;
    if (event.code === 'Escape') stop();
    else if (event.code === 'KeyT') set('target', state.target === 'torso' ? 'effector' : 'torso');
    else if (MODE_KEYS[event.code]) requestMode(MODE_KEYS[event.code]);
    else { down.add(event.code); tick(); }
  });
  addEventListener('keyup', (event) => { if (event.code === 'Space') event.preventDefault(); down.delete(event.code); tick(); });
  engageButton.addEventListener('pointerdown', (event) => { engageButton.setPointerCapture(event.pointerId); mouse = true; tick(); });
  for (const name of ['pointerup', 'pointercancel', 'lostpointercapture']) engageButton.addEventListener(name, () => { mouse = false; tick(); });
  addEventListener('blur', release);
  addEventListener('pagehide', release);
  document.addEventListener('visibilitychange', () => { if (document.hidden) release(); });
  setInterval(() => { if (!document.hidden) tick(); }, SEND_MS);
  changed(state);
  return { set };
}
