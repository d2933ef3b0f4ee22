// What really happens: the stages of the error chain, each with a switch and a number, and where the tool truly is.
import { h } from "/static/js/dom.js";
import { fixed } from "/static/js/format.js";
import { draw, hintLine, html, live, nothing, titled, unlessFocused } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { Commands, StageView, TruthSection, ViewModel } from "/static/js/types.js" */

/** @typedef {Commands["rehearsal.errors"]} Change */

const SAME = 1e-3; // of two sizes; the planner rounds them to 1e-4
const OFF = "All off: the robot is exactly where it believes.";
const HELP = "These errors change what is shown, not the drive: a person sees what the robot believes, and the certificate is of that. Compensation alone changes the drive: the robot then leads the bent tip along the path, and keeps the margin under the whole force of the hand.";

export class TruthGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    /** @type {TruthSection | undefined} */
    this.shown = undefined;
    /** @type {Change} what was chosen here and the planner does not tell yet: every figure of a drive draws the group anew */
    this.chosen = {};
    this.element = h("div", { class: "group", id: "truth" });
    this.element.hidden = true;
  }

  /** @param {ViewModel} state */
  update({ truth }) {
    if (truth === this.shown) return;
    this.shown = truth;
    this.chosen = truth ? notTold(this.chosen, truth) : {};
    this.element.hidden = !truth;
    if (truth) this.render(truth);
  }

  /** @param {TruthSection} truth */
  render(truth) {
    const stages = truth.stages.map((stage) => chosenOf(stage, this.chosen));
    const head = stages.find(({ name }) => name === "head");
    const bends = stages.find(({ name }) => name === "compliance");
    const { followed = truth.followed } = this.chosen;
    const compensated = truth.compensated_mm_per_n;
    draw(this.element, titled("What really happens", null, html`
      ${hintLine("truth-words", words(truth), HELP, truth.below_margin)}
      <ul class="stages">${stages.map((stage) => this.stage(stage))}</ul>
      ${head?.on ? html`<label class="check"><input type="checkbox" id="head-followed" .checked=${live(followed)}
        @change=${(/** @type {Event} */ event) => this.choose({ followed: checked(event) })}>A reference follows the head</label>` : nothing}
      ${bends?.on || compensated ? html`<label class="check"><input type="checkbox" id="compensate" .checked=${live(compensated > 0)}
        ?disabled=${!truth.may_compensate && !compensated}
        @change=${(/** @type {Event} */ event) => this.compensate(checked(event) ? bends?.value ?? 0 : 0)}>Robot compensates the bend</label>` : nothing}`));
  }

  /** @param {StageView} stage */
  stage({ name, label, unit, most, step, value, on, known, hint, refusal }) {
    return html`<li title=${refusal || hint}>
      <label class="check"><input type="checkbox" data-stage=${name} .checked=${live(on)} ?disabled=${Boolean(refusal)}
        @change=${(/** @type {Event} */ event) => this.choose({ [name]: checked(event) ? value : null })}>${label}</label>
      <input type="number" data-size=${name} aria-label="${label} in ${unit}" min="0" max=${most} step=${step} .value=${unlessFocused(String(Number(fixed(value, 3))))}
        ?disabled=${!on || known} @change=${(/** @type {Event} */ event) => this.choose({ [name]: size(event, most) })}>
      <span class="unit">${unit}</span></li>`;
  }

  /** @param {Change} change */
  choose(change) {
    if (!this.shown) return;
    this.chosen = { ...this.chosen, ...change };
    const stages = this.shown.stages.map((stage) => chosenOf(stage, this.chosen));
    const asked = Object.fromEntries(stages.map(({ name, on, value, most }) => [name, on ? Math.min(value, most) : null]));
    const followed = this.chosen.followed ?? this.shown.followed;
    this.connection.request("rehearsal.errors", { ...asked, followed }).catch((error) => {
      this.chosen = {};
      if (this.shown) this.render(this.shown);
      this.connection.say("note", { words: error.message, error: true });
    });
  }

  /** @param {number} value in mm/N; 0: not */
  compensate(value) {
    this.connection.send("rehearsal.settings", { values: { compliance_mm_per_n: value } });
  }
}

/**
 * A stage as it was chosen here.
 * @param {StageView} stage
 * @param {Change} chosen
 */
function chosenOf(stage, chosen) {
  const value = /** @type {Record<string, number | null | undefined>} */ (chosen)[stage.name];
  return value === undefined ? stage : { ...stage, on: value !== null, value: value ?? stage.value };
}

/**
 * What of it the planner does not tell yet.
 * @param {Change} chosen
 * @param {TruthSection} truth
 * @returns {Change}
 */
export function notTold(chosen, { stages, followed }) {
  /** @type {Record<string, unknown>} */
  const told = { followed, ...Object.fromEntries(stages.map(({ name, on, value }) => [name, on ? value : null])) };
  const same = (/** @type {unknown} */ one, /** @type {unknown} */ other) =>
    typeof one === "number" && typeof other === "number" ? Math.abs(one - other) < SAME : one === other;
  return Object.fromEntries(Object.entries(chosen).filter(([name, value]) => !same(value, told[name])));
}

/** @param {Event} event */
function checked({ target }) {
  return target instanceof HTMLInputElement && target.checked;
}

/**
 * @param {Event} event
 * @param {number} most
 */
function size({ target }, most) {
  const typed = target instanceof HTMLInputElement ? Number(target.value) : NaN;
  return Number.isFinite(typed) ? Math.min(Math.max(typed, 0), most) : 0;
}

/** @param {TruthSection} truth */
function words({ stages, difference_mm: apart, clearance_mm: clear, clearance_capped: capped, below_margin: below }) {
  if (!stages.some(({ on }) => on)) return OFF;
  if (apart === null) return "Shown once the robot is in place.";
  const bone = clear === null ? "" : clear < 0 ? `, ${fixed(-clear, 2)} mm in bone` : `, ${capped ? "over " : ""}${fixed(clear, 2)} mm from bone`;
  return `${below ? "Too near: true tip" : "True tip"} ${fixed(apart, 2)} mm off${bone}.`;
}
