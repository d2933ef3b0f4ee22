// One slice on the page: its picture, the marks over it, and the words that belong to both.
import { h, icon, svg } from "../dom.js";
import { pacing } from "../frame-pacing.js";
import { replay } from "../replay.js";
import { addressesOf, Loader } from "../slice-loader.js";
import { marksOf } from "./marks.js";
import { PaneKeys } from "./pane-keys.js";
import { letterOf, sideWords } from "./place-words.js";
import { PointerInput } from "./pointer-input.js";
import { AXES, Port } from "./port.js";
import { drawRegions, drawnNow } from "./region-cuts.js";
import { drawTool } from "./tool-outline.js";
import { dot, length, minus, plus } from "./vectors.js";
import { Waiting } from "./waiting.js";
/** @import { SlicePlane } from "../types.js" */
/** @import { Slices, StateWithSlices } from "../slices.js" */
/** @import { Triple } from "./grid.js" */
/** @import { Axes, AxisName } from "./port.js" */

/** @typedef {AxisName | "path"} ViewName */
/** @type {Record<ViewName, string>} */
export const TITLES = { axial: "Axial", coronal: "Coronal", sagittal: "Sagittal", path: "Across path" };
const NORMAL = { axial: 2, coronal: 1, sagittal: 0 };
const PATH_VIEW_MM = 120; // that the view across the path shows at a zoom of 1
const ZOOM = [0.5, 40];
const TOOL = { tool: "#ffd479", ring: "#7fe0a0" };
const GHOST = { tool: "#4fc3a1", ring: "#4fc3a1" }; // another run beside the one that is replayed
const SIDES = /** @type {const} */ (["left", "right", "top", "bottom"]);

export class Pane {
  /**
   * @param {ViewName} name
   * @param {Slices} board what the slices share
   */
  constructor(name, board) {
    this.name = name;
    this.board = board;
    this.zoom = 2;
    this.pan = [0, 0]; // of the view's middle from its anchor, mm along u and v
    /** @type {Port | null} what is drawn */
    this.port = null;
    this.drawing = false; // a picture is being made
    this.stale = false; // another one is wanted already
    /** @type {SlicePlane | null} of the pictures that came from the planner */
    this.plane = null;
    this.canvas = h("canvas", { class: "slice-picture" });
    this.over = h("canvas", { class: "slice-tool-outline" });
    this.pictures = svg("g");
    this.coming = svg("g", { visibility: "hidden" });
    this.marks = svg("g");
    this.svg = svg("svg", {}, this.coming, this.pictures);
    this.loader = new Loader(this.coming, board.connection, (plane, images, caseId) => this.loaded(plane, images, caseId));
    this.waiting = new Waiting();
    this.letters = SIDES.map((side) => h("span", { class: `slice-letter ${side}`, "aria-hidden": "true" }));
    this.pointerInput = new PointerInput(this);
    this.keys = new PaneKeys(this);
    this.stage = h("div", {
      class: "slice-stage", tabIndex: 0, role: "application", "aria-roledescription": "CT slice", "data-axis": name,
      "aria-label": `${TITLES[name]}. Arrows move, Page scrolls, Enter adds, M lifts.`,
    }, this.svg, this.canvas, this.over, this.letters, svg("svg", { "aria-hidden": "true" }, this.marks), this.waiting.element);
    this.pointerInput.listen(this.stage);
    this.keys.listen(this.stage);
    new ResizeObserver(() => this.refresh()).observe(this.stage);
    this.where = h("button", { type: "button", class: "slice-where number", title: "Type a place", onclick: () => board.placeField.open(this) });
    this.readings = [h("span", { class: "slice-reading" }), h("span", { class: "slice-reading" })]; // place and HU under the pointer
    this.head = h("div", { class: "slice-head" }, h("span", { class: "slice-title" }, TITLES[name]), this.where, h("div", { class: "slice-readings" }, this.readings));
    /** @type {HTMLInputElement} */
    this.slider = h("input", { type: "range", class: "slice-slide", "aria-orientation": "vertical", "aria-label": this.sliderWords(), oninput: () => this.goTo(Number(this.slider.value)) });
    this.large = h("button", { type: "button", class: "slice-large", "aria-label": `${TITLES[name]}: large`, "aria-pressed": "false", title: "Large, and back (double-click)", onclick: () => this.toggle() }, icon("large"));
    this.element = h("div", { class: "slice", "data-view": name }, this.stage, this.head, this.slider, this.large);
  }

  /** Let this slice fill the viewing area, or all stand as before. */
  toggle() {
    this.board.enlarge(this.board.layout === this.name ? null : this.name);
  }

  sliderWords() {
    return this.name === "path" ? "Place along the path, mm" : `${TITLES[this.name]} slice, mm`;
  }

  /** @returns {Axes} */
  axes() {
    return this.name === "path" ? this.board.frame?.axes ?? AXES.axial : AXES[this.name];
  }

  /** The place that the view is panned from: the middle of the head in this plane, or the path. */
  anchor() {
    if (this.name === "path") return this.board.frame?.place ?? this.board.middle;
    const { n } = AXES[this.name];
    const { middle, crosshair } = this.board;
    return plus(middle, n, dot(minus(crosshair.place ?? middle, middle), n));
  }

  /** mm of the head to a CSS pixel. */
  perPixel() {
    const { clientWidth: width, clientHeight: height } = this.stage;
    const [wide, high] = this.name === "path" ? [PATH_VIEW_MM, PATH_VIEW_MM] : this.board.extent(this.axes());
    return Math.max(wide / width, high / height) / this.zoom;
  }

  /** The port that is wanted now. */
  wanted() {
    const { u, v } = this.axes();
    const centre = plus(plus(this.anchor(), u, this.pan[0]), v, this.pan[1]);
    return new Port(this.axes(), centre, this.perPixel(), this.stage.clientWidth, this.stage.clientHeight);
  }

  /**
   * Bring a place to the middle of the view.
   * @param {Triple} place
   */
  centre(place) {
    const { u, v } = this.axes();
    const away = minus(place, this.anchor());
    this.pan = [dot(away, u), dot(away, v)];
    this.refresh();
  }

  /** Bring the crosshair into sight, where it is not. */
  follow() {
    const { place } = this.board.crosshair;
    if (!place || !this.stage.clientWidth) return;
    const { x, y } = this.wanted().project(place);
    if (x < 8 || y < 8 || x > this.stage.clientWidth - 8 || y > this.stage.clientHeight - 8) this.centre(place);
  }

  /**
   * Zoom, with the place at a pixel staying where it is.
   * @param {number} zoom
   * @param {number} x CSS pixels
   * @param {number} y
   */
  zoomTo(zoom, x = this.stage.clientWidth / 2, y = this.stage.clientHeight / 2) {
    const before = this.wanted().place(x, y);
    this.zoom = Math.min(ZOOM[1], Math.max(ZOOM[0], zoom));
    const off = minus(before, this.wanted().place(x, y));
    const { u, v } = this.axes();
    this.pan = [this.pan[0] + dot(off, u), this.pan[1] + dot(off, v)];
    this.refresh();
  }

  /** Another head: nothing of the one before may stay. */
  forget() {
    this.port = this.plane = null;
    this.loader.clear();
    this.pictures.replaceChildren();
    this.marks.replaceChildren();
    this.canvas.width = this.over.width = 0;
    this.waiting.load();
    this.pointerInput.forget();
    this.keys.lifted = null;
    this.say("");
  }

  /** Draw what is wanted now; while a picture is being made, the newest wish waits. */
  refresh() {
    const { state, link } = this.board;
    if (!state || this.element.hidden || !this.stage.clientWidth || !this.stage.clientHeight) return;
    if (link.holds(state.case.id)) this.cut();
    else this.fetch(state);
  }

  async cut() {
    if (this.drawing) {
      this.stale = true;
      return;
    }
    this.drawing = true;
    const { board } = this;
    const port = this.wanted();
    const place = board.crosshair.place ?? board.middle;
    const words = this.position(place);
    const { head } = board.link;
    const drawn = await board.link.draw(this.name, port.raster(devicePixelRatio * pacing.scale), board.greys.values, board.outlines.on, board.second.look);
    if (pacing.held) await new Promise((go) => { pacing.request(go); });
    this.drawing = false;
    const bitmap = board.link.head === head && board.link.holds(board.state?.case.id) ? drawn : null; // another one may have been opened in the meantime
    if (bitmap !== drawn) drawn?.close();
    if (bitmap) {
      Object.assign(this.canvas, { width: bitmap.width, height: bitmap.height });
      this.canvas.getContext("bitmaprenderer")?.transferFromImageBitmap(bitmap);
      this.pictures.replaceChildren();
      this.loader.clear();
      this.waiting.done();
      this.plane = null;
      this.shown(port, words);
    }
    if (!this.stale && bitmap) return;
    this.stale = false;
    this.refresh();
  }

  /**
   * Until the voxels are there, pictures come from the planner.
   * @param {StateWithSlices} state
   */
  fetch(state) {
    if (this.name === "path") {
      const { link } = this.board;
      if (link.state === "failed") this.waiting.fail(`CT not loaded: ${link.words}. Trying again.`);
      else this.waiting.load(link.share); // it is cut from all of the voxels, or not at all
      return;
    }
    const plane = state.slices.planes[this.name];
    this.loader.want(state.case.id, plane, addressesOf(state, this.name));
    this.place();
  }

  /**
   * Picture, label and marks change together, so that none says something of another slice.
   * @param {SlicePlane} plane
   * @param {SVGImageElement[] | null} images
   * @param {string} caseId of the head that they are of
   */
  loaded(plane, images, caseId) {
    const { state, link } = this.board;
    if (caseId !== state?.case.id || link.holds(caseId)) return; // of another head, or the voxels were faster
    this.plane = plane;
    this.canvas.width = 0; // it lies upon them
    if (images) this.waiting.done();
    else this.waiting.fail("Slice not loaded. Trying again.");
    this.pictures.replaceChildren(...(images ?? []));
    this.place();
  }

  /** Put the planner's pictures where they belong. */
  place() {
    const { plane, name } = this;
    if (!plane || name === "path") return;
    const wanted = this.wanted();
    const { n } = wanted.axes;
    const centre = plus(wanted.centre, n, plane.position - dot(wanted.centre, n));
    const port = new Port(wanted.axes, centre, wanted.perPixel, wanted.width, wanted.height);
    const grids = [plane, plane.detail];
    [...this.pictures.children].forEach((picture, index) => {
      const grid = grids[index];
      if (!grid) return;
      const first = port.project(grid.origin); // the centre of its first pixel
      const [w, h0] = [grid.columns * length(/** @type {Triple} */ (grid.u)) / port.perPixel, grid.rows * length(/** @type {Triple} */ (grid.v)) / port.perPixel];
      setBox(picture, first.x - w / grid.columns / 2, first.y - h0 / grid.rows / 2, w, h0);
    });
    this.shown(port, `${sideWords(plane.position, NORMAL[name])} mm`);
  }

  /**
   * @param {Port} port
   * @param {string} words
   */
  shown(port, words) {
    this.port = port;
    this.say(words);
    const { u, v } = port.axes;
    const sides = { left: opposite(u), right: u, top: opposite(v), bottom: v };
    this.letters.forEach((letter, index) => { letter.textContent = letterOf(sides[SIDES[index]]); });
    this.mark();
  }

  /** The marks over what is drawn; they may change while the picture stays. */
  mark() {
    const { port, board } = this;
    if (!port || !board.state) return;
    this.marks.replaceChildren(...marksOf(port, board.state, board.crosshair.place ?? board.middle, board.measures.shown));
    this.draw(port);
    this.slide();
  }

  /**
   * Cuts of the plan's regions and of the tool, over the picture.
   * @param {Port} port
   */
  draw(port) {
    const { board, over } = this;
    Object.assign(over, { width: Math.round(port.width * devicePixelRatio), height: Math.round(port.height * devicePixelRatio) }); // clears it
    const context = /** @type {CanvasRenderingContext2D} */ (over.getContext("2d"));
    context.scale(devicePixelRatio, devicePixelRatio);
    drawRegions(context, port, board.state?.regions?.items ?? []);
    drawRegions(context, port, drawnNow(board.state?.regions?.drawing));
    const { pose } = board;
    if (pose) drawTool(context, port, pose, TOOL);
    for (const { segments, radii, ghost } of [...replay.tools].reverse()) drawTool(context, port, { segments, radii, margin: 0 }, ghost ? GHOST : TOOL);
  }

  slide() {
    const { board, name } = this;
    if (name === "path") {
      if (board.frames) setRange(this.slider, 0, board.frames.length, 0.1, board.along);
      return;
    }
    if (!board.state) return;
    const { lo, hi, step } = board.state.slices.planes[name];
    setRange(this.slider, lo, hi, step, (board.crosshair.place ?? board.middle)[NORMAL[name]]);
  }

  /**
   * Where the slice is: 'R 24.5 mm', or how far along the path.
   * @param {Triple} place
   */
  position(place) {
    const { frames, along } = this.board;
    if (this.name === "path") return frames ? `${along.toFixed(1)} of ${frames.length.toFixed(1)} mm` : "";
    return `${sideWords(place[NORMAL[this.name]], NORMAL[this.name])} mm`;
  }

  /** @param {string} words */
  say(words) {
    this.where.textContent = words;
    this.where.hidden = !words;
    if (this.pointerInput.reading) this.pointerInput.read(); // another place lies under the pointer
  }

  /**
   * What lies under the pointer; '' where none is.
   * @param {string} place
   * @param {string} hu
   */
  read(place, hu) {
    [place, hu].forEach((words, index) => { this.readings[index].textContent = words; });
  }

  /**
   * Go through the head by steps of the slice, or along the path by half a millimetre.
   * @param {number} steps
   */
  goBy(steps) {
    const { board, name } = this;
    if (name === "path") board.goAlong(board.along + steps * 0.5);
    else if (board.state && board.crosshair.place) {
      this.goTo(board.crosshair.place[NORMAL[name]] + steps * board.state.slices.planes[name].step);
    }
  }

  /** @param {number} position mm along the axis across the slice, or along the path */
  goTo(position) {
    const { crosshair } = this.board;
    if (this.name === "path") {
      this.board.goAlong(position);
      return;
    }
    if (!crosshair.place) return;
    const place = /** @type {Triple} */ ([...crosshair.place]);
    place[NORMAL[this.name]] = position;
    crosshair.move(place);
  }
}

/**
 * @param {Triple} direction
 * @returns {Triple}
 */
function opposite([x, y, z]) {
  return [-x, -y, -z];
}

/**
 * @param {HTMLInputElement} slider
 * @param {number} low
 * @param {number} high
 * @param {number} step
 * @param {number} value
 */
function setRange(slider, low, high, step, value) {
  Object.assign(slider, { min: String(low), max: String(high), step: String(step) });
  slider.value = String(value);
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
