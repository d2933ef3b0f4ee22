// How wide the way is: the pathway's radius and the distance from the centreline to the wall, along the route.
import { h, whenChanged } from "/static/js/dom.js";
import { fixed } from "/static/js/format.js";
import { plotInto, plotKey, plotOptions, themed } from "/static/js/plot-line.js";

/** @import { Line } from "/static/js/plot-line.js" */
/** @import { ContourList, RoutePathSection } from "/static/js/types.js" */

const HEIGHT_PX = 130;
/** @type {Line[]} */
const LINES = [{ name: "Pathway", colour: "--accent" }, { name: "Centreline to wall", colour: "--text-faint", width: 1.25, dash: [2, 3] }];

const DOT_PX = 3; // radius of a contour by hand

export class RadiiPlot {
  /** @param {(at_mm: number) => void} picked a place along the route was clicked */
  constructor(picked) {
    this.picked = picked;
    this.area = h("div", { class: "plot-area" });
    this.now = h("span", { class: "number" }, radiiWords({ s_mm: [], radius_mm: [], wall_mm: [] }, null));
    this.element = h("figure", { class: "plot route-radii", hidden: true, "aria-label": "Radius along the route" },
      h("figcaption", {}, h("span", {}, "Radius along the route")), h("p", { class: "plot-keys" }, LINES.map((line) => plotKey(line))), h("p", { class: "words quiet" }, this.now), this.area);
    /** @type {ReturnType<typeof plotInto> | null} */
    this.plot = null;
    /** @type {RoutePathSection | undefined} */
    this.path = undefined;
    /** @type {ContourList | undefined} */
    this.contours = undefined;
    this.changed = whenChanged();
    this.changedContours = whenChanged();
    new ResizeObserver(() => this.fit()).observe(this.area);
  }

  /**
   * @param {RoutePathSection | undefined} path
   * @param {ContourList | undefined} contours
   */
  update(path, contours) {
    this.contours = contours;
    this.changed([path], () => {
      this.path = path;
      this.element.hidden = path?.state !== "ready";
      this.plot?.destroy();
      this.plot = null;
      this.fit();
    });
    this.changedContours([contours], () => this.plot?.redraw(false)); // true would fix the scales of a plot that has not drawn yet
  }

  fit() {
    const { path } = this, width = this.area.clientWidth;
    if (!width || path?.state !== "ready") return;
    if (this.plot) this.plot.setSize({ width, height: HEIGHT_PX });
    else this.plot = this.made(width, path);
  }

  /**
   * The values under the pointer.
   * @param {RoutePathSection} path
   * @param {number | null | undefined} index of a sample; none: the pointer is elsewhere
   */
  tell(path, index) {
    this.now.textContent = radiiWords(path, index);
  }

  /**
   * @param {number} width
   * @param {RoutePathSection} path
   */
  made(width, path) {
    const options = plotOptions({ width, height: HEIGHT_PX, lines: LINES, unit: "mm", digits: 0, x: (value) => `${fixed(value, 0)} mm` });
    const plot = plotInto({ ...options, hooks: { draw: [(drawn) => this.drawContours(drawn)], setCursor: [({ cursor }) => this.tell(path, cursor.idx)] } }, [path.s_mm, path.radius_mm, path.wall_mm], this.area);
    plot.over.addEventListener("click", () => this.picked(plot.posToVal(plot.cursor.left ?? 0, "x")));
    return plot;
  }

  /**
   * Contours by hand as dots, the chosen one as a line.
   * @param {ReturnType<typeof plotInto>} plot
   */
  drawContours(plot) {
    const { ctx } = plot, ratio = devicePixelRatio;
    for (const [index, { at_mm, radii_mm, by_hand }] of (this.contours?.items ?? []).entries()) {
      const x = plot.valToPos(at_mm, "x", true);
      ctx.fillStyle = ctx.strokeStyle = themed(index === this.contours?.chosen ? "--text" : "--accent");
      if (index === this.contours?.chosen) {
        ctx.lineWidth = ratio;
        ctx.beginPath();
        ctx.moveTo(x, plot.bbox.top);
        ctx.lineTo(x, plot.bbox.top + plot.bbox.height);
        ctx.stroke();
      }
      if (!by_hand) continue;
      ctx.beginPath();
      ctx.arc(x, plot.valToPos(Math.min(...radii_mm), "y", true), DOT_PX * ratio, 0, 2 * Math.PI);
      ctx.fill();
    }
  }
}

/**
 * Where along the route, its radius there, and the distance to the wall.
 * @param {Pick<RoutePathSection, "s_mm" | "radius_mm" | "wall_mm">} path
 * @param {number | null | undefined} index
 */
export function radiiWords({ s_mm: s, radius_mm: radius, wall_mm: wall }, index) {
  if (index === null || index === undefined || s[index] === undefined) return "Point at the plot for values.";
  return `At ${fixed(s[index], 0)} mm: ${fixed(radius[index], 1)} mm, wall ${fixed(wall[index], 1)} mm`;
}
