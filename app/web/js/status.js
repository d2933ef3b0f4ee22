// The status bar, of a drive: its figures, and the details of the control loop.
import { h } from "./dom.js";
import { fixed, sentence } from "./format.js";
/** @import { TabStatus } from "./panel.js" */
/** @import { DetailsSection, ViewModel } from "./types.js" */

/** @type {[Exclude<keyof DetailsSection, "priority">, string, number, string][]} name, label, digits, unit */
const ROWS = [
  ["loop_hz", "Loop rate", 0, "Hz"], ["step_us", "Step time, median", 0, "µs"], ["step_us_p99", "Step time, 99 %", 0, "µs"],
  ["lateness_us_p50", "Lateness, median", 1, "µs"], ["lateness_us_p99", "Lateness, 99 %", 1, "µs"], ["overruns", "Overruns", 0, ""], ["rows", "Rows in the QP", 0, ""], ["steps", "Steps", 0, ""],
];

export class StatusBar {
  /** @param {HTMLElement} root */
  constructor(root) {
    this.root = root;
    this.drive = new DriveStatus();
    this.sheet = h("div", { class: "details-sheet", hidden: true, id: "details-sheet" });
    this.values = new Map(ROWS.map(([name]) => [name, h("dd", { class: "number" })]));
    this.priority = h("dd", {});
    this.sheet.append(h("dl", { class: "facts" }, ROWS.flatMap(([name, label]) => [h("dt", {}, label), this.values.get(name)]),
      h("dt", {}, "Real-time priority"), this.priority));
    this.toggle = h("button", { type: "button", class: "plain", "aria-expanded": "false", "aria-controls": "details-sheet", onclick: () => this.fold() }, "Details");
    this.details = h("div", { class: "details" }, this.toggle, this.sheet);
    root.append(this.details);
  }

  fold() {
    this.sheet.hidden = !this.sheet.hidden;
    this.toggle.setAttribute("aria-expanded", String(!this.sheet.hidden));
  }

  /**
   * @param {ViewModel} state
   * @param {TabStatus} [own] of the tab that is shown; a drive without one has the figures of every drive
   */
  update(state, own = this.drive) {
    const driving = state.step?.input === "drive";
    this.root.hidden = !driving;
    if (!driving) return;
    this.show(own.elements);
    own.update(state);
    const details = state.details ?? {};
    for (const [name, , digits, unit] of ROWS) {
      const value = this.values.get(name);
      if (value) value.textContent = `${fixed(details[name], digits)} ${unit}`.trim();
    }
    this.priority.textContent = details.priority ?? "–";
  }

  /**
   * What stands before the details.
   * @param {HTMLElement[]} elements
   */
  show(elements) {
    if (this.root.firstElementChild !== elements[0]) this.root.replaceChildren(...elements, this.details);
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
