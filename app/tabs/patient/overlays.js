// Volumes that can be laid over the open head: an MR, another CT. Listed, named, deleted; new ones out of files.
import { askName, confirm, note } from "/static/js/dialogs.js";
import { h } from "/static/js/dom.js";
import { ListFilter } from "/static/js/list-filter.js";
import { change, remove } from "/static/js/rest.js";
import { rovingRows } from "/static/js/roving.js";
import { draw, filesButton, html, iconTool, nameRow, nothing, repeat, said, titled } from "/static/js/template.js";

/** @import { CaseSection, ViewModel } from "/static/js/types.js" */
/** @typedef {CaseSection["overlays"][number]} Overlay */

const NONE_YET = "Add an MR or another CT. DICOM, NRRD, NIfTI or MetaImage; it is laid over the slices by a transform.";

/** The user's word that the description of a DICOM series, which may tell of the patient, becomes the name. */
export function descriptionCheck() {
  /** @type {HTMLInputElement} */
  const input = h("input", { type: "checkbox" });
  const title = "A series name may identify the patient";
  return { input, element: h("label", { class: "check", title }, input, "Use series name") };
}

export class OverlaysGroup {
  /** @param {(files: File[]) => void} send lays chosen files over the open head */
  constructor(send) {
    this.send = send;
    /** @type {CaseSection | null | undefined} */
    this.open = null;
    this.describe = descriptionCheck();
    this.filter = new ListFilter("volumes", () => this.update({ case: this.open }));
    this.element = h("div", { class: "group" });
    this.roving = rovingRows(this.element);
  }

  /** @param {Pick<ViewModel, "case">} state */
  update({ case: open }) {
    this.open = open;
    const items = open?.overlays ?? [];
    const disabled = !open?.has_volume;
    const shown = this.filter.of(items);
    const doubts = items.flatMap((item) => (item.notes.length ? [`${item.name}: ${item.notes.join(" ")}`] : []));
    draw(this.element, titled("Second volumes", null, html`
      ${this.filter.field(items.length)}
      <ul class="list" id="overlays" aria-label="Second volumes" ?hidden=${!shown.length}>${repeat(shown, (item) => item.id, (item) => this.row(item))}</ul>
      ${shown.length || !items.length ? nothing : html`<p class="empty">None found.</p>`}
      <p class=${doubts.length ? "words caution" : "words"}>${said(items.length ? ["Show it by ‘Second volume’ at the slices.", ...doubts].join(" ") : NONE_YET)}</p>
      <div class="buttons even">
        ${filesButton({ id: "import-overlay", input: "overlay-file", words: "Add volume …", disabled }, this.send)}
        ${filesButton({ id: "import-overlay-folder", input: "overlay-folder", words: "Folder …", folder: true, disabled }, this.send)}
      </div>
      ${this.describe.element}`));
    this.roving.update();
  }

  /** @param {Overlay} item */
  row(item) {
    const rename = () => this.rename(item);
    return nameRow(item, item.words, rename, [iconTool("pencil", "Rename", rename), iconTool("trash", "Delete", () => this.remove(item))]);
  }

  /** @param {Overlay} item */
  async rename(item) {
    const name = await askName("Rename volume", item.name);
    if (name) this.ask(change(this.address(item), { name }));
  }

  nameNewest() {
    const newest = this.open?.overlays.at(-1);
    if (newest) this.rename(newest);
  }

  /** @param {Overlay} item */
  async remove(item) {
    const sure = await confirm(`Delete ‘${item.name}’?`, "The volume is taken off this head. Its file can be imported again.", "Delete");
    if (sure) this.ask(remove(this.address(item)));
  }

  /** @param {Overlay} item */
  address({ id }) {
    return `/api/v1/cases/${encodeURIComponent(this.open?.id ?? "")}/overlays/${encodeURIComponent(id)}`;
  }

  /** @param {Promise<unknown>} answer */
  ask(answer) {
    answer.catch((error) => note(error.message, { error: true }));
  }
}
