// The pointer on a slice: crosshair, points, window and level, pan, zoom, measures.
import { readingWords } from "./place-words.js";
import { NEAR_MM, openingsOf } from "./marks.js";
/** @import { ItemEntry } from "../types.js" */
/** @import { Triple } from "./grid.js" */
/** @import { Pane } from "./pane.js" */

/** @typedef {"cross" | "window" | "pan" | "measure" | "paint"} Mode what a drag does */
/** @typedef {{ mode: Mode, item: ItemEntry | null, from: [number, number], last: [number, number], dragging: boolean, shift: boolean }} Grab */

const GRAB_PX = 8;
const CLICK_PX = 4; // a press that moves less is a click
const DOUBLE_MS = 250; // a click that would add waits whether it becomes a double click
const ZOOM_STEP = 1.15;

export class PointerInput {
  /** @param {Pane} pane */
  constructor(pane) {
    this.pane = pane;
    this.reading = false; // the pointer is over the slice: its place is told
    this.asked = 0;
    /** @type {[number, number]} where the pointer is, CSS pixels of the view */
    this.pointer = [0, 0];
    /** @type {Grab | null} */
    this.grab = null;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.later = undefined;
  }

  /** @param {HTMLElement} stage */
  listen(stage) {
    stage.addEventListener("pointerdown", (event) => this.pressed(event));
    stage.addEventListener("pointermove", (event) => this.moved(event));
    stage.addEventListener("pointerup", (event) => this.lifted(event));
    for (const end of ["pointercancel", "lostpointercapture"]) stage.addEventListener(end, () => this.lost());
    stage.addEventListener("pointerleave", () => this.left());
    stage.addEventListener("contextmenu", (event) => event.preventDefault());
    stage.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    stage.addEventListener("dblclick", () => this.doubled());
  }

  /**
   * CSS pixels from the view's upper left corner.
   * @param {MouseEvent} event
   * @returns {[number, number]}
   */
  at(event) {
    const box = this.pane.stage.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  /**
   * The place in the head under the pointer; null beside the scan.
   * @param {MouseEvent} event
   * @returns {Triple | null}
   */
  place(event) {
    return this.placeAt(this.at(event));
  }

  /** @param {[number, number]} at CSS pixels of the view */
  placeAt(at) {
    const place = this.pane.port?.place(...at) ?? null;
    return place && this.pane.board.holds(place) ? place : null;
  }

  /** Whether a press may take a point or target: not while the next place belongs to what is drawn or aimed at. */
  get takes() {
    const { step, regions, shaft } = this.pane.board.newest ?? {};
    return step?.input === "edit" && !regions?.drawing && !shaft?.aiming;
  }

  /**
   * The point or target that is drawn under the pointer and lies near the plane.
   * @param {PointerEvent} event
   */
  under(event) {
    const { port, board } = this.pane;
    const plan = board.state?.plan;
    if (!port || !plan) return null;
    const [px, py] = this.at(event);
    const items = plan.add_mode === "target" ? [...plan.targets, ...plan.points] : [...plan.points, ...plan.targets];
    return items.find((item) => {
      const { x, y, away } = port.project(item.position);
      return Math.abs(away) <= NEAR_MM && Math.hypot(x - px, y - py) <= GRAB_PX;
    }) ?? null;
  }

  /**
   * The marked opening whose ring is around a place of the plane that is shown.
   * @param {Triple} place
   */
  opening(place) {
    const { port, board } = this.pane;
    if (!port || !board.state) return undefined;
    const at = port.project(place);
    return openingsOf(board.state).find(({ position, radius_mm: radius }) => {
      const { x, y, away } = port.project(position);
      return Math.abs(away) <= radius && Math.hypot(x - at.x, y - at.y) <= Math.max(radius / port.perPixel, GRAB_PX);
    });
  }

  /** @param {PointerEvent} event */
  pressed(event) {
    const { pane } = this;
    if (!pane.port || this.grab) return;
    clearTimeout(this.later);
    pane.stage.setPointerCapture(event.pointerId);
    const { tool } = pane.board;
    const pans = event.button === 1 || (event.button === 0 && event.ctrlKey);
    /** @type {Mode} */
    let mode = tool === "window" || tool === "cross" || tool === "paint" ? tool : "measure";
    if (event.button === 2) mode = "window";
    else if (pans) mode = "pan";
    const item = mode === "cross" && this.takes && !event.shiftKey ? this.under(event) : null;
    const from = /** @type {[number, number]} */ ([event.clientX, event.clientY]);
    this.grab = { mode, item, from, last: from, dragging: false, shift: event.shiftKey };
    if (item) pane.board.connection.send("item.select", { item_id: item.id });
    if (mode === "paint") pane.board.painting.begin(pane, this.place(event));
    if (event.button === 1) event.preventDefault(); // else the browser scrolls
  }

  /** @param {PointerEvent} event */
  moved(event) {
    this.pointer = this.at(event);
    this.read();
    const { grab, pane } = this;
    if (pane.board.tool === "paint") pane.board.painting.point(pane, this.pointer);
    if (grab?.mode === "paint") {
      pane.board.painting.go(this.place(event));
      return;
    }
    if (!grab) {
      pane.board.measures.point(this.place(event));
      return;
    }
    const [x, y] = grab.from;
    if (!grab.dragging && Math.hypot(event.clientX - x, event.clientY - y) < CLICK_PX) return;
    if (!grab.dragging && grab.mode === "cross" && grab.shift) grab.mode = "window";
    grab.dragging = true;
    const [dx, dy] = [event.clientX - grab.last[0], event.clientY - grab.last[1]];
    grab.last = [event.clientX, event.clientY];
    if (grab.mode === "window") pane.board.greys.drag(dx, dy);
    else if (grab.mode === "pan") this.pan(dx, dy);
    else if (grab.mode === "cross") this.carry(event, grab);
  }

  /**
   * @param {PointerEvent} event
   * @param {Grab} grab
   */
  carry(event, { item }) {
    const { board } = this.pane;
    const place = this.place(event);
    if (!place) return;
    if (!item) board.crosshair.move(place);
    else if (!board.state?.plan?.locked) board.connection.send("item.drag", { item_id: item.id, position: place });
  }

  /**
   * @param {number} dx CSS pixels
   * @param {number} dy
   */
  pan(dx, dy) {
    const { pane } = this;
    const perPixel = pane.perPixel();
    pane.pan = [pane.pan[0] - dx * perPixel, pane.pan[1] - dy * perPixel];
    pane.refresh();
  }

  /** @param {PointerEvent} event */
  lifted(event) {
    const { grab, pane } = this;
    this.grab = null;
    if (!grab) return;
    if (grab.mode === "paint") {
      pane.board.painting.end();
      return;
    }
    if (grab.dragging) {
      if (grab.item) pane.board.connection.send("item.drop", { item_id: grab.item.id });
      return;
    }
    if (grab.item) {
      this.led(grab.item);
      return;
    }
    const place = this.place(event);
    if (!place) return;
    if (grab.mode === "measure") pane.board.measure(place);
    else if (grab.mode === "cross") this.clicked(place, grab);
  }

  /** The browser has taken the pointer away; after a press that was lifted nothing is left to let go. */
  lost() {
    if (this.grab?.mode === "paint") this.pane.board.painting.end();
    this.grab = null;
  }

  /**
   * @param {Triple} place
   * @param {Grab} grab
   */
  clicked(place, { shift }) {
    const { board } = this.pane;
    const opening = shift ? undefined : this.opening(place);
    if (opening) this.later = setTimeout(() => board.connection.send("opening.use", { opening_id: opening.id }), DOUBLE_MS);
    else if (shift || !board.adds) board.crosshair.move(place);
    else this.later = setTimeout(() => board.connection.send("pick.slice", { position: place }), DOUBLE_MS);
  }

  /**
   * While clicks add points, the path is led on to a target that is clicked.
   * @param {{ id: string, position: Triple }} item
   */
  led({ id, position }) {
    const { board } = this.pane;
    const plan = board.state?.plan;
    if (!board.adds || plan?.add_mode !== "point" || !plan.points.length || !plan.targets.some((target) => target.id === id)) return;
    this.later = setTimeout(() => board.connection.send("pick.slice", { position }), DOUBLE_MS);
  }

  doubled() {
    clearTimeout(this.later);
    if (this.pane.board.tool === "cross") this.pane.toggle();
  }

  /** @param {WheelEvent} event */
  wheel(event) {
    event.preventDefault();
    const { pane } = this;
    if (!event.ctrlKey && !event.metaKey) pane.goBy(Math.sign(event.deltaY));
    else {
      pane.zoomTo(pane.zoom * (event.deltaY > 0 ? 1 / ZOOM_STEP : ZOOM_STEP), ...this.at(event));
      pane.board.zoomed(pane.zoom);
    }
  }

  /**
   * Tell the place under the pointer and the HU that is drawn there; an answer to an older question is dropped.
   */
  async read() {
    const { pane } = this;
    const place = this.placeAt(this.pointer);
    this.reading = place !== null;
    this.asked += 1;
    const mine = this.asked;
    if (!place) {
      pane.read("", "");
      return;
    }
    const { link, state } = pane.board;
    const values = link.holds(state?.case.id) ? await link.read([place]) : null;
    if (mine !== this.asked || !this.reading) return;
    if (values) pane.read(...readingWords(place, values[0]));
  }

  /** Another head: what was pressed in the one before adds, carries and paints nothing in this one. */
  forget() {
    clearTimeout(this.later);
    this.grab = null;
    this.asked += 1;
    this.pane.read("", "");
  }

  left() {
    this.reading = false;
    this.pane.read("", "");
    this.pane.board.measures.point(null);
    this.pane.board.painting.ring.hidden = true;
  }
}
