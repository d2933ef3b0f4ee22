// What the status bar says of the snake robot: depth, the link nearest to its bound, force, and what holds it.
import { holdingWords, reading } from "/static/js/status.js";

/** @import { ViewModel } from "/static/js/types.js" */

const NEAR_SHARE = 0.9; // of a bound: from there on it is a caution
const AT_SHARE = 0.98; // and from here on the link is at it
const END_MM = 0.5;

const FREE = "Nothing, the robot is free to move";

/**
 * What a robot that nothing holds is at: its bound, or the end of its way.
 * @param {ViewModel["snake"]} snake
 */
export function limitOf(snake) {
  const nearest = snake?.nearest;
  if (nearest && nearest.deviation_mm >= AT_SHARE * nearest.bound_mm) return `Link ${nearest.link} is at its bound`;
  if (snake && !snake.fixed && snake.length_mm > 0 && snake.depth_mm >= snake.length_mm - END_MM) return "At the end of the route";
  return null;
}

export class SnakeStatus {
  constructor() {
    this.depth = reading("Depth");
    this.deviation = reading("Deviation");
    this.bound = reading("Bound");
    this.force = reading("Force");
    this.holding = reading("Held by", "fill");
    this.elements = [this.depth, this.deviation, this.bound, this.force, this.holding].map(({ element }) => element);
  }

  /** @param {ViewModel} state */
  update({ rehearsal, snake }) {
    const nearest = snake?.nearest;
    this.depth.element.hidden = Boolean(snake?.fixed);
    this.depth.set(snake?.depth_mm, 0, "mm");
    this.deviation.set(nearest?.deviation_mm, 1, "mm");
    this.bound.set(nearest?.bound_mm, 1, "mm");
    this.deviation.element.classList.toggle("caution", Boolean(nearest && nearest.deviation_mm > NEAR_SHARE * nearest.bound_mm));
    this.force.set(rehearsal?.force_n, 2, "N");
    const words = holdingWords(rehearsal ?? {}, "At the entry, not started");
    this.holding.say(words === FREE ? (limitOf(snake) ?? words) : words);
  }
}
