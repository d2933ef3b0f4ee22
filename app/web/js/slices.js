// The three CT slices: cross-hair, points, and clicks that mean a place in the head.
import { h, svg } from "./dom.js";
import { mm } from "./format.js";

const AXES = [
  { name: "axial", title: "Axial", normal: 2, letters: { left: "R", right: "L", top: "A", bottom: "P" } },
  { name: "coronal", title: "Coronal", normal: 1, letters: { left: "R", right: "L", top: "S", bottom: "I" } },
  { name: "sagittal", title: "Sagittal", normal: 0, letters: { left: "A", right: "P", top: "S", bottom: "I" } },
];
const NEAR_MM = 1.5; // a point this near to the plane is drawn solid
const GRAB_PX = 8;
const WINDOWS = [["bone", "Bone", 2500, 600], ["sinus", "Sinus", 2000, -200], ["soft", "Soft tissue", 400, 40]];

export class Slices {
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
  }

  update(state) {
    const available = Boolean(state.case?.has_volume && state.slices);
    this.empty.hidden = available || !state.case;
    this.empty.textContent = state.case?.has_volume ? state.case.loading ?? "" : "This head came as a surface, without a CT. Slices need a CT volume.";
    this.foot.hidden = !available;
    for (const stage of this.stages) {
      stage.element.hidden = !available;
      if (available) stage.update(state);
    }
    if (available && state.slices.window_name) this.window.value = state.slices.window_name;
  }

  setZoom() {
    this.zoom = Number(this.zoomInput.value);
    this.zoomWords.textContent = `${this.zoom.toFixed(1)}×`;
    for (const stage of this.stages) stage.draw();
  }

  setWindow() {
    const [name, , window, level] = WINDOWS.find(([value]) => value === this.window.value);
    this.connection.send("slice.window", { name, window, level });
  }
}

class SliceStage {
  constructor(axis, connection, zoom) {
    this.axis = axis;
    this.connection = connection;
    this.zoomOf = zoom;
    this.wide = new Picture();
    this.detail = new Picture();
    this.marks = svg("g");
    this.svg = svg("svg", { preserveAspectRatio: "xMidYMid meet" }, this.wide.element, this.detail.element, this.marks);
    const letters = Object.entries(axis.letters).map(([side, letter]) => h("span", { class: `slice-letter ${side}`, "aria-hidden": "true" }, letter));
    this.stage = h("div", {
      class: "slice-stage", tabIndex: 0, role: "application", "data-axis": axis.name,
      "aria-label": `${axis.title} slice. Arrow keys and wheel move through the head, a click adds what is chosen in the panel.`,
      onpointerdown: (event) => this.pressed(event), onpointermove: (event) => this.moved(event), onpointerup: (event) => this.lifted(event),
      onpointercancel: () => { this.grab = null; }, onkeydown: (event) => this.key(event),
    }, this.svg, letters);
    this.stage.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    new ResizeObserver(() => this.draw()).observe(this.stage);
    this.where = h("span", { class: "number" });
    this.slider = h("input", { type: "range", "aria-label": `Position of the ${axis.name} slice in mm`, oninput: () => this.goTo(Number(this.slider.value)) });
    this.element = h("div", { class: "slice" },
      h("div", { class: "slice-head" }, axis.title, this.where), this.stage, h("div", { class: "slice-slide" }, this.slider));
  }

  update(state) {
    this.state = state;
    this.plane = state.slices.planes[this.axis.name];
    this.caseId = state.case.id;
    const { lo, hi, step, position } = this.plane;
    Object.assign(this.slider, { min: lo, max: hi, step });
    if (document.activeElement !== this.slider || !this.wanted) this.slider.value = String(position);
    this.where.textContent = `${"LPS"[this.axis.normal]} ${mm(position)}`;
    this.load();
    this.draw();
  }

  load() {
    const { window, level } = this.state.slices;
    const address = `/api/cases/${encodeURIComponent(this.caseId)}/slices/${this.axis.name}`
      + `?position_mm=${this.plane.position.toFixed(3)}&window=${window}&level=${level}`;
    this.wide.want(address);
    const fine = this.plane.detail && this.state.case.detail;
    this.detail.want(fine ? `${address}&volume=${encodeURIComponent(fine)}` : null);
  }

  size() {
    return { width: this.plane.columns * length(this.plane.u), height: this.plane.rows * length(this.plane.v) };
  }

  /** LPS to the plane's millimetres from its upper left corner, and the signed distance from the plane. */
  project(point) {
    const { origin, u, v } = this.plane;
    const delta = point.map((value, index) => value - origin[index]);
    return {
      x: dot(delta, u) / length(u) + length(u) / 2,
      y: dot(delta, v) / length(v) + length(v) / 2,
      away: point[this.axis.normal] - this.plane.position,
    };
  }

  draw() {
    if (!this.plane || !this.stage.clientWidth) return;
    const { width, height } = this.size();
    const zoom = this.zoomOf();
    const fit = Math.max(width / this.stage.clientWidth, height / this.stage.clientHeight); // mm per pixel that shows all
    const shownWidth = (fit / zoom) * this.stage.clientWidth;
    const shownHeight = (fit / zoom) * this.stage.clientHeight;
    const centre = zoom > 1 ? this.project(this.state.slices.cross) : { x: width / 2, y: height / 2 };
    this.view = { x: centre.x - shownWidth / 2, y: centre.y - shownHeight / 2, perPixel: fit / zoom };
    this.svg.setAttribute("viewBox", `${this.view.x} ${this.view.y} ${shownWidth} ${shownHeight}`);
    this.wide.place(0, 0, width, height);
    const { detail } = this.plane;
    if (detail) {
      const corner = this.project(detail.origin);
      const [u, v] = [length(detail.u), length(detail.v)];
      this.detail.place(corner.x - u / 2, corner.y - v / 2, detail.columns * u, detail.rows * v);
    }
    this.drawMarks(width, height);
  }

  drawMarks(width, height) {
    const radius = 3.6 * this.view.perPixel;
    const cross = this.project(this.state.slices.cross);
    const marks = [
      svg("line", { class: "cross-hair", x1: 0, x2: width, y1: cross.y, y2: cross.y }),
      svg("line", { class: "cross-hair", y1: 0, y2: height, x1: cross.x, x2: cross.x }),
    ];
    const curve = this.state.curve?.points ?? [];
    if (curve.length > 1) {
      const path = curve.map((point) => this.project(point)).map(({ x, y }) => `${x.toFixed(2)},${y.toFixed(2)}`).join(" ");
      marks.push(svg("polyline", { class: "slice-path", points: path }));
    }
    const plan = this.state.driven ?? this.state.plan; // a rehearsal of the plan as it was shows what it drives
    for (const item of plan?.points ?? []) marks.push(this.mark(item, radius, "slice-point", plan.selected));
    for (const item of plan?.targets ?? []) marks.push(this.mark(item, radius, "slice-target", plan.selected));
    if (plan?.ghost) marks.push(this.mark({ id: "ghost", position: plan.ghost.position }, radius * 1.3, "slice-point ghost"));
    const tool = this.state.tool?.segments ?? [];
    for (const [start, end] of tool) {
      const [a, b] = [this.project(start), this.project(end)];
      marks.push(svg("line", { class: "slice-tool", x1: a.x, y1: a.y, x2: b.x, y2: b.y }));
    }
    this.marks.replaceChildren(...marks);
  }

  mark(item, radius, kind, selected) {
    const { x, y, away } = this.project(item.position);
    const near = Math.abs(away) <= NEAR_MM;
    const classes = item.id === selected ? `${kind} selected` : kind;
    return svg("circle", { class: classes, cx: x, cy: y, r: near ? radius : radius * 0.6, opacity: near ? 1 : 0.45 });
  }

  /** The place in the head under the pointer, LPS mm; null beside the picture. */
  place(event) {
    const box = this.stage.getBoundingClientRect();
    const x = this.view.x + (event.clientX - box.left) * this.view.perPixel;
    const y = this.view.y + (event.clientY - box.top) * this.view.perPixel;
    const { width, height } = this.size();
    if (x < 0 || y < 0 || x > width || y > height) return null;
    const { origin, u, v } = this.plane;
    const column = x / length(u) - 0.5;
    const row = y / length(v) - 0.5;
    return origin.map((value, index) => value + u[index] * column + v[index] * row);
  }

  /** The point or target that is drawn under the pointer and lies near the plane. */
  under(event) {
    const plan = this.state.plan;
    const box = this.stage.getBoundingClientRect();
    const items = [...(plan?.points ?? []), ...(plan?.targets ?? [])];
    return items.find((item) => {
      const { x, y, away } = this.project(item.position);
      if (Math.abs(away) > NEAR_MM) return false;
      const dx = (x - this.view.x) / this.view.perPixel - (event.clientX - box.left);
      const dy = (y - this.view.y) / this.view.perPixel - (event.clientY - box.top);
      return Math.hypot(dx, dy) <= GRAB_PX;
    });
  }

  pressed(event) {
    if (event.button !== 0 || !this.plane) return;
    this.stage.setPointerCapture(event.pointerId);
    const planning = this.state.step?.name === "plan" && !event.shiftKey;
    const item = planning ? this.under(event) : null;
    this.grab = { item, from: [event.clientX, event.clientY], dragging: false, planning };
    if (item) this.connection.send("item.select", { item_id: item.id });
  }

  moved(event) {
    if (!this.grab) return;
    const [x, y] = this.grab.from;
    if (!this.grab.dragging && Math.hypot(event.clientX - x, event.clientY - y) < 4) return;
    this.grab.dragging = true;
    const place = this.place(event);
    if (!place) return;
    if (!this.grab.item) this.connection.send("slice.cross", { position: place });
    else if (!this.state.plan.locked) this.connection.send("item.drag", { item_id: this.grab.item.id, position: place });
  }

  lifted(event) {
    const grab = this.grab;
    this.grab = null;
    if (!grab) return;
    if (grab.dragging) {
      if (grab.item) this.connection.send("item.drop", { item_id: grab.item.id });
      return;
    }
    const place = this.place(event);
    if (!place || grab.item) return;
    const adds = grab.planning && this.state.plan && !this.state.plan.locked && this.state.plan.add_mode !== "none";
    this.connection.send(adds ? "pick.slice" : "slice.cross", { position: place });
  }

  wheel(event) {
    event.preventDefault();
    if (!this.plane) return;
    this.goTo((this.wanted ?? this.plane.position) + Math.sign(event.deltaY) * this.plane.step);
  }

  key(event) {
    const turns = { ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1, PageUp: 10, PageDown: -10 };
    if (!(event.key in turns) || !this.plane) return;
    event.preventDefault();
    event.stopPropagation();
    this.goTo((this.wanted ?? this.plane.position) + turns[event.key] * this.plane.step);
  }

  /** Move the slice; wishes are collected for 50 ms so that the wheel cannot flood the planner. */
  goTo(position) {
    this.wanted = Math.min(this.plane.hi, Math.max(this.plane.lo, position));
    this.slider.value = String(this.wanted);
    if (this.timer) return;
    this.timer = setTimeout(() => {
      this.timer = null;
      this.connection.send("slice.set", { axis: this.axis.name, position: this.wanted });
      this.wanted = null;
    }, 50);
  }
}

/** A picture in the slice: the newest wanted one is fetched, at most one is on its way. */
class Picture {
  constructor() {
    this.element = svg("image", { preserveAspectRatio: "none" });
  }

  want(address) {
    this.wanted = address;
    this.element.style.display = address ? "" : "none";
    if (!address || this.loading || address === this.shown) return;
    this.loading = true;
    const image = new Image();
    image.onload = () => {
      this.element.setAttribute("href", address);
      this.shown = address;
    };
    const done = () => {
      this.loading = false;
      if (this.wanted !== address) this.want(this.wanted);
    };
    image.addEventListener("load", done);
    image.addEventListener("error", done);
    image.src = address;
  }

  place(x, y, width, height) {
    for (const [name, value] of Object.entries({ x, y, width, height })) this.element.setAttribute(name, value);
  }
}

function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

function length(a) {
  return Math.hypot(...a);
}
