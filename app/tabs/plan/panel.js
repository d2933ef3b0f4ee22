// Plan: a bar, the steps of a plan of which one is open, and what is rare below them.
import { fillListRow, h, iconButton, keyed, listRow, whenChanged } from "/static/js/dom.js";
import { when } from "/static/js/format.js";
import { placeWords, sideWords } from "/static/js/slices/place-words.js";
import { FRAME_QUESTION, askChoices, askForImages, askName, clearErrors, confirm, note, noteDone, noteEdit } from "/static/js/dialogs.js";
import { keep, recall } from "/static/js/remember.js";
import { StepList } from "/static/js/step-list.js";
import { UsedRegistration } from "/static/js/used-registration.js";
import { verdictLine } from "/static/js/verdict-line.js";
import { ClearanceGroup } from "./clearance.js";
import { ConeGroup } from "./cones.js";
import { Guide, STEPS, adds, stepLine } from "./guide.js";
import { InstrumentsGroup } from "./instruments.js";
import { PlanBar } from "./plan-bar.js";
import { ShaftGroup } from "./shaft.js";
import { SuggestGroup } from "./suggest.js";
import { ToolTableGroup } from "./tool-table.js";
import { PathsGroup } from "./paths.js";
import { RegionsGroup } from "./regions.js";
import { VersionsGroup } from "./versions.js";
import { PlannerError, download, missing, read, upload } from "/static/js/rest.js";

/** @import { Parts } from "/static/js/panel.js" */
/** @import { Row } from "/static/js/dom.js" */
/** @import { StepName } from "./guide.js" */
/** @import { GhostView, ItemEntry, PlanEntry, PlanPublic, PlanRegistrationPublic, PlanSection, ViewModel } from "/static/js/types.js" */

const POINTS_QUESTION = {
  name: "points_as",
  label: "The points are",
  options: [["path", "a path, from outside to inside"], ["targets", "targets to inspect"]],
};
const SCAN_WORDS = "A scan can identify its patient.";
const SCAN_QUESTION = { name: "scan", label: "The pictures show", options: [["without", "outlines of bone only"], ["with", "the scan as well"]] };
const QUESTIONS = [FRAME_QUESTION, POINTS_QUESTION];
const AXES = [["R/L", "Right or left of the middle of the scan's frame, in mm"], ["A/P", "Front or back, in mm"], ["S/I", "Up or down, in mm"]];
const MORE = [{ name: "bone", title: "Bone removal" }, { name: "versions", title: "Versions" }, { name: "notes", title: "Notes" }, { name: "plans", title: "Plans" }];
const EXPORTS = [
  ["json", "vfix plan (JSON)", "Everything, comes back as it was"],
  ["mrk.json", "3D Slicer markups (.mrk.json)", "Control points, dense curve with bone clearance, targets"],
  ["report", "Report to print (.html)", "Verdict, figures and pictures on one page of A4"],
  ["csv", "Table (.csv)", "Points and targets in mm"],
  ["slicer", "Folder for 3D Slicer (.zip)", "Plan, head, CT and registrations as a scene that 3D Slicer opens; made in some seconds"],
];

export default class PlanPanel {
  /** @param {Parts} parts */
  constructor({ connection }) {
    this.connection = connection;
    this.changedPlan = whenChanged();
    this.changedPlans = whenChanged();
    this.changedGhost = whenChanged();
    /** @type {HTMLElement | undefined} what had the focus before the ghost's card */
    this.before = undefined;
    this.overlay = h("div", { class: "overlay overlay-ghost", id: "ghost-card", hidden: true });
    this.bar = new PlanBar(connection, { plans: () => this.unfold("plans", true), exports: () => this.goTo("export") });
    this.guide = new Guide();
    /** @type {string | null | undefined} the region that was selected last */
    this.region = undefined;
    this.planList = h("ul", { class: "list", id: "plan-list" });
    this.showDeleted = h("input", { type: "checkbox", onchange: () => this.update(connection.state) });
    this.chooser = h("input", { type: "file", hidden: true, accept: ".json,.csv,.fcsv", onchange: () => this.importPlan() });
    this.points = h("tbody");
    this.targets = h("tbody");
    this.insertButton = h("button", { type: "button", id: "insert", "data-command": "point.insert_after", onclick: () => this.act("point.insert_after"), title: "Add a point half way to the next one" }, "Insert after");
    this.renameButton = h("button", { type: "button", id: "rename-item", "data-operation": "item.rename", onclick: () => this.renameSelected(), title: "F2" }, "Rename");
    this.deleteButton = h("button", { type: "button", id: "delete-item", "data-operation": "item.delete", onclick: () => this.act("item.delete"), title: "Del" }, "Delete");
    this.selectedTools = h("div", { class: "buttons even" }, this.insertButton, this.renameButton, this.deleteButton);
    this.targetWords = h("p", { class: "empty" });
    this.registration = new UsedRegistration("plan-registration", false);
    this.clearance = new ClearanceGroup(connection);
    this.exports = EXPORTS.map(([format, label, words]) =>
      h("button", { type: "button", class: "export", title: words, "data-format": format, onclick: () => this.export(format) }, label));
    this.instruments = new InstrumentsGroup(connection);
    this.suggest = new SuggestGroup(connection);
    this.tools = new ToolTableGroup(connection);
    this.shaft = new ShaftGroup(connection);
    this.cone = new ConeGroup();
    this.paths = new PathsGroup(connection);
    this.spare = new RegionsGroup(connection, "spare");
    this.versions = new VersionsGroup(connection);
    this.opened = new RegionsGroup(connection, "remove");
    this.newPlanButton = h("button", { type: "button", id: "new-plan", "data-operation": "plan.new", onclick: () => this.newPlan() }, "New plan");
    const contents = this.contents();
    this.steps = new StepList({ label: "Steps of the plan", steps: STEPS.map((step) => ({ ...step, content: contents[step.name] })), chosen: (name, open) => this.choose(/** @type {StepName} */ (name), open) });
    /** @type {Record<string, HTMLElement[]>} */
    const more = {
      bone: [this.opened.element], versions: [this.versions.element], notes: [this.paths.notesElement],
      plans: [this.newPlanButton, this.planList, h("label", { class: "check" }, this.showDeleted, "Show deleted plans")],
    };
    this.more = new StepList({ label: "More", numbered: false, steps: MORE.map((part) => ({ ...part, content: more[part.name] })), chosen: (name, open) => this.unfold(name, open) });
    /** @type {Set<string>} */
    this.unfolded = new Set(MORE.map(({ name }) => name).filter((name) => recall(`fold-${name}`, ["open", "shut"], "shut") === "open"));
    this.element = h("div", { class: "plan" }, this.bar.element, this.steps.element, this.more.element);
  }

  /** @returns {Record<StepName, HTMLElement[]>} */
  contents() {
    return {
      entry: [this.paths.sideElement],
      targets: [this.table("target", this.targets), this.targetWords, this.cone.element],
      protect: [this.spare.element],
      path: [this.suggest.element, this.table("point", this.points), this.selectedTools, this.shaft.element, this.paths.element],
      tool: [this.instruments.element, this.tools.element, this.registration.element],
      check: [this.clearance.element],
      export: [h("div", { class: "fields" }, this.exports), h("button", { type: "button", class: "wide", id: "import-plan", onclick: () => this.chooser.click() }, "Import plan …"), this.chooser],
    };
  }

  /** @param {"point.insert_after" | "item.delete"} type */
  act(type) {
    const selected = this.connection.state.plan?.selected;
    if (selected) this.connection.send(type, { item_id: selected });
  }

  /**
   * @param {"point" | "target"} kind
   * @param {HTMLElement} body
   */
  table(kind, body) {
    const head = h("tr", {}, h("th", { scope: "col" }, kind === "point" ? "Point" : "Target"),
      AXES.map(([axis, title]) => h("th", { scope: "col", title }, axis)));
    return h("table", { class: "points", id: kind === "point" ? "points-table" : "targets-table", "aria-label": kind === "point" ? "Points of the path, in mm" : "Targets, in mm" }, h("thead", {}, head), body);
  }

  /** @param {ViewModel} state */
  update(state) {
    for (const part of [this.suggest, this.tools, this.cone, this.shaft, this.instruments, this.paths, this.spare, this.opened, this.versions]) part.update(state);
    this.registration.update(state);
    this.changedGhost([state.plan?.ghost], () => this.renderGhost(state.plan?.ghost));
    this.changedPlan([state.plan, state.corridor], () => this.renderPlan(state.plan));
    this.clearance.update(state.corridor);
    this.bar.update(state.plan);
    this.follow(state);
    this.renderSteps(state);
    this.changedPlans([state.plans, state.plan?.id, this.showDeleted.checked], () => this.renderPlans(state));
  }

  /** @param {GhostView | null | undefined} ghost */
  renderGhost(ghost) {
    const { activeElement } = document;
    const within = this.overlay.contains(activeElement);
    if (ghost && !within && activeElement instanceof HTMLElement) this.before = activeElement;
    this.overlay.hidden = !ghost;
    if (!ghost && within) this.before?.focus({ preventScroll: true }); // keys go on where they were, such as in a slice
    if (!ghost) return;
    const send = (/** @type {"ghost.confirm" | "ghost.cancel"} */ type) => () => this.connection.send(type);
    const add = h("button", { type: "button", class: "primary", id: "ghost-add", onclick: send("ghost.confirm"), title: "Enter" }, "Add here");
    this.overlay.replaceChildren(
      h("span", { class: "words" }, ghost.words),
      add,
      h("button", { type: "button", id: "ghost-cancel", onclick: send("ghost.cancel"), title: "Esc" }, "Cancel"));
    add.focus(/** @type {FocusOptions} */ ({ preventScroll: true, focusVisible: false }));
  }

  /**
   * Open what the plan asks for next.
   * @param {ViewModel} state
   */
  follow({ plan, regions }) {
    const other = plan?.id !== this.guide.plan;
    const opened = this.guide.follow(plan, this.isBusy());
    if (opened) this.addFor(opened);
    if (other) this.element.closest("#panel")?.scrollTo({ top: 0 });
    const region = regions?.items.find(({ id }) => id === regions.selected);
    if (region && !other && region.id !== this.region && region.purpose === "spare") this.guide.choose("protect", true);
    else if (region && !other && region.id !== this.region) this.unfold("bone", true);
    this.region = region?.id;
  }

  /** Whether somebody works in the open step, or holds something: nothing moves under the hand. */
  isBusy() {
    return Boolean(this.steps.find(this.guide.open)?.querySelector(".step-body")?.contains(document.activeElement)) || Boolean(this.element.querySelector("button:active"));
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
    const kind = adds(name);
    if (plan && kind && !plan.locked && plan.add_mode !== kind) this.connection.send("add.mode", { kind });
  }

  /**
   * @param {string} name of what is rare
   * @param {boolean} open
   */
  unfold(name, open) {
    if (open) this.unfolded.add(name);
    else this.unfolded.delete(name);
    keep(`fold-${name}`, open ? "open" : "shut");
    this.renderSteps(this.connection.state);
    if (open) this.more.bringIntoSight(name);
  }

  /** @param {ViewModel} state */
  renderSteps(state) {
    const search = state.jobs?.items.find(({ kind, subject }) => kind === "suggestion" && subject === state.plan?.name);
    const known = { suggestion: this.suggest.suggestion, searching: search?.fraction ?? null, verdict: verdictLine(state.corridor) };
    this.steps.update({ open: [this.guide.open], marked: this.guide.marked, lines: Object.fromEntries(STEPS.map(({ name }) => [name, stepLine(name, state, known)])) });
    this.more.update({ open: [...this.unfolded] });
  }

  /** @param {PlanSection | null | undefined} plan */
  renderPlan(plan) {
    this.renderItems(this.points, plan?.points ?? [], "point", plan?.selected);
    this.renderItems(this.targets, plan?.targets ?? [], "target", plan?.selected);
    this.targetWords.textContent = plan && !plan.targets.length ? "None yet. Click what is to be inspected." : "";
    this.targetWords.hidden = this.targetWords.textContent === "";
    for (const button of this.exports) button.disabled = !plan;
    this.renderSelected(plan);
  }

  /**
   * @param {HTMLElement} body
   * @param {ItemEntry[]} items
   * @param {"point" | "target"} kind
   * @param {string | null | undefined} selected
   */
  renderItems(body, items, kind, selected) {
    keyed(body, items, (item) => item.id, () => this.pointRow(kind), (row, item) => fillPointRow(row, item, selected));
    body.parentElement?.toggleAttribute("hidden", !items.length);
  }

  /**
   * @param {"point" | "target"} kind
   * @returns {Row<ItemEntry>}
   */
  pointRow(kind) {
    const send = (/** @type {"item.select" | "item.delete"} */ type) => this.connection.send(type, { item_id: row.item.id });
    const row = /** @type {Row<ItemEntry> & HTMLTableRowElement} */ (h("tr", {
      tabIndex: 0, title: "Click to select, double-click to rename", onclick: () => send("item.select"), ondblclick: () => this.rename(row.item),
      onkeydown: (event) => {
        const { plan } = this.connection.state;
        if (event.key === "Enter") send("item.select");
        if (event.key === "F2") this.rename(row.item);
        if (["Delete", "Backspace"].includes(event.key) && !plan?.locked && !plan?.ghost) send("item.delete");
      },
    },
    h("td", {}, h("span", { class: kind === "target" ? "dot target" : "dot" }), h("span")), h("td"), h("td"), h("td")));
    return row;
  }

  /** @param {PlanSection | null | undefined} plan */
  renderSelected(plan) {
    const item = selectedItem(plan);
    const points = plan?.points ?? [];
    const index = item ? points.indexOf(item) : -1;
    const frozen = !item || Boolean(plan?.locked);
    this.insertButton.disabled = frozen || index < 0 || index === points.length - 1;
    this.renameButton.disabled = this.deleteButton.disabled = frozen;
  }

  renameSelected() {
    const item = selectedItem(this.connection.state.plan);
    if (item) this.rename(item);
  }

  /** @param {ItemEntry} item */
  async rename(item) {
    const label = await askName(`Rename ${item.label}`, item.label);
    if (label) this.connection.send("item.rename", { item_id: item.id, label });
  }

  /** @param {ViewModel} state */
  renderPlans(state) {
    const shown = (state.plans?.items ?? []).filter((item) => this.showDeleted.checked || !item.deleted);
    keyed(this.planList, shown, (item) => `${item.id} ${item.deleted}`, (item) => this.planRow(item),
      (row, item) => {
        fillListRow(row, item, when(item.modified), item.id === state.plan?.id);
        row.querySelector("[data-tool=take-targets]")?.toggleAttribute("hidden", item.id === state.plan?.id); // has them
      });
  }

  /**
   * @param {PlanEntry} item
   * @returns {Row<PlanEntry>}
   */
  planRow({ deleted }) {
    const send = (/** @type {"plan.open" | "plan.duplicate" | "plan.restore"} */ type) => this.connection.send(type, { plan_id: row.item.id });
    const tools = deleted ? [iconButton("restore", "Restore", () => send("plan.restore"), { "data-operation": "plan.restore" })] : [
      iconButton("pencil", "Rename", async () => {
        const { id, name: before } = row.item;
        const name = await askName("Rename this plan", before);
        if (name) this.connection.send("plan.rename", { plan_id: id, name });
      }, { "data-operation": "plan.rename" }),
      iconButton("copy", "Duplicate", () => send("plan.duplicate"), { "data-operation": "plan.duplicate" }),
      iconButton("target", "Take its targets into the open plan", () => this.takeTargets(row.item), { "data-tool": "take-targets", "data-operation": "targets.take" }),
      iconButton("trash", "Delete", () => this.remove(row.item.id), { "data-operation": "plan.delete" }),
    ];
    /** @type {Row<PlanEntry>} */
    const row = listRow(deleted, () => send("plan.open"), tools);
    return row;
  }

  /** @param {PlanEntry} other */
  takeTargets({ id, name }) {
    noteEdit(this.connection, "plan", this.connection.request("targets.take", { plan_id: id }), `The targets of ‘${name}’ were added.`);
  }

  /** @param {string} id */
  remove(id) {
    const fields = { plan_id: id };
    noteDone(this.connection.request("plan.delete", fields), "The plan was deleted.",
      { label: "Restore", run: () => this.connection.send("plan.restore", fields) });
  }

  async newPlan() {
    const name = await askName("Name the new plan", "Plan", "Create");
    if (!name) return;
    this.connection.send("plan.new", { name });
  }

  /** @param {string} format */
  async export(format) {
    const { plan, plan_use: use, case: head } = this.connection.state;
    if (!plan || (format === "slicer" && head?.images && !await askForImages(head.name))) return;
    if (format === "report") {
      this.report(plan.id);
      return;
    }
    const path = `/api/v1/plans/${encodeURIComponent(plan.id)}/export`;
    download(format === "slicer" ? `${path}/slicer?with_images=true` : `${path}?format=${encodeURIComponent(format)}`);
    if (format === "slicer") note("The folder for 3D Slicer is being made; its download begins in some seconds.");
    if (use?.registration && format === "json") note(`The file names the registration ‘${use.name ?? use.registration}’ and does not hold it. To take both elsewhere, save the head in Patient; or export the transform in Register as well.`, { stay: true });
  }

  /**
   * The report to print. With the scan in its pictures where that shows nobody, or where the user wants it.
   * @param {string} planId
   */
  async report(planId) {
    const { case: head } = this.connection.state;
    const answer = head?.images ? await askChoices("Report to print", SCAN_WORDS, [SCAN_QUESTION], "Save") : { scan: "with" };
    if (answer) download(`/api/v1/plans/${encodeURIComponent(planId)}/report/page?with_images=${answer.scan === "with"}`);
  }

  async importPlan() {
    const file = this.chooser.files?.[0];
    this.chooser.value = "";
    clearErrors();
    if (file) await this.send(file, {});
  }

  /**
   * @param {File} file
   * @param {Record<string, string>} answers to what it does not say
   */
  async send(file, answers) {
    const caseId = this.connection.state.case?.id;
    if (!caseId) return;
    const form = new FormData();
    form.append("file", file);
    for (const [key, value] of Object.entries(answers)) form.append(key, value);
    try {
      /** @type {PlanPublic} */
      const plan = await upload(`/api/v1/cases/${encodeURIComponent(caseId)}/plans/import`, form, () => {});
      this.connection.send("plan.open", { plan_id: plan.id });
      const doubts = [plan.told, await this.wanting(plan)].filter(Boolean);
      note([`‘${file.name}’ was imported as a plan.`, ...doubts].join(" "), { stay: doubts.length > 0 });
    } catch (error) {
      await this.ask(file, answers, /** @type {Error} */ (error));
    }
  }

  /**
   * Why a plan that came in cannot use the registration that it names; '' where it can, or names none.
   * @param {PlanPublic} plan
   */
  async wanting({ id, registration }) {
    if (!registration) return "";
    /** @type {PlanRegistrationPublic} */
    const used = await read(`/api/v1/plans/${encodeURIComponent(id)}/registration`);
    return used.state === "ready" ? "" : used.words;
  }

  /**
   * What a file does not say is asked, never guessed.
   * @param {File} file
   * @param {Record<string, string>} answers
   * @param {Error} error
   */
  async ask(file, answers, error) {
    const words = missing(error);
    const questions = QUESTIONS.filter(({ name }) => words.includes(name));
    if (questions.length && questions.length === words.length) {
      const chosen = await askChoices(`What ‘${file.name}’ does not say`, error.message, questions, "Import");
      if (chosen) await this.send(file, { ...answers, ...chosen });
    } else if (error instanceof PlannerError && error.code === "other_case" && !answers.other_case) {
      if (await confirm(`‘${file.name}’ was made for another head`, error.message, "Import all the same")) await this.send(file, { ...answers, other_case: "yes" });
    } else {
      note(`‘${file.name}’: ${error.message}`, { error: true });
    }
  }
}

/** @param {PlanSection | null | undefined} plan */
function selectedItem(plan) {
  return plan && [...plan.points, ...plan.targets].find((item) => item.id === plan.selected);
}

/**
 * @param {HTMLElement} row
 * @param {ItemEntry} item
 * @param {string | null | undefined} selected
 */
function fillPointRow(row, item, selected) {
  row.setAttribute("aria-selected", String(item.id === selected));
  row.dataset.item = item.id;
  const [name, ...places] = row.querySelectorAll("td");
  name.title = `${item.label}: ${placeWords(item.position)}`;
  name.querySelectorAll("span")[1].textContent = item.label;
  places.forEach((cell, axis) => { cell.textContent = sideWords(item.position[axis], axis); });
}
