// Plots of one session. All plots share one time window and one cursor: drag to zoom, shift-drag to move, double click
// to see all again. What is drawn is each column's least and greatest value, so that no peak is lost at any zoom.
import "./report.css";
import { Plot, css, line } from "../../plots/plots.js";

const trace = JSON.parse(document.getElementById("trace").textContent);
const STATES = ["free", "touching", "held", "fading", "fault", "paused"];
const GRAVITY = [0, 1, 3, 4, 5, 2];  // of each

const floats = (base64) => {
  const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  return new Float32Array(bytes.buffer);
};
const time = floats(trace.time_s);
const state = Uint8Array.from(atob(trace.state), (c) => c.charCodeAt(0));
const lines = new Map(trace.lines.map((l) => {
  const low = floats(l.low);
  return [l.name, { low, high: l.high === null ? low : floats(l.high) }];
}));
const end = time.length > 1 ? time[time.length - 1] : 1;
const bucket_s = end / Math.max(time.length, 1);

const xyz = (name, unit) => [["x", `${name}_x_${unit}`], ["y", `${name}_y_${unit}`], ["z", `${name}_z_${unit}`],
                             ["length", `${name}_${unit}`]];
const PLOTS = [
  { title: "Force on the hand", unit: "N", series: xyz("hand_force", "N") },
  { title: "Torque on the hand", units: [[1e3, "mN·m"], [1, "N·m"]], series: xyz("hand_torque", "Nm") },
  { title: "Penetration depth", units: [[1e6, "µm"], [1e3, "mm"]], series: [["deepest contact", "depth_max_m"]] },
  { title: "Contacts", unit: "count", series: [["contacts that press", "contacts"]] },
  { title: "Pairs of pieces near", unit: "count", series: [["pairs", "pairs"]] },
  { title: "Round trip", unit: "ms", series: [["pose to contacts", "rtt_ms"]], dots: true },
  { title: "Loop: how late ticks begin", unit: "µs", series: [["wake-up", "wake_us"]], isLog: true },
  { title: "Loop: how long ticks work", unit: "µs", series: [["work", "work_us"]], isLog: true },
  { title: "Energy stored", units: [[1e3, "mJ"], [1, "J"]], series: [["coupling", "coupling_energy_J"],
    ["contacts", "contact_energy_J"]] },
  { title: "Energy tank: what updates may still add", units: [[1e3, "mJ"], [1, "J"]],
    series: [["tank", "tank_J"]], note: "below zero: a debt, paid back as damping" },
  { title: "Energy through the ports", units: [[1e3, "mJ"], [1, "J"]], series: [
    ["hand into device", "device_observer_J"], ["tool into contacts", "contact_port_J"],
    ["moving objects into contacts", "script_work_J"]],
    note: "tool and moving objects together: below zero is only what the tank's allowance gave" },
  { title: "Ticks missed so far", unit: "count", series: [["missed", "ticks_missed"]] },
];

const stateColour = (s) => css(`--${STATES[s]}`);

// First bucket at or after t.
const bucketAt = (t) => {
  let low = 0, high = time.length;
  while (low < high) { const middle = (low + high) >> 1; if (time[middle] < t) low = middle + 1; else high = middle; }
  return low;
};

// What uPlot draws over a window of time, an array of times and one a line: two values a column where that has more than
// one, its least and its greatest, so the line fills the range the quantity swept.
const COLUMNS = 700;
const dataOf = (plot, from, to) => {
  const first = Math.max(bucketAt(from) - 1, 0), last = Math.min(bucketAt(to) + 1, time.length);
  const step = Math.max(1, Math.ceil((last - first) / COLUMNS)), hasRange = step > 1 || trace.rows_per_bucket > 1;
  const scale = plot.scale || 1, data = [[], ...plot.lines.map(() => [])];
  for (let at = first; at < last; at += step) {
    const until = Math.min(at + step, last);
    data[0].push(time[at]);
    if (hasRange) data[0].push(time[at] + (until - at) * bucket_s / 2);
    plot.lines.forEach((swept, n) => {
      let low = Infinity, high = -Infinity;
      for (let i = at; i < until; ++i) {
        if (swept.low[i] < low) low = swept.low[i];
        if (swept.high[i] > high) high = swept.high[i];
      }
      const drawn = (value) => low > high || (plot.isLog && value <= 0) ? null : value * scale;
      data[n + 1].push(drawn(low));
      if (hasRange) data[n + 1].push(drawn(high));
    });
  }
  return data;
};

// Behind every plot: what the loop was doing.
const tint = (graph) => {
  const { ctx, bbox } = graph, [from, to] = shownWindow;
  const last = Math.min(bucketAt(to) + 1, time.length);
  ctx.save();
  for (let at = Math.max(bucketAt(from) - 1, 0); at < last;) {
    let until = at + 1;
    while (until < last && state[until] === state[at]) ++until;
    if (state[at] !== 0) {
      const left = Math.max(graph.valToPos(time[at], "x", true), bbox.left);
      const right = Math.min(graph.valToPos(until < time.length ? time[until] : end, "x", true), bbox.left + bbox.width);
      ctx.globalAlpha = state[at] === 1 ? 0.055 : 0.2;
      ctx.fillStyle = stateColour(state[at]);
      if (right > left) ctx.fillRect(left, bbox.top, right - left, bbox.height);
    }
    at = until;
  }
  ctx.restore();
};

let graphs = [];
let shownWindow = [0, end];
const show = (from, to) => {
  const length = Math.max(Math.min(to - from, end), 1e-3), start = Math.min(Math.max(from, 0), end - length);
  shownWindow = [start, start + length];
  for (const { graph, plot } of graphs) graph.plot.setData(dataOf(plot, ...shownWindow));
  drawRibbon();
};

// Shift and drag moves the window; without shift uPlot draws what is to be zoomed to.
const moved = (graph, _, zoom) => (event) => {
  if (!event.shiftKey) return zoom(event);
  const [from, to] = shownWindow, at = event.clientX, perPixel = (to - from) / graph.over.clientWidth;
  const move = ({ clientX }) => show(from - (clientX - at) * perPixel, to - (clientX - at) * perPixel);
  addEventListener("mousemove", move);
  addEventListener("mouseup", () => removeEventListener("mousemove", move), { once: true });
  return null;
};
const zoomed = (graph) => {
  const { left, width } = graph.select;
  if (width < 3) return;
  graph.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
  show(graph.posToVal(left, "x"), graph.posToVal(left + width, "x"));
};

const makePlot = (plot) => {
  const present = plot.series.filter(([, column]) => lines.has(column) && lines.get(column).low.some((v) => !Number.isNaN(v)));
  if (!present.length) return;
  plot.lines = present.map(([, column]) => lines.get(column));
  if (plot.units) {  // the first in which no figure is long
    const largest = plot.lines.reduce((m, l) => l.high.reduce((n, v) => Math.max(n, Math.abs(v) || 0), m), 0);
    [plot.scale, plot.unit] = plot.units.find(([scale]) => largest * scale < 2000) || plot.units[plot.units.length - 1];
  }
  const dots = plot.dots ? { paths: () => null, points: { show: true, size: 3 } } : { spanGaps: true };
  const graph = new Plot(document.getElementById("plots"), {
    heading: "h3", title: `${plot.title} [${plot.unit}]`, note: plot.note, height: 230, isLog: plot.isLog, x: () => shownWindow,
    timeLabel: "time [s]",
    series: present.map(([name], n) => line(name, n, plot.unit, dots)), data: dataOf(plot, ...shownWindow),
    cursor: { sync: { key: "session" }, drag: { x: true, y: false, setScale: false }, bind: { mousedown: moved, dblclick: () => () => show(0, end) } },
    hooks: { drawClear: [tint], setSelect: [zoomed] },
  });
  graph.card.classList.add("card");
  graphs.push({ graph, plot });
};

// The whole session's states in one ribbon, and the rungs it was felt from in another: what is gravest, or poorest, in
// every column. The window shown in the plots is framed. A click goes there.
const RUNGS = new Map([[0, "held wrench"], [1, "linear contacts"], [2, "quadratic contacts"], [3, "tiles"]]);
const rungLine = lines.get("rung");
const rungColour = (rung) => css(`--rung-${rung}`);
const ribbons = [[document.getElementById("states"), state, (s) => s === 0 ? null : stateColour(s), (a, b) => GRAVITY[a] > GRAVITY[b] ? a : b]];
if (rungLine) ribbons.push([document.getElementById("rungs"), rungLine.low, rungColour, (a, b) => Math.min(a, b)]);
function drawRibbon() {
  for (const each of ribbons) drawOneRibbon(...each);
}
function drawOneRibbon(ribbon, values, colourOf, worse) {
  const context = ribbon.getContext("2d");
  const density = window.devicePixelRatio || 1;
  const width = ribbon.width = Math.round(ribbon.clientWidth * density);
  const height = ribbon.height = Math.round(ribbon.clientHeight * density);
  context.fillStyle = css("--grid");
  context.fillRect(0, 0, width, height);
  for (let x = 0; x < width; ++x) {
    const from = Math.floor(x / width * values.length), to = Math.max(from + 1, Math.floor((x + 1) / width * values.length));
    let worst = values[Math.min(from, values.length - 1)];
    for (let i = from; i < to && i < values.length; ++i) worst = worse(worst, values[i]);
    const colour = colourOf(worst);
    if (!colour) continue;
    context.fillStyle = colour;
    context.fillRect(x, 0, 1, height);
  }
  if (shownWindow[0] > 0 || shownWindow[1] < end) {
    context.strokeStyle = css("--text");
    context.lineWidth = 2 * density;
    context.strokeRect(shownWindow[0] / end * width, density, (shownWindow[1] - shownWindow[0]) / end * width, height - 2 * density);
  }
}
for (const [ribbon] of ribbons) {
  ribbon.addEventListener("click", (event) => {
    const centre = event.offsetX / ribbon.clientWidth * end;
    const half = Math.min((shownWindow[1] - shownWindow[0]) / 2, end / 20);
    show(centre - half, centre + half);
  });
  ribbon.addEventListener("dblclick", () => show(0, end));
}

const percent = (share) => `${(100 * share).toFixed(share > 0 && share < 0.01 ? 2 : 0)} %`;
if (rungLine) {
  const counts = new Map();
  for (const rung of rungLine.low) counts.set(rung, (counts.get(rung) || 0) + 1);
  document.getElementById("rung-legend").innerHTML = [...counts.keys()].sort().map((rung) =>
    `<span><span class="swatch" style="background:var(--rung-${rung})"></span>${RUNGS.get(rung) || rung} ${percent(counts.get(rung) / rungLine.low.length)}</span>`).join("");
}

const shares = STATES.map((_, s) => state.reduce((n, v) => n + (v === s), 0) / Math.max(state.length, 1));
document.getElementById("state-legend").innerHTML = STATES.map((name, s) =>
  `<span><span class="swatch" style="background:var(--${name})"></span>${name} ${percent(shares[s])}</span>`).join("")
  + `<span>drag: zoom · shift-drag: move · double click: all</span>`;

PLOTS.forEach(makePlot);
drawRibbon();
addEventListener("resize", drawRibbon);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  for (const { graph } of graphs) graph.remove();
  graphs = [];
  PLOTS.forEach(makePlot);
  drawRibbon();
});

// The window of time that all plots show: for tests.
window.farfeelWindow = () => shownWindow;
