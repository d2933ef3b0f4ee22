// The heads: which one is open, and what is done with each; a whole head saved as one file.
import { h } from "/static/js/dom.js";
import { when } from "/static/js/format.js";
import { askForImages, askName, note, noteDone } from "/static/js/dialogs.js";
import { chooseStudy } from "/static/js/led-study.js";
import { ListFilter } from "/static/js/list-filter.js";
import { download } from "/static/js/rest.js";
import { rovingRows } from "/static/js/roving.js";
import { draw, html, iconTool, live, nameRow, nothing, repeat } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { CaseEntry, ViewModel } from "/static/js/types.js" */

const SAVED = "All of this case as zip";

export class HeadsList {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.filter = new ListFilter("heads", () => this.update(connection.state));
    this.deleted = false; // whether deleted ones are listed
    this.element = h("div", { class: "fields" });
    this.roving = rovingRows(this.element);
  }

  /** @param {ViewModel} state */
  update({ cases, case: open, study }) {
    const items = (cases?.items ?? []).filter((item) => this.deleted || !item.deleted);
    const show = (/** @type {Event} */ { currentTarget }) => {
      this.deleted = /** @type {HTMLInputElement} */ (currentTarget).checked;
      this.update(this.connection.state);
    };
    const shown = this.filter.of(items);
    draw(this.element, html`
      ${this.filter.field(items.length)}
      <ul class="list two-lines plain-rows" id="cases" aria-label="Cases">${repeat(shown, ({ id, deleted }) => `${id} ${deleted}`, (item) => this.row(item, item.id === open?.id))}</ul>
      ${shown.length || !items.length ? nothing : html`<p class="empty">None found.</p>`}
      <button type="button" class="wide" id="save-case" title=${SAVED} ?disabled=${!open} @click=${() => save(open)}>Save ${open?.noun ?? "case"} …</button>
      ${study ? nothing : html`<button type="button" class="wide" id="choose-study" title="A study of people, from its file (.toml)" data-operation="study.new" ?disabled=${!open} @click=${() => chooseStudy(this.connection)}>Open study …</button>`}
      <label class="check"><input type="checkbox" .checked=${live(this.deleted)} @change=${show}>Show deleted</label>`);
    this.roving.update();
  }

  /**
   * @param {CaseEntry} item
   * @param {boolean} open
   */
  row(item, open) {
    const send = (/** @type {"case.open" | "case.restore"} */ type) => this.connection.send(type, { case_id: item.id });
    const tools = item.deleted
      ? iconTool("restore", "Restore", () => send("case.restore"))
      : [iconTool("pencil", "Rename", () => this.rename(item)), iconTool("download", "Save case (zip)", () => save(item)),
        iconTool("trash", "Delete", () => this.remove(item.id), { tool: "delete", title: open ? "The open case cannot be deleted" : "Delete", off: open })];
    return nameRow(item, item.unreadable || when(item.created), () => send("case.open"), tools, open);
  }

  /** @param {CaseEntry} item */
  async rename({ id, name: before }) {
    const name = await askName("Rename case", before);
    if (name) this.connection.send("case.rename", { case_id: id, name });
  }

  /** @param {string} id */
  remove(id) {
    const fields = { case_id: id };
    noteDone(this.connection.request("case.delete", fields), "Case deleted.",
      { label: "Restore", run: () => this.connection.send("case.restore", fields) });
  }
}

/**
 * A head with all that belongs to it, as one file.
 * @param {{ id: string, name: string, images: boolean } | null | undefined} head
 */
async function save(head) {
  if (!head || (head.images && !await askForImages(head.name))) return;
  download(`/api/v1/cases/${encodeURIComponent(head.id)}/archive?with_images=true`);
  note(`‘${head.name}’ is being packed. The browser saves it as a zip with scan, structures, plans and registrations.`);
}
