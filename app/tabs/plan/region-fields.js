// The fields of a protected structure, or of bone to be removed, that is selected. They are elements that stay: what is typed
// in them belongs to somebody, whatever is drawn meanwhile.
import { h } from "/static/js/dom.js";
import { placeOf, placeWords } from "/static/js/slices/place-words.js";
import { complain, escapePutsBack, field, heldNumber, isTyped, isWrong, numberInput, putBack, showNumber, watchTyping } from "/static/js/fields.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { Commands, RegionView } from "/static/js/types.js" */

export class RegionFields {
  /**
   * @param {Connection} connection
   * @param {string} prefix of the ids
   */
  constructor(connection, prefix) {
    this.connection = connection;
    /** @type {RegionView | undefined} */
    this.item = undefined;
    this.placed = ""; // whose place the field shows
    /** @type {RegionView | undefined} whose name is being typed, also where another one is selected meanwhile */
    this.named = undefined;
    const id = (/** @type {string} */ name) => `${prefix}-${name}`;
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
    this.place = h("input", { type: "text", id: id("place"), autocomplete: "off", placeholder: "R 24.5 A 10 S 3", title: "R or L, A or P, S or I, in mm", onchange: () => this.move() });
    for (const input of [this.name, this.place]) watchTyping(input);
    /** @type {HTMLInputElement} */
    this.visible = h("input", { type: "checkbox", id: id("visible"), onchange: () => this.send({ visible: this.visible.checked }) });
    this.visibleField = h("label", { class: "check" }, this.visible, "Visible");
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
    this.turn = h("button", { type: "button", id: id("turn"), onclick: () => this.send({ turn: true }) }, "Turn round");
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
    const isProtected = item.purpose === "spare";
    for (const control of this.controls) control.disabled = locked;
    if (!isTyped(this.name) || this.named?.id !== item.id) this.name.value = item.name;
    this.colour.value = item.colour;
    this.soft.value = item.soft ? "soft" : "hard";
    showNumber(this.margin, item.margin_mm);
    showNumber(this.stiffness, item.stiffness_n_per_mm);
    showNumber(this.depth, item.max_depth_mm);
    this.visible.checked = item.visible;
    for (const element of [this.colourField, this.softField, this.marginField, this.visibleField]) element.hidden = !isProtected;
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
