// How panel, scene and slices share the page: a layout by CSS grid areas, nothing is ever moved in the document.
import { barButton, byId, h } from "./dom.js";
import { letterOf } from "./letters.js";
import { keep, recall, recallText } from "./remember.js";

/**
 * endoscope: its picture large, scene and slices beside it; endoscope-beside: the scene large; endoscope-alone: nothing else.
 * @typedef {"one-three" | "two-by-two" | "endoscope" | "endoscope-beside" | "endoscope-alone" | "scene" | "axial" | "coronal" | "sagittal" | "path"} Layout
 */
/** @typedef {"panel" | "scene" | "slices"} Part */

/** A view asks to fill the viewing area, or, with null, to be one of several again; `detail` names it. */
export const ENLARGE = "vfix:enlarge";
/** The layout has changed; `detail` is its name. */
export const LAID_OUT = "vfix:layout";

/** @type {readonly Layout[]} layouts of several views that every step has */
const PLAIN = ["one-three", "two-by-two"];
/** @type {readonly Layout[]} */
const SEVERAL = [...PLAIN, "endoscope", "endoscope-beside"];
/** @type {readonly Layout[]} */
const REMEMBERED = [...SEVERAL, "endoscope-alone", "scene", "axial", "coronal", "sagittal"];
/** @type {[Layout, Parameters<typeof barButton>[0], string, string][]} its picture, word and tooltip */
const BUTTONS = [
  ["one-three", "layoutOneThree", "3D + slices", "3D beside the slices"],
  ["two-by-two", "layoutTwoByTwo", "Four views", "Four views of one size"],
  ["scene", "layoutOne", "3D only", "3D alone (4)"],
  ["path", "layoutPath", "Across path", "Across the path alone (5)"],
];
/** @type {Record<string, Layout | undefined>} */
const KEYS = { Digit1: "axial", Digit2: "coronal", Digit3: "sagittal", Digit4: "scene", Digit5: "path" };
/** @type {[Layout, string][]} views that fill the viewing area, for the palette */
const ALONE = [["axial", "Axial slice alone"], ["coronal", "Coronal slice alone"], ["sagittal", "Sagittal slice alone"], ["scene", "3D alone"], ["path", "View across the path alone"]];
/** @type {[Part, string][]} */
const PARTS = [["panel", "Panel"], ["scene", "3D"], ["slices", "Slices"]];
const LEAST_SLICES_PX = 212;
const LEAST_SCENE_PX = 320;
const STEP_PX = 24;

/**
 * The layout after a request: the same view again goes back to several.
 * @param {Layout} now
 * @param {Layout | null} request
 * @param {Layout} several the one that was shown last
 * @returns {Layout}
 */
export function next(now, request, several) {
  if (request === null) return several;
  return request === now && !SEVERAL.includes(request) ? several : request;
}

/**
 * What the endoscope's key and button ask for: its picture large, and then the other way round.
 * @param {Layout} now
 * @returns {Layout}
 */
export function endoscopeAfter(now) {
  return now === "endoscope" ? "endoscope-beside" : "endoscope";
}

export class Layouts {
  /** @param {HTMLElement} bench the viewing area; its `data-layout` is the one switch of the layout */
  constructor(bench) {
    this.bench = bench;
    this.first = false; // the step shows the endoscope large until another layout is chosen in it
    this.shared = /** @type {Layout} */ (recall("layout", REMEMBERED, "one-three"));
    this.ofFirst = /** @type {Layout} */ (recall("layout-first", REMEMBERED, "endoscope"));
    this.plain = /** @type {Layout} */ (recall("layout-several", PLAIN, "one-three")); // of several views, without the endoscope
    this.several = SEVERAL.includes(this.layout) ? this.layout : this.plain; // the one of several views that was shown last
    this.folded = recall("panel", ["folded", "open"], "open") === "folded";
    this.fixed = /** @type {Layout | null} */ (null); // the one that cannot be left now
    this.available = true; // whether there are slices to show
    this.sliced = true; // or may be, of such a case
    this.path = false; // and a view across a path
    this.endoscope = false; // whether the step has the picture of an endoscope
    this.buttons = BUTTONS.map(([layout, picture, word, title]) => barButton(picture, word, title, () => this.set(next(this.layout, layout, this.before)), { "data-layout-button": layout }));
    this.foldButton = barButton("panel", "Panel", "", () => this.fold(), { id: "fold-panel", "aria-controls": "panel" });
    this.endoscopeButton = barButton("endoscope", "Endoscope", "Endoscope large; again: beside 3D (E)", () => this.swapEndoscope(), { id: "endoscope-button" });
    byId("layouts").append(this.foldButton, ...this.buttons, this.endoscopeButton);
    this.partButtons = PARTS.map(([part, label]) => h("button", { type: "button", "data-part-button": part, onclick: () => this.showPart(part) }, label));
    byId("parts").append(...this.partButtons);
    this.splitter = byId("splitter");
    this.listen();
    this.width(Number(recallText("slices-width")) || 0);
    this.showPart("scene");
    this.render();
  }

  get layout() {
    return this.first ? this.ofFirst : this.shared;
  }

  set layout(layout) {
    if (this.first) this.ofFirst = layout;
    else this.shared = layout;
  }

  listen() {
    window.addEventListener(ENLARGE, (event) => this.set(next(this.layout, /** @type {CustomEvent<Layout | null>} */ (event).detail, this.before)));
    const { splitter } = this;
    splitter.addEventListener("pointerdown", (event) => {
      splitter.setPointerCapture(event.pointerId);
      this.bench.classList.add("splitting"); // the scene's frame would swallow the pointer
    });
    splitter.addEventListener("pointermove", (event) => {
      if (splitter.hasPointerCapture(event.pointerId)) this.width(this.bench.getBoundingClientRect().right - event.clientX);
    });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) splitter.addEventListener(end, () => this.bench.classList.remove("splitting"));
    splitter.addEventListener("dblclick", () => this.width(0));
    splitter.addEventListener("keydown", (event) => {
      const turn = { ArrowLeft: 1, ArrowRight: -1 }[event.key];
      if (turn) this.width(byId("slices").clientWidth + turn * STEP_PX);
    });
    new ResizeObserver(() => this.tellWidth()).observe(byId("slices"));
  }

  /**
   * Width of the slice column; 0 is what the page's width asks for.
   * @param {number} wide px
   */
  width(wide) {
    if (!Number.isFinite(wide) || wide <= 0) {
      this.bench.style.removeProperty("--slices-width");
      keep("slices-width", "");
      return;
    }
    const panel = this.folded ? 0 : byId("panel").clientWidth;
    const most = Math.max(LEAST_SLICES_PX, (this.bench.clientWidth || innerWidth) - panel - LEAST_SCENE_PX);
    const held = Math.round(Math.min(most, Math.max(LEAST_SLICES_PX, wide)));
    this.bench.style.setProperty("--slices-width", `${held}px`);
    keep("slices-width", String(held));
  }

  tellWidth() {
    this.splitter.setAttribute("aria-valuenow", String(Math.round(byId("slices").clientWidth)));
  }

  /** @param {Layout} layout */
  set(layout) {
    if (this.fixed) return;
    this.layout = layout;
    if (SEVERAL.includes(layout)) this.several = layout;
    if (PLAIN.includes(layout)) {
      this.plain = layout;
      keep("layout-several", layout);
    }
    keep(this.first ? "layout-first" : "layout", layout);
    this.render();
  }

  /**
   * Show a layout that cannot be left, such as during a trial of a study; null: the one from before again.
   * @param {Layout | null} layout
   */
  fix(layout) {
    if (layout === this.fixed) return;
    this.fixed = layout;
    this.render();
  }

  fold() {
    this.folded = !this.folded;
    keep("panel", this.folded ? "folded" : "open");
    this.render();
  }

  /**
   * On a phone one part is shown at a time.
   * @param {Part} part
   */
  showPart(part) {
    document.body.dataset.part = part;
    for (const button of this.partButtons) button.setAttribute("aria-pressed", String(button.dataset.partButton === part));
    this.say();
  }

  /**
   * A head without a CT has no slices: its scene gets their place.
   * @param {boolean} available
   * @param {boolean} path whether there is a path, to look across it
   * @param {"none" | "offered" | "first"} scope whether the step has the picture of an endoscope
   * @param {boolean} sliced whether such a case may have slices
   */
  offer(available, path, scope, sliced) {
    const [endoscope, first] = [scope !== "none", scope === "first"];
    if (available === this.available && path === this.path && endoscope === this.endoscope && first === this.first && sliced === this.sliced) return;
    Object.assign(this, { available, path, endoscope, first, sliced });
    this.render();
  }

  swapEndoscope() {
    this.set(endoscopeAfter(this.layout));
  }

  /** @param {Layout} layout */
  can(layout) {
    if (this.fixed) return layout === this.fixed;
    if (layout === "path") return this.available && this.path;
    if (layout.startsWith("endoscope")) return this.endoscope;
    return this.available || layout === "scene" || (layout === "one-three" && this.sliced);
  }

  /** The layout of several views that a single one goes back to. */
  get before() {
    if (this.first) return "endoscope";
    return this.can(this.several) ? this.several : this.plain;
  }

  render() {
    const shown = this.fixed ?? [this.layout, this.plain].find((layout) => this.can(layout)) ?? (this.sliced ? "one-three" : "scene");
    this.bench.dataset.layout = shown;
    this.bench.dataset.sliced = String(this.sliced);
    this.bench.dataset.panel = this.folded ? "folded" : "open";
    this.foldButton.setAttribute("aria-expanded", String(!this.folded));
    this.foldButton.title = `${this.folded ? "Show the panel" : "Fold the panel away"} (P)`;
    for (const button of this.buttons) {
      button.setAttribute("aria-pressed", String(button.dataset.layoutButton === shown));
      button.disabled = !this.can(/** @type {Layout} */ (button.dataset.layoutButton));
    }
    this.endoscopeButton.disabled = !this.endoscope || Boolean(this.fixed); // not hidden: what lies beside it would move
    this.endoscopeButton.setAttribute("aria-pressed", String(shown.startsWith("endoscope")));
    this.say();
  }

  say() {
    window.dispatchEvent(new CustomEvent(LAID_OUT, { detail: this.bench.dataset.layout }));
  }

  /** The views and layouts, for the palette. */
  actions() {
    const several = BUTTONS.filter(([layout]) => SEVERAL.includes(layout)).map(([layout, , name]) => ({ group: "View", name, off: this.can(layout) ? undefined : "no slices", run: () => this.set(layout) }));
    const alone = ALONE.map(([layout, name]) => ({ group: "View", name, does: `layout.${layout}`, off: this.can(layout) ? undefined : "nothing to show", run: () => this.set(next(this.layout, layout, this.before)) }));
    const endoscope = { group: "View", name: this.layout === "endoscope" ? "Endoscope beside 3D" : "Endoscope large", does: "layout.endoscope", off: this.fixed ? "fixed by the trial" : this.endoscope ? undefined : "in a drive or Review", run: () => this.swapEndoscope() };
    return [...several, ...alone, endoscope, { group: "View", name: this.folded ? "Show the panel" : "Fold the panel away", does: "panel", run: () => this.fold() }];
  }

  /**
   * Whether a key means a layout; it is done then.
   * @param {KeyboardEvent} event
   */
  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.shiftKey || event.repeat) return false;
    const request = KEYS[event.code];
    if (letterOf(event) === "P") this.fold();
    else if (letterOf(event) === "E" && this.endoscope) this.swapEndoscope();
    else if (request && this.can(request)) this.set(next(this.layout, request, this.before));
    else return false;
    return true;
  }
}
