// The status bar: force, tip error, clearance, what holds the tool, and the details of the loop.
import { h } from "./dom.js";
import { isOld } from "./dry-run.js";
import { fixed, sentence } from "./format.js";
/** @import { CorridorSection, DetailsSection, RehearsalSection, ViewModel } from "./types.js" */

/** @type {[Exclude<keyof DetailsSection, "priority">, string, number, string][]} name, label, digits, unit */
const ROWS = [
  ["loop_hz", "Loop rate", 0, "Hz"], ["step_us", "Step time, median", 0, "µs"], ["step_us_p99", "Step time, 99 %", 0, "µs"],
  ["lateness_us_p50", "Lateness, median", 1, "µs"], ["lateness_us_p99", "Lateness, 99 %", 1, "µs"], ["overruns", "Overruns", 0, ""], ["rows", "Rows in the QP", 0, ""], ["steps", "Steps", 0, ""],
];

const NEAR_MM = 0.1; // this close to the margin the clearance is shown as a caution

export class StatusBar {
  /** @param {HTMLElement} root */
  constructor(root) {
    this.force = reading("Force of the hand");
    this.tip = reading("Tip error");
    this.clearance = reading("Bone clearance of the tool");
    this.target = reading("Target error");
    this.holding = reading("What holds the tool", "fill");
    this.verdict = reading("Plan", "fill");
    this.verdict.element.id = "bar-verdict";
    this.sheet = h("div", { class: "details-sheet", hidden: true, id: "details-sheet" });
    this.values = new Map(ROWS.map(([name]) => [name, h("dd", { class: "number" })]));
    this.priority = h("dd", {});
    this.sheet.append(h("dl", { class: "facts" }, ROWS.flatMap(([name, label]) => [h("dt", {}, label), this.values.get(name)]),
      h("dt", {}, "Real-time priority"), this.priority));
    this.toggle = h("button", { type: "button", class: "plain", "aria-expanded": "false", "aria-controls": "details-sheet", onclick: () => this.fold() }, "Details");
    this.details = h("div", { class: "details" }, this.toggle, this.sheet);
    root.append(this.force.element, this.tip.element, this.clearance.element, this.target.element, this.holding.element, this.verdict.element, this.details);
  }

  fold() {
    this.sheet.hidden = !this.sheet.hidden;
    this.toggle.setAttribute("aria-expanded", String(!this.sheet.hidden));
  }

  /** @param {ViewModel} state */
  update(state) {
    const driving = state.step?.input === "drive";
    /** @type {Partial<RehearsalSection>} */
    const now = driving ? state.rehearsal ?? {} : {};
    this.force.set(now.force_n, 2, "N");
    this.tip.set(now.mode === "path" || !driving ? now.tip_error_mm : null, 3, "mm");
    const corridor = driving ? null : state.corridor;
    this.clearance.label.textContent = driving ? "Bone clearance of the tool" : corridor?.nearest ? `Least clearance to ${corridor.nearest}` : "Least clearance";
    this.clearance.set(driving ? now.clearance_mm : corridor?.min_clearance_mm, 2, "mm", now.clearance_capped ? "≥ " : "");
    const slack = (now.clearance_mm ?? NaN) - (now.margin_mm ?? NaN);
    this.clearance.element.classList.toggle("caution", driving ? slack < NEAR_MM : Boolean(corridor?.caution));
    this.target.element.hidden = now.mode !== "inspect";
    this.target.set(now.target_error_mm, 3, "mm");
    this.force.element.hidden = !driving;
    this.tip.element.hidden = !driving;
    this.details.hidden = !driving; // they are of the control loop
    this.holding.element.hidden = !driving;
    this.verdict.value.textContent = planWords(state.corridor);
    this.verdict.element.dataset.level = state.corridor?.level ?? "";
    if (driving) this.holding.value.textContent = holdingWords(now);
    for (const { value } of [this.holding, this.verdict]) value.title = value.textContent ?? ""; // where the bar cuts it short
    this.holding.element.classList.toggle("caution", Boolean(now.held));
    const details = state.details ?? {};
    for (const [name, , digits, unit] of ROWS) {
      const value = this.values.get(name);
      if (value) value.textContent = `${fixed(details[name], digits)} ${unit}`.trim();
    }
    this.priority.textContent = details.priority ?? "–";
  }
}

/** @param {Partial<RehearsalSection>} now */
function holdingWords(now) {
  if (!["running", "paused", "ready"].includes(now.state ?? "")) return "–";
  if (now.state === "ready") return "In place at the entry, not started";
  if (now.state === "paused") return "Paused";
  return sentence(now.holding ?? "");
}

/**
 * @param {string} name
 * @param {string} [extra] further classes
 */
function reading(name, extra = "") {
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
  return { element, label, value, set };
}

/**
 * The verdict's sentence, as banner and panel have it, or what goes on.
 * @param {CorridorSection | null | undefined} corridor
 */
function planWords(corridor) {
  if (isOld(corridor)) return "Judging the path …";
  if (corridor?.short) return `${corridor.short}.`;
  return corridor?.status === "computing" ? "Driving the path …" : "–";
}
