// The colours of near passes: from contact to the reach of what was measured, the same for every run.

/** @typedef {[number, number, number]} Rgb */

/** @type {[number, Rgb][]} mm, sRGB; further than the last one is bone's own colour at the reach */
const STOPS = [[0, [200, 16, 46]], [0.5, [240, 84, 50]], [1.5, [250, 160, 60]], [3, [255, 226, 120]]];
export const CONTACT = "#8a0f5c"; // within the tool, as only a free hand can be

/**
 * The colour of a distance, linear RGB as three.js wants it.
 * @param {number} least mm
 * @param {number} reach mm
 * @param {number[]} rest bone's own colour, linear
 * @returns {Rgb}
 */
export function nearColour(least, reach, rest) {
  if (least < 0) return linear([138, 15, 92]);
  const next = STOPS.findIndex(([at]) => at > least);
  if (next > 0) {
    const [[from, a], [to, b]] = [STOPS[next - 1], STOPS[next]];
    return linear(between(a, b, (least - from) / (to - from)));
  }
  const [from, colour] = STOPS[STOPS.length - 1];
  return between(linear(colour), /** @type {Rgb} */ (rest), Math.min((least - from) / Math.max(reach - from, 1e-6), 1));
}

/** The scale as a gradient of CSS from 0 to the reach, which ends in bone. @param {number} reach mm */
export function scaleGradient(reach) {
  const stops = STOPS.map(([at, colour]) => `rgb(${colour.join(" ")}) ${(100 * at) / reach}%`);
  return `linear-gradient(to right, ${stops.join(", ")}, #d8cbb0 100%)`;
}

/** @param {Rgb} a @param {Rgb} b @param {number} share @returns {Rgb} */
function between(a, b, share) {
  return /** @type {Rgb} */ (a.map((value, axis) => value + share * (b[axis] - value)));
}

/** @param {Rgb} colour sRGB, 0 to 255 @returns {Rgb} */
function linear(colour) {
  return /** @type {Rgb} */ (colour.map((value) => {
    const one = value / 255;
    return one <= 0.04045 ? one / 12.92 : ((one + 0.055) / 1.055) ** 2.4;
  }));
}
