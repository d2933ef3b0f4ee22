// The CT slices: three through the crosshair and one across the path, cut in this window from the CT's own voxels.
import { h } from "./dom.js";
import { pacing } from "./frame-pacing.js";
import { ENLARGE, LAID_OUT } from "./layout.js";
import { CloseUp } from "./slices/close-up.js";
import { Crosshair } from "./slices/crosshair.js";
import { GreyValues } from "./slices/grey-values.js";
import { Measures } from "./slices/measures.js";
import { Outlines } from "./slices/outlines.js";
import { OverlayControls } from "./slices/overlay-controls.js";
import { Pane, TITLES } from "./slices/pane.js";
import { Painting } from "./slices/painting.js";
import { PathFrames } from "./slices/path-frames.js";
import { PlaceField } from "./slices/place-field.js";
import { TipFollower } from "./slices/tip-follower.js";
import { ToolPoses } from "./slices/tool-poses.js";
import { ToolStrip, toolHint } from "./slices/tool-strip.js";
import { VolumeLink } from "./slices/volume-link.js";
import { paintBrush } from "./paint-brush.js";
import { replay } from "./replay.js";
import { thresholdPreview } from "./threshold-preview.js";
/** @import { Connection } from "./connection.js" */
/** @import { Triple } from "./slices/grid.js" */
/** @import { ViewName } from "./slices/pane.js" */
/** @import { Axes } from "./slices/port.js" */
/** @import { SlicesSection, ViewModel } from "./types.js" */

/** @typedef {ViewModel & { case: NonNullable<ViewModel["case"]>, slices: SlicesSection }} StateWithSlices */
/** @typedef {"cross" | "window" | "distance" | "angle" | "paint"} Tool what the mouse does */

/** @type {ViewName[]} */
const VIEWS = ["axial", "coronal", "sagittal", "path"];

/**
 * What the panes share, and the element they stand in.
 */
export class Slices extends EventTarget {
  /**
   * @param {HTMLElement} root
   * @param {Connection} connection
   */
  constructor(root, connection) {
    super();
    this.root = root;
    this.connection = connection;
    /** @type {StateWithSlices | null} */
    this.state = null;
    /** @type {Tool} */
    this.tool = "cross";
    /** @type {ViewName | null} the slice that fills the viewing area */
    this.layout = null;
    this.link = new VolumeLink();
    this.second = new OverlayControls(this.link, connection);
    this.crosshair = new Crosshair(connection);
    this.closeUp = new CloseUp(this);
    this.greys = new GreyValues(connection);
    this.measures = new Measures();
    this.poses = new ToolPoses();
    /** @type {PathFrames | null} */
    this.frames = null;
    this.along = 0; // arc length of the view across the path, mm
    /** @type {number | null} */
    this.shownTool = null; // arc length at which the Plan tab shows the tool, mm
    this.outlines = new Outlines(this.link);
    this.tip = new TipFollower(this);
    this.caseId = "";
    this.curveKey = "";
    this.planned = false;
    this.placeField = new PlaceField(this);
    this.panes = VIEWS.map((name) => new Pane(name, this));
    this.strip = new ToolStrip(this);
    this.said = h("span", { class: "slices-said", role: "status" });
    this.hint = h("span", { class: "slices-hint" });
    this.line = h("p", { class: "slices-line" }, this.said, this.hint);
    this.empty = h("p", { class: "slices-empty" });
    this.painting = new Painting(this);
    this.panes[0].element.append(this.strip.element);
    const none = h("div", { class: "slice-none" }, h("strong", {}, TITLES.path), h("span", {}, "Needs a path")); // keeps its place
    root.append(...this.panes.map((pane) => pane.element), none, this.line, this.empty, ...this.strip.popovers);
    this.listen();
    this.update({}); // nothing is known of the head yet
  }

  listen() {
    const all = () => this.plan(() => { for (const pane of this.panes) pane.refresh(); });
    this.crosshair.addEventListener("move", all);
    this.crosshair.addEventListener("elsewhere", () => { for (const pane of this.panes) if (pane.name !== "path") pane.follow(); });
    this.greys.addEventListener("change", all);
    pacing.addEventListener("scale", all);
    this.second.addEventListener("change", all);
    this.link.addEventListener("change", () => this.linked());
    this.link.addEventListener("outlines", all);
    this.measures.addEventListener("change", () => this.mark());
    this.poses.addEventListener("change", () => this.mark());
    replay.addEventListener("change", () => this.replayed());
    thresholdPreview.addEventListener("kept", () => this.link.keep(thresholdPreview.kept));
    thresholdPreview.addEventListener("change", () => this.greys.tint(thresholdPreview.value));
    this.connection.addEventListener("link", () => this.unanswered());
    window.addEventListener(LAID_OUT, (event) => this.laidOut(/** @type {CustomEvent<string>} */ (event).detail));
  }

  /**
   * Draw once per frame, whatever asks for it in between.
   * @param {() => void} draw
   */
  plan(draw) {
    if (this.planned) return;
    this.planned = true;
    pacing.request(() => {
      this.planned = false;
      draw();
    });
  }

  /** @param {ViewModel} state */
  update(state) {
    const available = hasSlices(state);
    this.empty.hidden = available || !state.case;
    this.empty.textContent = state.case?.has_volume ? state.case.loading ?? "" : "No CT, so no slices.";
    this.line.hidden = !available;
    this.state = available ? { ...state } : null; // as it was found: the connection writes the next head into its own
    this.poses.update(state);
    this.updateCurve(state);
    this.followTool(state);
    for (const pane of this.panes) pane.element.hidden = !available || (pane.name === "path" && !this.frames);
    this.root.dataset.panes = String(this.panes.filter((pane) => !pane.element.hidden).length);
    if (this.layout === "path" && !this.frames) this.enlarge(null);
    if (available) this.show(state);
    if (!replay.tools.length) this.tip.at(available && state.step?.input === "drive" ? state.rehearsal?.tip : undefined);
    this.strip.update();
    this.sayHint();
  }

  /** @param {StateWithSlices} state */
  show(state) {
    const another = state.case.id !== this.caseId;
    if (another) {
      this.caseId = state.case.id;
      this.crosshair.forget();
      this.measures.clear();
      this.painting.stroke = null;
      this.second.forget();
      this.placeField.close();
      this.tell("");
      for (const pane of this.panes) pane.forget();
      this.outlines.forget();
      this.link.open(state.case.id, state.case.volumes); // before anything draws: the voxels of the head before are gone
    }
    this.crosshair.heard(state.slices);
    this.greys.heard(state.slices);
    if (another) {
      this.centreAll();
      if (this.frames) this.along = this.frames.nearest(this.crosshair.place ?? this.middle);
    }
    this.second.update(state);
    this.closeUp.heard(state);
    this.outlines.ask(state);
    for (const pane of this.panes) {
      if (!this.link.ready) pane.refresh();
      pane.mark();
    }
  }

  /**
   * The path as its spline runs; nothing of it while there is none.
   * @param {ViewModel} state
   */
  updateCurve({ curve }) {
    const points = curve?.points ?? [];
    const key = JSON.stringify(points);
    if (key === this.curveKey) return;
    this.curveKey = key;
    const before = this.frames;
    this.frames = framesOf(points);
    if (!this.frames) return;
    this.along = before ? Math.min(this.along, this.frames.length) : this.frames.nearest(this.crosshair.place ?? this.middle);
    this.panes[3].refresh();
  }

  /**
   * The view across the path goes where the tool is shown.
   * @param {ViewModel} state
   */
  followTool({ corridor }) {
    const shown = corridor?.shown_mm ?? null;
    if (shown === this.shownTool || !this.frames) return;
    this.shownTool = shown;
    if (shown === null) return;
    this.along = Math.min(this.frames.length, shown);
    this.panes[3].refresh();
  }

  /** The voxels have come nearer, are there, or did not come. */
  linked() {
    this.outlines.ask(this.state);
    for (const pane of this.panes) pane.refresh();
  }

  unanswered() {
    this.crosshair.forget();
    this.greys.forget();
    this.link.again();
    for (const pane of this.panes) pane.loader.again();
  }

  mark() {
    for (const pane of this.panes) pane.mark();
  }

  /** A run is replayed: the slices follow its tip. */
  replayed() {
    this.tip.at(this.state ? replay.tip : undefined);
    this.plan(() => this.mark());
  }

  // -- what the panes ask

  /** The middle of the scan, LPS mm. @returns {Triple} */
  get middle() {
    const [low, high] = this.crosshair.bounds;
    if (!Number.isFinite(low[0])) return [0, 0, 0];
    return [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2];
  }

  /**
   * Width and height of the scan in a view, mm.
   * @param {Axes} axes
   */
  extent({ u, v }) {
    const [low, high] = this.crosshair.bounds;
    return [u, v].map((way) => way.reduce((sum, part, axis) => sum + Math.abs(part) * (high[axis] - low[axis]), 0));
  }

  /**
   * Whether a place is within the box of the scan.
   * @param {Triple} place
   */
  holds(place) {
    const [low, high] = this.crosshair.bounds;
    return place.every((value, axis) => value >= low[axis] - 1e-6 && value <= high[axis] + 1e-6);
  }

  get frame() {
    return this.frames?.at(this.along) ?? null;
  }

  /** The tool as it is driven; else as the dry run brings it to the place of the view across the path. None while a run is replayed. */
  get pose() {
    const { step, tool, rehearsal } = this.state ?? {};
    if (replay.tools.length) return null;
    if (step?.input !== "drive") return this.poses.at(this.along);
    if (!tool?.segments.length || !tool.radii_mm) return null;
    const segments = /** @type {[Triple, Triple][]} */ (tool.segments);
    return { segments, radii: tool.radii_mm, margin: rehearsal?.margin_mm ?? 0 };
  }

  /** What a press means: the newest state of the head that is drawn, which a frame may not have shown yet. */
  get newest() {
    const { state } = this.connection;
    return this.state && state?.case?.id === this.state.case.id ? state : this.state;
  }

  /** Whether a click adds something to the plan. */
  get adds() {
    const { plan, regions, step } = this.newest ?? {};
    return Boolean(step?.input === "edit" && plan && !plan.locked && (plan.add_mode !== "none" || regions?.drawing));
  }

  /** Whether Escape takes back what a click has begun, before it ends anything of the slices. */
  get halfDone() {
    const { plan, regions, shaft, step } = this.newest ?? {};
    return step?.input === "edit" && Boolean(plan?.ghost || regions?.drawing || shaft?.aiming);
  }

  // -- what pointer and keys do

  /** @param {Tool} tool */
  choose(tool) {
    this.measures.cancel();
    this.tool = tool;
    paintBrush.set({ held: tool === "paint" });
    this.root.dataset.hand = tool;
    this.strip.update();
    this.tell("");
    this.sayHint();
  }

  /** @param {Triple} place */
  measure(place) {
    if (this.tool === "distance" || this.tool === "angle") this.measures.add(this.tool, place);
  }

  /** What Escape ends in the slices; returns whether there was something. */
  escape() {
    if (this.measures.cancel()) return true;
    if (this.tool !== "cross") {
      this.choose("cross");
      return true;
    }
    if (!this.layout) return false;
    this.enlarge(null);
    return true;
  }

  /**
   * Ask the layout to let one slice fill the viewing area, or, with null, to show several again.
   * @param {ViewName | null} name
   */
  enlarge(name) {
    if (name === this.layout || (name === "path" && !this.frames)) return;
    window.dispatchEvent(new CustomEvent(ENLARGE, { detail: name }));
  }

  /**
   * The layout has changed.
   * @param {string} layout
   */
  laidOut(layout) {
    const name = VIEWS.find((view) => view === layout) ?? null;
    if (name === this.layout) return;
    this.layout = name;
    for (const pane of this.panes) pane.large.setAttribute("aria-pressed", String(pane.name === name));
    this.panes[name ? VIEWS.indexOf(name) : 0].element.append(this.strip.element); // upon the first one in sight
    if (name) this.panes[VIEWS.indexOf(name)].stage.focus({ preventScroll: true });
  }

  /**
   * The view across the path goes to an arc length, and the crosshair with it.
   * @param {number} s mm
   */
  goAlong(s) {
    if (!this.frames) return;
    this.along = Math.min(this.frames.length, Math.max(0, s));
    this.crosshair.move(this.frames.at(this.along).place);
    for (const pane of this.panes) if (pane.name !== "path") pane.follow();
  }

  /** @param {number} zoom */
  zoomAll(zoom) {
    for (const pane of this.panes) pane.zoomTo(zoom);
    this.zoomed(zoom);
  }

  /** @param {number} zoom of the pane that was zoomed last */
  zoomed(zoom) {
    this.strip.menu.zoom = zoom;
    this.strip.update();
  }

  centreAll() {
    for (const pane of this.panes) if (pane.name !== "path") pane.centre(this.crosshair.place ?? this.middle);
  }

  /** @param {boolean} on */
  outline(on) {
    this.outlines.on = on;
    this.outlines.ask(this.state);
    for (const pane of this.panes) pane.refresh();
  }

  /** @param {string} words of what a key or press did; '' once they are old */
  tell(words) {
    this.said.textContent = words;
    this.hint.hidden = words !== "";
  }

  /** While nothing else is said: why the second volume is not shown, or what the mouse does. */
  sayHint() {
    const { caution } = this.second;
    this.hint.classList.toggle("caution", caution !== "");
    const words = caution || toolHint(this);
    if (this.hint.textContent !== words) this.hint.textContent = words;
  }
}

/**
 * @param {ViewModel} state
 * @returns {state is StateWithSlices}
 */
function hasSlices(state) {
  return Boolean(state.case?.has_volume && state.slices);
}

/** @param {Triple[]} points */
function framesOf(points) {
  try {
    return new PathFrames(points);
  } catch {
    return null; // fewer than two places
  }
}
