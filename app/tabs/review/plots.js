// The plots of a run, with a mark at the time that is shown; a press or drag upon one goes there.
import { h } from "/static/js/dom.js";
import { fixed } from "/static/js/format.js";
import { millimetres } from "/static/js/runs.js";
import { drivenOf } from "/static/js/run-views.js";
import { digitsOf, plotInto, plotKey, plotOptions } from "/static/js/plot-line.js";
import { THEMED } from "/static/js/theme.js";
import { lumenContents } from "./lumen-plots.js";
import { bothRuns } from "./run-lines.js";
import { errorAlongPath, leastClearance, overTime, sampleAt, speeds, timeAlong } from "./curves.js";

/** @import { Line } from "/static/js/plot-line.js" */
/** @import { AnySeries } from "/static/js/runs.js" */
/** @import { SeriesPublic } from "/static/js/types.js" */
/** @import { Curves } from "./curves.js" */
/** @import { Player } from "./player.js" */

const LEAST_PX = 84;

/**
 * @typedef {{ title: string, unit: string, lines: Line[], curves: Curves, digits: number, along?: boolean, signed?: boolean, now: (at: number) => string }} Content
 *   along: x is the path in mm, not time. signed: values may be below 0. now: words for the sample of a number
 */

/** @param {SeriesPublic} main @param {SeriesPublic | null} ghost @returns {Content[]} */
export function contentsOf(main, ghost) {
  const runs = ghost ? [main, ghost] : [main];
  const two = () => bothRuns(main, ghost);
  const value = (/** @type {number | null | undefined} */ number, /** @type {number} */ digits, /** @type {string} */ unit) => (number === null || number === undefined ? "" : `${fixed(number, digits)} ${unit}`);
  const least = leastClearance(main), moving = speeds(main);
  const inspected = main.progress_mm.every((s) => s === null) || errorAlongPath([main]).x.length < 2;
  const error = inspected ? overTime(runs, (series) => series.error_mm) : errorAlongPath(runs);
  const most = Math.max(0, ...error.lines.flat().map((one) => one ?? 0));
  const digits = Math.max(digitsOf(most), 2);
  const colours = ["--accent", "--caution", "--target", "--ghost", "--text-soft", "--alarm", "--fits"];
  const reach = Math.max(...main.reach_mm);
  return [
    { title: inspected ? "Error" : "Tip error along the path", unit: "mm", lines: two(), curves: error, digits, along: !inspected, now: (at) => (main.error_mm[at] === null ? "" : millimetres(main.error_mm[at])) },
    { title: "Clearance", unit: "mm", lines: two(), curves: overTime(runs, leastClearance), digits: 1, now: (at) => (least[at] === null ? `over ${fixed(reach, 1)} mm` : `${value(least[at], 2, "mm")} to ${main.structures[main.nearest[at]] ?? ""}`) },
    { title: "Force of the hand", unit: "N", lines: two(), curves: overTime(runs, (series) => series.force_n), digits: 1, now: (at) => value(main.force_n[at], 2, "N") },
    {
      title: main.joints.length ? "Joint speeds" : "Speed of the tip", unit: main.joints.length ? "mm/s, °/s" : "mm/s", digits: 0, signed: moving.length > 2,
      lines: moving.map(({ name }, index) => ({ name, colour: colours[index % colours.length], width: 1.2 })),
      curves: { x: main.t_s, lines: moving.map(({ values }) => values) },
      now: (at) => { const fastest = Math.max(...moving.map(({ values }) => Math.abs(values[at]))); return main.joints.length ? `up to ${fixed(fastest, 1)}` : value(fastest, 1, "mm/s"); },
    },
  ];
}

/** @typedef {{ element: HTMLElement, plot: ReturnType<typeof plotInto> | null, mark: (series: AnySeries) => void, remove: () => void }} RunPlot */

/** Plots of the run that is played and of the one beside it, made anew with another one; marked while they are in sight. */
export class RunPlots {
  /**
   * @param {Player} player
   * @param {(main: any, ghost: any) => RunPlot[]} make of two series of what was driven alike
   * @param {{ class?: string, none?: string }} looks none: words where nothing is made
   */
  constructor(player, make, { class: name = "", none = "" } = {}) {
    this.player = player;
    this.make = make;
    this.none = none;
    this.element = h("div", { class: `review-plots ${name}`.trim() });
    /** @type {RunPlot[]} */
    this.plots = [];
    this.key = "";
    player.addEventListener("change", () => this.update());
    window.addEventListener(THEMED, () => { for (const { plot } of this.plots) plot?.redraw(false); });
  }

  update() {
    const { main, ghost } = this.player;
    const key = `${main?.run.id} ${ghost?.run.id}`;
    if (key !== this.key) {
      this.key = key;
      for (const plot of this.plots) plot.remove();
      this.plots = main ? this.make(main.series, ghost?.series ?? null) : [];
      const none = main && !this.plots.length && this.none ? [h("p", { class: "empty" }, this.none)] : [];
      this.element.replaceChildren(...none, ...this.plots.map(({ element }) => element));
    }
    if (main && this.element.isConnected) for (const plot of this.plots) plot.mark(main.series);
  }
}

/** @param {Player} player */
export function plotsOf(player) {
  return new RunPlots(player, (main, ghost) => CONTENTS[drivenOf(main)](main, ghost).map((content) => new Plot(content, player)));
}

/** What is plotted, by what was driven. @type {Record<string, (main: any, ghost: any) => Content[]>} */
const CONTENTS = { tool: contentsOf, lumen: lumenContents };

class Plot {
  /**
   * @param {Content} content
   * @param {Player} player
   */
  constructor(content, player) {
    this.content = content;
    this.player = player;
    this.now = h("span", { class: "number" });
    this.line = h("div", { class: "plot-now" });
    this.area = h("div", { class: "plot-area" });
    this.element = h("figure", { class: "plot", "aria-label": content.title }, h("figcaption", {}, h("span", {}, content.title), h("span", { class: "plot-keys" }, content.lines.length > 1 ? content.lines.map((line) => plotKey(line)) : []), this.now), this.area);
    /** @type {ReturnType<typeof plotInto> | null} */
    this.plot = null;
    this.watch = new ResizeObserver(() => this.fit());
    this.watch.observe(this.area);
  }

  fit() {
    const width = this.area.clientWidth, height = Math.max(this.area.clientHeight, LEAST_PX);
    const { content } = this;
    if (!width || content.curves.x.length < 2) return;
    if (this.plot) {
      this.plot.setSize({ width, height });
    } else {
      const options = plotOptions({ width, height, lines: content.lines, unit: content.unit, digits: content.digits, least: content.signed ? null : 0, x: (value) => `${fixed(value, value % 1 ? 1 : 0)} ${content.along ? "mm" : "s"}` });
      this.plot = plotInto(options, [content.curves.x, ...content.curves.lines], this.area);
      this.plot.over.append(this.line);
      this.plot.over.addEventListener("pointerdown", (event) => this.pressed(event));
      this.plot.over.addEventListener("pointermove", (event) => { if (event.buttons & 1) this.pressed(event); });
    }
    if (this.player.main) this.mark(this.player.main.series);
  }

  /** @param {PointerEvent} event */
  pressed({ clientX }) {
    const { plot, player } = this;
    if (!plot || !player.main) return;
    const x = plot.posToVal(clientX - plot.over.getBoundingClientRect().left, "x");
    player.pause();
    player.seek(this.content.along ? timeAlong(/** @type {SeriesPublic} */ (player.main.series), x) : x);
  }

  /** @param {AnySeries} series */
  mark(series) {
    const at = sampleAt(series.t_s, this.player.t);
    const words = this.content.now(at);
    if (this.now.textContent !== words) this.now.textContent = words;
    const x = this.content.along ? /** @type {SeriesPublic} */ (series).progress_mm[at] : this.player.t;
    this.line.hidden = x === null || !this.plot;
    if (this.plot && x !== null) this.line.style.translate = `${this.plot.valToPos(x, "x").toFixed(1)}px 0`;
  }

  remove() {
    this.watch.disconnect();
    this.plot?.destroy();
  }
}

