// The last 30 seconds, the newest at the right edge: each quantity's mean, and how far it went within a picture's time.
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { SERIES } from "./messages.js";

const SHOWN_S = 30, HEIGHT_PX = 118;
const LINES = ["--line1", "--line2", "--line3", "--line4"];
const CHARTS = [
  { title: "Force on the hand", unit: "N", scale: 1, series: [["force", "force"]] },
  { title: "Torque on the hand", unit: "mNm", scale: 1e3, series: [["torque", "torque"]] },
  { title: "Deepest contact", unit: "µm", scale: 1e6, series: [["depth", "depth"]] },
  { title: "Energy", unit: "mJ", scale: 1e3, series: [["tank", "tank"], ["coupling", "coupling"], ["contacts", "contacts"]] },
  { title: "Work of a tick", unit: "µs", scale: 1, series: [["work", "work"]] },
  { title: "Round trip", unit: "ms", scale: 1, series: [["roundTrip", "all"], ["network", "network"], ["node", "node"], ["age", "age here"]] },
];

export class Charts {
  constructor(element) {
    this.element = element;
    this.times = [];
    this.values = SERIES.map(() => ({ low: [], high: [], mean: [] }));
    this.plots = [];
    this.build();
    new ResizeObserver(() => this.resize()).observe(element);
  }

  build() {
    for (const { plot } of this.plots) plot.destroy();
    this.element.replaceChildren();
    const css = getComputedStyle(document.documentElement), colour = (name) => css.getPropertyValue(name).trim();
    this.plots = CHARTS.map((chart) => {
      const axis = { stroke: colour("--text"), grid: { stroke: colour("--grid"), width: 1 }, ticks: { stroke: colour("--grid"), width: 1 }, font: "11px system-ui" };
      const series = [{ label: "time", value: (_, v) => (v === null ? "" : `${v.toFixed(1)} s`) }], bands = [];
      chart.series.forEach(([, label], i) => {
        const stroke = colour(LINES[i]);
        series.push({ label, stroke, width: 1.5, points: { show: false }, value: (_, v) => (v === null || v === undefined ? "-" : `${v.toPrecision(3)} ${chart.unit}`) });
        series.push({ show: true, stroke: "transparent", points: { show: false }, label: "" }, { show: true, stroke: "transparent", points: { show: false }, label: "" });
        bands.push({ series: [3 * i + 3, 3 * i + 2], fill: `${stroke}40` });
      });
      const box = document.createElement("figure");
      box.setAttribute("aria-label", `${chart.title}, ${chart.unit}`);
      this.element.appendChild(box);
      const plot = new uPlot({
        title: `${chart.title} (${chart.unit})`, width: this.width(), height: HEIGHT_PX, series, bands,
        scales: { x: { time: false, range: () => [-SHOWN_S, 0] } },
        axes: [{ ...axis, size: 24 }, { ...axis, size: 58 }],
        legend: { live: false, show: chart.series.length > 1 },
        cursor: { points: { show: false } },
      }, this.data(chart), box);
      return { plot, chart };
    });
  }

  width() { return Math.max(200, this.element.clientWidth - 4); }
  resize() { for (const { plot } of this.plots) plot.setSize({ width: this.width(), height: HEIGHT_PX }); }

  add(tick) {
    this.times.push(tick.time);
    tick.bins.forEach((bin, i) => {
      for (const part of ["low", "high", "mean"]) this.values[i][part].push(bin.count > 0 ? bin[part] : null);
    });
    let old = 0;
    while (this.times[old] < tick.time - SHOWN_S - 1) ++old;
    if (old < 120) return;
    this.times.splice(0, old);
    for (const value of this.values) for (const part of ["low", "high", "mean"]) value[part].splice(0, old);
  }

  data(chart) {
    const scaled = (values) => values.map((v) => (v === null ? null : v * chart.scale));
    const newest = this.times[this.times.length - 1];
    const data = [this.times.map((t) => t - newest)];
    for (const [name] of chart.series) {
      const value = this.values[SERIES.indexOf(name)];
      data.push(scaled(value.mean), scaled(value.low), scaled(value.high));
    }
    return data;
  }

  draw() { for (const { plot, chart } of this.plots) plot.setData(this.data(chart)); }
}
