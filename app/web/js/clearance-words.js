// The plot of clearance in words and colours.
import { fixed } from "./format.js";

/** @import { ClearanceProfile, ObstacleCurve, ScaleView, VerdictView } from "./types.js" */

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
 * What each line of the plot is: bone's, and one for each structure to spare, whose margins are their own.
 * @param {ObstacleCurve} curve
 * @param {number} index
 */
export function curveWords({ name, margin_mm: margin }, index) {
  return `${name}${index ? "" : ", in the colours of the path"}; dashed: margin ${fixed(margin, 2)} mm`;
}

/**
 * What the dry run found where the tip is at an arc length.
 * @param {VerdictView} verdict
 * @param {number} s mm
 */
export function placeWords({ profile }, s) {
  const row = rowAt(profile, s);
  const length = profile.tissue_mm?.[row] ?? 0;
  const tissue = !profile.tissue_mm ? "" : length < 0.5 ? "; no soft tissue" : `; soft tissue ${fixed(length, 0)} mm, ${fixed(profile.tissue_depth_mm?.[row], 1)} mm deep`;
  const off = profile.registration_mm ? `, and the registration may be off by ${fixed(profile.registration_mm[row], 2)} mm` : "";
  const away = profile.curves.map(({ name, clearance_mm: clearance }) => `${name} ${fixed(clearance[row], 2)} mm`).join(", ");
  const sideways = profile.sideways_mm?.[row] ?? 0;
  const round = sideways < 0.1 ? "" : `; air leads round the tissue ${sideways < 15 ? `${fixed(sideways, 1)} mm` : "15 mm or more"} beside the tool`;
  return `At ${fixed(s, 1)} mm: ${away}${off}${tissue}${round}.`;
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
