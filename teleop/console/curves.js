// Tracking quality over the last 20 seconds, a curve for each shell.
import uPlot from './vendor/uplot.min.js';

const SPAN_S = 20;
const COLORS = { torso: '#d8dee9', right_palm: '#ff8a5c', left_palm: '#5cb8ff', right_thumb: '#ffd166', left_thumb: '#7fd17f' };
const NAMES = Object.keys(COLORS);

function plot(parent, title, unit) {
  const axis = { stroke: '#8592a6', grid: { stroke: '#2a3340', width: 1 }, ticks: { show: false }, font: '11px sans-serif' };
  const options = {
    title, width: parent.clientWidth || 370, height: 112, legend: { show: false }, cursor: { show: false },
    scales: { x: { time: false, range: () => [-SPAN_S, 0] }, y: { range: (_, low, high) => [0, Math.max(high * 1.1, 0.1)] } },
    axes: [{ ...axis, size: 20, values: (_, ticks) => ticks.map((t) => `${t} s`) }, { ...axis, size: 46, values: (_, ticks) => ticks.map((t) => `${t} ${unit}`) }],
    series: [{}, ...NAMES.map((name) => ({ label: name, stroke: COLORS[name], width: 1.3, points: { show: false } }))],
  };
  return new uPlot(options, [[], ...NAMES.map(() => [])], parent);
}

export const shellColor = (name) => COLORS[name] ?? '#d8dee9';

export function makeCurves(rmsParent, sigmaParent) {
  const plots = [plot(rmsParent, 'reprojection error', 'px'), plot(sigmaParent, 'position, one sigma', 'mm')];
  const samples = [];
  let drawn = 0;
  return (shells) => {
    const now = performance.now() / 1000;
    const by = (key) => NAMES.map((name) => {
      const shell = shells.find((s) => s.name === name);
      return shell && shell.verdict === 'tracked' ? shell[key] : null;
    });
    samples.push({ t: now, rms: by('rms_px'), sigma: by('sigma_mm') });
    while (samples.length && samples[0].t < now - SPAN_S) samples.shift();
    if (now - drawn < 0.25) return;
    drawn = now;
    const x = samples.map((s) => s.t - now);
    ['rms', 'sigma'].forEach((key, i) => plots[i].setData([x, ...NAMES.map((_, n) => samples.map((s) => s[key][n]))]));
  };
}
