// Wires the page: status in, picture and tables out; buttons and keys to the station.
import { makeCameras } from './cameras.js';
import { makeCurves, shellColor } from './curves.js';
import { makeInput } from './input.js';
import { connect } from './link.js';
import { makeScene } from './scene.js';

const $ = (id) => document.getElementById(id);
const words = (name) => (name ?? '').toLowerCase().replaceAll('_', ' ');
const SECOND_PRESS_MS = 10_000;

const scene = await makeScene($('view'));
const showPreview = makeCameras($('cameras'));
const addCurves = makeCurves($('rms'), $('sigma'));

let stoppedAt = -Infinity;
function stop() {
  const again = performance.now() - stoppedAt < SECOND_PRESS_MS;
  stoppedAt = performance.now();
  link.send({ stop: again ? 'damp' : 'settle' });
  $('stop').innerHTML = again ? 'STOPPED<small>damped</small>' : 'STOP<small>press again: damp at once</small>';
  setTimeout(() => { if (performance.now() - stoppedAt >= SECOND_PRESS_MS) $('stop').innerHTML = 'STOP<small>settle · Esc</small>'; }, SECOND_PRESS_MS);
}

const link = connect({
  onStatus: show,
  onPreview: showPreview,
  onOpen: () => { $('banner').hidden = true; },
  onClose: () => banner('No connection to the station (locoman-teleop). Trying again…'),
});
const requestMode = (mode) => link.send({ mode });
const input = makeInput({
  engageButton: $('engage'), send: link.send, requestMode, stop,
  changed: (state) => {
    document.querySelectorAll('[data-drive]').forEach((b) => b.classList.toggle('on', b.dataset.drive === state.drive));
    document.querySelectorAll('[data-target]').forEach((b) => b.classList.toggle('on', b.dataset.target === state.target));
  },
});
$('stop').onclick = stop;
document.querySelectorAll('[data-mode]').forEach((b) => { b.onclick = () => { requestMode(b.dataset.mode); b.blur(); }; });
document.querySelectorAll('[data-drive]').forEach((b) => { b.onclick = () => { input.set('drive', b.dataset.drive); b.blur(); }; });
document.querySelectorAll('[data-target]').forEach((b) => { b.onclick = () => { input.set('target', b.dataset.target); b.blur(); }; });
document.querySelectorAll('[data-look]').forEach((b) => {
  b.hidden = !scene.hasOperator;
  b.onclick = () => {
    scene.look(b.dataset.look);
    document.querySelectorAll('[data-look]').forEach((other) => other.classList.toggle('on', other === b));
    b.blur();
  };
});
let auto = null;
$('auto').onclick = () => { link.send({ auto: !auto }); $('auto').blur(); };

function chip(id, text, kind = '') { $(id).textContent = text; $(id).className = `chip ${kind}`; }
function banner(text) { $('banner').hidden = !text; $('banner').textContent = text; }

/** A table row by row, without building HTML from received text. */
function rows(table, list) {
  const made = list.map((cells) => {
    const tr = document.createElement('tr');
    cells.forEach((cell, i) => {
      const td = document.createElement(i ? 'td' : 'th');
      if (cell instanceof Node) { td.className = cell.dataset.kind; td.append(cell); }
      else if (Array.isArray(cell)) { td.textContent = cell[0]; td.className = cell[1]; }
      else td.textContent = cell;
      tr.append(td);
    });
    return tr;
  });
  table.replaceChildren(...made);
}
function items(list, texts) {
  list.replaceChildren(...texts.map((text) => Object.assign(document.createElement('li'), { textContent: text })));
}
function mark(kind, style) { const i = Object.assign(document.createElement('i'), { style }); i.dataset.kind = kind; return i; }
const bar = (share) => mark('bar', `width: ${Math.min(100, 100 * share)}%`);
const swatch = (color) => mark('swatch', `background: ${color}`);
const ms = (value) => (value === null || value === undefined ? '–' : `${value.toFixed(value < 10 ? 2 : 1)}`);

const signed = (value) => `${value < 0 ? '−' : '+'}${Math.abs(value) < 1000 ? Math.abs(value).toFixed(2) : Math.abs(value).toExponential(2)}`;

let [tables, first] = [0, true];
function show(status) {
  const { robot, pilot, tracking } = status;
  // With live cameras and no autopilot the dead-man is there for the tracked operator.
  if (first && tracking.shells.length) {
    first = false;
    if (pilot.auto === null) input.set('drive', 'tracker');
  }
  scene.robot(robot);
  scene.operator(tracking.shells, status.cameras);
  if (tracking.fresh) addCurves(tracking.shells);
  if (status.robot_silent_s !== null && status.robot_silent_s <= 0.5) banner('');
  else if (status.robot_silent_s === null) banner('No robot yet: nothing has been heard since the station started');
  else banner(`Robot silent since ${status.robot_silent_s.toFixed(1)} s: holding, not engaged`);

  const moving = robot && robot.goal !== robot.mode;
  const silent = status.robot_silent_s === null || status.robot_silent_s > 0.5;
  chip('mode', !robot ? 'no robot' : moving ? `${words(robot.mode)} → ${words(robot.goal)} · ${robot.phase}` : words(robot.mode), silent ? 'bad' : moving ? 'warn' : 'good');
  chip('engaged', pilot.engagement ? `engaged · ${words(pilot.device)}` : 'not engaged', pilot.engagement ? 'good' : '');
  const severity = robot?.severity ?? 'none';
  chip('severity', !robot ? '–' : severity === 'none' ? 'all well' : words(severity), !robot ? '' : { none: 'good', warn: 'warn', hold: 'warn' }[severity] ?? 'bad');
  $('message').textContent = robot?.refusal ? `refused: ${robot.refusal}` : pilot.engagement ? '' : pilot.waiting_for;
  auto = pilot.auto;
  $('auto').hidden = auto === null;
  $('auto').classList.toggle('on', Boolean(auto));
  document.querySelectorAll('[data-mode]').forEach((b) => {
    b.classList.toggle('here', robot?.mode === b.dataset.mode);
    b.classList.toggle('asked', Boolean(moving) && robot.goal === b.dataset.mode);
  });

  tables += 1;
  if (tables % 4) return; // five times a second is enough to read
  const worst = Math.max(1, ...status.latency.map((stage) => stage.p99_ms ?? 0));
  rows($('latency'), status.latency.map((s) => [s.name, bar((s.p50_ms ?? 0) / worst), `${ms(s.p50_ms)} / ${ms(s.p99_ms)} ms`]));
  $('rate').textContent = `${tracking.rate_hz.toFixed(1)} Hz · dropped ${tracking.dropped}`;
  rows($('shells'), tracking.shells.map((s) => {
    const good = s.verdict === 'tracked';
    return [words(s.name), swatch(shellColor(s.name)), [s.verdict, good ? 'good' : s.verdict === 'predicted' ? 'warn' : 'bad'],
      good ? `${s.rms_px.toFixed(2)} px` : '', good ? `${s.sigma_mm.toFixed(2)} mm` : '', `${s.tags} tags`];
  }));
  $('camera-card').hidden = !status.cameras.length;
  const clocks = status.cameras.some((camera) => camera.clock);
  const heads = ['', 'age', 'dropped', 'read', 'tags', ...(clocks ? ['clock'] : [])];
  rows($('camera-table'), [heads.map((head) => [head, 'head']), ...status.cameras.map((c) => {
    const dropped = c.frames ? (100 * c.dropped) / c.frames : 0;
    const cells = [words(c.name), c.age_ms === null ? ['never', 'bad'] : c.silent ? [`silent ${(c.age_ms / 1000).toFixed(1)} s`, 'bad'] : [`${c.age_ms.toFixed(0)} ms`, 'good'],
      [`${dropped.toFixed(1)} %`, dropped > 5 ? 'warn' : ''], `${ms(c.read_ms)} ms`,
      [`${c.seen.accepted.length} / ${c.seen.accepted.length + c.seen.refused.length}`, c.seen.refused.length > c.seen.accepted.length ? 'warn' : '']];
    if (clocks) cells.push(c.clock ? `${signed(c.clock.offset_ms)} ± ${c.clock.error_ms.toFixed(2)} ms` : 'here');
    return cells;
  })]);
  items($('camera-problems'), status.cameras.filter((c) => c.problem).map((c) => `${words(c.name)}: ${c.problem}`));
  if (robot) {
    $('owner').textContent = robot.ours ? 'obeys this station' : robot.command_age_ms === null ? 'has no commands' : 'obeys somebody else';
    rows($('robot'), [
      ['control period p50 / p99 / worst', `${ms(robot.period_ms[0])} / ${ms(robot.period_ms[1])} / ${ms(robot.period_ms[2])} ms`],
      ['control step p50 / p99', `${ms(robot.compute_ms[0])} / ${ms(robot.compute_ms[1])} ms`],
      ['commands accepted / rejected', `${robot.accepted} / ${robot.rejected}`],
      ['gripper opening right / left', robot.openings.map((o) => `${Math.round(100 * o)} %`).join(' / ')],
      ['foot forces FR FL RR RL', robot.foot_force_n.map((f) => f.toFixed(0)).join('  ') + ' N'],
    ]);
  }
  items($('reasons'), robot?.reasons ?? []);
  items($('events'), status.events.map((e) => `${e.ago_s.toFixed(0)} s ago · ${e.name} ${e.detail}`));
}
