// The three-dimensional scene in its frame: tools on top of it, scale, legend, and the hand on the grip.
import { byId, h, whenChanged } from "./dom.js";
import { fixed } from "./format.js";
import { pacing } from "./frame-pacing.js";
import { drawsInSoftware } from "./graphics.js";
import { LET_GO, letGoOfEverything } from "./keys.js";
import { LAID_OUT } from "./layout.js";
import { letterOf } from "./letters.js";
import { replay } from "./replay.js";
import { SceneLayer } from "./scene-layer/layer.js";
import { WindowSwitch } from "./scene-layer/tool-window.js";
import { ViewFollower } from "./scene-layer/view-follower.js";
import { THEMED } from "./theme.js";

/** @import { Connection } from "./connection.js" */
/** @import { Keys } from "./keys.js" */
/** @import { Commands, ScaleView, ViewModel } from "./types.js" */

/** Somebody has pressed in the scene. */
export const TOUCHED = "vfix:scene-touched";

const SOFTWARE_RESOLUTION = 0.6;
const STILL_MS = 400; // until a scene that rests has been drawn in its size
const REST_MS = 2000; // between two frames of it
const BRIEF_MS = 50; // a frame that takes longer would cost the hand its hold: the page has to say in time that it is awake
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
    this.software = drawsInSoftware();
    this.layout = "";
    this.follower = new ViewFollower();
    this.window = new WindowSwitch();
    this.rests = false; // without a graphics card, while the endoscope is large and the tool moves
    /** @type {number | undefined} until it rests */
    this.restTimer = undefined;
    this.still = /** @type {HTMLCanvasElement} */ (byId("scene-still"));
    /** @type {ReturnType<typeof setInterval> | undefined} */
    this.pulse = undefined;
    this.changedLegend = whenChanged();
    this.holding = false;
    /** @type {CSSStyleSheet | null} of the page within the frame */
    this.sheet = null;
    /** @type {SceneLayer | null} */
    this.layer = null;
    /** @type {boolean | null} whether the scene is being drawn */
    this.drawn = null;
    this.frame.addEventListener("load", () => this.loaded());
    this.window.addEventListener("change", () => this.update(this.connection.state));
    window.addEventListener(THEMED, () => this.colour());
    window.addEventListener(LAID_OUT, (event) => {
      this.layout = /** @type {CustomEvent<string>} */ (event).detail;
      this.restIfMust(this.connection.state);
      this.drawIfSeen();
    });
    new ResizeObserver(() => {
      if (this.rests) this.drawOnce();
      this.drawIfSeen();
    }).observe(this.frame);
    window.addEventListener(LET_GO, () => this.pointerGone());
    pacing.addEventListener("scale", () => this.layer?.hooks.resolve(pacing.scale));
    replay.addEventListener("change", () => this.layer?.replayed.show(replay.tools));
    replay.addEventListener("laid", () => this.layer?.lay(replay));
  }

  /** (Re)load the scene: a new frame has no state, the planner draws it again. */
  open() {
    this.wait.hidden = false;
    this.isClosed = false;
    this.undress();
    const { tab } = this.connection;
    const resolution = this.software ? `&fixedDpr=${SOFTWARE_RESOLUTION}` : "";
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
      layer.replayed.show(replay.tools);
      layer.lay(replay);
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

  /** A scene that rests shows a copy of its last frame: its canvas is empty where the browser paints it anew. */
  drawOnce() {
    clearTimeout(this.restTimer);
    this.layer?.hooks.draw(true);
    this.drawn = true;
    this.restTimer = setTimeout(() => {
      this.restTimer = undefined;
      this.drawIfSeen();
    }, STILL_MS);
  }

  /** While a hand drives, only frames are drawn that are brief. */
  drawAgain() {
    const waits = pacing.held && (this.layer?.hooks.tookMs ?? Infinity) > BRIEF_MS;
    byId("scene-rests").textContent = waits ? "3D waits while you drive." : "3D is drawn every 2 s.";
    if (!waits) this.drawOnce();
  }

  /** A hidden frame continues to draw unless it is notified. */
  drawIfSeen() {
    if (this.restTimer !== undefined) return;
    const seen = !this.rests && this.frame.checkVisibility({ visibilityProperty: true }) && this.frame.clientHeight > 0;
    if (!this.layer || seen === this.drawn) return;
    this.drawn = seen;
    this.layer.hooks.draw(seen);
  }

  /**
   * One processor draws both pictures: what is not looked at gives way.
   * @param {ViewModel} state
   */
  restIfMust({ rehearsal, step, scene }) {
    const mayRest = this.software && (this.layout === "endoscope" || this.layout === "endoscope-alone") && step?.input === "drive";
    if (this.layer) this.layer.hooks.copied = mayRest && this.connection.connected && scene?.ready ? this.still : null; // one that comes anew is empty at first
    const rests = mayRest && rehearsal?.state === "running";
    if (rests === this.rests) return;
    this.rests = rests;
    byId("scene-rests").hidden = this.still.hidden = !rests;
    clearInterval(this.pulse);
    if (rests) this.pulse = setInterval(() => this.drawAgain(), REST_MS); // its last frame is there: who presses Start drives at once
    this.drawIfSeen();
  }

  /** @param {Commands["view.camera"]["view"]} view */
  look(view) {
    this.layer?.turning.reset();
    this.connection.send("view.camera", { view });
    if (this.rests) this.drawOnce();
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
    this.restIfMust(state);
    const tip = state.step?.name === "rehearse" ? state.rehearsal?.tip : undefined;
    this.follower.at(tip, this.layer?.turning, this.holding);
    this.layer?.window.show((this.window.on && tip) || null);
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
    legend.replaceChildren(...scaleLegend(scale), ...(balls ? [h("div", { class: "legend-unknown" }, h("span", { class: "ball-swatch" }), "registration error, 95 %")] : []));
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
