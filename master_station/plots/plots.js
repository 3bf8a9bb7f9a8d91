// What both pages plot with, the session's report and the live view: a card that holds a title, a plot as wide as the
// card, and a legend with the values at the cursor. Colours are the page's own, by name: --line1 to --line4, --text,
// --grid.
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import "./plots.css";

export const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// Four digits, as a person reads them.
export function shown(value) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  const size = Math.abs(value);
  if (size >= 1e5 || (size < 1e-3 && size > 0)) return value.toExponential(2);
  return Number(value.toPrecision(4)).toString();
}

export const line = (label, nth, unit, more = {}) => ({
  label, stroke: css(`--line${nth + 1}`), width: 1.3, points: { show: false }, value: (_, v) => `${shown(v)} ${unit}`, ...more,
});

// How far a quantity went within each column of a line, behind it: two series without a name.
export const reach = () => ({ label: "", stroke: "transparent", points: { show: false }, class: "unnamed" });

// 1, 2 and 5 of every decade are marked, and 1 is told where all would be too many.
const logLabels = (_, splits) => splits.map((v) => (v === null || (splits.length > 8 && Math.log10(v) % 1 !== 0) ? "" : shown(v)));

// heading: h2 or h3. series, bands, hooks and cursor are uPlot's own; x: what is shown of the time axis. The axis
// of values begins at zero, or goes through it, but where it is logarithmic.
export class Plot {
  constructor(parent, { heading, title, note = "", height, isLog = false, x, timeLabel = "", series, data, ...options }) {
    this.card = document.createElement("figure");
    this.card.className = "plot";
    const head = document.createElement(heading);
    head.textContent = title;
    if (note) {
      const small = document.createElement("small");
      small.textContent = note;
      head.append(" ", small);
    }
    this.card.append(head);
    parent.append(this.card);
    const axis = { stroke: css("--text"), grid: { stroke: css("--grid"), width: 1 }, ticks: { stroke: css("--grid"), width: 1 }, font: "12px system-ui" };
    const zero = (_, low, high) => (low === null ? [0, 1] : uPlot.rangeNum(Math.min(low, 0), Math.max(high, 0), 0.08, true));
    this.plot = new uPlot({
      width: this.width(), height, ...options,
      series: [{ label: "time", value: (_, v) => (v === null || v === undefined ? "–" : `${v.toFixed(3)} s`) }, ...series],
      scales: { x: { time: false, range: x }, y: isLog ? { distr: 3 } : { range: zero } },
      axes: [{ ...axis, size: 28, ...(timeLabel && { label: timeLabel, labelSize: 16, labelFont: "12px system-ui", labelGap: 0 }) }, { ...axis, size: 62, values: isLog ? logLabels : (_, splits) => splits.map(shown) }],
      legend: { markers: { width: 3 } },
    }, data, this.card);
    this.height = height;
    this.resizing = new ResizeObserver(() => this.plot.setSize({ width: this.width(), height: this.height }));
    this.resizing.observe(this.card);
  }

  width() {
    const { paddingLeft, paddingRight } = getComputedStyle(this.card);
    return Math.max(120, Math.floor(this.card.clientWidth - parseFloat(paddingLeft) - parseFloat(paddingRight)));
  }

  remove() {
    this.resizing.disconnect();
    this.plot.destroy();
    this.card.remove();
  }
}
