// Plan: a bar, the steps of a plan of which one is open, and what is rare below them.
import { h, whenChanged } from "/static/js/dom.js";
import { FoldedParts, StepList } from "/static/js/step-list.js";
import { UsedRegistration } from "/static/js/used-registration.js";
import { shortWords, verdictLine } from "/static/js/verdict-line.js";
import { ClearanceGroup } from "./clearance.js";
import { ConeGroup } from "./cones.js";
import { EntryStep } from "./entry-step.js";
import { ExportStep } from "./export-step.js";
import { GhostCard } from "./ghost-card.js";
import { ADDS, Guide, STEPS, moreLine, stepLine } from "./guide.js";
import { InstrumentsGroup } from "./instruments.js";
import { ItemsTable } from "./items-table.js";
import { Notes } from "./notes.js";
import { PathsList } from "./paths-list.js";
import { PlanBar } from "./plan-bar.js";
import { PlanList } from "./plan-list.js";
import { RegionsGroup } from "./regions.js";
import { ShaftGroup } from "./shaft.js";
import { SuggestGroup } from "./suggest.js";
import { runningSearch } from "./suggestion.js";
import { ToolTableGroup } from "./tool-table.js";
import { Versions } from "./versions.js";

/** @import { Parts } from "/static/js/panel.js" */
/** @import { StepName } from "./guide.js" */
/** @import { PlanSection, ViewModel } from "/static/js/types.js" */

const MORE = [{ name: "bone", title: "Bone removal" }, { name: "versions", title: "Versions" }, { name: "notes", title: "Notes" }];

export default class PlanPanel {
  /** @param {Parts} parts */
  constructor({ connection }) {
    this.connection = connection;
    this.guide = new Guide();
    this.changed = whenChanged();
    /** @type {string | null | undefined} the region that was selected last */
    this.region = undefined;
    this.plans = new PlanList(connection);
    this.bar = new PlanBar(connection, () => this.goTo("export"));
    this.ghost = new GhostCard(connection);
    this.suggest = new SuggestGroup(connection, () => this.renderSteps(connection.state), () => this.goTo("entry"));
    this.shaft = new ShaftGroup(connection);
    this.cones = new ConeGroup();
    this.points = new ItemsTable(connection, "point", this.shaft.element);
    this.targets = new ItemsTable(connection, "target", this.cones.element);
    this.noTargets = h("p", { class: "empty" }, "Click a target.");
    this.noPath = h("p", { class: "empty" }, "A path needs two points.");
    this.entry = new EntryStep(connection);
    this.paths = new PathsList(connection);
    this.spare = new RegionsGroup(connection, "spare");
    this.instruments = new InstrumentsGroup(connection);
    this.tools = new ToolTableGroup(connection);
    this.registration = new UsedRegistration("plan-registration", false);
    this.clearance = new ClearanceGroup(connection);
    this.exports = new ExportStep(connection);
    this.bone = new RegionsGroup(connection, "remove");
    this.versions = new Versions(connection);
    this.notes = new Notes(connection);
    /** @type {Record<StepName, HTMLElement[]>} */
    const contents = {
      entry: [this.entry.element],
      targets: [this.targets.element, this.noTargets],
      protect: [this.spare.element],
      path: [this.suggest.element, this.points.element, this.paths.element],
      tool: [this.instruments.element, this.tools.element, this.registration.element],
      check: [this.clearance.element, this.noPath],
      export: [this.exports.element],
    };
    /** @type {Record<string, HTMLElement>} */
    const more = { bone: this.bone.element, versions: this.versions.element, notes: this.notes.element };
    this.steps = new StepList({ label: "Steps of the plan", steps: STEPS.map((step) => ({ ...step, content: contents[step.name] })), chosen: (name, open) => this.choose(/** @type {StepName} */ (name), open) });
    this.more = new FoldedParts({ label: "More", steps: MORE.map((part) => ({ ...part, content: more[part.name] })) });
    this.element = h("div", { class: "plan" }, this.bar.element, this.steps.element, this.more.element);
    this.overlay = h("div", { class: "plan-overlay" }, this.ghost.element, this.plans.element);
    this.update(connection.state); // its controls are found by the palette before the tab is shown
    this.plans.popover.openedBy(/** @type {HTMLElement} */ (this.bar.element.querySelector("#plans")));
  }

  /** @param {ViewModel} state */
  update(state) {
    const { plan } = state;
    for (const part of [this.suggest, this.tools, this.cones, this.shaft, this.instruments, this.entry, this.paths, this.spare, this.bone, this.versions, this.notes, this.exports, this.registration, this.ghost, this.plans]) part.update(state);
    this.clearance.update(state.corridor);
    this.changed([plan], () => this.renderPlan(plan));
    const within = this.steps.find(this.guide.open)?.querySelector(".step-body")?.contains(document.activeElement);
    const opened = this.follow(state);
    this.renderSteps(state);
    if (opened && within) this.steps.find(opened)?.querySelector("summary")?.focus({ preventScroll: true }); // what had the focus is folded
  }

  /** @param {PlanSection | null | undefined} plan */
  renderPlan(plan) {
    this.bar.update(plan);
    this.points.update(plan);
    this.targets.update(plan);
    this.noTargets.hidden = Boolean(plan?.targets.length);
    this.noPath.hidden = (plan?.points.length ?? 0) > 1;
  }

  /**
   * Open what the plan asks for next.
   * @param {ViewModel} state
   * @returns {StepName | null} the step that was opened
   */
  follow({ plan, regions, step }) {
    if (step?.name !== "plan") return null;
    const other = plan?.id !== this.guide.plan;
    const opened = this.guide.follow(plan, this.isBusy());
    if (opened) this.addFor(opened);
    if (other) this.element.closest("#panel")?.scrollTo({ top: 0 });
    const region = regions?.items.find(({ id }) => id === regions.selected);
    if (region && !other && region.id !== this.region && region.purpose === "spare") this.guide.choose("protect", true);
    else if (region && !other && region.id !== this.region) this.more.unfold("bone", true);
    this.region = region?.id;
    return opened;
  }

  /** Whether somebody types or chooses in the open step, or holds a button: nothing moves under the hand. */
  isBusy() {
    return Boolean(this.element.querySelector(".step-body :is(input, select, textarea):focus, button:active"));
  }

  /**
   * @param {StepName} name
   * @param {boolean} open
   */
  choose(name, open) {
    this.guide.choose(name, open);
    if (open) this.addFor(name);
    this.renderSteps(this.connection.state);
  }

  /** @param {StepName} name */
  goTo(name) {
    if (this.guide.open !== name) this.choose(name, true);
    this.steps.bringIntoSight(name);
  }

  /**
   * What a click adds is what the open step is about.
   * @param {StepName} name
   */
  addFor(name) {
    const { plan } = this.connection.state;
    const kind = ADDS[name];
    if (plan && kind && !plan.locked && plan.add_mode !== kind) this.connection.send("add.mode", { kind });
  }

  /** @param {ViewModel} state */
  renderSteps(state) {
    const search = runningSearch(state);
    const known = { suggestion: this.suggest.suggestion, searching: search?.fraction ?? null, verdict: verdictLine(state.corridor), short: shortWords(state.plan?.short_mm ?? 0) };
    this.steps.update({ open: [this.guide.open], marked: this.guide.marked, lines: Object.fromEntries(STEPS.map(({ name }) => [name, stepLine(name, state, known)])) });
    this.more.show(Object.fromEntries(MORE.map(({ name }) => [name, moreLine(name, state)])));
  }
}
