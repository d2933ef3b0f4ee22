// The assignment of the open plan: opened from an instructor's file, with what its runs have to reach.
import { assignment, closeAssignment, criteriaList, openAssignment } from "/static/js/assignments.js";
import { note } from "/static/js/dialogs.js";
import { h } from "/static/js/dom.js";
import { draw, filesButton, html, iconTool, nothing, titled } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { ViewModel } from "/static/js/types.js" */

export class AssignmentGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.element = h("div", { class: "group", id: "assignment" });
    assignment.addEventListener("change", () => this.render());
    this.element.addEventListener("dragover", (event) => event.preventDefault());
    this.element.addEventListener("drop", (event) => {
      event.preventDefault();
      event.stopPropagation();
      this.take([.../** @type {DragEvent} */ (event).dataTransfer?.files ?? []]);
    });
    this.render();
  }

  /** @param {ViewModel} state */
  update(state) {
    assignment.follow(state);
  }

  render() {
    const { open, results } = assignment;
    const tools = open ? iconTool("blocked", "Close assignment", () => this.close(open.id)) : null;
    draw(this.element, titled("Assignment", tools, html`
      ${open && results ? html`<p class="words" id="assignment-words">${open.name}: ${results.passed} of ${results.wanted} passed</p>${criteriaList(results.criteria)}` : nothing}
      <div class="buttons">${filesButton({ id: "open-assignment", input: "assignment-file", words: open ? "Open another" : "Open assignment", disabled: false, title: "A file from your instructor", accept: ".json" }, (files) => this.take(files))}</div>`));
  }

  /** Open a file, and what is driven with it: its plan and mode. @param {File[]} files */
  async take([file]) {
    if (!file) return;
    try {
      const { case_id: head, plan_id: plan, mode, preset } = await openAssignment(file);
      const { state } = this.connection;
      if (state.case?.id !== head) await this.connection.request("case.open", { case_id: head });
      if (state.plan?.id !== plan) await this.connection.request("plan.open", { plan_id: plan });
      await this.connection.request("rehearsal.control", { mode, device: this.connection.state.rehearsal?.control?.device ?? "position", preset });
      await assignment.refresh();
    } catch (error) {
      note(error instanceof Error ? error.message : String(error), { error: true });
    }
  }

  /** @param {string} id */
  async close(id) {
    try {
      await closeAssignment(id);
      await assignment.refresh();
    } catch (error) {
      note(error instanceof Error ? error.message : String(error), { error: true });
    }
  }
}
