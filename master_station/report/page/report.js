// Plots of one session. All plots share one time window and one cursor: drag to zoom, shift-drag to move, double click
// to see all again. What is drawn is each pixel's least and greatest value, so that no peak is lost at any zoom.
"use strict";

const trace = JSON.parse(document.getElementById("trace").textContent);
const STATES = ["free", "touching", "held", "fading", "fault"];

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
  { title: "Force on the hand", axis: "force", unit: "N", series: xyz("hand_force", "N") },
  { title: "Torque on the hand", axis: "torque", units: [[1e3, "mN·m"], [1, "N·m"]], series: xyz("hand_torque", "Nm") },
  { title: "Penetration depth", axis: "depth", units: [[1e6, "µm"], [1e3, "mm"]], series: [["deepest contact", "depth_max_m"]] },
  { title: "Contacts", unit: "count", series: [["contacts that press", "contacts"]] },
  { title: "Pairs of pieces near", axis: "pairs", unit: "count", series: [["pairs", "pairs"]] },
  { title: "Round trip", unit: "ms", series: [["pose to contacts", "rtt_ms"]], dots: true },
  { title: "Loop: how late ticks begin", axis: "wake-up", unit: "µs", series: [["wake-up", "wake_us"]], log: true },
  { title: "Loop: how long ticks work", axis: "work", unit: "µs", series: [["work", "work_us"]], log: true },
  { title: "Energy stored", axis: "energy", units: [[1e3, "mJ"], [1, "J"]], series: [["coupling", "coupling_energy_J"],
    ["contacts", "contact_energy_J"]] },
  { title: "Energy tank: what updates may still add", axis: "tank", units: [[1e3, "mJ"], [1, "J"]],
    series: [["tank", "tank_J"]], note: "below zero: a debt, paid back as damping" },
  { title: "Energy through the ports", axis: "energy", units: [[1e3, "mJ"], [1, "J"]], series: [
    ["hand into device", "device_observer_J"], ["tool into contacts", "contact_port_J"],
    ["moving objects into contacts", "script_work_J"]],
    note: "tool and moving objects together: below zero is only what the tank's allowance gave" },
  { title: "Ticks missed so far", axis: "ticks missed", unit: "count", series: [["missed", "ticks_missed"]] },
];

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const stateColour = (s) => css(`--${STATES[s]}`);

// First bucket at or after t.
const bucketAt = (t) => {
  let low = 0, high = time.length;
  while (low < high) { const middle = (low + high) >> 1; if (time[middle] < t) low = middle + 1; else high = middle; }
  return low;
};

// Rows for dygraphs over a window of time: two a column where a column has more than one value, its least and its
// greatest, so the line fills the range the quantity swept. All plots get the same number of rows at the same times.
const COLUMNS = 700;
const rowsOf = (plot, from, to) => {
  const first = Math.max(bucketAt(from) - 1, 0), last = Math.min(bucketAt(to) + 1, time.length);
  const step = Math.max(1, Math.ceil((last - first) / COLUMNS));
  const scale = plot.scale || 1;
  const rows = [];
  for (let at = first; at < last; at += step) {
    const until = Math.min(at + step, last);
    const lowRow = [time[at]], highRow = [time[at] + (until - at) * bucket_s / 2];
    for (const line of plot.lines) {
      let low = Infinity, high = -Infinity;
      for (let i = at; i < until; ++i) {
        if (line.low[i] < low) low = line.low[i];
        if (line.high[i] > high) high = line.high[i];
      }
      const drawn = (value) => low > high || (plot.log && value <= 0) ? null : value * scale;
      lowRow.push(drawn(low));
      highRow.push(drawn(high));
    }
    rows.push(lowRow);
    if (step > 1 || trace.rows_per_bucket > 1) rows.push(highRow);
  }
  return rows;
};

// Behind every plot: what the loop was doing.
const tint = (context, area, graph) => {
  const [from, to] = graph.xAxisRange();
  let at = Math.max(bucketAt(from) - 1, 0);
  const last = Math.min(bucketAt(to) + 1, time.length);
  while (at < last) {
    let until = at + 1;
    while (until < last && state[until] === state[at]) ++until;
    if (state[at] !== 0) {
      const left = Math.max(graph.toDomXCoord(time[at]), area.x);
      const right = Math.min(graph.toDomXCoord(until < time.length ? time[until] : end), area.x + area.w);
      context.globalAlpha = state[at] === 1 ? 0.055 : 0.2;
      context.fillStyle = stateColour(state[at]);
      if (right > left) context.fillRect(left, area.y, right - left, area.h);
    }
    at = until;
  }
  context.globalAlpha = 1;
};

const shown = (value) => {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  const size = Math.abs(value);
  if (size >= 1e5 || (size < 1e-3 && size > 0)) return value.toExponential(2);
  return Number(value.toPrecision(4)).toString();
};

// 1, 2 and 5 of every decade.
const logTicks = (low, high, pixels, options) => {
  const ticks = [];
  for (let decade = Math.floor(Math.log10(low)); decade <= Math.ceil(Math.log10(high)); ++decade)
    for (const digit of [1, 2, 5]) ticks.push(digit * 10 ** decade);
  const inside = ticks.filter((v) => v >= low && v <= high);
  const labelled = inside.length > 8 ? inside.filter((v) => Math.log10(v) % 1 === 0) : inside;
  return inside.map((v) => ({ v, label: labelled.includes(v) ? shown(v) : "" }));
};

const graphs = [];
let isSynchronising = false;
const together = (action) => {
  if (isSynchronising) return;
  isSynchronising = true;
  try { action(); } finally { isSynchronising = false; }
};

let shownWindow = [0, end];
const show = (from, to) => together(() => {
  const length = Math.min(to - from, end), start = Math.min(Math.max(from, 0), end - length);
  shownWindow = [start, start + length];
  for (const g of graphs) g.updateOptions({ file: rowsOf(g.farfeelPlot, ...shownWindow), dateWindow: shownWindow });
  drawRibbon();
});

const coloursOf = (plot) => plot.lines.length === 1 ? [css("--series-1")]
  : [1, 2, 3, 4].map((n) => css(`--series-${n}`)).slice(0, plot.lines.length);

const makePlot = (plot) => {
  const present = plot.series.filter(([, column]) => lines.has(column) && lines.get(column).low.some((v) => !Number.isNaN(v)));
  if (!present.length) return;
  plot.lines = present.map(([, column]) => lines.get(column));
  if (plot.units) {  // the first in which no figure is long
    const largest = plot.lines.reduce((m, l) => l.high.reduce((n, v) => Math.max(n, Math.abs(v) || 0), m), 0);
    [plot.scale, plot.unit] = plot.units.find(([scale]) => largest * scale < 2000) || plot.units[plot.units.length - 1];
  }
  const card = document.createElement("section");
  card.className = "card plot";
  card.innerHTML = `<h3>${plot.title}${plot.note ? ` <small>${plot.note}</small>` : ""}</h3><div class="values"></div><div class="canvas"></div>`;
  document.getElementById("plots").append(card);
  const values = card.querySelector(".values");
  const canvas = card.querySelector(".canvas");

  const graph = new Dygraph(canvas, rowsOf(plot, 0, end), {
    labels: ["time", ...present.map(([name]) => name)],
    colors: coloursOf(plot),
    strokeWidth: plot.dots ? 0 : 1.1, drawPoints: !!plot.dots, pointSize: 1.1, highlightCircleSize: 3,
    connectSeparatedPoints: true, logscale: !!plot.log,
    xlabel: "time [s]", ylabel: `${plot.axis || plot.title.toLowerCase()} [${plot.unit}]`,
    xLabelHeight: 17, yLabelWidth: 17,
    axisLineColor: css("--edge"), gridLineColor: css("--grid"), gridLineWidth: 1, axisLabelFontSize: 12,
    axes: { x: { valueFormatter: (t) => `${t.toFixed(3)} s` },
            y: { axisLabelWidth: 50, valueFormatter: shown, axisLabelFormatter: (v) => shown(v),
             ...(plot.log ? { ticker: logTicks } : {}) } },
    includeZero: !plot.log, xRangePad: 0, yRangePad: 8, dateWindow: [0, end],
    animatedZooms: false, labelsDiv: values, legend: "always",
    legendFormatter: (data) => {
      const at = data.x === undefined ? "" : `<span>${data.xHTML}</span>`;
      return at + data.series.map((s) =>
        `<span style="color:${s.color}"><b>${s.labelHTML}</b>${data.x === undefined ? "" : " " + (s.yHTML || "–")}</span>`).join("");
    },
    underlayCallback: tint,
    // dygraphs knows only the rows of the window shown: its own double click could not go back to all of them.
    interactionModel: { ...Dygraph.defaultInteractionModel, dblclick: () => show(0, end) },
    zoomCallback: (from, to) => show(from, to),
    drawCallback: (g) => { const [from, to] = g.xAxisRange();
      if (Math.abs(from - shownWindow[0]) > 1e-9 || Math.abs(to - shownWindow[1]) > 1e-9) show(from, to); },
    highlightCallback: (event, x, points, row) => together(() => {
      for (const g of graphs) if (g !== graph && row < g.numRows()) g.setSelection(row);
    }),
    unhighlightCallback: () => together(() => { for (const g of graphs) if (g !== graph) g.clearSelection(); }),
  });
  graph.farfeelPlot = plot;
  graphs.push(graph);
};

// The whole session's states in one ribbon, and the rungs it was felt from in another: what is gravest, or poorest, in
// every column. The window shown in the plots is framed. A click goes there.
const RUNGS = new Map([[0, "held wrench"], [1, "linear contacts"], [2, "quadratic contacts"], [3, "tiles"]]);
const rungLine = lines.get("rung");
const rungColour = (rung) => css(`--rung-${rung}`);
const ribbons = [[document.getElementById("states"), state, (s) => s === 0 ? null : stateColour(s), (a, b) => Math.max(a, b)]];
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
  for (const g of graphs) g.updateOptions({ colors: coloursOf(g.farfeelPlot), axisLineColor: css("--edge"), gridLineColor: css("--grid") });
  drawRibbon();
});
