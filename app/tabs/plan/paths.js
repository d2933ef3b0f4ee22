// The paths of a plan, of which one is chosen, where it enters, and the plan's notes.
import { fillListRow, group, h, iconButton, keyed, listRow, whenChanged } from "/static/js/dom.js";
import { count } from "/static/js/format.js";
import { askName, noteEdit } from "/static/js/dialogs.js";
import { field } from "/static/js/fields.js";

/** @import { Row } from "/static/js/dom.js" */
/** @import { Connection } from "/static/js/connection.js" */
/** @import { Commands, PathView, PathsSection, ViewModel } from "/static/js/types.js" */

/** @type {[Commands["path.side"]["side"], string][]} */
const SIDES = [["", "Not set"], ["left", "Left nostril"], ["right", "Right nostril"], ["midline", "Midline"]];

export class PathsGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.list = h("ul", { class: "list two-lines plain-rows", id: "paths" });
    this.newButton = h("button", { type: "button", class: "plain", id: "new-path", "data-operation": "path.new", title: "Add an empty path with the same tool", onclick: () => connection.send("path.new") }, "New");
    /** @type {HTMLSelectElement} */
    this.side = h("select", { id: "entry-side", "data-operation": "path.side", onchange: () => this.sendSide() }, SIDES.map(([value, label]) => h("option", { value }, label)));
    /** @type {HTMLTextAreaElement} */
    this.notes = h("textarea", { id: "plan-notes", "data-operation": "plan.notes", rows: 3, maxLength: 10_000, placeholder: "What others should know of this plan", onchange: () => connection.send("plan.notes", { notes: this.notes.value }) });
    this.sideCaution = h("p", { class: "words caution", id: "side-caution" });
    this.element = group("Paths", [this.newButton], this.list);
    this.sideElement = h("div", { class: "fields" }, field("Side", "", this.side), this.sideCaution);
    this.notesElement = group("Notes", null, h("label", { class: "field" }, h("span", { class: "visually-hidden" }, "Notes of the plan"), this.notes));
  }

  /** @param {ViewModel} state */
  update({ paths }) {
    this.changed([paths, Boolean(paths)], () => this.render(paths));
  }

  /** @param {PathsSection | null | undefined} paths */
  render(paths) {
    const items = paths?.items ?? [];
    keyed(this.list, items, (item) => item.id, () => this.row(), (row, item) => {
      fillListRow(row, item, `${count(item.points, "point", "points")} · ${item.tool}`, item.id === paths?.chosen);
      const remove = /** @type {HTMLButtonElement | null} */ (row.querySelector('[aria-label="Delete"]'));
      if (remove) remove.disabled = items.length < 2 || Boolean(paths?.locked);
    });
    const frozen = !paths || paths.locked;
    for (const control of [this.newButton, this.side, this.notes]) control.disabled = frozen;
    this.side.value = items.find((item) => item.id === paths?.chosen)?.entry_side ?? "";
    this.sideCaution.textContent = paths?.side_caution ?? "";
    if (document.activeElement !== this.notes) this.notes.value = paths?.notes ?? "";
  }

  sendSide() {
    const chosen = this.connection.state.paths?.chosen;
    if (chosen) this.connection.send("path.side", { path_id: chosen, side: /** @type {Commands["path.side"]["side"]} */ (this.side.value) });
  }

  /** @returns {Row<PathView>} */
  row() {
    const send = (/** @type {"path.choose" | "path.duplicate"} */ type) => this.connection.send(type, { path_id: row.item.id });
    /** @type {Row<PathView>} */
    const row = listRow(false, () => send("path.choose"), [
      iconButton("pencil", "Rename", () => this.rename(row.item), { "data-operation": "path.rename" }),
      iconButton("copy", "Duplicate", () => send("path.duplicate"), { "data-operation": "path.duplicate" }),
      iconButton("trash", "Delete", () => this.remove(row.item), { "data-operation": "path.delete" }),
    ]);
    return row;
  }

  /** @param {PathView} path */
  async rename(path) {
    const name = await askName(`Rename ${path.name}`, path.name);
    if (name) this.connection.send("path.rename", { path_id: path.id, name });
  }

  /** @param {PathView} path */
  remove(path) {
    noteEdit(this.connection, "plan", this.connection.request("path.delete", { path_id: path.id }), `${path.name} was deleted.`);
  }
}
