// Register: a bar, the steps from beads in the CT to a plan that uses the registration, and what is rare below them.
import { h, whenChanged } from "/static/js/dom.js";
import { letterOf } from "/static/js/letters.js";
import { FoldedParts, StepList } from "/static/js/step-list.js";
import { draw, html, nothing, said } from "/static/js/template.js";
import { RegistrationBar } from "./bar.js";
import { BeadsGroup } from "./beads.js";
import { CalibrationGroup } from "./calibration.js";
import { ErrorsGroup, FitGroup } from "./fit.js";
import { Guide, PARTS, STEPS, isBlocked, partLine, stepLine } from "./guide.js";
import { PointsGroup } from "./points.js";
import { RegistrationsList } from "./registrations.js";
import { SurfaceGroup } from "./surface.js";
import { TraceGroup } from "./trace.js";
import { UseGroup } from "./use.js";

/** @import { Parts } from "/static/js/panel.js" */
/** @import { StepName } from "./guide.js" */
/** @import { PlanUseSection, RegistrationSection, ViewModel } from "/static/js/types.js" */

const WHAT = "Lays the CT onto the patient. The same points are found in the CT and measured at the patient. A rehearsal in the CT alone needs none.";
const OF_ONE = PARTS.map(({ name }) => name).filter((name) => name !== "registrations"); // parts that belong to an open registration

export default class RegisterPanel {
  /** @param {Parts} parts */
  constructor({ connection, keys }) {
    this.connection = connection;
    this.guide = new Guide();
    this.changedHead = whenChanged();
    keys.shortcuts.push((event) => this.key(event));
    this.bar = new RegistrationBar(connection, () => this.list());
    this.head = h("div", { class: "group" });
    this.beads = new BeadsGroup(connection);
    this.points = new PointsGroup(connection);
    this.fit = new FitGroup(connection);
    this.errors = new ErrorsGroup(connection);
    this.use = new UseGroup(connection);
    this.surface = new SurfaceGroup(connection);
    this.trace = new TraceGroup(connection);
    this.calibration = new CalibrationGroup(connection);
    this.registrations = new RegistrationsList(connection);
    const contents = { beads: this.beads.element, points: this.points.element, fit: this.fit.element, error: this.errors.element, use: this.use.element };
    const rare = { refine: this.surface.element, trace: this.trace.element, calibration: this.calibration.element, registrations: this.registrations.element };
    this.steps = new StepList({ label: "Steps of the registration", steps: STEPS.map((step) => ({ ...step, content: contents[step.name] })), chosen: (name, open) => this.choose(/** @type {StepName} */ (name), open) });
    this.more = new FoldedParts({ label: "More", steps: PARTS.map((part) => ({ ...part, content: rare[part.name] })) });
    for (const event of ["click", "change"]) this.steps.element.addEventListener(event, () => { this.guide.acted = true; });
    this.element = h("div", { class: "register" }, this.bar.element, this.head, this.steps.element, this.more.element);
    this.update(connection.state); // its controls are found by the palette before the tab is shown
  }

  /**
   * Whether the key is of this tab: undo and redo, as in Plan.
   * @param {KeyboardEvent} event
   */
  key(event) {
    const { step, registration } = this.connection.state;
    if (step?.name !== "register" || !registration || event.repeat || !(event.ctrlKey || event.metaKey)) return false;
    if (letterOf(event) === "Z") this.connection.send(event.shiftKey ? "registration.redo" : "registration.undo");
    else if (letterOf(event) === "Y") this.connection.send("registration.redo");
    else return false;
    return true;
  }

  /** @param {ViewModel} state */
  update(state) {
    const { registration, plan_use: use } = state;
    this.steps.element.hidden = !registration;
    this.changedHead([registration, use], () => {
      this.bar.update(registration);
      this.renderHead(registration, use);
    });
    this.registrations.update(state);
    if (registration) {
      for (const part of [this.beads, this.fit, this.errors]) part.update(registration);
      this.points.update(registration, state.pointer);
      this.surface.update(registration, state.structures?.items ?? [], state.pointer);
      this.trace.update(registration, state);
      this.calibration.update(registration, state.pointer);
      this.use.update(registration, use);
    }
    const within = this.steps.find(this.guide.open)?.querySelector(".step-body")?.contains(document.activeElement);
    const opened = this.follow(state);
    this.renderSteps(state);
    if (opened) this.steps.bringIntoSight(opened);
    if (opened && within) this.steps.find(opened)?.querySelector("summary")?.focus({ preventScroll: true }); // what had the focus is folded
  }

  /**
   * Open the step that comes next.
   * @param {ViewModel} state
   * @returns {StepName | null} the step that was opened
   */
  follow({ registration, plan_use: use, step }) {
    if (step?.name !== "register") return null;
    const other = registration?.id !== this.guide.registration;
    const opened = this.guide.follow(registration, use, this.isBusy());
    if (!other) return opened;
    this.element.closest("#panel")?.scrollTo({ top: 0 });
    return null;
  }

  /** Whether somebody types or chooses in an open part, or holds a button: nothing moves under the hand. */
  isBusy() {
    return Boolean(this.element.querySelector(".step-body :is(input, select):focus, button:active"));
  }

  /**
   * @param {StepName} name
   * @param {boolean} open
   */
  choose(name, open) {
    this.guide.choose(name, open);
    this.renderSteps(this.connection.state);
  }

  /** The registrations of this head. */
  list() {
    if (!this.more.unfolded.has("registrations")) this.more.unfold("registrations", true);
    this.more.bringIntoSight("registrations");
  }

  /** @param {ViewModel} state */
  renderSteps(state) {
    const { registration, plan_use: use } = state;
    const lines = registration ? Object.fromEntries(STEPS.map(({ name }) => [name, stepLine(name, registration, use)])) : {};
    this.steps.update({ open: [this.guide.open], marked: this.guide.marked, lines });
    this.more.show(Object.fromEntries(PARTS.map(({ name }) => [name, partLine(name, state)])), registration ? [] : OF_ONE);
  }

  /**
   * What stands in the way of a step: no registration yet, one that was deleted, one that the plan cannot use.
   * @param {RegistrationSection | null | undefined} registration
   * @param {PlanUseSection | null | undefined} use
   */
  renderHead(registration, use) {
    const blocked = use && !use.here && isBlocked(use) ? use : null; // what it refers to is not what is open here
    const gone = registration?.deleted ? registration : blocked?.state === "deleted" ? { id: blocked.registration ?? "", name: blocked.name } : null;
    this.head.hidden = Boolean(registration) && !gone && !blocked;
    const { connection } = this;
    draw(this.head, html`
      ${blocked ? html`<p class="words caution" id="blocked-words">${said(`${blocked.words} Until then nothing is simulated.`)}</p>` : nothing}
      ${registration?.deleted ? html`<p class="words caution">‘${registration.name}’ is deleted. Restore it, or open another one.</p>` : nothing}
      ${gone ? html`<button type="button" class="primary wide" id="restore-registration" @click=${() => connection.send("registration.restore", { registration_id: gone.id })}>Restore ‘${gone.name}’</button>` : nothing}
      ${blocked ? html`<button type="button" class="wide" id="drop-blocked" ?disabled=${blocked.locked} @click=${() => connection.send("registration.use", { used: false })}>Use none</button>` : nothing}
      ${registration ? nothing : html`<p class="words">${said(WHAT)}</p><button type="button" class="primary wide" id="begin-registration" @click=${() => connection.send("registration.new")}>Begin registration</button>`}`);
  }
}
