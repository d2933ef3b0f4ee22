// Plan: the points of the path and the targets, and what the tool makes of them.
import { h, group, iconButton, whenChanged } from "../dom.js";
import { fixed, mm, sentence, when } from "../format.js";
import { FRAME_QUESTION, askChoices, askName, confirm, note } from "../dialogs.js";
import { download, upload } from "../rest.js";

const EXPORTS = [
  ["json", "vfix plan (JSON)", "Everything, comes back as it was"],
  ["mrk.json", "3D Slicer markups (.mrk.json)", "Control points, dense curve with bone clearance, targets"],
  ["csv", "Table (.csv)", "Points and targets in mm"],
];

export class PlanPanel {
  constructor(connection) {
    this.connection = connection;
    this.changedPlan = whenChanged();
    this.changedPlans = whenChanged();
    this.buildTools();
    this.buildPlans();
    this.points = h("tbody");
    this.targets = h("tbody");
    this.buildSelected();
    this.pathWords = h("p", { class: "words" });
    this.targetWords = h("p", { class: "empty" });
    this.pointWords = h("p", { class: "empty" });
    this.corridor = h("p", { class: "words", id: "verdict" });
    this.marginWarning = h("p", { class: "words caution", id: "margin-warning" });
    this.exports = h("div", { class: "list" }, EXPORTS.map(([format, label, words]) =>
      h("button", { type: "button", class: "export", title: words, "data-format": format, onclick: () => this.export(format) }, label)));
    this.element = h("div", {},
      group("A click adds", [this.undoButton, this.redoButton, this.lockButton], this.modes, this.lockWords),
      group("Path", null, this.table("point", this.points), this.pointWords, this.pathWords, this.corridor, this.marginWarning),
      group("Targets", null, this.table("target", this.targets), this.targetWords),
      group("Selected", null, this.selectedWords, this.selectedTools),
      group("Plans of this head", [h("button", { type: "button", class: "plain", onclick: () => this.newPlan() }, "New")], this.planList,
        h("label", { class: "check" }, this.showDeleted, "Show deleted plans")),
      group("Export and import", null, this.exports,
        h("button", { type: "button", class: "wide", onclick: () => this.chooser.click() }, "Import a plan …"), this.chooser));
  }

  buildTools() {
    const send = (type, fields) => this.connection.send(type, fields);
    this.undoButton = iconButton("undo", "Undo (Ctrl+Z)", () => send("undo"), { id: "undo" });
    this.redoButton = iconButton("redo", "Redo (Ctrl+Shift+Z)", () => send("redo"), { id: "redo" });
    this.lockButton = h("button", { type: "button", class: "plain", id: "lock", title: "Locked points cannot be moved, added or deleted", onclick: () => send("lock", { locked: !this.connection.state.plan?.locked }) });
    this.lockWords = h("p", { class: "words" });
    const mode = (kind, label) => h("button", { type: "button", "data-kind": kind, onclick: () => send("add.mode", { kind }) }, label);
    this.modes = h("div", { class: "segmented", role: "group", "aria-label": "What a click adds" },
      mode("point", "Path point"), mode("target", "Target"), mode("none", "Nothing"));
  }

  buildSelected() {
    const act = (type) => () => this.connection.send(type, { item_id: this.connection.state.plan.selected });
    this.selectedWords = h("p", { class: "words" });
    this.insertButton = h("button", { type: "button", id: "insert", onclick: act("point.insert_after"), title: "Add a point half way to the next one" }, "Insert after");
    this.renameButton = h("button", { type: "button", id: "rename-item", onclick: () => this.renameSelected(), title: "F2" }, "Rename");
    this.deleteButton = h("button", { type: "button", id: "delete-item", onclick: act("item.delete"), title: "Del" }, "Delete");
    this.selectedTools = h("div", { class: "buttons even" }, this.insertButton, this.renameButton, this.deleteButton);
  }

  buildPlans() {
    this.planList = h("ul", { class: "list" });
    this.showDeleted = h("input", { type: "checkbox", onchange: () => this.update(this.connection.state) });
    this.chooser = h("input", { type: "file", hidden: true, accept: ".json,.csv,.fcsv", onchange: () => this.importPlan() });
  }

  table(kind, body) {
    const head = h("tr", {}, h("th", { scope: "col" }, kind === "point" ? "Point" : "Target"),
      ["L", "P", "S"].map((axis) => h("th", { scope: "col", title: AXES[axis] }, axis, h("span", { class: "unit" }, " mm"))));
    return h("table", { class: "points", "aria-label": kind === "point" ? "Points of the path, LPS in mm" : "Targets, LPS in mm" }, h("thead", {}, head), body);
  }

  update(state) {
    this.changedPlan([state.plan, state.corridor], () => this.renderPlan(state.plan, state.corridor));
    this.changedPlans([state.plans, state.plan?.id, this.showDeleted.checked], () => this.renderPlans(state));
  }

  renderPlan(plan, corridor) {
    this.undoButton.disabled = !plan?.can_undo;
    this.redoButton.disabled = !plan?.can_redo;
    this.lockButton.textContent = plan?.locked ? "Unlock" : "Lock";
    this.lockButton.setAttribute("aria-pressed", String(Boolean(plan?.locked)));
    this.lockWords.textContent = plan?.locked ? "Points are locked: turning the view cannot move one." : "";
    this.lockWords.hidden = !plan?.locked;
    for (const button of this.modes.children) {
      button.setAttribute("aria-pressed", String(button.dataset.kind === plan?.add_mode));
      button.disabled = !plan || plan.locked;
    }
    this.points.replaceChildren(...(plan?.points ?? []).map((item) => this.pointRow(plan, item, "point")));
    this.targets.replaceChildren(...(plan?.targets ?? []).map((item) => this.pointRow(plan, item, "target")));
    this.points.parentElement.hidden = !plan?.points.length;
    this.targets.parentElement.hidden = !plan?.targets.length;
    this.pointWords.textContent = plan && !plan.points.length ? "No points yet. The first one is where the tool goes in." : "";
    this.pointWords.hidden = this.pointWords.textContent === "";
    this.targetWords.textContent = plan && !plan.targets.length ? "No targets yet. Choose ‘Target’ above and click what is to be inspected." : "";
    this.targetWords.hidden = this.targetWords.textContent === "";
    this.pathWords.textContent = plan?.points.length > 1 ? `Spline of degree ${plan.degree}, ${mm(plan.length_mm)} long. Frame ${plan.frame}, ${plan.unit}.` : "";
    this.corridor.textContent = sentence(corridor?.words ?? "");
    this.marginWarning.textContent = corridor?.warning ? `${sentence(corridor.warning)}.` : "";
    this.marginWarning.hidden = !corridor?.warning;
    this.corridor.className = corridor?.caution ? "words caution" : "words";
    for (const button of this.exports.children) button.disabled = !plan;
    this.renderSelected(plan);
  }

  pointRow(plan, item, kind) {
    const send = (type, fields = {}) => this.connection.send(type, { item_id: item.id, ...fields });
    const select = () => send("item.select");
    return h("tr", {
      tabIndex: 0, "aria-selected": String(plan.selected === item.id), "data-item": item.id, title: "Click to select, double-click to rename",
      onclick: select, ondblclick: () => this.rename(item),
      onkeydown: (event) => {
        if (event.key === "Enter") select();
        if (event.key === "F2") this.rename(item);
        if ((event.key === "Delete" || event.key === "Backspace") && !plan.locked) send("item.delete");
      },
    },
    h("td", { title: item.label }, h("span", { class: kind === "target" ? "dot target" : "dot" }), item.label),
    item.position.map((value) => h("td", {}, fixed(value, 1))));
  }

  renderSelected(plan) {
    const item = plan ? [...plan.points, ...plan.targets].find((entry) => entry.id === plan.selected) : null;
    const index = item ? plan.points.findIndex((entry) => entry.id === item.id) : -1;
    this.selectedWords.textContent = item ? `${item.label}. Drag it in the head or in a slice to move it.` : "Nothing selected. Click a point, a target or a row above.";
    this.insertButton.disabled = !item || plan.locked || index < 0 || index === plan.points.length - 1;
    this.renameButton.disabled = this.deleteButton.disabled = !item || plan.locked;
  }

  renameSelected() {
    const plan = this.connection.state.plan;
    const item = [...plan.points, ...plan.targets].find((entry) => entry.id === plan.selected);
    if (item) this.rename(item);
  }

  async rename(item) {
    const label = await askName(`Rename ${item.label}`, item.label);
    if (label) this.connection.send("item.rename", { item_id: item.id, label });
  }

  renderPlans(state) {
    const shown = (state.plans?.items ?? []).filter((item) => this.showDeleted.checked || !item.deleted);
    this.planList.replaceChildren(...shown.map((item) => this.planRow(item, state.plan?.id)));
  }

  planRow(item, openId) {
    const send = (type, fields = {}) => this.connection.send(type, { plan_id: item.id, ...fields });
    const tools = item.deleted ? [iconButton("restore", "Restore", () => send("plan.restore"))] : [
      iconButton("pencil", "Rename", async () => {
        const name = await askName("Rename this plan", item.name);
        if (name) send("plan.rename", { name });
      }),
      iconButton("copy", "Duplicate", () => send("plan.duplicate")),
      iconButton("trash", "Delete", () => this.connection.request("plan.delete", { plan_id: item.id })
        .then(() => note("The plan was deleted.", { action: { label: "Restore", run: () => send("plan.restore") } }))
        .catch((error) => note(error.message, { error: true }))),
    ];
    const main = h("button", { type: "button", class: "row-main", disabled: item.deleted, onclick: () => send("plan.open") },
      item.name, h("span", { class: "row-sub" }, when(item.modified)));
    return h("li", { class: item.deleted ? "row deleted" : "row", "aria-current": String(item.id === openId) }, main, h("div", { class: "row-tools" }, tools));
  }

  async newPlan() {
    const name = await askName("Name the new plan", "Plan", "Create");
    if (name) this.connection.send("plan.new", { name });
  }

  export(format) {
    const plan = this.connection.state.plan;
    if (plan) download(`/api/plans/${encodeURIComponent(plan.id)}/export?format=${encodeURIComponent(format)}`);
  }

  async importPlan() {
    const file = this.chooser.files[0];
    this.chooser.value = "";
    if (file && this.connection.state.case) await this.send(file, {});
  }

  async send(file, answers) {
    const form = new FormData();
    form.append("file", file);
    for (const [key, value] of Object.entries(answers)) form.append(key, value);
    try {
      const plan = await upload(`/api/cases/${encodeURIComponent(this.connection.state.case.id)}/plans/import`, form, () => {});
      this.connection.send("plan.open", { plan_id: plan.id });
      note("The plan was imported.");
    } catch (error) {
      await this.ask(file, answers, error);
    }
  }

  /** What a file does not say is asked, never guessed. */
  async ask(file, answers, error) {
    if (error.code === "frame_error" && !answers.frame) {
      const chosen = await askChoices("Which frame?", error.message, [FRAME_QUESTION], "Import");
      if (chosen) await this.send(file, { ...answers, ...chosen });
    } else if (/another case/.test(error.message) && !answers.other_case) {
      if (await confirm("Made for another head", error.message, "Import all the same")) await this.send(file, { ...answers, other_case: "yes" });
    } else {
      note(error.message, { error: true });
    }
  }
}

const AXES = { L: "Towards the patient's left", P: "Towards the patient's back", S: "Towards the top of the head" };
