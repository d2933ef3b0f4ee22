// Clearance along the path: clearance to bone and to each structure to spare, and depth in soft tissue over arc length, and the tool at one place of it.
import { h, svg, whenChanged } from "/static/js/dom.js";
import { colourOf, curveWords, placeWords } from "/static/js/clearance-words.js";
import { isOld } from "/static/js/verdict-card.js";
import { fixed } from "/static/js/format.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { ClearanceProfile, EvaluationSection, ObstacleCurve, ScaleView, VerdictView } from "/static/js/types.js" */

const WIDTH = 320, HEIGHT = 132; // of the drawing's own units; it is as wide as the panel
const LEFT = 26, RIGHT = 6, TOP = 8, BOTTOM = 22;
const STEP_MM = 0.5; // of the scrubber
const TONES = 4; // colours of the curves of structures to spare
const TICKS = [5, 10, 20, 50, 100, 200]; // mm, between labels of the arc length

export class ClearanceGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.changedPlace = whenChanged();
    this.drawing = svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: "profile", role: "img" });
    this.cursor = svg("line", { class: "profile-cursor", y1: TOP, y2: HEIGHT - BOTTOM });
    /** @type {HTMLInputElement} */
    this.slider = h("input", {
      type: "range", id: "profile-place", min: "0", step: String(STEP_MM), "aria-label": "Place of the tool along the path",
      oninput: () => { this.show(this.slider.valueAsNumber); },
    });
    this.reading = h("p", { class: "words", id: "profile-reading" });
    this.hide = h("button", { type: "button", class: "plain", id: "profile-hide", onclick: () => connection.send("clearance.hide") }, "Hide the tool");
    this.keys = h("ul", { class: "words profile-keys", "aria-label": "Lines of the plot" });
    this.key = h("p", { class: "words profile-key" });
    this.element = h("div", { class: "fields", id: "profile", hidden: true }, this.drawing, this.slider, h("div", { class: "profile-line" }, this.reading, this.hide), this.keys, this.key);
    this.drawing.addEventListener("pointerdown", (event) => this.pointed(event));
    this.drawing.addEventListener("pointermove", (event) => { if (event.buttons & 1) this.pointed(event); });
    /** @type {VerdictView | null} */
    this.verdict = null;
    this.old = false;
  }

  /** @param {number} s arc length, mm */
  show(s) {
    if (!this.old) this.connection.send("clearance.show", { s_mm: s });
  }

  /** @param {PointerEvent} event */
  pointed(event) {
    if (!this.verdict) return;
    const box = this.drawing.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * WIDTH;
    const share = (x - LEFT) / (WIDTH - LEFT - RIGHT);
    this.show(Math.min(Math.max(share, 0), 1) * this.verdict.length_mm);
  }

  /** @param {EvaluationSection | undefined} corridor */
  update(corridor) {
    const verdict = corridor?.verdict ?? null;
    this.old = isOld(corridor);
    this.element.classList.toggle("stale", this.old);
    this.changed([verdict, corridor?.scale], () => {
      this.verdict = verdict;
      this.element.hidden = !verdict || !corridor?.scale;
      if (verdict && corridor?.scale) this.draw(verdict, corridor.scale);
    });
    this.changedPlace([verdict, corridor?.shown_mm, this.old], () => this.place(verdict, corridor?.shown_mm ?? null));
  }

  /**
   * @param {VerdictView} verdict
   * @param {ScaleView} scale
   */
  draw(verdict, scale) {
    const { profile, length_mm: length } = verdict;
    const depths = profile.tissue_depth_mm ?? [];
    const margins = profile.curves.map(({ margin_mm: margin }) => margin);
    const top = Math.ceil(Math.max(scale.hi, ...depths, ...margins));
    const x = (/** @type {number} */ s) => LEFT + (s / length) * (WIDTH - LEFT - RIGHT);
    const y = (/** @type {number} */ value) => HEIGHT - BOTTOM - (Math.min(Math.max(value, 0), top) / top) * (HEIGHT - TOP - BOTTOM);
    this.drawing.replaceChildren(...axes(length, top, x, y), tissueArea(profile, x, y), registrationBand(profile, verdict.nearest_curve, x, y),
      ...profile.curves.map(({ margin_mm: margin }, index) => svg("line", { x1: LEFT, x2: WIDTH - RIGHT, y1: y(margin), y2: y(margin), class: `profile-margin ${tone(index)}` })),
      ...profile.curves.slice(1).map((curve, index) => outline(profile, curve, x, y, `profile-curve ${tone(index + 1)}`)),
      outline(profile, profile.curves[0], x, y, "profile-outline"), // the middle of the scale is almost white
      ...coloured(profile, scale, x, y), this.cursor);
    this.drawing.setAttribute("aria-label", `Clearance to ${profile.curves.map(({ name }) => name).join(", ")} over ${fixed(length, 0)} mm of path`);
    this.slider.max = String(Math.floor(length / STEP_MM) * STEP_MM);
    this.keys.replaceChildren(...profile.curves.map((curve, index) => h("li", {}, h("span", { class: `profile-swatch ${tone(index)}` }), curveWords(curve, index))));
    const tissue = profile.tissue_depth_mm ? " Grey area: depth in soft tissue." : "";
    const band = profile.registration_mm ? ` Band about ${verdict.nearest}: registration error, 95 %; tool and tracking errors come on top.` : "";
    this.key.textContent = `Lines: clearance of the whole tool, mm.${tissue}${band}`;
  }

  /**
   * @param {VerdictView | null} verdict
   * @param {number | null} s
   */
  place(verdict, s) {
    this.cursor.style.display = verdict && s !== null && !this.old ? "" : "none";
    this.hide.hidden = s === null;
    if (!verdict) return;
    if (s === null || this.old) {
      this.reading.textContent = this.old ? "Greyed until the path is judged." : "Move along the path to show the tool there.";
      this.slider.setAttribute("aria-valuetext", "no place chosen");
      return;
    }
    const at = LEFT + (s / verdict.length_mm) * (WIDTH - LEFT - RIGHT);
    this.cursor.setAttribute("x1", String(at));
    this.cursor.setAttribute("x2", String(at));
    if (document.activeElement !== this.slider) this.slider.value = String(s);
    this.reading.textContent = placeWords(verdict, s);
    this.slider.setAttribute("aria-valuetext", this.reading.textContent);
  }
}

/**
 * @param {ClearanceProfile} profile
 * @param {(s: number) => number} x
 * @param {(value: number) => number} y
 */
function tissueArea(profile, x, y) {
  const depths = profile.tissue_depth_mm;
  if (!depths) return svg("g");
  const points = profile.s_mm.map((s, index) => `${x(s)},${y(depths[index])}`);
  const ends = [x(profile.s_mm[0]), x(profile.s_mm[profile.s_mm.length - 1])];
  return svg("polygon", { points: `${ends[0]},${y(0)} ${points.join(" ")} ${ends[1]},${y(0)}`, class: "profile-tissue" });
}

/**
 * Class of the colour of a curve; of structures to spare it comes again after a few.
 * @param {number} index 0 is bone
 */
function tone(index) {
  return index ? `tone-${(index - 1) % TONES + 1}` : "tone-bone";
}

/**
 * @param {ClearanceProfile} profile
 * @param {ObstacleCurve} curve
 * @param {(s: number) => number} x
 * @param {(value: number) => number} y
 * @param {string} className
 */
function outline(profile, curve, x, y, className) {
  return svg("polyline", { points: profile.s_mm.map((s, index) => `${x(s)},${y(curve.clearance_mm[index])}`).join(" "), class: className });
}

/**
 * Bone's curve in the colours of the path.
 * @param {ClearanceProfile} profile
 * @param {ScaleView} scale
 * @param {(s: number) => number} x
 * @param {(value: number) => number} y
 */
function coloured({ s_mm: at, curves }, scale, x, y) {
  const clearance = curves[0].clearance_mm;
  return at.slice(1).map((s, index) => {
    const stroke = colourOf(Math.min(clearance[index], clearance[index + 1]), scale);
    return svg("line", { x1: x(at[index]), y1: y(clearance[index]), x2: x(s), y2: y(clearance[index + 1]), class: "profile-bone", stroke });
  });
}

/**
 * The clearance to what is nearest to its margin, less and plus the registration's error.
 * @param {ClearanceProfile} profile
 * @param {number} nearest its curve
 * @param {(s: number) => number} x
 * @param {(value: number) => number} y
 */
function registrationBand(profile, nearest, x, y) {
  const off = profile.registration_mm;
  if (!off) return svg("g");
  const { clearance_mm: clearance } = profile.curves[nearest];
  const edge = (/** @type {number} */ sign) => profile.s_mm.map((s, index) => `${x(s)},${y(clearance[index] + sign * off[index])}`);
  return svg("polygon", { points: [...edge(1), ...edge(-1).reverse()].join(" "), class: "profile-registration" });
}

/**
 * @param {number} length
 * @param {number} top
 * @param {(s: number) => number} x
 * @param {(value: number) => number} y
 */
function axes(length, top, x, y) {
  const step = TICKS.find((value) => length / value <= 6) ?? length;
  const label = (/** @type {number} */ at, /** @type {number} */ row, /** @type {string} */ words, /** @type {string} */ anchor) => {
    const text = svg("text", { x: at, y: row, class: "profile-label", "text-anchor": anchor });
    text.textContent = words;
    return text;
  };
  /** @type {SVGElement[]} */
  const marks = [svg("line", { x1: LEFT, x2: WIDTH - RIGHT, y1: y(0), y2: y(0), class: "profile-axis" })];
  for (let s = 0; s <= length; s += step) marks.push(label(x(s), HEIGHT - 8, fixed(s, 0), "middle"));
  for (const value of [0, top / 2, top]) marks.push(label(LEFT - 5, y(value) + 3, fixed(value, Number.isInteger(value) ? 0 : 1), "end"));
  marks.push(label(WIDTH - RIGHT, TOP + 4, "over mm of path", "end"));
  return marks;
}
