// The plot of clearance in words, figures and colours.
import { fixed } from "./format.js";

/** @import { ClearanceProfile, ObstacleCurve, RegionView, ScaleView, VerdictView } from "./types.js" */

/**
 * The pose of a profile that is nearest to an arc length.
 * @param {ClearanceProfile} profile
 * @param {number} s mm
 */
export function rowAt(profile, s) {
  let row = 0;
  profile.s_mm.forEach((at, index) => { if (Math.abs(at - s) < Math.abs(profile.s_mm[row] - s)) row = index; });
  return row;
}

/**
 * Where the plot cuts values, mm: all that is known of the clearance to bone, and every margin, is below it.
 * @param {ClearanceProfile} profile
 */
export function topOf({ curves, exact_to_mm: exact }) {
  return Math.ceil(Math.max(exact, ...curves.map(({ margin_mm: margin }) => margin)));
}

/**
 * The end of the axis of depths in soft tissue, mm: the greatest one is below it. 0 where the tool is in none.
 * @param {ClearanceProfile} profile
 */
export function deepestOf({ tissue_depth_mm: depths }) {
  const deepest = Math.max(0, ...depths ?? []);
  return deepest < 0.1 ? 0 : Math.ceil(deepest);
}

/** @param {ObstacleCurve} curve */
export function marginWords({ margin_mm: margin }) {
  return `margin ${fixed(margin, 2)} mm`;
}

/**
 * Colour in which the head shows a protected structure, by the name of its curve: of a soft one that is its hard core, such
 * as 'optic nerve, 1 mm deep'.
 * @param {string} name
 * @param {Pick<RegionView, "name" | "colour">[]} regions
 */
export function structureColour(name, regions) {
  const of = name.replace(/, [^,]+ mm deep$/, "");
  return (regions.find((one) => one.name === name) ?? regions.find((one) => one.name === of))?.colour ?? "var(--text-soft)";
}

/**
 * What the dry run found where the tip is at an arc length, in one line.
 * @param {VerdictView} verdict
 * @param {number} s mm
 */
export function placeWords({ profile }, s) {
  const row = rowAt(profile, s);
  // Bone is the first; from the reach of the exact distance on it is only known to be farther away.
  const far = (/** @type {number} */ value, /** @type {number} */ index) => (index === 0 && value >= profile.exact_to_mm - 0.005 ? "≥ " : "");
  const away = profile.curves.map(({ name, clearance_mm: clearance }, index) => `${name} ${far(clearance[row], index)}${fixed(clearance[row], 2)}`);
  if (profile.registration_mm) away.push(`registration ${fixed(profile.registration_mm[row], 2)}`);
  if (profile.tissue_mm) away.push(`tissue ${fixed(profile.tissue_mm[row], 0)}`);
  return `At ${fixed(s, 0)} mm: ${away.join(", ")} mm`;
}

/**
 * The rest of it: how deep the tissue is, and how far air leads round it.
 * @param {VerdictView} verdict
 * @param {number} s mm
 */
export function placeDetail({ profile }, s) {
  const row = rowAt(profile, s);
  const depth = profile.tissue_depth_mm?.[row] ?? 0;
  const sideways = profile.sideways_mm?.[row] ?? 0;
  return [
    (profile.tissue_mm?.[row] ?? 0) < 0.5 ? "" : `Here the tool is ${fixed(depth, 1)} mm deep in soft tissue.`,
    sideways < 0.1 ? "" : `Air leads round the tissue ${sideways < 15 ? `${fixed(sideways, 1)} mm` : "15 mm or more"} beside the tool.`,
  ].filter(Boolean).join(" ");
}

/**
 * What the lines, areas and bands of the plot are.
 * @param {VerdictView} verdict
 */
export function captionWords({ profile, nearest }) {
  const [bone, ...others] = profile.curves;
  return [
    `Line in the path's colours: the tool's clearance to ${bone.name}, mm.`,
    `Dashed: its margin, ${fixed(bone.margin_mm, 2)} mm.`,
    others.length ? "Lines in other colours: clearance to protected structures; dashed: their margins." : "",
    profile.tissue_depth_mm ? "Grey area, scale on the right: depth in soft tissue." : "",
    profile.registration_mm ? `Band about ${nearest}: registration error, 95 %, without tool and tracking errors.` : "",
    "Click or drag in the plot to see the tool there.",
  ].filter(Boolean).join(" ");
}

/**
 * Colour of a clearance on the scale of the path.
 * @param {number} value mm
 * @param {ScaleView} scale
 */
export function colourOf(value, { lo, hi, colours }) {
  const share = Math.min(Math.max((value - lo) / (hi - lo), 0), 1) * (colours.length - 1);
  const first = Math.min(Math.floor(share), colours.length - 2);
  const part = share - first;
  const mixed = [1, 3, 5].map((from) => {
    const [low, high] = [colours[first], colours[first + 1]].map((code) => parseInt(code.slice(from, from + 2), 16));
    return Math.round(low + part * (high - low)).toString(16).padStart(2, "0");
  });
  return `#${mixed.join("")}`;
}
