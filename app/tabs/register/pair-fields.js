// The name and the coordinates of the selected point, to be typed; they stand below its row.
import { noteEdit } from "/static/js/dialogs.js";
import { h } from "/static/js/dom.js";
import { complain, escapePutsBack, isTyped, isWrong, numberInput, putBack, showNumber, watchTyping } from "/static/js/fields.js";
import { placeOf, placeWords } from "/static/js/slices/place-words.js";
import { say } from "/static/js/said.js";
import { readPlace, threeIn } from "/static/js/typed-place.js";
import { field } from "./beads.js";
import { isReal } from "./words.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { PairEntry, TrackerView } from "/static/js/types.js" */

/** @typedef {{ texts: string[], over: string }} Draft what is typed of a place and cannot be taken yet; over: what is held */

const LABEL_MOST = 120;

export class PairFields {
  /**
   * @param {Connection} connection
   * @param {{ touch: (pairId: string) => void, measure: (pairId: string) => void, drafted: () => void }} acts
   */
  constructor(connection, { touch, measure, drafted }) {
    this.connection = connection;
    this.drafted = drafted;
    /** @type {PairEntry | undefined} */
    this.pair = undefined;
    /** @type {Map<string, Draft>} by the pair's id */
    this.drafts = new Map();
    /** @type {HTMLInputElement} */
    this.label = h("input", { type: "text", id: "pair-label", "data-operation": "pair.change", maxLength: LABEL_MOST, onchange: () => this.send({ label: this.label.value }) });
    /** @type {HTMLInputElement} */
    this.image = h("input", { type: "text", id: "pair-image", placeholder: "L 72.7 P 77.1 S 20.4", onchange: () => this.typedImage() });
    this.measured = ["x", "y", "z"].map((axis) => this.coordinate(axis));
    this.measuredWords = h("p", { class: "words", id: "pair-measured-words", role: "status" });
    this.weight = numberInput("pair-weight", 0.01, 1000, 0.05, (weight) => this.send({ weight }));
    this.touchButton = h("button", { type: "button", id: "touch-selected", "data-operation": "pair.touch", title: "Practice", onclick: () => { if (this.pair) touch(this.pair.id); } }, "Simulate");
    this.measureButton = h("button", { type: "button", class: "primary wide", id: "measure-selected", onclick: () => { if (this.pair) measure(this.pair.id); } }, "Measure");
    this.forgetButton = h("button", { type: "button", id: "forget-measured", title: "Its place in the CT stays", onclick: () => this.forget() }, "Forget");
    this.deleteButton = h("button", { type: "button", id: "delete-pair", "data-operation": "pair.delete", onclick: () => this.delete() }, "Delete");
    for (const input of [this.label, this.image]) watchTyping(input);
    escapePutsBack(this.image);
    escapePutsBack(this.label);
    this.element = h("div", { class: "fields pair-fields", hidden: true }, field("Name", this.label), field("In the CT, mm", this.image),
      h("div", { class: "field" }, h("span", { class: "field-label" }, "On the patient, mm"), h("div", { class: "three" }, this.measured)), this.measuredWords,
      h("div", { class: "field inline", title: "1 is equal" }, h("label", { class: "field-label", for: "pair-weight" }, "Weight in the fit"), this.weight),
      this.measureButton, h("div", { class: "buttons even" }, this.touchButton, this.forgetButton, this.deleteButton));
  }

  /** @param {string} axis */
  coordinate(axis) {
    /** @type {HTMLInputElement} */
    const input = h("input", {
      type: "text", inputMode: "decimal", autocomplete: "off", "aria-label": `Measured, ${axis}`, "aria-describedby": "pair-measured-words", placeholder: axis,
      onchange: () => this.typedMeasured(), onpaste: (event) => this.pasted(event),
    });
    watchTyping(input);
    escapePutsBack(input, () => this.dropDraft(), () => this.drafts.has(this.pair?.id ?? ""));
    return input;
  }

  /**
   * @param {PairEntry | undefined} pair
   * @param {boolean} locked
   * @param {TrackerView | null} pointer
   * @param {boolean} measuring
   */
  update(pair, locked, pointer, measuring) {
    const other = pair?.id !== this.pair?.id;
    this.pair = pair;
    this.element.hidden = !pair;
    if (!pair) return;
    const { in_image: image, measured } = pair;
    this.label.dataset.known = pair.label;
    this.image.dataset.known = image ? placeWords(image, 2).replace(" mm", "") : "";
    if (other) putBack(this.weight);
    for (const input of [this.label, this.image]) if (other || !(isTyped(input) || isWrong(input))) putBack(input);
    showNumber(this.weight, pair.weight);
    this.showMeasured(other);
    for (const control of [this.label, this.image, this.weight, ...this.measured, this.deleteButton, this.forgetButton]) control.disabled = locked;
    this.touchButton.hidden = isReal(pair) || !image;
    this.touchButton.disabled = locked;
    this.forgetButton.hidden = !measured || !image;
    this.measureButton.hidden = !pointer;
    this.measureButton.disabled = locked || measuring || pointer?.state !== "fresh";
    this.measureButton.textContent = measuring ? "Hold still …" : "Measure";
  }

  /**
   * Forget what was typed of points that were measured otherwise meanwhile, or are gone.
   * @param {PairEntry[]} pairs
   */
  keepDrafts(pairs) {
    const held = new Map(pairs.map((pair) => [pair.id, JSON.stringify(pair.measured)]));
    for (const [id, { over }] of this.drafts) if (held.get(id) !== over) this.drafts.delete(id);
  }

  /** @param {boolean} other another point than before */
  showMeasured(other) {
    const { pair } = this;
    if (!pair) return;
    const draft = this.drafts.get(pair.id);
    const texts = draft?.texts ?? [0, 1, 2].map((axis) => (pair.measured ? String(Math.round(pair.measured[axis] * 1000) / 1000) : ""));
    this.measured.forEach((input, axis) => { if (other || !isTyped(input)) input.value = texts[axis]; });
    const { wrong, missing, words } = readPlace(draft?.texts ?? ["", "", ""]);
    const kept = pair.measured ? " Not saved; Escape goes back." : " Not measured.";
    this.measured.forEach((input, axis) => {
      if (draft && (wrong[axis] || (missing[axis] && pair.measured))) input.setAttribute("aria-invalid", "true");
      else input.removeAttribute("aria-invalid");
    });
    say(this.measuredWords, draft && words ? `${words}${kept}` : "");
    this.measuredWords.hidden = !(draft && words);
    this.measuredWords.classList.toggle("field-problem", Boolean(draft) && this.measured.some(isWrong));
  }

  typedImage() {
    try {
      const place = this.image.value.trim() === "" ? null : placeOf(this.image.value);
      complain(this.image, "");
      this.send({ in_image: place });
    } catch (error) {
      complain(this.image, /** @type {Error} */ (error).message);
    }
  }

  /** @param {ClipboardEvent} event */
  pasted(event) {
    const three = threeIn(event.clipboardData?.getData("text") ?? "");
    if (!three) return;
    event.preventDefault();
    this.spread(three);
    this.typedMeasured();
  }

  /** @param {string[]} texts */
  spread(texts) {
    this.measured.forEach((input, axis) => { input.value = texts[axis]; });
  }

  typedMeasured() {
    const { pair } = this;
    if (!pair) return;
    const three = this.measured.map((input) => threeIn(input.value)).find(Boolean);
    if (three) this.spread(three);
    const texts = this.measured.map((input) => input.value);
    const { place, words } = readPlace(texts);
    if (words) this.drafts.set(pair.id, { texts, over: JSON.stringify(pair.measured) });
    else this.drafts.delete(pair.id);
    if (place) {
      this.send({ measured: place });
      this.pair = { ...pair, measured: place }; // until the planner answers: a next number is sent with this one
    }
    if (!place && !words && pair.measured) this.forget();
    this.showMeasured(false);
    this.drafted();
  }

  /** Show what is held instead of what is typed. */
  dropDraft() {
    if (this.pair) this.drafts.delete(this.pair.id);
    for (const input of this.measured) delete input.dataset.typing;
    this.showMeasured(true);
    this.drafted();
  }

  forget() {
    if (this.pair) this.undoable("pair.change", { pair_id: this.pair.id, measured: null }, `Measured point of ‘${this.pair.label}’ removed.`);
  }

  delete() {
    if (this.pair) this.undoable("pair.delete", { pair_id: this.pair.id }, `‘${this.pair.label}’ deleted.`);
  }

  /**
   * @template {"pair.change" | "pair.delete"} T
   * @param {T} type
   * @param {import("/static/js/types.js").Fields<T>[0]} fields
   * @param {string} words
   */
  undoable(type, fields, words) {
    const done = this.connection.request(type, /** @type {any} */ (fields));
    noteEdit(this.connection, "registration", done, words);
  }

  /** @param {Record<string, unknown>} fields */
  send(fields) {
    if (this.pair) this.connection.send("pair.change", { pair_id: this.pair.id, ...fields });
  }
}
