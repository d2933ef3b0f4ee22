// The status bar, of a drive: its figures. Those of the control loop are in a drawer that the palette opens.
import { h } from "./dom.js";
import { fixed, sentence } from "./format.js";
/** @import { TabStatus } from "./panel.js" */
/** @import { ViewModel } from "./types.js" */

export class StatusBar {
  /** @param {HTMLElement} root */
  constructor(root) {
    this.root = root;
    this.drive = new DriveStatus();
  }

  /**
   * @param {ViewModel} state
   * @param {TabStatus} [own] of the tab that is shown; a drive without one has the figures of every drive
   */
  update(state, own = this.drive) {
    const driving = state.step?.input === "drive";
    this.root.hidden = !driving;
    if (!driving) return;
    if (this.root.firstElementChild !== own.elements[0]) this.root.replaceChildren(...own.elements);
    own.update(state);
  }
}

/** The figures that every drive has. */
class DriveStatus {
  constructor() {
    this.force = reading("Force of the hand");
    this.holding = reading("What holds the robot", "fill");
    this.elements = [this.force.element, this.holding.element];
  }

  /** @param {ViewModel} state */
  update({ rehearsal }) {
    this.force.set(rehearsal?.force_n, 2, "N");
    this.holding.say(holdingWords(rehearsal ?? {}, "In place, not started"));
  }
}

/**
 * What holds the robot, or that it does not move.
 * @param {Partial<NonNullable<ViewModel["rehearsal"]>>} now
 * @param {string} ready words for a robot that was not started
 */
export function holdingWords(now, ready) {
  if (!["running", "paused", "ready"].includes(now.state ?? "")) return "–";
  if (now.state === "ready") return ready;
  if (now.state === "paused") return "Paused";
  return sentence(now.holding ?? "");
}

/**
 * One figure or sentence of the bar.
 * @param {string} name
 * @param {string} [extra] further classes
 */
export function reading(name, extra = "") {
  const label = h("span", { class: "reading-label" }, name);
  const value = h("span", { class: "reading-value" }, "–");
  const element = h("div", { class: `reading ${extra}` }, label, value);
  /**
   * @param {number | null | undefined} number
   * @param {number} digits
   * @param {string} unit
   * @param {string} [before]
   */
  const set = (number, digits, unit, before = "") => {
    if (!Number.isFinite(number)) value.replaceChildren("–");
    else value.replaceChildren(before + fixed(number, digits), h("span", { class: "unit" }, ` ${unit}`));
  };
  const say = (/** @type {string} */ words) => {
    value.textContent = words;
    value.title = words; // where the bar cuts it short
  };
  return { element, label, set, say };
}
