// The plot of clearance in words and colours.
import { fixed } from "./format.js";

/** @import { ScaleView, VerdictView } from "./types.js" */

/**
 * What the dry run found where the tip is at an arc length.
 * @param {VerdictView} verdict
 * @param {number} s mm
 */
export function placeWords({ profile, nearest }, s) {
  let row = 0;
  profile.s_mm.forEach((at, index) => { if (Math.abs(at - s) < Math.abs(profile.s_mm[row] - s)) row = index; });
  const length = profile.tissue_mm?.[row] ?? 0;
  const tissue = !profile.tissue_mm ? "" : length < 0.5 ? "; no soft tissue" : `; soft tissue ${fixed(length, 0)} mm, ${fixed(profile.tissue_depth_mm?.[row], 1)} mm deep`;
  const off = profile.registration_mm ? `, and the registration may be off by ${fixed(profile.registration_mm[row], 2)} mm` : "";
  const sideways = profile.sideways_mm?.[row] ?? 0;
  const round = sideways < 0.1 ? "" : `; air leads round the tissue ${sideways < 15 ? `${fixed(sideways, 1)} mm` : "15 mm or more"} beside the tool`;
  return `At ${fixed(s, 1)} mm: ${nearest} ${fixed(profile.clearance_mm[row], 2)} mm${off}${tissue}${round}.`;
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
