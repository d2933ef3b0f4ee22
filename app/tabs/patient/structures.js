// Imported structures of the open head: shown and hidden, named, coloured, deleted; new ones out of a segmentation.
import { group, h, iconButton, keyed, whenChanged } from "/static/js/dom.js";
import { count } from "/static/js/format.js";
import { askName, confirm, note } from "/static/js/dialogs.js";
import { madeOf, wayBack } from "./structure-words.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { Row } from "/static/js/dom.js" */
/** @import { StructureEntry, ViewModel } from "/static/js/types.js" */

const NONE_YET = "Labels of a segmentation become structures of this head, each with a name and a colour: .seg.nrrd, a NIfTI label map (with a table of names, if there is one) or a DICOM SEG. A folder of masks names them after its files.";

export class StructuresGroup {
  /**
   * @param {Connection} connection
   * @param {(files: File[]) => void} send imports chosen files into the open head
   */
  constructor(connection, send) {
    this.connection = connection;
    this.changed = whenChanged();
    this.words = h("p", { class: "words" }, NONE_YET);
    this.list = h("ul", { class: "list structures" });
    this.all = h("button", { type: "button", class: "plain", id: "structures-all", onclick: () => this.showAll() });
    /** @type {HTMLInputElement} */
    this.chooser = h("input", {
      type: "file", hidden: true, multiple: true, id: "segmentation-file", accept: ".nrrd,.nii,.gz,.mha,.dcm,.zip,.json,.csv,.tsv",
      onchange: () => {
        const files = [...this.chooser.files ?? []];
        this.chooser.value = "";
        if (files.length) send(files);
      },
    });
    this.button = h("button", { type: "button", id: "import-segmentation", onclick: () => this.chooser.click() }, "Segmentation …");
    /** @type {HTMLInputElement} */
    this.folderChooser = h("input", {
      type: "file", hidden: true, webkitdirectory: true, id: "segmentation-folder",
      onchange: () => {
        const files = [...this.folderChooser.files ?? []];
        this.folderChooser.value = "";
        if (files.length) send(files);
      },
    });
    this.folderButton = h("button", { type: "button", id: "import-masks", title: "A folder of NIfTI masks, one of each structure, as TotalSegmentator writes it; structures are named after the files", onclick: () => this.folderChooser.click() }, "Folder of masks …");
    this.element = group("Structures", [this.all], this.list, this.words, h("div", { class: "buttons even" }, this.button, this.folderButton), this.chooser, this.folderChooser);
    /** @type {StructureEntry[]} */
    this.items = [];
  }

  /** @param {ViewModel} state */
  update(state) {
    this.changed([state.structures, Boolean(state.case)], () => this.render(state.structures?.items ?? [], Boolean(state.case)));
  }

  /**
   * @param {StructureEntry[]} items
   * @param {boolean} open
   */
  render(items, open) {
    this.items = items;
    this.button.disabled = this.folderButton.disabled = !open;
    this.all.hidden = !items.length;
    this.all.textContent = items.some((item) => item.shown) ? "Hide all" : "Show all";
    keyed(this.list, items, (item) => item.id, (item) => this.row(item), (row, item) => fill(row, item));
    this.words.hidden = Boolean(items.length);
  }

  showAll() {
    this.connection.send("structure.show", { shown: !this.items.some((item) => item.shown) });
  }

  /**
   * @param {StructureEntry} entry
   * @returns {Row<StructureEntry>}
   */
  row(entry) {
    /** @type {HTMLInputElement} */
    const shown = h("input", { type: "checkbox", onchange: () => this.connection.send("structure.show", { structure_id: row.item.id, shown: shown.checked }) });
    /** @type {HTMLInputElement} */
    const colour = h("input", {
      type: "color", class: "swatch",
      onchange: () => this.ask("structure.change", { structure_id: row.item.id, colour: colour.value }),
    });
    const label = h("label", { class: "check row-main" }, shown, h("span"));
    const tools = h("div", { class: "row-tools" },
      iconButton("pencil", "Rename", async () => {
        const { id, name: before } = row.item;
        const name = await askName("Rename this structure", before);
        if (name) this.ask("structure.change", { structure_id: id, name });
      }),
      iconButton("trash", "Delete", () => this.remove(row.item)));
    /** @type {Row<StructureEntry>} */
    const row = Object.assign(h("li", { class: "row", "data-structure": entry.id }, label, h("div", { class: "structure-end" }, tools, colour),
      h("details", { class: "structure-notes", hidden: true }, h("summary"), h("p", { class: "words" }))), { item: entry });
    return row;
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

/**
 * @param {HTMLElement} row
 * @param {StructureEntry} item
 */
function fill(row, item) {
  const [shown, colour] = row.querySelectorAll("input");
  const [label, name] = row.querySelectorAll("label, label > span");
  shown.checked = item.shown;
  if (document.activeElement !== colour) colour.value = item.colour;
  colour.setAttribute("aria-label", `Colour of ${item.name}`);
  colour.title = "Colour";
  name.textContent = item.name;
  label.setAttribute("title", `${item.name}, ${count(item.triangles, "triangle", "triangles")}`);
  const notes = /** @type {HTMLElement} */ (row.querySelector("details"));
  const [summary, words] = notes.children;
  notes.hidden = !item.notes.length;
  summary.textContent = count(item.notes.length, "note", "notes");
  summary.setAttribute("aria-label", `Notes of ${item.name}`);
  words.textContent = item.notes.join(" ");
}
