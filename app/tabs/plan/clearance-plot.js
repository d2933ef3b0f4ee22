// The plot of clearance over the length of the path: a picture of a dry run, without state.
import { colourOf, deepestOf, topOf } from "/static/js/clearance-words.js";
import { fixed } from "/static/js/format.js";
import { html, nothing, svg } from "/static/js/template.js";

/** @import { ClearanceProfile, ScaleView, VerdictView } from "/static/js/types.js" */

const WIDTH = 320, HEIGHT = 132; // of the drawing's own units; it is as wide as the panel
const LEFT = 28, RIGHT = 26, TOP = 8, BOTTOM = 22;
const TICKS = [5, 10, 20, 50, 100, 200]; // mm, between labels of the arc length

/**
 * @typedef {{ profile: ClearanceProfile, scale: ScaleView, top: number, deepest: number, x: (s: number) => number, y: (mm: number, top?: number) => number }} Plot
 *   top: where clearances are cut, mm. deepest: the end of the axis of depths on the right, mm; 0 without one
 */

/**
 * Curves of the whole tool's clearance to bone and to each protected structure, and the cursor at one place.
 * @param {VerdictView} verdict
 * @param {ScaleView} scale
 * @param {string[]} colours of the curves; bone's first, which is drawn in those of the scale
 * @param {number | null} shown arc length of the cursor, mm
 * @param {(event: PointerEvent) => void} pointed a press or drag upon the plot
 */
export function clearancePlot({ profile, length_mm: length, nearest_curve: nearest }, scale, colours, shown, pointed) {
  const top = topOf(profile);
  /** @type {Plot} */
  const plot = {
    profile, scale, top, deepest: deepestOf(profile),
    x: (s) => LEFT + (s / length) * (WIDTH - LEFT - RIGHT),
    y: (mm, end = top) => HEIGHT - BOTTOM - (Math.min(Math.max(mm, 0), end) / end) * (HEIGHT - TOP - BOTTOM),
  };
  const names = profile.curves.map(({ name }) => name).join(", ");
  return html`<svg viewBox="0 0 ${WIDTH} ${HEIGHT}" class="profile" role="img" aria-label="Clearance to ${names} over ${fixed(length, 0)} mm of path"
    @pointerdown=${pointed} @pointermove=${(/** @type {PointerEvent} */ event) => { if (event.buttons & 1) pointed(event); }}>
    ${axes(plot, length)}${tissueArea(plot)}${registrationBand(plot, nearest)}
    ${profile.curves.map(({ margin_mm: margin }, index) => svg`<line class="profile-margin" x1=${LEFT} x2=${WIDTH - RIGHT} y1=${plot.y(margin)} y2=${plot.y(margin)} stroke=${colours[index]}></line>`)}
    ${profile.curves.slice(1).map((curve, index) => svg`<polyline class="profile-curve" points=${line(plot, curve.clearance_mm)} stroke=${colours[index + 1]}></polyline>`)}
    <polyline class="profile-outline" points=${line(plot, profile.curves[0].clearance_mm)}></polyline>
    ${coloured(plot)}
    ${shown === null ? nothing : svg`<line class="profile-cursor" x1=${plot.x(shown)} x2=${plot.x(shown)} y1=${TOP} y2=${HEIGHT - BOTTOM}></line>`}
  </svg>`;
}

/**
 * The arc length under the pointer.
 * @param {PointerEvent} event upon the plot
 * @param {number} length of the path, mm
 */
export function placeUnder({ currentTarget, clientX }, length) {
  const box = /** @type {Element} */ (currentTarget).getBoundingClientRect();
  const share = (((clientX - box.left) / box.width) * WIDTH - LEFT) / (WIDTH - LEFT - RIGHT);
  return Math.min(Math.max(share, 0), 1) * length;
}

/**
 * @param {Plot} plot
 * @param {number[]} values mm, one for each place of the profile
 */
function line({ profile, x, y }, values) {
  return profile.s_mm.map((s, index) => `${x(s)},${y(values[index])}`).join(" ");
}

/** @param {Plot} plot */
function tissueArea({ profile: { s_mm: at, tissue_depth_mm: depths }, deepest, x, y }) {
  if (!depths || !deepest) return nothing;
  const base = y(0), edge = at.map((s, index) => `${x(s)},${y(depths[index], deepest)}`).join(" ");
  return svg`<polygon class="profile-tissue" points="${x(at[0])},${base} ${edge} ${x(at[at.length - 1])},${base}"></polygon>`;
}

/**
 * The clearance to what is nearest to its margin, less and plus the registration's error.
 * @param {Plot} plot
 * @param {number} nearest its curve
 */
function registrationBand({ profile, x, y }, nearest) {
  const off = profile.registration_mm;
  if (!off) return nothing;
  const { clearance_mm: clearance } = profile.curves[nearest];
  const edge = (/** @type {number} */ sign) => profile.s_mm.map((s, index) => `${x(s)},${y(clearance[index] + sign * off[index])}`);
  return svg`<polygon class="profile-registration" points=${[...edge(1), ...edge(-1).reverse()].join(" ")}></polygon>`;
}

/**
 * Bone's curve in the colours of the path, over an outline: the middle of that scale is almost white.
 * @param {Plot} plot
 */
function coloured({ profile: { s_mm: at, curves }, scale, x, y }) {
  const clearance = curves[0].clearance_mm;
  return at.slice(1).map((s, index) => svg`<line class="profile-bone" x1=${x(at[index])} y1=${y(clearance[index])} x2=${x(s)} y2=${y(clearance[index + 1])}
    stroke=${colourOf(Math.min(clearance[index], clearance[index + 1]), scale)}></line>`);
}

/**
 * @param {Plot} plot
 * @param {number} length of the path, mm
 */
function axes({ top, deepest, x, y }, length) {
  const step = TICKS.find((value) => length / value <= 6) ?? length;
  const along = [...Array(Math.floor(length / step) + 1).keys()].map((tick) => tick * step);
  const label = (/** @type {number} */ at, /** @type {number} */ row, /** @type {string} */ anchor, /** @type {string} */ words) => svg`<text class="profile-label" x=${at} y=${row} text-anchor=${anchor}>${words}</text>`;
  const number = (/** @type {number} */ mm) => fixed(mm, Number.isInteger(mm) ? 0 : 1);
  const up = [0, top / 2, top].map((mm) => label(LEFT - 5, y(mm) + 3, "end", mm === top ? `≥ ${number(mm)}` : number(mm)));
  const depths = deepest ? [0, deepest / 2, deepest].map((mm) => label(WIDTH - RIGHT + 5, y(mm, deepest) + 3, "start", number(mm))) : nothing;
  return svg`<line class="profile-axis" x1=${LEFT} x2=${WIDTH - RIGHT} y1=${y(0)} y2=${y(0)}></line>
    ${along.map((s) => label(x(s), HEIGHT - 8, "middle", `${fixed(s, 0)}${s + step > length ? " mm" : ""}`))}${up}${depths}`;
}
