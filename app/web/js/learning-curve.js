// The last runs of a plan as a small plot: whether one gets better, and how far the teacher is.
import { h } from "./dom.js";
import { digitsOf, plotInto, plotOptions } from "./plot-line.js";
import { errorOf, millimetres } from "./runs.js";
import { THEMED } from "./theme.js";

/** @import { RunTitle } from "./types.js" */

const HEIGHT = 96; // px
const TEACHER = { name: "teacher", colour: "--target", width: 1.5, dash: [6, 4] };

/** Mean tip error over the last runs; the newest is the point on the right. The teacher's run is a level across it. */
export class LearningCurve {
  constructor() {
    this.element = h("div", { class: "learning", role: "img" });
    this.key = "";
    /** @type {ReturnType<typeof plotInto> | null} */
    this.plot = null;
    /** @type {RunTitle[]} */
    this.runs = [];
    /** @type {number | null} mean tip error of the teacher's run, mm */
    this.level = null;
    window.addEventListener(THEMED, () => this.plot?.redraw());
    new ResizeObserver(() => this.fit()).observe(this.element);
  }

  /**
   * @param {RunTitle[]} runs oldest first
   * @param {RunTitle | null} teacher
   */
  show(runs, teacher) {
    const level = errorOf(teacher), key = `${runs.map(({ id }) => id).join(" ")} ${level}`;
    if (key === this.key) return;
    Object.assign(this, { key, runs, level });
    this.plot?.destroy();
    this.plot = null;
    this.fit();
    const last = errorOf(runs.at(-1)), taught = level === null ? "" : `; teacher ${millimetres(level)}`;
    this.element.setAttribute("aria-label", `Tip error of the last ${runs.length} completed runs; newest ${millimetres(last)}${taught}`);
  }

  fit() {
    const width = this.element.clientWidth, { runs, level } = this;
    if (!width || runs.length < 2) return;
    if (this.plot) {
      this.plot.setSize({ width, height: HEIGHT });
      return;
    }
    const most = Math.max(level ?? 0, ...runs.map((run) => errorOf(run) ?? 0));
    const lines = [{ name: "Tip error", colour: "--accent", points: true }, ...(level === null ? [] : [TEACHER])];
    const options = plotOptions({ width, height: HEIGHT, lines, x: (value) => (Number.isInteger(value) ? String(value) : ""), unit: "mm", digits: digitsOf(most) });
    const errors = runs.map(errorOf);
    this.plot = plotInto({ ...options, cursor: { show: false } }, [[...runs.keys()].map((index) => index + 1), errors, ...(level === null ? [] : [runs.map(() => level)])], this.element);
  }
}
