// The plans of the open head, in a list that is opened from the bar and from the plan's name in the title bar.
import { askName, noteDone, noteEdit } from "/static/js/dialogs.js";
import { byId, h, whenChanged } from "/static/js/dom.js";
import { when } from "/static/js/format.js";
import { ListFilter } from "/static/js/list-filter.js";
import { Popover } from "/static/js/popover.js";
import { Roving } from "/static/js/roving.js";
import { draw, html, iconTool, nameRow, nothing, repeat } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { PlanEntry, ViewModel } from "/static/js/types.js" */

export class PlanList {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.filter = new ListFilter("plans", () => this.again());
    this.deleted = false; // whether deleted ones are shown
    this.element = h("div", { class: "plan-popover", id: "plans-popover", role: "dialog", "aria-label": "Plans of this head" });
    this.roving = new Roving(this.element, ".row-main", { first: '[aria-current="true"] > .row-main' });
    this.element.addEventListener("beforetoggle", (event) => { if (isOpening(event)) this.anew(); });
    this.element.addEventListener("toggle", (event) => { if (isOpening(event)) this.focus(); });
    this.popover = new Popover(this.element, { button: byId("where-plan"), sides: ["below"] });
  }

  anew() {
    this.filter.typed = "";
    this.render(this.connection.state);
  }

  focus() {
    this.element.querySelector(/** @type {"input"} */ ('input[type="text"], [aria-current="true"] > .row-main'))?.focus();
  }

  /** @param {ViewModel} state */
  update(state) {
    this.changed([state.plans, state.plan?.id, state.case?.id], () => this.render(state));
  }

  again = () => this.render(this.connection.state);

  /** @param {ViewModel} state */
  render({ plans, plan }) {
    const all = plans?.items ?? [];
    const listed = all.filter((item) => this.deleted || !item.deleted);
    const shown = this.filter.of(listed);
    const show = (/** @type {Event} */ { currentTarget }) => {
      this.deleted = /** @type {HTMLInputElement} */ (currentTarget).checked;
      this.again();
    };
    draw(this.element, html`
      <div class="group-head"><h2>Plans</h2><button type="button" id="new-plan" data-operation="plan.new" @click=${() => this.add()}>New plan</button></div>
      ${this.filter.field(listed.length)}
      <ul class="list two-lines plain-rows" id="plan-list">${repeat(shown, ({ id, deleted }) => `${id} ${deleted}`, (item) => this.row(item, plan?.id))}</ul>
      ${shown.length ? nothing : html`<p class="empty">${listed.length ? "None found." : "No plans yet."}</p>`}
      <label class="check" ?hidden=${!all.some(({ deleted }) => deleted)}><input type="checkbox" .checked=${this.deleted} @change=${show}>Show deleted</label>`);
    this.roving.update();
  }

  /**
   * @param {PlanEntry} item
   * @param {string | undefined} open id of the open plan
   */
  row(item, open) {
    const { id, name } = item;
    const send = (/** @type {"plan.open" | "plan.duplicate" | "plan.restore"} */ type) => this.connection.send(type, { plan_id: id });
    const take = () => noteEdit(this.connection, "plan", this.connection.request("targets.take", { plan_id: id }), `The targets of ‘${name}’ were added.`);
    const tools = item.deleted ? iconTool("restore", "Restore", () => send("plan.restore"), { operation: "plan.restore" }) : [
      iconTool("pencil", "Rename", () => this.rename(item), { operation: "plan.rename" }),
      iconTool("copy", "Duplicate", () => send("plan.duplicate"), { operation: "plan.duplicate" }),
      iconTool("target", "Take targets", take, { operation: "targets.take", tool: "take-targets", title: "Into the open plan", hidden: id === open }),
      iconTool("trash", "Delete", () => this.remove(id), { operation: "plan.delete" }),
    ];
    const choose = () => {
      this.popover.hide();
      send("plan.open");
    };
    return nameRow(item, when(item.modified), choose, tools, id === open);
  }

  /** A question closes the list: it lies above everything. */
  async add() {
    const name = await askName("Name the new plan", "Plan", "Create");
    if (name) this.connection.send("plan.new", { name });
  }

  /** @param {PlanEntry} item */
  async rename({ id, name: before }) {
    const name = await askName("Rename this plan", before);
    if (name) this.connection.send("plan.rename", { plan_id: id, name });
    this.popover.show(); // the question has closed it
  }

  /** @param {string} id */
  remove(id) {
    const fields = { plan_id: id };
    noteDone(this.connection.request("plan.delete", fields), "The plan was deleted.",
      { label: "Restore", run: () => this.connection.send("plan.restore", fields) });
  }
}

/** @param {Event} event */
function isOpening(event) {
  return /** @type {ToggleEvent} */ (event).newState === "open";
}
