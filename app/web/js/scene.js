// The three-dimensional scene in its frame: tools on top of it, scale, legend, and the hand on the grip.
import { byId, h, whenChanged } from "./dom.js";
import { fixed } from "./format.js";
import { pacing } from "./frame-pacing.js";
import { JobLine } from "./job-line.js";
import { jobWatch } from "./jobs.js";
import { LET_GO, letGoOfEverything } from "./keys.js";
import { LAID_OUT } from "./layout.js";
import { letterOf } from "./letters.js";
import { SceneLayer } from "./scene-layer/layer.js";
import { THEMED } from "./theme.js";

/** @import { Connection } from "./connection.js" */
/** @import { Keys } from "./keys.js" */
/** @import { Commands, JobPublic, ScaleView, SkinSection, ViewModel } from "./types.js" */

/** @typedef {Commands["view.set"]} Look */

/** @type {[Commands["view.camera"]["view"], string][]} */
const VIEWS = [["anterior", "Front"], ["left", "Left"], ["right", "Right"], ["superior", "Top"], ["oblique", "Oblique"], ["nose", "Nose"]];
const CUTS = [["whole", "Whole head"], ["left", "Left half cut away"], ["right", "Right half cut away"]];
const SLICES = [["none", "No slices"], ["sagittal", "Sagittal CT"], ["coronal", "Coronal CT"], ["axial", "Axial CT"], ["all", "All three"]];
/** Somebody has pressed in the scene. */
export const TOUCHED = "vfix:scene-touched";

const SOFTWARE_RESOLUTION = 0.6;
const SCALES_MM = [1, 2, 5, 10, 20, 50, 100, 200];

export class SceneFrame {
  /**
   * @param {Connection} connection
   * @param {Keys} keys
   */
  constructor(connection, keys) {
    this.connection = connection;
    this.keys = keys;
    this.frame = /** @type {HTMLIFrameElement} */ (byId("scene"));
    this.wait = byId("scene-wait");
    this.waitWords = byId("scene-wait-words");
    this.isClosed = false;
    this.changedLegend = whenChanged();
    this.holding = false;
    this.opacityWords = h("span", { class: "number" });
    this.opacity = h("input", { type: "range", min: 10, max: 100, step: 5, "aria-label": "Opacity of the bone in percent", oninput: () => this.sendOpacity() });
    this.skin = h("input", { type: "checkbox", id: "skin", onchange: () => this.sendSkin() });
    this.skinShare = h("span", { class: "number" });
    this.skinOpacity = h("input", { type: "range", id: "skin-opacity", min: 10, max: 100, step: 5, "aria-label": "Opacity of the skin in percent", oninput: () => this.sendSkinOpacity() });
    this.skinWords = h("p", { class: "words caution", role: "status" });
    this.skinJob = new JobLine();
    this.skinField = h("div", { class: "field", id: "skin-field" },
      h("label", { class: "check" }, this.skin, "Skin", this.skinShare), this.skinOpacity, this.skinJob.element, this.skinWords);
    this.cut = h("select", { "aria-label": "Cut-away", id: "cut", onchange: () => this.sendCut() },
      CUTS.map(([value, label]) => h("option", { value }, label)));
    this.slices = h("select", { "aria-label": "CT slices in the scene", id: "slices-in-scene", onchange: () => this.sendSlices() },
      SLICES.map(([value, label]) => h("option", { value }, label)));
    /** @type {CSSStyleSheet | null} of the page within the frame */
    this.sheet = null;
    /** @type {SceneLayer | null} */
    this.layer = null;
    /** @type {boolean | null} whether the scene is being drawn */
    this.drawn = null;
    this.showTools();
    this.frame.addEventListener("load", () => this.loaded());
    jobWatch.addEventListener("change", () => this.followSkin());
    window.addEventListener(THEMED, () => this.colour());
    window.addEventListener(LAID_OUT, () => this.drawIfSeen());
    new ResizeObserver(() => this.drawIfSeen()).observe(this.frame);
    window.addEventListener(LET_GO, () => this.pointerGone());
    pacing.addEventListener("scale", () => this.layer?.hooks.resolve(pacing.scale));
  }

  showTools() {
    const views = h("div", { class: "tool-strip views", role: "group", "aria-label": "Standard views" }, VIEWS.map(([view, label]) =>
      h("button", { type: "button", "data-view": view, onclick: () => this.look(view) }, label)));
    const look = h("div", { class: "tool-strip column", id: "look" },
      h("label", { class: "field" }, h("span", { class: "field-label" }, "Bone", this.opacityWords), this.opacity), this.skinField, this.cut, this.slices);
    /** @type {HTMLButtonElement} */
    const toggle = h("button", {
      type: "button", id: "look-toggle", "aria-expanded": "false", "aria-controls": "look",
      onclick: () => toggle.setAttribute("aria-expanded", String(look.classList.toggle("open"))),
    }, "Bone, skin, cut");
    views.append(toggle);
    byId("view-tools").append(views, look);
  }

  /** The standard views and the cuts, for the palette. */
  actions() {
    const { connection } = this;
    const views = VIEWS.map(([view, label]) => ({ group: "Scene", name: `${label} view`, run: () => this.look(view) }));
    const cuts = CUTS.map(([value, name]) => ({ group: "Scene", name, run: () => { this.cut.value = value; this.sendCut(); } }));
    const skin = this.skinField.hidden ? [] : [{ group: "Scene", name: this.skin.checked ? "Hide the skin" : "Show the skin", run: () => this.skin.click() }];
    return connection.state.case ? [...views, ...cuts, ...skin] : [];
  }

  sendOpacity() {
    this.opacityWords.textContent = `${this.opacity.value} %`;
    this.connection.send("view.set", { opacity: Number(this.opacity.value) / 100 });
  }

  sendSkin() {
    this.connection.send("view.set", { skin: this.skin.checked });
  }

  sendSkinOpacity() {
    this.skinShare.textContent = `${this.skinOpacity.value} %`;
    this.connection.send("view.set", { skin_opacity: Number(this.skinOpacity.value) / 100 });
  }

  /** The skin of the open head is made once, when it is first shown. */
  async followSkin() {
    const job = jobWatch.items.find(({ kind, case_id: id }) => kind === "skin" && id === this.connection.state.case?.id);
    if (!job || job.id === this.skinJob.job) return;
    try {
      await this.skinJob.follow(/** @type {JobPublic} */ (job));
    } catch {
      // the section says why it could not be made
    }
  }

  /** @param {SkinSection} skin */
  showSkin({ possible, shown, opacity, words }) {
    this.skinField.hidden = !possible;
    this.skin.checked = shown;
    this.skinOpacity.hidden = !shown;
    if (document.activeElement !== this.skinOpacity) this.skinOpacity.value = String(Math.round(opacity * 100));
    this.skinShare.textContent = shown ? `${this.skinOpacity.value} %` : "";
    if (this.skinWords.textContent !== words) this.skinWords.textContent = words;
    this.skinWords.hidden = !words;
  }

  /** A cut shows the CT on its face, where there is one. */
  sendCut() {
    const cut = /** @type {Look["cut"]} */ (this.cut.value);
    this.connection.send("view.set", this.slices.hidden ? { cut } : { cut, slices: cut === "whole" ? "none" : "sagittal" });
  }

  sendSlices() {
    this.connection.send("view.set", { slices: /** @type {Look["slices"]} */ (this.slices.value) });
  }

  /** (Re)load the scene: a new frame has no state, the planner draws it again. */
  open() {
    this.wait.hidden = false;
    this.isClosed = false;
    this.undress();
    const { tab } = this.connection;
    const resolution = drawsInSoftware() ? `&fixedDpr=${SOFTWARE_RESOLUTION}` : "";
    this.frame.src = `/scene/?tab=${tab}${resolution}`;
  }

  /** Without a session there is no scene: its viewer must not try to reconnect. */
  close() {
    this.isClosed = true;
    this.undress();
    this.wait.hidden = false;
    this.waitWords.textContent = "No scene without a connection.";
    this.frame.src = "about:blank";
  }

  loaded() {
    const inner = /** @type {(Window & typeof globalThis) | null} */ (this.frame.contentWindow);
    if (!inner || inner.location.href === "about:blank") return;
    pacing.adopt(inner);
    this.dress(inner);
    this.reach(inner);
    // capture: before the viewer sees the event, so that keys mean the same here as in the page around
    inner.addEventListener("keydown", (event) => this.keys.down(event), { capture: true });
    inner.addEventListener("keyup", (event) => this.keys.up(event), { capture: true });
    inner.addEventListener("pointerdown", (event) => this.pointerDown(event), { capture: true });
    for (const kind of ["pointerup", "pointercancel"]) inner.addEventListener(kind, () => this.pointerGone(), { capture: true });
    inner.addEventListener("blur", (event) => { if (event.target === inner) letGoOfEverything(); });
  }

  /**
   * The ground takes the page's colour.
   * @param {Window & typeof globalThis} inner
   */
  dress(inner) {
    this.sheet = new inner.CSSStyleSheet();
    inner.document.adoptedStyleSheets = [...inner.document.adoptedStyleSheets, this.sheet];
    this.colour();
  }

  /** The canvas is clear where nothing is drawn: the frame's ground shows, in the colour of the page's theme. */
  colour() {
    const ground = getComputedStyle(document.documentElement).getPropertyValue("--scene-ground").trim();
    this.sheet?.replaceSync(`html, body, canvas[data-engine] { background: ${ground} !important; }`);
  }

  /**
   * Add what viser has not; where its canvas cannot be reached, the scene goes on as viser draws it.
   * @param {Window} inner
   */
  async reach(inner) {
    try {
      const layer = await SceneLayer.attach(inner, byId("scene-labels"), () => this.frame.contentWindow === inner && !inner.closed && this.sheet !== null);
      if (!layer || this.frame.contentWindow !== inner) return;
      this.layer = layer;
      layer.hooks.resolve(pacing.scale);
      this.drawn = null;
      this.drawIfSeen();
      this.sayWhoWrites();
      this.update(this.connection.state);
    } catch (error) {
      console.error(error);
      this.sayWhoWrites();
    }
  }

  /**
   * Whether the page writes the words at places of the scene, or viser does. Said with each connection: the frame may
   * be there before the planner has answered, and a new session knows nothing of it.
   */
  sayWhoWrites() {
    if (this.connection.connected) this.connection.send("view.labels", { by_page: this.layer !== null });
  }

  undress() {
    this.layer?.remove();
    this.layer = null;
    this.sheet = null;
  }

  /** A hidden frame continues to draw unless it is notified. */
  drawIfSeen() {
    const seen = this.frame.checkVisibility({ visibilityProperty: true }) && this.frame.clientHeight > 0;
    if (!this.layer || seen === this.drawn) return;
    this.drawn = seen;
    this.layer.hooks.draw(seen);
  }

  /** @param {Commands["view.camera"]["view"]} view */
  look(view) {
    this.layer?.turning.reset();
    this.connection.send("view.camera", { view });
  }

  /**
   * C brings what was clicked to the middle of the view.
   * @param {KeyboardEvent} event
   */
  key(event) {
    if (letterOf(event) !== "C" || event.ctrlKey || event.metaKey || event.altKey || event.repeat) return false;
    return Boolean(this.layer?.turning.centre());
  }

  /** @param {PointerEvent} event */
  pointerDown(event) {
    // the viewer prevents what a press would do from a listener that cannot, and each try is an error in the console
    event.preventDefault = () => {};
    window.dispatchEvent(new Event(TOUCHED));
    if (event.button !== 0) return;
    this.holding = true;
    this.keys.hold("pointer", true);
  }

  pointerGone() {
    if (!this.holding) return;
    this.holding = false;
    this.keys.hold("pointer", false);
    this.connection.send("grip.release");
  }

  /** @param {ViewModel} state */
  update(state) {
    if (!this.isClosed) {
      this.wait.hidden = Boolean(state.scene?.ready);
      this.waitWords.textContent = state.scene?.words ?? "Preparing the scene …";
    }
    const view = state.view;
    if (view) {
      if (document.activeElement !== this.opacity) this.opacity.value = String(Math.round(view.opacity * 100));
      this.opacityWords.textContent = `${this.opacity.value} %`;
      this.showSkin(view.skin);
      this.cut.value = view.cut;
      this.slices.value = view.slices;
      this.slices.hidden = !state.case?.has_volume;
    }
    this.layer?.update(state.labels, state.camera, state.view?.skin);
    this.changedLegend([state.corridor?.scale, state.step?.name, hasErrorBalls(state)], () => this.renderLegend(state.corridor?.scale, hasErrorBalls(state)));
    const height = state.camera?.view_height_mm;
    this.renderScale(state.scene?.ready && height ? height / this.frame.clientHeight : null);
  }

  /**
   * @param {ScaleView | null | undefined} scale
   * @param {boolean} balls whether targets have a ball of the registration's error
   */
  renderLegend(scale, balls) {
    const legend = byId("legend");
    legend.hidden = !scale && !balls;
    legend.replaceChildren(...scaleLegend(scale), ...(balls ? [h("div", { class: "legend-unknown" }, h("span", { class: "ball-swatch" }), "registration’s error, 95 %")] : []));
  }

  /** @param {number | null} perPixel mm */
  renderScale(perPixel) {
    const bar = byId("scale-bar");
    bar.hidden = perPixel === null || !Number.isFinite(perPixel);
    if (perPixel === null || bar.hidden) return;
    const length = SCALES_MM.find((value) => value / perPixel >= 60) ?? SCALES_MM[SCALES_MM.length - 1];
    byId("scale-line").style.width = `${Math.round(length / perPixel)}px`;
    byId("scale-words").textContent = `${length} mm at the centre of the view`;
  }
}

/**
 * Whether the scene has balls about the targets, of what the registration may be off by.
 * @param {ViewModel} state
 */
export function hasErrorBalls({ step, plan_use: use, registration }) {
  if (step?.name === "register") return Boolean(registration?.errors.rows.some((row) => row.s_mm === null));
  return step?.name === "plan" && Boolean(use?.has_balls);
}

/** @param {ScaleView | null | undefined} scale */
function scaleLegend(scale) {
  if (!scale) return [];
  const span = scale.hi - scale.lo;
  const bar = h("div", { class: "legend-bar" });
  bar.style.background = `linear-gradient(to right, ${scale.colours.join(", ")})`;
  const margin = h("div", { class: "legend-margin", title: "Margin" });
  margin.style.left = `${((scale.margin - scale.lo) / span) * 100}%`;
  bar.append(margin);
  const ticks = h("div", { class: "legend-ticks" }, [scale.lo, (scale.lo + scale.hi) / 2, scale.hi].map((value, index) => {
    const tick = h("span", {}, index === 2 ? `≥ ${fixed(value, 1)}` : fixed(value, 1));
    tick.style.left = `${((value - scale.lo) / span) * 100}%`;
    return tick;
  }));
  const title = h("div", { class: "legend-title" }, `Bone clearance, mm; line: margin ${fixed(scale.margin, 2)}`);
  const named = (/** @type {string} */ colour, /** @type {string} */ words) => {
    const swatch = h("span", { class: "legend-swatch" });
    swatch.style.background = colour;
    return h("div", { class: "legend-unknown" }, swatch, words);
  };
  const unreached = scale.unknown ? [named(scale.unknown, "not reached by the tool")] : [];
  return [title, bar, ticks, named(scale.blocked, "blocked or pierced"), ...unreached];
}

/** Without a graphics card every pixel costs; a coarser picture that follows the hand is the better one then. */
function drawsInSoftware() {
  const gl = document.createElement("canvas").getContext("webgl");
  const info = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = info ? gl?.getParameter(info.UNMASKED_RENDERER_WEBGL) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}
