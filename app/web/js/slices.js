// The three CT slices: cross-hair, points, and clicks that mean a place in the head.
import { h, svg } from "./dom.js";
import { mm } from "./format.js";
import { cutNear } from "./near-plane.js";
import { Loader } from "./slice-loader.js";
import { sizeOf, toPatient, toPicture } from "./slice-geometry.js";
/** @import { Connection } from "./connection.js" */
/** @import { PlaceNear } from "./near-plane.js" */
/** @import { Position } from "./slice-geometry.js" */
/** @import { ItemEntry, SlicePlane, SlicesSection, ViewModel } from "./types.js" */

/** @typedef {{ name: keyof SlicesSection["planes"], title: string, normal: number, letters: Record<string, string> }} Axis */
/** @typedef {{ item: ItemEntry | null | undefined, from: [number, number], dragging: boolean, planning: boolean }} Grab */
/** @typedef {ViewModel & { case: NonNullable<ViewModel["case"]>, slices: SlicesSection }} StateWithSlices */

/** @type {Axis[]} */
const AXES = [
  { name: "axial", title: "Axial", normal: 2, letters: { left: "R", right: "L", top: "A", bottom: "P" } },
  { name: "coronal", title: "Coronal", normal: 1, letters: { left: "R", right: "L", top: "S", bottom: "I" } },
  { name: "sagittal", title: "Sagittal", normal: 0, letters: { left: "A", right: "P", top: "S", bottom: "I" } },
];
const NEAR_MM = 2; // what lies this near to the plane is drawn in full, the rest faint
const GRAB_PX = 8;
const SAME_MM = 2e-3; // positions come back rounded to 0.001 mm
/** @type {[string, string, number, number][]} name, label, window, level */
const WINDOWS = [["bone", "Bone", 2500, 600], ["sinus", "Sinus", 2000, -200], ["soft", "Soft tissue", 400, 40]];

export class Slices {
  /**
   * @param {HTMLElement} root
   * @param {Connection} connection
   */
  constructor(root, connection) {
    this.connection = connection;
    this.zoom = 2;
    this.stages = AXES.map((axis) => new SliceStage(axis, connection, () => this.zoom));
    this.zoomInput = h("input", { type: "range", min: 1, max: 6, step: 0.25, value: 2, "aria-label": "Zoom of the slices", oninput: () => this.setZoom() });
    this.zoomWords = h("span", { class: "number" }, "2.0×");
    this.window = h("select", { "aria-label": "Grey values", onchange: () => this.setWindow() },
      WINDOWS.map(([value, label]) => h("option", { value }, label)));
    this.foot = h("div", { class: "slices-foot" },
      h("label", { class: "field" }, h("span", { class: "field-label" }, "Zoom", this.zoomWords), this.zoomInput), this.window);
    this.empty = h("p", { class: "slices-empty" });
    root.append(...this.stages.map((stage) => stage.element), this.foot, this.empty);
    this.update({}); // nothing is known of the head yet
    connection.addEventListener("link", () => { for (const stage of this.stages) stage.unanswered(); });
  }

  /** @param {ViewModel} state */
  update(state) {
    const available = hasSlices(state);
    this.empty.hidden = available || !state.case;
    this.empty.textContent = state.case?.has_volume ? state.case.loading ?? "" : "This head came as a surface, without a CT. Slices need a CT volume.";
    this.foot.hidden = !available;
    for (const stage of this.stages) {
      stage.element.hidden = !available;
      if (available) stage.update(state);
    }
    if (available) this.window.value = state.slices.window_name;
  }

  setZoom() {
    this.zoom = Number(this.zoomInput.value);
    this.zoomWords.textContent = `${this.zoom.toFixed(1)}×`;
    for (const stage of this.stages) stage.draw();
  }

  setWindow() {
    const [name, , window, level] = WINDOWS[this.window.selectedIndex];
    this.connection.send("slice.window", { name, window, level });
  }
}

/**
 * @param {ViewModel} state
 * @returns {state is StateWithSlices}
 */
function hasSlices(state) {
  return Boolean(state.case?.has_volume && state.slices);
}

class SliceStage {
  /**
   * @param {Axis} axis
   * @param {Connection} connection
   * @param {() => number} zoom
   */
  constructor(axis, connection, zoom) {
    this.axis = axis;
    this.connection = connection;
    this.zoomOf = zoom;
    this.pictures = svg("g");
    this.coming = svg("g", { visibility: "hidden" });
    this.loader = new Loader(this.coming, connection, (plane, images) => this.loaded(plane, images));
    /** @type {number[]} positions asked for whose answer is not there yet, oldest first */
    this.sent = [];
    /** @type {number | null} the position that the newest wish leads to */
    this.wanted = null;
    /** @type {number | null} the planner's position */
    this.known = null;
    /** @type {number | null} */
    this.timer = null;
    /** @type {StateWithSlices | null} */
    this.state = null;
    /** @type {SlicePlane | null} what the planner has said last */
    this.newest = null;
    /** @type {SlicePlane | null} what is drawn */
    this.plane = null;
    /** @type {string | null} */
    this.caseId = null;
    /** @type {Grab | null} */
    this.grab = null;
    this.view = { x: 0, y: 0, perPixel: 1 }; // upper left corner and scale of what is shown, mm
    this.marks = svg("g");
    this.svg = svg("svg", { preserveAspectRatio: "xMidYMid meet" }, this.coming, this.pictures, this.marks);
    this.failed = h("div", { class: "slice-failed", hidden: true }, "This slice could not be loaded. It is tried again.");
    const letters = Object.entries(axis.letters).map(([side, letter]) => h("span", { class: `slice-letter ${side}`, "aria-hidden": "true" }, letter));
    this.stage = h("div", {
      class: "slice-stage", tabIndex: 0, role: "application", "data-axis": axis.name,
      "aria-label": `${axis.title} slice. Arrow keys and wheel move through the head, a click adds what is chosen in the panel.`,
      onpointerdown: (event) => this.pressed(event), onpointermove: (event) => this.moved(event), onpointerup: (event) => this.lifted(event),
      onpointercancel: () => { this.grab = null; }, onkeydown: (event) => this.key(event),
    }, this.svg, letters, this.failed);
    this.stage.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    new ResizeObserver(() => this.draw()).observe(this.stage);
    this.where = h("span", { class: "number" });
    /** @type {HTMLInputElement} */
    this.slider = h("input", { type: "range", "aria-label": `Position of the ${axis.name} slice in mm`, oninput: () => this.goTo(Number(this.slider.value)) });
    this.element = h("div", { class: "slice" },
      h("div", { class: "slice-head" }, axis.title, this.where), this.stage, h("div", { class: "slice-slide" }, this.slider));
  }

  /** @param {StateWithSlices} state */
  update(state) {
    this.state = state;
    const { lo, hi, step, position } = this.newest = state.slices.planes[this.axis.name];
    if (state.case.id !== this.caseId) this.forget(state.case.id);
    this.answered(position);
    Object.assign(this.slider, { min: String(lo), max: String(hi), step: String(step) });
    this.slider.value = String(this.wanted ?? position);
    this.loader.want(this.newest, this.addresses(state, this.newest));
    this.draw();
  }

  /**
   * Another head: nothing of the one before may stay.
   * @param {string} caseId
   */
  forget(caseId) {
    this.caseId = caseId;
    this.plane = this.wanted = null;
    this.sent = [];
    this.loader.clear();
    this.pictures.replaceChildren();
    this.marks.replaceChildren();
    this.where.textContent = "";
  }

  /**
   * The planner's position: the answer to a wish of ours, or a move from elsewhere, which ends all wishes.
   * @param {number} position
   */
  answered(position) {
    const index = this.sent.findIndex((sent) => Math.abs(sent - position) < SAME_MM);
    if (position === this.known) return;
    this.known = position;
    this.sent = index < 0 ? [] : this.sent.slice(index + 1);
    if (!this.sent.length && !this.timer) this.wanted = null;
  }

  /** Another line: what was asked on the one before is not answered any more. */
  unanswered() {
    this.sent = [];
    this.wanted = null;
    this.loader.again();
  }

  /**
   * @param {StateWithSlices} state
   * @param {SlicePlane} plane
   */
  addresses(state, plane) {
    const { window, level } = state.slices;
    const address = `/api/cases/${encodeURIComponent(state.case.id)}/slices/${this.axis.name}`
      + `?position_mm=${plane.position.toFixed(3)}&window=${window}&level=${level}`;
    const fine = plane.detail && state.case.detail;
    return fine ? [address, `${address}&volume=${encodeURIComponent(fine)}`] : [address];
  }

  /**
   * Picture, label and marks change together, so that none says something of another slice.
   * @param {SlicePlane} plane
   * @param {SVGImageElement[] | null} images
   */
  loaded(plane, images) {
    this.plane = plane;
    this.where.textContent = `${"LPS"[this.axis.normal]} ${mm(plane.position)}`;
    this.failed.hidden = images !== null;
    this.pictures.replaceChildren(...(images ?? []));
    this.draw();
  }

  draw() {
    const { plane, state } = this;
    if (!plane || !state || !this.stage.clientWidth) return;
    const project = (/** @type {Position} */ point) => toPicture(plane, this.axis.normal, point);
    const { width, height } = sizeOf(plane);
    const zoom = this.zoomOf();
    const fit = Math.max(width / this.stage.clientWidth, height / this.stage.clientHeight); // mm per pixel that shows all
    const shownWidth = (fit / zoom) * this.stage.clientWidth;
    const shownHeight = (fit / zoom) * this.stage.clientHeight;
    const centre = zoom > 1 ? project(state.slices.cross) : { x: width / 2, y: height / 2 };
    this.view = { x: centre.x - shownWidth / 2, y: centre.y - shownHeight / 2, perPixel: fit / zoom };
    this.svg.setAttribute("viewBox", `${this.view.x} ${this.view.y} ${shownWidth} ${shownHeight}`);
    const [wide, fine] = this.pictures.children;
    if (wide) setBox(wide, 0, 0, width, height);
    if (fine && plane.detail) {
      const size = sizeOf(plane.detail);
      const first = project(plane.detail.origin); // the centre of its first pixel
      setBox(fine, first.x - size.width / plane.detail.columns / 2, first.y - size.height / plane.detail.rows / 2, size.width, size.height);
    }
    this.drawMarks(state, project, width, height);
  }

  /**
   * @param {StateWithSlices} state
   * @param {(point: Position) => PlaceNear} project
   * @param {number} width
   * @param {number} height
   */
  drawMarks(state, project, width, height) {
    const radius = 3.6 * this.view.perPixel;
    const cross = project(state.slices.cross);
    /** @type {SVGElement[]} */
    const marks = [
      svg("line", { class: "cross-hair", x1: 0, x2: width, y1: cross.y, y2: cross.y }),
      svg("line", { class: "cross-hair", y1: 0, y2: height, x1: cross.x, x2: cross.x }),
    ];
    const line = (/** @type {Position[]} */ places, /** @type {string} */ kind) => marks.push(...drawnLine(places.map(project), kind));
    line(state.curve?.points ?? [], "slice-path");
    const { driven, plan } = state; // a rehearsal of the plan as it was shows what it drives
    const selected = driven ? null : plan?.selected;
    const { points, targets } = driven ?? plan ?? { points: [], targets: [] };
    for (const item of points) marks.push(drawnMark(project(item.position), radius, "slice-point", item.id === selected));
    for (const item of targets) marks.push(drawnMark(project(item.position), radius, "slice-target", item.id === selected));
    if (!driven && plan?.ghost) marks.push(drawnMark(project(plan.ghost.position), radius * 1.3, "slice-point ghost", false));
    if (state.step?.name === "rehearse") for (const segment of state.tool?.segments ?? []) line(segment, "slice-tool");
    this.marks.replaceChildren(...marks);
  }

  /**
   * The place in the head under the pointer, LPS mm; null beside the picture.
   * @param {PointerEvent} event
   */
  place(event) {
    const box = this.stage.getBoundingClientRect();
    const x = this.view.x + (event.clientX - box.left) * this.view.perPixel;
    const y = this.view.y + (event.clientY - box.top) * this.view.perPixel;
    return this.plane && toPatient(this.plane, x, y);
  }

  /**
   * The point or target that is drawn under the pointer and lies near the plane.
   * @param {PointerEvent} event
   */
  under(event) {
    const { plane } = this;
    const plan = this.state?.plan;
    if (!plane || !plan) return undefined;
    const box = this.stage.getBoundingClientRect();
    return [...plan.points, ...plan.targets].find((item) => {
      const { x, y, away } = toPicture(plane, this.axis.normal, item.position);
      if (Math.abs(away) > NEAR_MM) return false;
      const dx = (x - this.view.x) / this.view.perPixel - (event.clientX - box.left);
      const dy = (y - this.view.y) / this.view.perPixel - (event.clientY - box.top);
      return Math.hypot(dx, dy) <= GRAB_PX;
    });
  }

  /** @param {PointerEvent} event */
  pressed(event) {
    if (event.button !== 0 || !this.plane) return;
    this.stage.setPointerCapture(event.pointerId);
    const planning = this.state?.step?.name === "plan" && !event.shiftKey;
    const item = planning ? this.under(event) : null;
    this.grab = { item, from: [event.clientX, event.clientY], dragging: false, planning };
    if (item) this.connection.send("item.select", { item_id: item.id });
  }

  /** @param {PointerEvent} event */
  moved(event) {
    if (!this.grab) return;
    const [x, y] = this.grab.from;
    if (!this.grab.dragging && Math.hypot(event.clientX - x, event.clientY - y) < 4) return;
    this.grab.dragging = true;
    const place = this.place(event);
    if (!place) return;
    if (!this.grab.item) this.connection.send("slice.cross", { position: place });
    else if (!this.state?.plan?.locked) this.connection.send("item.drag", { item_id: this.grab.item.id, position: place });
  }

  /** @param {PointerEvent} event */
  lifted(event) {
    const { grab } = this;
    this.grab = null;
    if (!grab) return;
    if (grab.dragging) {
      if (grab.item) this.connection.send("item.drop", { item_id: grab.item.id });
      return;
    }
    const place = this.place(event);
    if (!place || grab.item) return;
    const plan = this.state?.plan;
    const adds = grab.planning && plan && !plan.locked && plan.add_mode !== "none";
    this.connection.send(adds ? "pick.slice" : "slice.cross", { position: place });
  }

  /** @param {WheelEvent} event */
  wheel(event) {
    event.preventDefault();
    this.goBy(Math.sign(event.deltaY));
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    /** @type {Record<string, number>} */
    const turns = { ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1, PageUp: 10, PageDown: -10 };
    if (!(event.key in turns)) return;
    event.preventDefault();
    event.stopPropagation();
    this.goBy(turns[event.key]);
  }

  /**
   * From where the last wish leads, not from where the planner stands until it has answered.
   * @param {number} steps
   */
  goBy(steps) {
    if (this.newest) this.goTo((this.wanted ?? this.newest.position) + steps * this.newest.step);
  }

  /**
   * Move the slice; wishes are collected for 50 ms so that the wheel cannot flood the planner.
   * @param {number} position
   */
  goTo(position) {
    if (!this.newest) return;
    this.wanted = Math.min(this.newest.hi, Math.max(this.newest.lo, position));
    this.slider.value = String(this.wanted);
    if (this.timer) return;
    this.timer = setTimeout(() => {
      this.timer = null;
      if (!this.connection.connected) this.wanted = null;
      if (this.wanted === null) return;
      this.sent.push(this.wanted);
      this.connection.send("slice.set", { axis: this.axis.name, position: this.wanted });
    }, 50);
  }
}

/**
 * A line in the head: in full where it is near the plane, dotted and faint where it is not.
 * @param {PlaceNear[]} places
 * @param {string} kind
 */
function drawnLine(places, kind) {
  return cutNear(places, NEAR_MM).map((run) => svg("polyline", {
    class: run.near ? kind : `${kind} far`, points: run.places.map(({ x, y }) => `${x.toFixed(2)},${y.toFixed(2)}`).join(" "),
  }));
}

/**
 * @param {PlaceNear} place
 * @param {number} radius
 * @param {string} kind
 * @param {boolean} selected
 */
function drawnMark({ x, y, away }, radius, kind, selected) {
  const near = Math.abs(away) <= NEAR_MM;
  const classes = selected ? `${kind} selected` : kind;
  return svg("circle", { class: classes, cx: x, cy: y, r: near ? radius : radius * 0.6, opacity: near ? 1 : 0.45 });
}

/**
 * @param {Element} element
 * @param {number} x
 * @param {number} y
 * @param {number} width
 * @param {number} height
 */
function setBox(element, x, y, width, height) {
  for (const [name, value] of Object.entries({ x, y, width, height })) element.setAttribute(name, String(value));
}
