// The registrations of the open head: which one is open, and what is done with each; a transform that is imported.
import { askName, clearErrors, note, noteDone } from "/static/js/dialogs.js";
import { h, whenChanged } from "/static/js/dom.js";
import { when } from "/static/js/format.js";
import { ListFilter } from "/static/js/list-filter.js";
import { upload } from "/static/js/rest.js";
import { rovingRows } from "/static/js/roving.js";
import { draw, filesButton, html, iconTool, nameRow, nothing, repeat } from "/static/js/template.js";
import { importedWords } from "./words.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { RegistrationEntry, RegistrationPublic, ViewModel } from "/static/js/types.js" */

const TRANSFORM = { id: "import-transform", input: "transform-file", words: "Import transform …", accept: ".tfm,.txt,.json", disabled: false };

export class RegistrationsList {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.filter = new ListFilter("registrations", () => this.render(connection.state));
    this.deleted = false; // whether deleted ones are shown
    this.element = h("div", { class: "fields" });
    this.roving = rovingRows(this.element);
  }

  /** @param {ViewModel} state */
  update(state) {
    this.changed([state.registrations, state.registration?.id], () => this.render(state));
  }

  /** @param {ViewModel} state */
  render({ registrations, registration }) {
    const all = registrations?.items ?? [];
    const listed = all.filter((item) => this.deleted || !item.deleted);
    const shown = this.filter.of(listed);
    const show = (/** @type {Event} */ { currentTarget }) => {
      this.deleted = /** @type {HTMLInputElement} */ (currentTarget).checked;
      this.render(this.connection.state);
    };
    draw(this.element, html`
      ${this.filter.field(listed.length)}
      <ul class="list two-lines plain-rows" id="registrations" aria-label="Registrations" ?hidden=${!shown.length}>${repeat(shown, ({ id, deleted }) => `${id} ${deleted}`, (item) => this.row(item, registration?.id))}</ul>
      ${shown.length || !listed.length ? nothing : html`<p class="empty">None found.</p>`}
      <label class="check" ?hidden=${!all.some(({ deleted }) => deleted)}><input type="checkbox" .checked=${this.deleted} @change=${show}>Show deleted</label>
      <div class="buttons even"><button type="button" id="new-registration" data-operation="registration.new" @click=${() => this.add()}>New registration</button
        >${filesButton(TRANSFORM, ([file]) => this.import(file))}</div>`);
    this.roving.update();
  }

  /**
   * @param {RegistrationEntry} item
   * @param {string | undefined} open id of the open one
   */
  row(item, open) {
    const send = (/** @type {"registration.open" | "registration.duplicate" | "registration.restore"} */ type) => this.connection.send(type, { registration_id: item.id });
    const tools = item.deleted ? iconTool("restore", "Restore", () => send("registration.restore"), { operation: "registration.restore" }) : [
      iconTool("pencil", "Rename", () => this.rename(item), { operation: "registration.rename" }),
      iconTool("copy", "Duplicate", () => send("registration.duplicate"), { operation: "registration.duplicate" }),
      iconTool("trash", "Delete", () => this.remove(item.id), { operation: "registration.delete" }),
    ];
    return nameRow(item, when(item.modified), () => send("registration.open"), tools, item.id === open);
  }

  /** @param {RegistrationEntry} item */
  async rename({ id, name: before }) {
    const name = await askName("Rename registration", before);
    if (name) this.connection.send("registration.rename", { registration_id: id, name });
  }

  /** @param {string} id */
  remove(id) {
    const fields = { registration_id: id };
    const used = this.connection.state.plan_use?.registration === id;
    noteDone(this.connection.request("registration.delete", fields), used ? "Deleted. The plan used it; choose another." : "Registration deleted.",
      { label: "Restore", run: () => this.connection.send("registration.restore", fields) });
  }

  async add() {
    const name = await askName("New registration", `Registration ${(this.connection.state.registrations?.items.length ?? 0) + 1}`, "Create");
    if (name) this.connection.send("registration.new", { name });
  }

  /** @param {File} file */
  async import(file) {
    clearErrors();
    const caseId = this.connection.state.case?.id;
    if (!caseId) return;
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
