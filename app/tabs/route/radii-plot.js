// How wide the way is: the pathway's radius and the distance from the centreline to the wall, along the route.
import { h, whenChanged } from "/static/js/dom.js";
import { fixed } from "/static/js/format.js";
import { plotInto, plotOptions } from "/static/js/plot-line.js";

/** @import { Line } from "/static/js/plot-line.js" */
/** @import { RoutePathSection } from "/static/js/types.js" */

const HEIGHT_PX = 130;
/** @type {Line[]} */
const LINES = [{ name: "Pathway", colour: "--accent" }, { name: "Centreline to wall", colour: "--text-faint", width: 1.25, dash: [2, 3] }];

export class RadiiPlot {
  constructor() {
    this.area = h("div", { class: "plot-area" });
    this.element = h("figure", { class: "plot route-radii", hidden: true, "aria-label": "Radius along the route" }, h("figcaption", {}, h("span", {}, "Radius along the route")), this.area);
    /** @type {ReturnType<typeof plotInto> | null} */
    this.plot = null;
    /** @type {RoutePathSection | undefined} */
    this.path = undefined;
    this.changed = whenChanged();
    new ResizeObserver(() => this.fit()).observe(this.area);
  }

  /** @param {RoutePathSection | undefined} path */
  update(path) {
    this.changed([path], () => {
      this.path = path;
      this.element.hidden = path?.state !== "ready";
      this.plot?.destroy();
      this.plot = null;
      this.fit();
    });
  }

  fit() {
    const { path } = this, width = this.area.clientWidth;
    if (!width || path?.state !== "ready") return;
    if (this.plot) this.plot.setSize({ width, height: HEIGHT_PX });
    else this.plot = plotInto(plotOptions({ width, height: HEIGHT_PX, lines: LINES, unit: "mm", digits: 0, x: (value) => `${fixed(value, 0)} mm` }), [path.s_mm, path.radius_mm, path.wall_mm], this.area);
  }
}
