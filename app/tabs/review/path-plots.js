// A run beside its path: the tip in the path's plane, a close-up at the time that is shown, and its errors across the path.
import { h } from "/static/js/dom.js";
import { fixed, signed } from "/static/js/format.js";
import { plotInto, plotKey, plotOptions, themed } from "/static/js/plot-line.js";
import { sampleAt } from "./curves.js";
import { aboutAll, aboutNone, closeUp, cloudOf, digitsOf, nearestPlace, shaped } from "./path-places.js";
import { RunPlots } from "./plots.js";
import { GHOST, keyOfRun } from "./run-lines.js";

/** @import { Line } from "/static/js/plot-line.js" */
/** @import { SeriesPublic } from "/static/js/types.js" */
/** @import { Pair, Range } from "./path-places.js" */
/** @import { Player } from "./player.js" */

const LEAST_PX = 84;
const DOT_PX = 1.6; // radius of a place of the cloud
const PATH = { name: "path", colour: "--text-faint", width: 1.25, dash: [2, 3] };

/** @typedef {Line & { places: Pair[] }} Drawn */
/**
 * @typedef {{ title: string, across: string, lines: Drawn[], dots: boolean, own: { index: number, place: Pair }[], window: (now: Pair | null) => Range, now: (place: Pair) => string }} PlaneContent
 *   across: what its axes are. dots: places, not lines. own: places of the run that is played. now: words for the present place
 */

/** @param {SeriesPublic} main @param {SeriesPublic | null} ghost @returns {PlaneContent[]} */
export function planesOf(main, ghost) {
  const { path_mm: path, flat_mm: flat } = main;
  if (!path || !flat) return [];
  const others = (/** @type {(series: SeriesPublic) => Pair[]} */ of) => (ghost ? [{ ...keyOfRun(ghost, "Beside: "), ...GHOST, places: of(ghost) }] : []);
  const run = { ...keyOfRun(main), colour: "--accent", width: 1.5 };
  const clouds = [main, ghost].map((series) => (series ? cloudOf(series) : []));
  const ways = [{ ...PATH, places: path }, ...others((series) => series.flat_mm ?? []), { ...run, places: flat }];
  const most = Math.max(0, ...clouds.flat().map(({ place }) => Math.hypot(...place)));
  const own = flat.map((place, index) => ({ index, place }));
  const words = (/** @type {Pair} */ [x, y]) => `${fixed(x, 1)}, ${fixed(y, 1)} mm`;
  return [
    { title: "Tip in the plane of the path", across: "mm along, mm aside", lines: ways, dots: false, own, window: () => aboutAll(ways.flatMap(({ places }) => places)), now: words },
    { title: "Close-up", across: "mm along, mm aside", lines: ways, dots: false, own, window: (now) => closeUp(now ?? path[0], most), now: () => `${fixed(2 * closeUp([0, 0], most).y[1], 1)} mm high` },
    {
      title: "Tip errors across the path", across: "mm in the plane, mm off it", dots: true, own: clouds[0],
      lines: [...others(() => clouds[1].map(({ place }) => place)), { ...run, places: clouds[0].map(({ place }) => place) }],
      window: () => aboutNone(clouds.flat().map(({ place }) => place)),
      now: ([x, y]) => { const digits = Math.max(digitsOf([-most, most]), 2); return `${signed(x, digits)}, ${signed(y, digits)} mm`; },
    },
  ];
}

/** @param {Player} player */
export function pathPlotsOf(player) {
  return new RunPlots(player, (main, ghost) => planesOf(main, ghost).map((content) => new PlanePlot(content, player)), { class: "path-plots", none: "This run has no path." });
}

class PlanePlot {
  /**
   * @param {PlaneContent} content
   * @param {Player} player
   */
  constructor(content, player) {
    this.content = content;
    this.player = player;
    this.now = h("span", { class: "number" });
    this.dot = h("div", { class: "plot-dot", hidden: true });
    this.area = h("div", { class: "plot-area" });
    this.element = h("figure", { class: "plot", "aria-label": `${content.title}; ${content.across}` },
      h("figcaption", { title: content.across }, h("span", {}, content.title), h("span", { class: "plot-keys" }, content.lines.map((line) => plotKey(line))), this.now), this.area);
    /** @type {ReturnType<typeof plotInto> | null} */
    this.plot = null;
    this.shown = ""; // the window, as it was drawn last
    this.watch = new ResizeObserver(() => this.fit());
    this.watch.observe(this.area);
  }

  fit() {
    const width = this.area.clientWidth, height = Math.max(this.area.clientHeight, LEAST_PX);
    if (!width) return;
    this.shown = "";
    if (this.plot) this.plot.setSize({ width, height });
    else this.make(width, height);
    this.mark();
  }

  /**
   * @param {number} width
   * @param {number} height
   */
  make(width, height) {
    const options = plotOptions({ width, height, lines: [], unit: "mm", x: (value) => String(value) });
    const [x, y] = options.axes ?? [];
    const as = (/** @type {"x" | "y"} */ axis, /** @type {string} */ unit) => (/** @type {{ scales: Record<string, { min?: number, max?: number }> }} */ { scales }, /** @type {number[]} */ values) => {
      const { min = 0, max = 1 } = scales[axis];
      return values.map((value) => `${fixed(value, digitsOf([min, max]))}${unit}`);
    };
    /** @type {(plot: unknown, low: number | null, high: number | null) => Pair} */
    const exact = (...[, low, high]) => [low ?? 0, high ?? 1];
    Object.assign(options, {
      scales: { x: { time: false, range: exact }, y: { range: exact } },
      axes: [{ ...x, values: as("x", " mm"), space: 56 }, { ...y, values: as("y", ""), size: 52 }],
      hooks: { draw: [() => this.draw()] },
    });
    this.plot = plotInto(options, [[0, 1]], this.area);
    this.plot.over.append(this.dot);
    this.plot.over.addEventListener("pointerdown", (event) => this.pressed(event));
    this.plot.over.addEventListener("pointermove", (event) => { if (event.buttons & 1) this.pressed(event); });
  }

  /** The lines or places, upon the grid that uPlot has drawn. */
  draw() {
    const { plot } = this;
    if (!plot) return;
    const { ctx, bbox: { left, top, width, height } } = plot, ratio = devicePixelRatio;
    ctx.save();
    ctx.beginPath();
    ctx.rect(left, top, width, height);
    ctx.clip();
    for (const { places, colour, width: line = 1.5, dash } of this.content.lines) {
      const at = places.map(([x, y]) => [plot.valToPos(x, "x", true), plot.valToPos(y, "y", true)]);
      ctx.fillStyle = themed(colour);
      ctx.strokeStyle = themed(colour);
      ctx.lineWidth = line * ratio;
      ctx.setLineDash((dash ?? []).map((length) => length * ratio));
      ctx.beginPath();
      for (const [x, y] of at) {
        if (this.content.dots) {
          ctx.moveTo(x + DOT_PX * ratio, y);
          ctx.arc(x, y, DOT_PX * ratio, 0, 2 * Math.PI);
        } else {
          ctx.lineTo(x, y);
        }
      }
      if (this.content.dots) ctx.fill();
      else ctx.stroke();
    }
    ctx.restore();
  }

  /** The present place of the run; null where it has none then. @returns {Pair | null} */
  present() {
    const { main } = this.player;
    if (!main) return null;
    const index = sampleAt(main.series.t_s, this.player.t);
    return (this.content.own.length === main.series.t_s.length ? this.content.own[index] : this.content.own.find((one) => one.index === index))?.place ?? null;
  }

  mark() {
    const { plot, content } = this, place = this.present();
    if (!plot) return;
    const range = shaped(content.window(place), plot.bbox.width / plot.bbox.height), key = JSON.stringify(range);
    if (key !== this.shown) {
      this.shown = key;
      plot.batch(() => {
        plot.setScale("x", { min: range.x[0], max: range.x[1] });
        plot.setScale("y", { min: range.y[0], max: range.y[1] });
      });
    }
    const words = place ? content.now(place) : "";
    if (this.now.textContent !== words) this.now.textContent = words;
    this.dot.hidden = !place;
    if (place) this.dot.style.translate = `${plot.valToPos(place[0], "x").toFixed(1)}px ${plot.valToPos(place[1], "y").toFixed(1)}px`;
  }

  /** To the moment whose place is nearest. @param {PointerEvent} event */
  pressed({ clientX, clientY }) {
    const { plot, player, content: { own } } = this;
    if (!plot || !player.main) return;
    const box = plot.over.getBoundingClientRect();
    const found = nearestPlace(own.map(({ place }) => place), [plot.posToVal(clientX - box.left, "x"), plot.posToVal(clientY - box.top, "y")]);
    if (found < 0) return;
    player.pause();
    player.seek(player.main.series.t_s[own[found].index]);
  }

  remove() {
    this.watch.disconnect();
    this.plot?.destroy();
  }
}
