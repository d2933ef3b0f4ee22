// Grey values of HU by one table of 65,536 entries: a change of window or threshold costs no new cut.
import { OUTSIDE } from "./cut.js";

/** @typedef {{ low: number, high: number }} Threshold HU, both ends included */
/** @typedef {{ window: number, level: number, threshold?: Threshold | null }} Greys HU */

const BLACK = 0xff000000;
const TINT = [36, 196, 120]; // red, green, blue of what a threshold takes in

/**
 * RGBA words, little-endian as ImageData has them, by HU & 0xffff.
 * @param {Greys} greys
 */
export function tableOf({ window, level, threshold }) {
  const table = new Uint32Array(65536);
  for (let value = OUTSIDE; value < 32768; value += 1) {
    const share = (value - level) / window + 0.5;
    const grey = share <= 0 ? 0 : share >= 1 ? 255 : Math.round(share * 255);
    let word = BLACK | (grey << 16) | (grey << 8) | grey;
    if (threshold && value >= threshold.low && value <= threshold.high) {
      const [red, green, blue] = TINT.map((part) => (grey * 0.55 + part * 0.45) | 0);
      word = BLACK | (blue << 16) | (green << 8) | red;
    }
    table[value & 0xffff] = value === OUTSIDE ? BLACK : word;
  }
  return table;
}

/**
 * @param {Uint32Array} rgba
 * @param {Int16Array} hu
 * @param {Uint32Array} table
 */
export function shade(rgba, hu, table) {
  for (let n = 0; n < hu.length; n += 1) rgba[n] = table[hu[n] & 0xffff];
}
