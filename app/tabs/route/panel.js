// Route: the routes of a lumen, entry and end of the open one, the robot, and how wide its pathway is along the way.
import { behindLine, behindWords } from "/static/js/behind-wall.js";
import { askName, noteDone } from "/static/js/dialogs.js";
import { isUndoKey } from "/static/js/fields.js";
import { h } from "/static/js/dom.js";
import { fixed, when } from "/static/js/format.js";
import { stageWords } from "/static/js/jobs.js";
import { NumberFields } from "/static/js/number-fields.js";
import { placeWords } from "/static/js/slices/place-words.js";
import { rovingRows } from "/static/js/roving.js";
import { FoldedParts } from "/static/js/step-list.js";
import { draw, html, iconTool, live, more, nameRow, repeat, said, titled } from "/static/js/template.js";
import { ContourPart } from "./contours.js";
import { MarksPart } from "./marks.js";
import { RadiiPlot } from "./radii-plot.js";
import { WallViews } from "./wall-views.js";

/** @import { Parts } from "/static/js/panel.js" */
/** @import { LandmarkView, ReachOfferView, RouteEntry, RoutePathSection, RouteSection, ViewModel } from "/static/js/types.js" */

/** @typedef {"entry" | "end"} End */
/** @type {[End, string][]} */
const ENDS = [["entry", "Entry"], ["end", "End"]];
const BOUND_HELP = "Empty: half the lumen’s radius, 8 mm at most.";
const LINKS_HELP = "Empty: as many as the way needs.";
const DEVIATION_HELP = "How far a link may lie outside the pathway: its largest deviation.";
const LENGTH_HELP = "Along the way of the robot’s tip, shorter than the centreline.";
/** What the planner takes of a robot. @type {["links" | "length_mm" | "radius_mm", string, number, number][]} */
const ROBOT = [["links", "Links", 1, 120], ["length_mm", "Link, mm", 1, 100], ["radius_mm", "Radius, mm", 0.5, 30]];
const BOUND_MM = /** @type {const} */ ([0.1, 50]);

export default class RoutePanel {
  /** @param {Parts} parts */
  constructor({ connection, keys }) {
    this.connection = connection;
    this.list = h("div", { class: "group" });
    this.ends = h("div", { class: "group" });
    this.robot = h("div", { class: "group" });
    this.path = h("div", { class: "group" });
    this.contours = new ContourPart(connection);
    this.marks = new MarksPart(connection);
    this.views = new WallViews(connection);
    this.plot = new RadiiPlot((at_mm) => {
      if (this.parts.unfolded.has("contours")) this.contours.picked(at_mm);
    });
    this.parts = new RouteParts(this.contours, this.marks);
    this.element = h("div", {}, this.list, this.ends, this.robot, this.path, this.views.element, this.plot.element, this.parts.element);
    this.roving = rovingRows(this.list);
    this.numbers = new NumberFields();
    keys.shortcuts.push((event) => this.key(event));
  }

  /** @param {ViewModel} state */
  update({ routes, route, route_path: path, route_contours: contours, route_views: views, case: open }) {
    this.drawList(routes?.items ?? [], route);
    draw(this.ends, route ? this.endsOf(route, open?.landmarks ?? []) : html``);
    draw(this.robot, route ? this.robotOf(route) : html``);
    draw(this.path, route && path ? titled("Pathway", null, this.pathOf(path)) : html``);
    for (const part of [this.ends, this.robot, this.path]) part.hidden = !route;
    this.plot.update(path, contours);
    this.views.update(path?.state === "ready" && path.limit !== "base" ? views : undefined); // from a base labels are traced
    this.contours.update(contours, route);
    this.marks.update(route, path?.state === "ready");
    this.parts.element.hidden = !route;
    this.parts.show({ contours: ContourPart.line(contours), marks: MarksPart.line(route) });
  }

  /**
   * @param {RouteEntry[]} items
   * @param {RouteSection | null | undefined} route
   */
  drawList(items, route) {
    const send = (/** @type {"route.undo" | "route.redo"} */ type) => this.connection.send(type);
    const tools = html`${iconTool("undo", "Undo", () => send("route.undo"), { operation: "route.undo", off: !route?.can_undo })}
      ${iconTool("redo", "Redo", () => send("route.redo"), { operation: "route.redo", off: !route?.can_redo })}`;
    draw(this.list, titled("Route", tools, html`
      <ul class="list two-lines plain-rows" id="routes" aria-label="Routes" ?hidden=${!items.length}>${repeat(items, ({ id }) => id, (item) => this.row(item, route))}</ul>
      <button type="button" class="wide" id="new-route" data-operation="route.new" @click=${() => this.connection.send("route.new")}>New route</button>`));
    this.roving.update();
  }

  /**
   * @param {RouteEntry} item
   * @param {RouteSection | null | undefined} route
   */
  row(item, route) {
    const fields = { route_id: item.id }, open = route?.id === item.id;
    const tools = [
      iconTool("pencil", "Rename", () => this.rename(item), { operation: "route.rename" }),
      iconTool("lock", open && route?.locked ? "Unlock" : "Lock", () => this.connection.send("route.lock", { ...fields, locked: !route?.locked }), { operation: "route.lock", off: !open }),
      iconTool("trash", "Delete", () => noteDone(this.connection.request("route.delete", fields), "Route deleted.", { label: "Restore", run: () => this.connection.send("route.restore", fields) }), { operation: "route.delete route.restore" }),
    ];
    return nameRow(item, when(item.modified), () => this.connection.send("route.open", fields), tools, open);
  }

  /** @param {RouteEntry} item */
  async rename({ id, name: before }) {
    const name = await askName("Rename route", before);
    if (name) this.connection.send("route.rename", { route_id: id, name });
  }

  /**
   * @param {RouteSection} route
   * @param {LandmarkView[]} landmarks
   */
  endsOf(route, landmarks) {
    const swap = iconTool("swap", "Swap entry and end", () => this.connection.send("route.swap"), { operation: "route.swap", off: !route.entry && !route.end });
    return titled("Ends", swap, html`${ENDS.map(([end, label]) => this.endOf(route, landmarks, end, label))}`);
  }

  /**
   * @param {RouteSection} route
   * @param {LandmarkView[]} landmarks
   * @param {End} end
   * @param {string} label
   */
  endOf(route, landmarks, end, label) {
    const at = route[end], picking = route.picking === end;
    const here = at ? landmarks.findIndex(({ position }) => position.every((value, axis) => Math.abs(value - at[axis]) < 0.01)) : -1;
    const choose = (/** @type {Event} */ { currentTarget }) => {
      const mark = landmarks[Number(/** @type {HTMLSelectElement} */ (currentTarget).value)];
      if (mark) this.connection.send(`route.${end}`, { at: mark.position });
    };
    const place = at ? placeWords(at, 0) : "Not chosen";
    return html`<div class="field"><span class="field-label">${label} <span class="number">${place}</span></span>
      <div class="buttons even">
        <select id=${`route-${end}`} aria-label=${`${label} at a landmark`} data-operation="route.entry route.end" ?hidden=${!landmarks.length} ?disabled=${route.locked} @change=${choose}>
          <option value="" .selected=${live(here < 0)}>${at ? "On the wall" : "Landmark …"}</option>
          ${landmarks.map(({ name }, index) => html`<option value=${index} .selected=${live(index === here)}>${name}</option>`)}
        </select>
        <button type="button" id=${`pick-${end}`} data-operation="route.entry route.end" aria-pressed=${String(picking)} ?disabled=${route.locked}
          @click=${() => this.connection.send("route.pick", { what: picking ? "" : end })}>Click wall</button>
      </div></div>`;
  }

  /** @param {RouteSection} route */
  robotOf(route) {
    const { links, length_mm, radius_mm, bound_mm, locked: off } = route, robot = { links, length_mm, radius_mm };
    const change = (/** @type {Partial<typeof robot>} */ changed) => this.connection.send("route.robot", { ...robot, ...changed });
    const bound = (/** @type {number | null} */ value) => this.connection.send("route.bound", { bound_mm: value });
    const auto = (/** @type {string} */ title) => ({ placeholder: "auto", title });
    const number = (/** @type {string} */ label, /** @type {HTMLInputElement} */ input, /** @type {unknown} */ help = "") => html`<div class="field"><span class="field-label"><label for=${input.id}>${label}</label>${help ? html` ${more(help)}` : ""}</span>${input}</div>`;
    return titled("Robot", null, html`<div class="fields two">
      ${ROBOT.map(([name, label, low, high]) => number(label, this.numbers.of(`route-${name}`, {
    low, high, value: route[name], off, changed: (value) => change({ [name]: name === "links" ? Math.round(value) : value }),
    ...(name === "links" ? { emptied: () => change({ links: null }) } : {}),
  }, { "data-operation": "route.robot", ...(name === "links" ? auto(LINKS_HELP) : {}) })))}
      ${number("Bound, mm", this.numbers.of("route-bound", { low: BOUND_MM[0], high: BOUND_MM[1], value: bound_mm, off, changed: bound, emptied: () => bound(null) },
    { "data-operation": "route.bound", ...auto(BOUND_HELP) }), DEVIATION_HELP)}</div>
      <label class="check"><input type="checkbox" id="route-breathing" data-operation="route.breathing" ?disabled=${route.locked} .checked=${live(route.breathing_mm > 0)}
        @change=${this.breathes}>Breathing, 8 mm</label>`);
  }

  /** @param {RoutePathSection} path */
  pathOf(path) {
    const take = (/** @type {ReachOfferView} */ { links, length_mm, radius_mm, bound_mm }) => {
      this.connection.send("route.robot", { links, length_mm, radius_mm });
      if (bound_mm !== (this.connection.state.route?.bound_mm ?? null)) this.connection.send("route.bound", { bound_mm });
    };
    return html`${pathWords(path, this.connection.state)}<ul class="list plain-rows" id="reach-offers" ?hidden=${!path.offers.length}>${path.offers.map((offer) => html`<li class="row"><span>${offer.words}</span>
      <button type="button" @click=${() => take(offer)}>Take</button></li>`)}</ul>`;
  }

  breathes = (/** @type {Event} */ { currentTarget }) => this.connection.send("route.breathing", { breathing_mm: /** @type {HTMLInputElement} */ (currentTarget).checked ? 8 : 0 });

  /**
   * Undo and redo while this tab is shown; Escape ends the choice of a place.
   * @param {KeyboardEvent} event
   */
  key(event) {
    const { step, route } = this.connection.state;
    if (step?.name !== "route" || !route) return false;
    if (event.key === "Escape" && route.picking) {
      this.connection.send("route.pick", { what: "" });
      return true;
    }
    if (!isUndoKey(event)) return false;
    this.connection.send(event.shiftKey || event.code === "KeyY" ? "route.redo" : "route.undo");
    return true;
  }
}

/** What is rare in this tab. */
class RouteParts extends FoldedParts {
  /**
   * @param {ContourPart} contours
   * @param {MarksPart} marks
   */
  constructor(contours, marks) {
    super({ label: "More", kept: "route", steps: [{ name: "contours", title: "Contours by hand", content: contours.element }, { name: "marks", title: "Polyps and labels", content: marks.element }] });
    this.contours = contours;
  }

  /**
   * @override
   * @param {string} name
   * @param {boolean} open
   */
  unfold(name, open) {
    super.unfold(name, open);
    if (name === "contours" && !open) this.contours.folded();
  }
}

/**
 * How far the pathway of the open route is.
 * @param {ViewModel} state
 */
function computing({ jobs, route }) {
  const job = jobs?.items.find(({ kind, document_id: of }) => kind === "route" && of === route?.id);
  if (!job) return html`<p class="words" id="route-state">Computing …</p>`;
  return html`<p class="words" id="route-state">${stageWords(job)}</p><div class="progress"><div style=${`width: ${(100 * job.fraction).toFixed(1)}%`}></div></div>`;
}

/**
 * @param {RoutePathSection} path
 * @param {ViewModel} state
 */
function pathWords(path, state) {
  if (path.state === "none") return html`<p class="words">Choose entry and end.</p>`;
  if (path.state === "computing") return computing(state);
  if (path.state === "failed") return html`<p class="words caution" id="route-state">${said(path.words)}</p>`;
  const stands = path.limit === "base"; // nothing is inserted from there
  const facts = [
    ...(stands ? [] : [["Length", `${fixed(path.length_mm, 0)} mm`, LENGTH_HELP]]),
    ["Links", String(path.links)],
    ["Narrowest radius", `${fixed(path.least_mm, 1)} mm at ${fixed(path.least_at_mm, 0)} mm`],
    stands ? ["Reach from the base", `${fixed(path.reach_mm, 0)} mm`] : ["Tip reaches", `${fixed(path.reach_mm, 0)} mm`],
  ];
  return html`<dl class="facts" id="route-facts">${facts.map(([term, value, help]) => html`<dt>${term}${help ? html` ${more(help)}` : ""}</dt><dd>${value}</dd>`)}</dl>
    ${path.behind_share === null || path.behind_mm === null ? "" : behindLine("behind-words", behindWords({ share: path.behind_share, depth_mm: path.behind_mm }, path.bound_mm))}
    <p class="plot-keys scene-keys"><span><i></i>Pathway in 3D</span>${stands || path.limit === "end" ? "" : html`<span><i data-key="stop"></i>Tip stops</span>`}</p>
    <p class=${["narrow", "bound", "shape"].includes(path.limit) ? "words caution" : "words"} id="reach-words">${said(path.reach_words)}</p>`;
}
