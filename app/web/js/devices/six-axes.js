// Six axes of a hand, each from −1 to 1, in the endoscope's picture: x right, y down, z into it, and right-hand turns about them.

/** Translation x, y, z, then rotation about x, y, z. @typedef {[number, number, number, number, number, number]} SixAxes */
/** A device that is read: what it is called, or why there is none, and its axes at a time in ms. @typedef {{ name: string, trouble: string, start: () => void, stop: () => void, read: (now: number) => SixAxes }} AxesSource */

/** @type {Readonly<SixAxes>} */
export const REST = [0, 0, 0, 0, 0, 0];
const DEAD = 0.05; // of the whole way: sticks and caps do not come back to 0 exactly

/**
 * An axis without its dead band, from which it rises without a jump.
 * @param {number} value
 */
export function shaped(value) {
  const held = Math.min(1, Math.max(-1, value));
  const beyond = Math.abs(held) - DEAD;
  return beyond > 0 ? Math.sign(held) * beyond / (1 - DEAD) : 0; // also of what is no number
}

/** @param {Readonly<SixAxes>} axes */
export function atRest(axes) {
  return axes.every((value) => value === 0);
}
