// The last 30 seconds, the newest at the right edge: each quantity's mean, and how far it went within a picture's time.
import { Plot, css, line, reach } from "../../plots/plots.js";
import { SERIES } from "./messages.js";

const SHOWN_S = 30, HEIGHT_PX = 118;
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
    this.plots = [];
    this.clear();
    this.build();
  }

  clear() {
    this.times = [];
    this.values = SERIES.map(() => ({ low: [], high: [], mean: [] }));
  }

  build() {
    for (const { plot } of this.plots) plot.remove();
    this.plots = CHARTS.map((chart) => ({
      chart,
      plot: new Plot(this.element, {
        heading: "h2", title: `${chart.title} (${chart.unit})`, height: HEIGHT_PX, x: () => [-SHOWN_S, 0],
        series: chart.series.flatMap(([, label], i) => [line(label, i, chart.unit), reach(), reach()]),
        bands: chart.series.map((_, i) => ({ series: [3 * i + 3, 3 * i + 2], fill: `${css(`--line${i + 1}`)}40` })),
        data: this.data(chart),
      }),
    }));
  }

  // A tick, or a moment of the past.
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

  draw() { for (const { plot, chart } of this.plots) plot.plot.setData(this.data(chart)); }
}
