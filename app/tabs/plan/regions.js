// Structures to spare and bone to be removed: drawn by clicks, listed, and changed.
import { fillListRow, group, h, iconButton, keyed, listRow, whenChanged } from "/static/js/dom.js";
import { count } from "/static/js/format.js";
import { placeOf, placeWords } from "/static/js/slices/place-words.js";
import { complain, escapePutsBack, field, heldNumber, isTyped, isWrong, numberInput, ownNumber, putBack, showNumber, watchTyping } from "/static/js/fields.js";
import { unfold } from "/static/js/folding.js";

/** @import { Row } from "/static/js/dom.js" */
/** @import { Connection } from "/static/js/connection.js" */
/** @import { Commands, RegionView, RegionsSection, RemovedBoneSection, ViewModel } from "/static/js/types.js" */
/** @typedef {RegionView["purpose"]} Purpose */
/** @typedef {Commands["region.draw"]["kind"]} Kind */

/** @type {Record<Purpose, [Kind, string][]>} */
const KINDS = {
  spare: [["sphere", "Sphere"], ["capsules", "Chain of points"], ["box", "Box"], ["half_space", "Half-space"], ["patch", "Patch of bone"]],
  remove: [["sphere", "Sphere"], ["capsule", "Capsule"], ["box", "Box"]],
};
/** @type {[NonNullable<Commands["region.draw"]["free_side"]>, string][]} */
const SIDES = [["I", "below"], ["S", "above"], ["A", "in front"], ["P", "behind"], ["R", "to the right"], ["L", "to the left"]];
const WORDS = {
  spare: { title: "Structures to spare", none: "None yet. The tool keeps away from what is marked here, in the dry run and in the drive." },
  remove: { title: "Bone to be removed", none: "None yet. Mark the walls that are opened before the tool goes in." },
};

export class RegionsGroup {
  /**
   * @param {Connection} connection
   * @param {Purpose} purpose
   */
  constructor(connection, purpose) {
    this.connection = connection;
    this.purpose = purpose;
    this.changed = whenChanged();
    /** @type {string | null | undefined} what was selected when this was unfolded last */
    this.unfolded = null;
    /** @type {HTMLSelectElement} */
    this.kind = h("select", { id: `${purpose}-kind`, "aria-label": "Shape", onchange: () => this.renderDrawing(this.connection.state.regions) }, KINDS[purpose].map(([value, label]) => h("option", { value }, label)));
    this.size = ownNumber(`${purpose}-size`, 0.1, 200, 0.5, 3);
    this.sizeField = field("Radius", "mm", this.size);
    /** @type {HTMLSelectElement} */
    this.side = h("select", { id: `${purpose}-side`, "aria-label": "The tool stays" }, SIDES.map(([value, label]) => h("option", { value }, label)));
    this.sideField = field("The tool stays", "", this.side);
    this.drawButton = h("button", { type: "button", id: `${purpose}-draw`, onclick: () => this.draw() });
    this.doneButton = h("button", { type: "button", class: "primary", id: `${purpose}-done`, title: "Enter", onclick: () => connection.send("region.done") }, "Done");
    this.drawingWords = h("p", { class: "words", role: "status" });
    /** @type {HTMLSelectElement} */
    this.structure = h("select", { id: `${purpose}-structure`, "data-operation": "region.structure", "aria-label": "Structure of this head", onchange: () => this.spareStructure() });
    this.list = h("ul", { class: "list two-lines", id: `${purpose}-list` });
    this.empty = h("p", { class: "empty" }, WORDS[purpose].none);
    this.total = h("p", { class: "words", id: `${purpose}-total`, role: "status" });
    this.editor = new RegionEditor(connection, purpose);
    this.element = group(WORDS[purpose].title, null, this.list, this.empty, this.total, this.editor.element,
      h("div", { class: "buttons even" }, field("Shape", "", this.kind), this.sizeField, this.sideField),
      h("div", { class: "buttons even" }, this.drawButton, this.doneButton), this.drawingWords, this.structure);
  }

  /** @param {ViewModel} state */
  update({ regions, removed_bone: removed }) {
    this.changed([regions, Boolean(regions), removed], () => this.render(regions, removed));
  }

  /**
   * @param {RegionsSection | null | undefined} regions
   * @param {RemovedBoneSection | null | undefined} removed
   */
  render(regions, removed) {
    const held = new Map((removed?.items ?? []).map((item) => [item.id, item.words]));
    const items = (regions?.items ?? []).filter((item) => item.purpose === this.purpose);
    keyed(this.list, items, (item) => item.id, () => this.row(), (row, item) => {
      fillListRow(row, item, [item.sub, held.get(item.id)].filter(Boolean).join(" · "), item.id === regions?.selected);
      /** @type {HTMLElement} */ (row.querySelector(".swatch")).style.background = item.colour;
    });
    this.empty.hidden = items.length > 0;
    this.total.hidden = this.purpose === "spare" || items.length === 0;
    this.total.textContent = removed ? removed.words : "The bone in it is counted …";
    if (items.some((item) => item.id === regions?.selected && item.id !== this.unfolded)) unfold(this.element);
    this.unfolded = regions?.selected;
    const structures = this.purpose === "spare" ? regions?.structures ?? [] : [];
    this.structure.hidden = !structures.length;
    this.structure.replaceChildren(h("option", { value: "" }, "Spare a structure of this head …"), ...structures.map(({ id, name }) => h("option", { value: id }, name)));
    this.structure.disabled = !regions || regions.locked;
    this.renderDrawing(regions);
    this.editor.render(items.find((item) => item.id === regions?.selected), Boolean(regions?.locked));
  }

  /** @param {RegionsSection | null | undefined} regions */
  renderDrawing(regions) {
    const drawing = regions?.drawing?.purpose === this.purpose ? regions.drawing : null;
    const kind = /** @type {Kind} */ (this.kind.value);
    const frozen = !regions || regions.locked;
    for (const control of [this.kind, this.size, this.side]) control.disabled = frozen || Boolean(drawing);
    const label = this.sizeField.querySelector("span span");
    if (label) label.textContent = kind === "box" ? "Edge" : "Radius";
    this.sizeField.hidden = kind === "half_space";
    this.sideField.hidden = kind !== "half_space";
    this.drawButton.disabled = frozen;
    this.drawButton.textContent = drawing ? "Cancel" : "Draw by clicking";
    this.drawButton.title = drawing ? "Esc" : "The next click in the head or in a slice places it";
    this.doneButton.hidden = drawing?.kind !== "capsules";
    this.doneButton.disabled = !drawing?.places.length;
    this.drawingWords.hidden = !drawing;
    this.drawingWords.textContent = drawing ? `${drawing.words}${drawing.places.length ? ` ${count(drawing.places.length, "place", "places")} so far.` : ""}` : "";
  }

  draw() {
    if (this.connection.state.regions?.drawing) {
      this.connection.send("region.cancel");
      return;
    }
    const kind = /** @type {Kind} */ (this.kind.value);
    const size = Number(heldNumber(this.size));
    const sizes_mm = kind === "box" ? [size / 2, size / 2, size / 2] : [size];
    this.connection.send("region.draw", { purpose: this.purpose, kind, sizes_mm, free_side: /** @type {Commands["region.draw"]["free_side"]} */ (this.side.value) });
  }

  spareStructure() {
    const structure = this.structure.value;
    this.structure.value = "";
    if (structure) this.connection.send("region.structure", { structure });
  }

  /** @returns {Row<RegionView>} */
  row() {
    const send = (/** @type {"region.select" | "region.delete"} */ type) => this.connection.send(type, { region_id: row.item.id });
    /** @type {Row<RegionView>} */
    const row = listRow(false, () => send("region.select"), [iconButton("trash", "Delete", () => send("region.delete"), { "data-operation": "region.delete" })]);
    row.querySelector(".row-main")?.prepend(h("i", { class: this.purpose === "spare" ? "swatch" : "swatch net" }));
    row.addEventListener("keydown", (event) => {
      if (event.key !== "Delete" || this.connection.state.regions?.locked) return;
      event.preventDefault();
      event.stopPropagation();
      send("region.delete");
    });
    return row;
  }
}

/** The fields of the region that is selected. */
class RegionEditor {
  /**
   * @param {Connection} connection
   * @param {Purpose} purpose
   */
  constructor(connection, purpose) {
    this.connection = connection;
    /** @type {RegionView | undefined} */
    this.item = undefined;
    this.placed = ""; // whose place the field shows
    /** @type {RegionView | undefined} whose name is being typed, also where another one is selected meanwhile */
    this.named = undefined;
    const id = (/** @type {string} */ name) => `${purpose}-${name}`;
    /** @type {HTMLInputElement} */
    this.name = h("input", { type: "text", id: id("name"), "data-operation": "region.change", maxLength: 56, oninput: () => { this.named = this.item; }, onchange: () => this.rename() });
    /** @type {HTMLInputElement} */
    this.colour = h("input", { type: "color", id: id("colour"), onchange: () => this.send({ colour: this.colour.value }) });
    /** @type {HTMLSelectElement} */
    this.soft = h("select", { id: id("soft"), onchange: () => this.send({ soft: this.soft.value === "soft" }) }, h("option", { value: "hard" }, "Hard"), h("option", { value: "soft" }, "Soft"));
    this.margin = numberInput(id("margin"), 0, 20, 0.1, (value) => this.send({ margin_mm: value }));
    this.stiffness = numberInput(id("stiffness"), 0.01, 100, 0.1, (value) => this.send({ stiffness_n_per_mm: value }));
    this.depth = numberInput(id("depth"), 0, 20, 0.1, (value) => this.send({ max_depth_mm: value }), () => this.send({ no_depth: true }));
    this.sizes = [0, 1, 2].map((axis) => numberInput(id(`size-${axis}`), 0.1, 400, 0.5, () => this.resize()));
    /** @type {HTMLInputElement} */
    this.place = h("input", { type: "text", id: id("place"), autocomplete: "off", placeholder: "R 24.5 A 10 S 3", title: "Right or left, front (A) or back (P), up (S) or down (I), in mm", onchange: () => this.move() });
    for (const input of [this.name, this.place]) watchTyping(input);
    /** @type {HTMLInputElement} */
    this.visible = h("input", { type: "checkbox", id: id("visible"), onchange: () => this.send({ visible: this.visible.checked }) });
    this.visibleField = h("label", { class: "check" }, this.visible, "Shown in the head");
    escapePutsBack(this.place);
    this.marginField = field("Margin", "mm", this.margin);
    this.stiffnessField = field("Stiffness", "N/mm", this.stiffness);
    this.depthField = field("Deepest", "mm", this.depth);
    this.depth.placeholder = "open";
    this.softField = field("Firmness", "", this.soft);
    this.colourField = field("Colour", "", this.colour);
    this.softRow = h("div", { class: "buttons even" }, this.stiffnessField, this.depthField);
    this.sizeFields = this.sizes.map((input) => field("", "mm", input));
    this.sizeRow = h("div", { class: "buttons even" }, this.sizeFields);
    this.placeRow = field("Place", "", this.place);
    this.sideWords = h("p", { class: "words", id: id("side-words") });
    this.turn = h("button", { type: "button", id: id("turn"), onclick: () => this.send({ turn: true }) }, "Turn it round");
    this.sideRow = h("div", { class: "fields" }, this.sideWords, this.turn);
    this.element = h("div", { class: "region-editor" },
      h("div", { class: "buttons even" }, field("Name", "", this.name), this.colourField),
      h("div", { class: "buttons even" }, this.softField, this.marginField),
      this.softRow,
      this.sizeRow, this.placeRow, this.sideRow, this.visibleField);
    this.numbers = [this.margin, this.stiffness, this.depth, ...this.sizes];
    this.controls = [this.name, this.colour, this.soft, this.margin, this.stiffness, this.depth, this.visible, ...this.sizes, this.place, this.turn];
  }

  /** @param {Omit<Commands["region.change"], "region_id">} fields */
  send(fields) {
    if (this.item) this.connection.send("region.change", { region_id: this.item.id, ...fields });
  }

  rename() {
    const name = this.name.value.trim();
    if (this.named && name) this.connection.send("region.change", { region_id: this.named.id, name });
    else if (this.item) this.name.value = this.item.name;
  }

  resize() {
    if (!this.item) return;
    const box = this.item.kind === "box";
    this.send({ sizes_mm: this.sizes.slice(0, this.item.sizes_mm.length).map((input) => (heldNumber(input) ?? 0) / (box ? 2 : 1)) });
  }

  move() {
    const now = this.item?.place;
    if (!now) return;
    try {
      const [typed, shown] = [placeOf(this.place.value), placeOf(placeWords(now))];
      complain(this.place, "");
      // The field shows tenths; an axis that was not typed keeps its place to the last digit.
      const place = typed.map((value, axis) => (value === shown[axis] ? now[axis] : value));
      this.send({ place: /** @type {[number, number, number]} */ (place) });
    } catch (error) {
      complain(this.place, error instanceof Error ? error.message : String(error));
    }
  }

  /**
   * @param {RegionView | undefined} item
   * @param {boolean} locked
   */
  render(item, locked) {
    if (item?.id !== this.item?.id) for (const input of this.numbers) putBack(input); // typed for another one
    this.item = item;
    this.element.hidden = !item;
    if (!item) return;
    const spare = item.purpose === "spare";
    for (const control of this.controls) control.disabled = locked;
    if (!isTyped(this.name) || this.named?.id !== item.id) this.name.value = item.name;
    this.colour.value = item.colour;
    this.soft.value = item.soft ? "soft" : "hard";
    showNumber(this.margin, item.margin_mm);
    showNumber(this.stiffness, item.stiffness_n_per_mm);
    showNumber(this.depth, item.max_depth_mm);
    this.visible.checked = item.visible;
    for (const element of [this.colourField, this.softField, this.marginField, this.visibleField]) element.hidden = !spare;
    this.softRow.hidden = !item.soft;
    const marginLabel = this.marginField.querySelector("span span");
    if (marginLabel) marginLabel.textContent = item.soft ? "Layer" : "Margin";
    this.sizeRow.hidden = !item.sizes_mm.length;
    this.sizes.forEach((input, index) => {
      const box = item.kind === "box";
      this.sizeFields[index].hidden = index >= item.sizes_mm.length;
      const label = this.sizeFields[index].querySelector("span span");
      if (label) label.textContent = box ? ["Width", "Depth", "Height"][index] : "Radius";
      showNumber(input, index < item.sizes_mm.length ? item.sizes_mm[index] * (box ? 2 : 1) : null);
    });
    this.sideRow.hidden = item.kind !== "half_space";
    this.sideWords.textContent = item.sub.split(" · ")[0];
    this.placeRow.hidden = !item.place;
    this.place.dataset.known = item.place ? placeWords(item.place) : "";
    if ((isTyped(this.place) || isWrong(this.place)) && this.placed === item.id) return; // somebody types in it
    this.placed = item.id;
    putBack(this.place);
  }
}
