// Named versions of a plan: saved, compared with the plan as it is, and gone back to.
import { fillListRow, group, h, iconButton, keyed, listRow, whenChanged } from "/static/js/dom.js";
import { whenExactly } from "/static/js/format.js";
import { askName, noteDone, noteEdit } from "/static/js/dialogs.js";

/** @import { Row } from "/static/js/dom.js" */
/** @import { Connection } from "/static/js/connection.js" */
/** @import { VersionView, VersionsSection, ViewModel } from "/static/js/types.js" */

export class VersionsGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.saveButton = h("button", { type: "button", class: "plain", id: "save-version", "data-operation": "version.save", onclick: () => this.save() }, "Save");
    this.list = h("ul", { class: "list two-lines plain-rows", id: "versions" });
    this.empty = h("p", { class: "empty" }, "None yet. A version keeps the plan as it is now, to compare it and to come back to it.");
    this.words = h("ul", { class: "changes", id: "version-changes" });
    this.backButton = h("button", { type: "button", class: "wide", id: "go-back", "data-operation": "version.go_back", onclick: () => this.goBack() }, "Go back to this version");
    this.element = group("Versions", [this.saveButton], this.list, this.empty, this.words, this.backButton);
  }

  /** @param {ViewModel} state */
  update({ versions }) {
    this.changed([versions, Boolean(versions)], () => this.render(versions));
  }

  /** @param {VersionsSection | null | undefined} versions */
  render(versions) {
    const items = versions?.items ?? [];
    keyed(this.list, items, (item) => item.id, () => this.row(),
      (row, item) => fillListRow(row, item, whenExactly(item.created), item.id === versions?.compared));
    this.empty.hidden = items.length > 0;
    this.saveButton.disabled = !versions;
    this.words.hidden = this.backButton.hidden = !versions?.compared;
    const changes = versions?.changes.length ? versions.changes : ["The plan is as it was in this version."];
    this.words.replaceChildren(...changes.map((text) => h("li", {}, text)));
    this.backButton.disabled = Boolean(versions?.locked) || !versions?.differs;
    this.backButton.title = versions?.changes.length && !versions.differs ? "Settings of the rehearsal stay as they are now" : "";
  }

  /** @returns {Row<VersionView>} */
  row() {
    /** @type {Row<VersionView>} */
    const row = listRow(false, () => this.connection.send("version.compare", { version_id: row.item.id }), [
      iconButton("pencil", "Rename", () => this.rename(row.item), { "data-operation": "version.rename" }),
      iconButton("trash", "Delete", () => this.remove(row.item), { "data-operation": "version.delete" }),
    ]);
    const main = /** @type {HTMLElement | null} */ (row.querySelector(".row-main"));
    if (main) main.title = "Show what changed since then";
    return row;
  }

  async save() {
    const name = await askName("Save this version of the plan", `Version ${(this.connection.state.versions?.items.length ?? 0) + 1}`);
    if (name) this.connection.send("version.save", { name });
  }

  /** @param {VersionView} version */
  async rename(version) {
    const name = await askName(`Rename ${version.name}`, version.name);
    if (name) this.connection.send("version.rename", { version_id: version.id, name });
  }

  /** @param {VersionView} version */
  remove(version) {
    const fields = { version_id: version.id };
    noteDone(this.connection.request("version.delete", fields), `Version ‘${version.name}’ was deleted.`,
      { label: "Restore", run: () => this.connection.send("version.restore", fields) });
  }

  goBack() {
    const compared = this.connection.state.versions?.compared;
    if (!compared) return;
    noteEdit(this.connection, "plan", this.connection.request("version.go_back", { version_id: compared }), "The plan is as it was in this version.");
  }
}
