// Imported structures of the open head: shown and hidden, named, coloured, deleted; new ones out of a segmentation.
import { h } from "/static/js/dom.js";
import { count } from "/static/js/format.js";
import { askName, confirm, note } from "/static/js/dialogs.js";
import { ListFilter } from "/static/js/list-filter.js";
import { rovingRows } from "/static/js/roving.js";
import { draw, filesButton, html, iconTool, live, nothing, repeat, said, titled, unlessFocused } from "/static/js/template.js";
import { madeOf, wayBack } from "./structure-words.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { StructureEntry, ViewModel } from "/static/js/types.js" */

const NONE_YET = "Import a segmentation. Its labels become structures, each with a name and a colour: .seg.nrrd, a NIfTI label map (with a table of names, if there is one) or a DICOM SEG. A folder of masks names them after its files.";
const SEGMENTATION = { id: "import-segmentation", input: "segmentation-file", words: "Segmentation …", accept: ".nrrd,.nii,.gz,.mha,.dcm,.zip,.json,.csv,.tsv" };
const MASKS = { id: "import-masks", input: "segmentation-folder", words: "Masks …", folder: true, title: "Folder of NIfTI masks, as of TotalSegmentator" };

export class StructuresGroup {
  /**
   * @param {Connection} connection
   * @param {(files: File[]) => void} send imports chosen files into the open head
   */
  constructor(connection, send) {
    this.connection = connection;
    this.send = send;
    this.filter = new ListFilter("structures", () => this.update(connection.state));
    this.element = h("div", { class: "group" });
    this.roving = rovingRows(this.element, ".row-main > input, .structure-end > input, .structure-notes > summary");
  }

  /** @param {ViewModel} state */
  update({ structures, case: open }) {
    const items = structures?.items ?? [];
    const listed = this.filter.of(items);
    const shown = items.some((item) => item.shown);
    const all = html`<button type="button" class="plain" id="structures-all" ?hidden=${!items.length}
      @click=${() => this.connection.send("structure.show", { shown: !shown })}>${shown ? "Hide all" : "Show all"}</button>`;
    draw(this.element, titled("Structures", all, html`
      ${this.filter.field(items.length)}
      <ul class="list structures" aria-label="Structures" ?hidden=${!listed.length}>${repeat(listed, (item) => item.id, (item) => this.row(item))}</ul>
      ${listed.length || !items.length ? nothing : html`<p class="empty">None found.</p>`}
      <p class="words" ?hidden=${items.length > 0}>${said(NONE_YET)}</p>
      <div class="buttons even">
        ${filesButton({ ...SEGMENTATION, disabled: !open }, this.send)}${filesButton({ ...MASKS, disabled: !open }, this.send)}
      </div>`));
    this.roving.update();
  }

  /** @param {StructureEntry} item */
  row(item) {
    const { id, name, notes } = item;
    const value = (/** @type {Event} */ { currentTarget }) => /** @type {HTMLInputElement} */ (currentTarget);
    return html`<li class="row" data-structure=${id}>
      <label class="check row-main" title=${`${name}, ${count(item.triangles, "triangle", "triangles")}`}>
        <input type="checkbox" .checked=${live(item.shown)}
          @change=${(/** @type {Event} */ event) => this.connection.send("structure.show", { structure_id: id, shown: value(event).checked })}>
        <span>${name}</span>
      </label>
      <div class="structure-end">
        <div class="row-tools">
          ${iconTool("pencil", "Rename", () => this.rename(item))}${iconTool("trash", "Delete", () => this.remove(item))}
        </div>
        <input type="color" class="swatch" title="Colour" aria-label=${`Colour of ${name}`} .value=${unlessFocused(item.colour)}
          @change=${(/** @type {Event} */ event) => this.ask("structure.change", { structure_id: id, colour: value(event).value })}>
      </div>
      <details class="structure-notes" ?hidden=${!notes.length}>
        <summary aria-label=${`Notes of ${name}`}>${count(notes.length, "note", "notes")}</summary>
        <p class="words help">${notes.join(" ")}</p>
      </details>
    </li>`;
  }

  /** @param {StructureEntry} item */
  async rename({ id, name: before }) {
    const name = await askName("Rename structure", before);
    if (name) this.ask("structure.change", { structure_id: id, name });
  }

  /** @param {StructureEntry} item */
  async remove(item) {
    const labelled = (this.connection.state.painted?.items ?? []).some((label) => madeOf(item.id, label.id));
    const sure = await confirm(`Delete ‘${item.name}’?`, `The structure is taken off this head. ${wayBack(item.origin, labelled)}`, "Delete");
    if (sure) this.ask("structure.delete", { structure_id: item.id });
  }

  /**
   * Ask for a change, and say why it was refused.
   * @param {"structure.change" | "structure.delete"} type
   * @param {{ structure_id: string, name?: string, colour?: string }} fields
   */
  ask(type, fields) {
    this.connection.request(type, fields).catch((error) => note(error.message, { error: true }));
  }
}
