// Volumes that can be laid over the open head: an MR, another CT. Listed, named, deleted; new ones out of files.
import { askName, confirm, note } from "/static/js/dialogs.js";
import { fillListRow, group, h, iconButton, keyed, listRow, whenChanged } from "/static/js/dom.js";
import { change, remove } from "/static/js/rest.js";

/** @import { Row } from "/static/js/dom.js" */
/** @import { CaseSection, ViewModel } from "/static/js/types.js" */
/** @typedef {CaseSection["overlays"][number]} Overlay */

/** The user's word that the description of a DICOM series, which may tell of the patient, becomes the name. */
export function descriptionCheck() {
  /** @type {HTMLInputElement} */
  const input = h("input", { type: "checkbox" });
  const title = "Off: named by kind, number and time. A series description is text of the file, and may tell of the patient";
  return { input, element: h("label", { class: "check", title }, input, "Name it by its series description") };
}

export class OverlaysGroup {
  /** @param {(files: File[]) => void} send lays chosen files over the open head */
  constructor(send) {
    this.caseId = "";
    /** @type {Overlay[]} */
    this.items = [];
    this.changed = whenChanged();
    this.words = h("p", { class: "words" });
    this.list = h("ul", { class: "list", id: "overlays", "aria-label": "Second volumes" });
    const chooser = (/** @type {Record<string, unknown>} */ props) => {
      /** @type {HTMLInputElement} */
      const input = h("input", {
        type: "file", hidden: true, multiple: true, ...props,
        onchange: () => {
          const files = [...input.files ?? []];
          input.value = "";
          if (files.length) send(files);
        },
      });
      return input;
    };
    this.chooser = chooser({ id: "overlay-file" });
    this.folderChooser = chooser({ id: "overlay-folder", webkitdirectory: true });
    this.button = h("button", { type: "button", id: "import-overlay", onclick: () => this.chooser.click() }, "Add a volume …");
    this.folderButton = h("button", { type: "button", id: "import-overlay-folder", onclick: () => this.folderChooser.click() }, "Folder …");
    this.describe = descriptionCheck();
    this.element = group("Second volumes", null, this.list, this.words, h("div", { class: "buttons even" }, this.button, this.folderButton), this.describe.element, this.chooser, this.folderChooser);
  }

  /** @param {ViewModel} state */
  update({ case: open }) {
    this.changed([open?.id, open?.overlays], () => this.render(open ?? null));
  }

  /** @param {CaseSection | null} open */
  render(open) {
    this.caseId = open?.id ?? "";
    const items = open?.overlays ?? [];
    this.items = items;
    this.button.disabled = this.folderButton.disabled = !open?.has_volume;
    keyed(this.list, items, (item) => item.id, () => this.row(), (row, item) => fillListRow(row, item, item.words, false));
    this.list.hidden = !items.length;
    const doubts = items.flatMap((item) => (item.notes.length ? [`${item.name}: ${item.notes.join(" ")}`] : []));
    this.words.textContent = items.length
      ? ["Lay one over the slices with ‘Second volume’ below them.", ...doubts].join(" ")
      : "An MR or another CT of this patient (DICOM, NRRD, NIfTI, MetaImage), to be laid over the slices by a transform.";
    this.words.className = doubts.length ? "words caution" : "words";
  }

  /** @param {string} id */
  async rename(id) {
    const name = await askName("Name this volume", this.items.find((item) => item.id === id)?.name ?? "");
    if (name) this.ask(change(this.address(id), { name }));
  }

  nameNewest() {
    const newest = this.items.at(-1);
    if (newest) this.rename(newest.id);
  }

  /** @returns {Row<Overlay>} */
  row() {
    const rename = () => this.rename(row.item.id);
    /** @type {Row<Overlay>} */
    const row = listRow(false, rename, [iconButton("pencil", "Rename", rename), iconButton("trash", "Delete", () => this.remove(row.item))]);
    return row;
  }

  /** @param {Overlay} item */
  async remove(item) {
    const sure = await confirm(`Delete ‘${item.name}’?`, "The volume is taken off this head. Its file can be imported again.", "Delete");
    if (sure) this.ask(remove(this.address(item.id)));
  }

  /** @param {string} id */
  address(id) {
    return `/api/v1/cases/${encodeURIComponent(this.caseId)}/overlays/${encodeURIComponent(id)}`;
  }

  /** @param {Promise<unknown>} answer */
  ask(answer) {
    answer.catch((error) => note(error.message, { error: true }));
  }
}
