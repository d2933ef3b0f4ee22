// The last runs of a plan as a small plot: whether one gets better, and how the modes differ.
import { h } from "/static/js/dom.js";
import { plotInto, plotOptions } from "/static/js/plot-line.js";
import { millimetres } from "/static/js/runs.js";
import { THEMED } from "/static/js/theme.js";

/** @import { RunTitle } from "/static/js/types.js" */

const HEIGHT = 96; // px

/** Mean tip error over the last runs; the newest is the point on the right. */
export class LearningCurve {
  constructor() {
    this.element = h("div", { class: "learning", role: "img" });
    this.key = "";
    /** @type {ReturnType<typeof plotInto> | null} */
    this.plot = null;
    /** @type {RunTitle[]} */
    this.runs = [];
    window.addEventListener(THEMED, () => this.plot?.redraw());
    new ResizeObserver(() => this.fit()).observe(this.element);
  }

  /** @param {RunTitle[]} runs oldest first */
  show(runs) {
    const key = runs.map(({ id }) => id).join(" ");
    if (key === this.key) return;
    this.key = key;
    this.runs = runs;
    this.plot?.destroy();
    this.plot = null;
    this.fit();
    const last = runs.at(-1)?.score;
    this.element.setAttribute("aria-label", `Mean tip error of the last ${runs.length} runs; the newest ${millimetres(last?.error_mm)}`);
  }

  fit() {
    const width = this.element.clientWidth;
    if (!width || this.runs.length < 2) return;
    if (this.plot) {
      this.plot.setSize({ width, height: HEIGHT });
      return;
    }
    const most = Math.max(...this.runs.map(({ score }) => score?.error_mm ?? 0));
    const options = plotOptions({ width, height: HEIGHT, lines: [{ name: "Tip error", colour: "--accent", points: true }], x: (value) => (Number.isInteger(value) ? String(value) : ""), unit: "mm", digits: most < 0.1 ? 3 : most < 1 ? 2 : 1 });
    this.plot = plotInto({ ...options, cursor: { show: false } }, [[...this.runs.keys()].map((index) => index + 1), this.runs.map(({ score }) => score?.error_mm ?? null)], this.element);
  }
}
