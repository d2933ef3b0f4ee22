// Register: registration of the CT to the patient, from beads in the CT to the error at the targets.
import { brief } from "/static/js/brief.js";
import { fillListRow, group, h, iconButton, keyed, listRow, whenChanged } from "/static/js/dom.js";
import { when } from "/static/js/format.js";
import { askName, clearErrors, note, noteDone } from "/static/js/dialogs.js";
import { letterOf } from "/static/js/letters.js";
import { download, upload } from "/static/js/rest.js";
import { say } from "/static/js/said.js";
import { BeadsGroup } from "./beads.js";
import { CalibrationGroup } from "./calibration.js";
import { ErrorsGroup, FitGroup } from "./fit.js";
import { PointsGroup } from "./points.js";
import { SurfaceGroup } from "./surface.js";
import { TraceGroup } from "./trace.js";
import { exportWords, importedWords } from "./words.js";

/** @import { Parts } from "/static/js/panel.js" */
/** @import { Row } from "/static/js/dom.js" */
/** @import { PlanUseSection, RegistrationEntry, RegistrationPublic, RegistrationSection, ViewModel } from "/static/js/types.js" */

const WHAT = "Says how the CT lies on the patient. The same points are found in the CT and measured at the patient. A rehearsal in the CT alone needs none.";
const EXPORTS = [["tfm", "ITK transform (.tfm)", "Opens in 3D Slicer and ITK"], ["json", "Transform (.json)", "The matrix with its frames and unit"]];

export default class RegisterPanel {
  /** @param {Parts} parts */
  constructor({ connection, keys }) {
    this.connection = connection;
    this.changedHead = whenChanged();
    this.changedUse = whenChanged();
    this.changedList = whenChanged();
    keys.shortcuts.push((event) => this.key(event));
    this.undoButton = iconButton("undo", "Undo (Ctrl+Z)", () => connection.send("registration.undo"), { id: "registration-undo", "data-operation": "registration.undo" });
    this.redoButton = iconButton("redo", "Redo (Ctrl+Shift+Z)", () => connection.send("registration.redo"), { id: "registration-redo", "data-operation": "registration.redo" });
    this.lockButton = h("button", { type: "button", class: "plain", id: "registration-lock", "data-operation": "registration.lock", onclick: () => connection.send("registration.lock", { locked: !connection.state.registration?.locked }) });
    this.head = h("p", { class: "words", id: "registration-words" });
    this.restoreButton = h("button", { type: "button", class: "primary wide", id: "restore-registration", hidden: true, onclick: () => this.restore() }, "Restore");
    this.blockedWords = h("p", { class: "words caution", id: "blocked-words", hidden: true });
    this.dropHere = h("button", { type: "button", class: "wide", id: "drop-blocked", hidden: true, onclick: () => connection.send("registration.use", { used: false }) }, "Use none");
    this.beginButton = h("button", { type: "button", class: "primary wide", id: "begin-registration", onclick: () => connection.send("registration.new") }, "Begin registration");
    this.beads = new BeadsGroup(connection);
    this.points = new PointsGroup(connection);
    this.fit = new FitGroup(connection);
    this.errors = new ErrorsGroup(connection);
    this.surface = new SurfaceGroup(connection);
    this.trace = new TraceGroup(connection);
    this.calibration = new CalibrationGroup(connection);
    this.useWords = h("p", { class: "words", id: "plan-use-words" });
    this.useButton = h("button", { type: "button", class: "primary wide", id: "use-registration", "data-command": "registration.use", onclick: () => connection.send("registration.use", { used: true }) }, "Use for plan");
    this.dropButton = h("button", { type: "button", class: "wide", id: "drop-registration", onclick: () => connection.send("registration.use", { used: false }) }, "Use none");
    this.exports = EXPORTS.map(([format, label, words]) => h("button", { type: "button", class: "export", title: words, "data-format": format, onclick: () => this.export(format) }, label));
    this.exportWords = h("p", { class: "words", id: "export-words" });
    this.chooser = h("input", { type: "file", hidden: true, accept: ".tfm,.txt,.json", id: "transform-file", onchange: () => this.import() });
    this.parts = h("div", {}, this.beads.element, this.points.element, this.fit.element, this.errors.element,
      group("5  Use", null, this.useWords, this.useButton, this.dropButton, h("div", { class: "fields" }, this.exports), this.exportWords),
      this.surface.element, this.trace.element, this.calibration.element);
    this.list = h("ul", { class: "list" });
    this.showDeleted = h("input", { type: "checkbox", onchange: () => this.update(connection.state) });
    this.element = h("div", { class: "register" },
      group("Registration", [this.undoButton, this.redoButton, this.lockButton], this.head, this.blockedWords, this.restoreButton, this.dropHere, this.beginButton), this.parts,
      group("Registrations", [h("button", { type: "button", class: "plain", id: "new-registration", "data-operation": "registration.new", onclick: () => this.add() }, "New")], this.list,
        h("label", { class: "check" }, this.showDeleted, "Show deleted"),
        h("button", { type: "button", class: "wide", id: "import-transform", onclick: () => this.chooser.click() }, "Import transform …"), this.chooser));
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
    const { registration } = state;
    this.parts.hidden = !registration;
    this.changedHead([registration?.id, registration?.name, registration?.locked, registration?.deleted, registration?.can_undo, registration?.can_redo, registration?.calibration.to, state.plan_use], () => this.renderHead(registration, state.plan_use));
    this.changedList([state.registrations, registration?.id, this.showDeleted.checked], () => this.renderList(state));
    if (!registration) return;
    for (const part of [this.beads, this.fit, this.errors]) part.update(registration);
    this.points.update(registration, state.pointer);
    this.surface.update(registration, state.structures?.items ?? [], state.pointer);
    this.trace.update(registration, state);
    this.calibration.update(registration, state.pointer);
    this.changedUse([state.plan_use, registration.fit.state, registration.made_from, registration.deleted, registration.calibration.to], () => this.renderUse(registration, state.plan_use));
  }

  /**
   * @param {RegistrationSection | null | undefined} registration
   * @param {PlanUseSection | null | undefined} use
   */
  renderHead(registration, use) {
    this.undoButton.disabled = !registration?.can_undo;
    this.redoButton.disabled = !registration?.can_redo;
    this.lockButton.hidden = !registration;
    this.lockButton.textContent = registration?.locked ? "Unlock" : "Lock";
    this.lockButton.setAttribute("aria-pressed", String(Boolean(registration?.locked)));
    this.beginButton.hidden = Boolean(registration);
    const blocked = use && !use.here && isBlocked(use); // what it refers to is not what is open here
    this.blockedWords.hidden = this.dropHere.hidden = !blocked;
    say(this.blockedWords, blocked ? `${use.words} Until then the plan is not driven.` : "");
    this.dropHere.disabled = Boolean(use?.locked);
    this.restoreButton.hidden = !registration?.deleted && !(blocked && use.state === "deleted");
    this.restoreButton.textContent = `Restore ‘${registration?.deleted ? registration.name : use?.name ?? ""}’`;
    if (!registration) say(this.head, WHAT);
    else if (registration.deleted) say(this.head, `‘${registration.name}’ is deleted. Restore it, or open another one.`);
    else say(this.head, `‘${registration.name}’${registration.calibration.to === "base" ? ", to the robot's base" : ""}${registration.locked ? ": locked." : ""}`);
  }

  /**
   * @param {RegistrationSection} registration
   * @param {PlanUseSection | null | undefined} use
   */
  renderUse(registration, use) {
    const usable = ["fitted", "given", "refined"].includes(registration.fit.state) && !registration.deleted;
    const words = use?.words ?? "Open a plan to use a registration for it.";
    say(this.useWords, use?.here ? words.replace(registration.fit.words, "").trim() : words); // 3 Fit says it
    this.useWords.classList.toggle("caution", isBlocked(use));
    this.useButton.hidden = !use || (use.here && use.state === "ready");
    this.useButton.disabled = !usable || Boolean(use?.locked);
    this.useButton.title = use?.locked ? "The plan is locked. Unlock it in Plan." : usable ? "" : notUsable(registration);
    say(this.exportWords, exportWords(registration.calibration.to));
    this.dropButton.hidden = !use?.registration;
    this.dropButton.disabled = Boolean(use?.locked);
    this.exports.forEach((button, index) => {
      button.disabled = !usable;
      button.title = usable ? EXPORTS[index][2] : notUsable(registration);
    });
  }

  /** @param {ViewModel} state */
  renderList(state) {
    const shown = (state.registrations?.items ?? []).filter((item) => this.showDeleted.checked || !item.deleted);
    keyed(this.list, shown, (item) => `${item.id} ${item.deleted}`, (item) => this.row(item),
      (row, item) => fillListRow(row, item, when(item.modified), item.id === state.registration?.id));
  }

  /**
   * @param {RegistrationEntry} item
   * @returns {Row<RegistrationEntry>}
   */
  row({ deleted }) {
    const send = (/** @type {"registration.open" | "registration.duplicate" | "registration.restore"} */ type) => this.connection.send(type, { registration_id: row.item.id });
    const tools = deleted ? [iconButton("restore", "Restore", () => send("registration.restore"), { "data-operation": "registration.restore" })] : [
      iconButton("pencil", "Rename", async () => {
        const { id, name: before } = row.item;
        const name = await askName("Rename registration", before);
        if (name) this.connection.send("registration.rename", { registration_id: id, name });
      }, { "data-operation": "registration.rename" }),
      iconButton("copy", "Duplicate", () => send("registration.duplicate"), { "data-operation": "registration.duplicate" }),
      iconButton("trash", "Delete", () => this.remove(row.item.id), { "data-operation": "registration.delete" }),
    ];
    /** @type {Row<RegistrationEntry>} */
    const row = listRow(deleted, () => send("registration.open"), tools);
    return row;
  }

  /** What is open here and deleted, else what the plan refers to. */
  restore() {
    const { registration, plan_use: use } = this.connection.state;
    const id = registration?.deleted ? registration.id : use?.registration;
    if (id) this.connection.send("registration.restore", { registration_id: id });
  }

  /** @param {string} id */
  remove(id) {
    const fields = { registration_id: id };
    const used = this.connection.state.plan_use?.registration === id;
    noteDone(this.connection.request("registration.delete", fields), used ? "Registration deleted. The open plan used it and is not driven." : "Registration deleted.",
      { label: "Restore", run: () => this.connection.send("registration.restore", fields) });
  }

  async add() {
    const name = await askName("New registration", `Registration ${(this.connection.state.registrations?.items.length ?? 0) + 1}`, "Create");
    if (!name) return;
    this.connection.send("registration.new", { name });
    this.element.parentElement?.scrollTo({ top: 0 });
  }

  /** @param {string} format */
  export(format) {
    const { registration } = this.connection.state;
    if (registration) download(`/api/v1/registrations/${encodeURIComponent(registration.id)}/export?format=${encodeURIComponent(format)}`);
  }

  async import() {
    const file = this.chooser.files?.[0];
    this.chooser.value = "";
    clearErrors();
    const caseId = this.connection.state.case?.id;
    if (!file || !caseId) return;
    const form = new FormData();
    form.append("file", file);
    try {
      /** @type {RegistrationPublic} */
      const made = await upload(`/api/v1/cases/${encodeURIComponent(caseId)}/registrations/import`, form, () => {});
      await this.connection.request("registration.open", { registration_id: made.id });
      note(importedWords(made), { stay: made.fit.simulated || !made.said?.to });
    } catch (error) {
      note(/** @type {Error} */ (error).message, { error: true });
    }
  }
}

/**
 * Whether a plan refers to a registration that it cannot use.
 * @param {PlanUseSection | null | undefined} use
 */
function isBlocked(use) {
  return Boolean(use) && use?.state !== "none" && use?.state !== "ready";
}

/**
 * Why a registration can neither be used nor exported.
 * @param {RegistrationSection} registration
 */
function notUsable({ deleted, fit }) {
  if (deleted) return "Restore the deleted registration first.";
  if (fit.state === "inconsistent") return brief(fit.words);
  return fit.state === "misfit" ? "Points do not fit: match their order or measure again." : "Fit the points first.";
}
