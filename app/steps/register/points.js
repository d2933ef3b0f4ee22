// The points: where each is in the image, where it was measured, and how far the two are apart under the fit.
import { group, h, keyed, whenChanged } from "/static/js/dom.js";
import { mm } from "/static/js/format.js";
import { note } from "/static/js/dialogs.js";
import { send, upload } from "/static/js/rest.js";
import { placeOf, placeWords } from "/static/js/slices/place-words.js";
import { field } from "./beads.js";
import { barScale, barShare, pairWords, threeNumbers } from "./words.js";

/** @import { Row } from "/static/js/dom.js" */
/** @import { Connection } from "/static/js/connection.js" */
/** @import { FitView, PairEntry, RegistrationSection, TrackerView } from "/static/js/types.js" */

export class PointsGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.words = h("p", { class: "words" });
    this.noise = h("input", { type: "number", id: "touch-noise", min: 0, max: 20, step: 0.1, value: "0.3" });
    this.touchButton = h("button", { type: "button", class: "wide", id: "touch-all", onclick: () => this.touch(null) }, "Touch all points (simulated)");
    this.touchBox = h("div", { class: "fields" }, this.touchButton, h("details", { class: "folded" }, h("summary", {}, "Simulated pointer"), h("div", { class: "fields" },
      h("p", { class: "words" }, "For practice without a tracker: it touches the points of a head that lies somewhere, with this error. No patient is measured."),
      field("Error of one touch, mm rms", this.noise))));
    /** @type {TrackerView | null} */
    this.pointer = null;
    this.measuring = false; // the tracked pointer rests on a point
    this.pointerWords = h("p", { class: "words", id: "pointer-words", role: "status" });
    this.chooser = h("input", { type: "file", hidden: true, accept: ".csv", id: "measured-file", onchange: () => this.readTable() });
    this.tableButton = h("button", { type: "button", id: "read-measured", title: "Columns label, x, y, z; lines '# unit=mm' and '# frame=patient' above", onclick: () => this.chooser.click() }, "From a table …");
    this.addButton = h("button", { type: "button", id: "add-pair", title: "A point of the image where the slices cross", onclick: () => connection.send("pair.add") }, "Add at crosshair");
    this.clearButton = h("button", { type: "button", class: "plain", id: "clear-measured", title: "Forget all that was measured", onclick: () => connection.send("pair.clear_measured") }, "Clear");
    this.list = h("ul", { class: "list fiducials", id: "pairs", "aria-label": "Points" });
    this.places = new PairFields(connection, (pairId) => this.touch(pairId), (pairId) => this.measure(pairId));
    this.element = group("2  Measured points", [this.clearButton], this.words, this.pointerWords, this.list, this.places.element, this.touchBox,
      h("div", { class: "buttons even" }, this.addButton, this.tableButton), this.chooser);
  }

  /**
   * @param {RegistrationSection} registration
   * @param {TrackerView | null | undefined} pointer
   */
  update(registration, pointer) {
    this.registration = registration;
    this.pointer = pointer ?? null;
    const { pairs, fit, locked, selected } = registration;
    this.changed([pairs, fit.wrong, locked, selected, registration.id, pointer, this.measuring], () => this.render(registration));
  }

  /** @param {RegistrationSection} registration */
  render({ pairs, fit, locked, selected }) {
    const scale = barScale(pairs);
    const wanted = pairs.filter((pair) => pair.in_image && !pair.measured).length;
    this.words.textContent = pairs.length
      ? `Each point is seen in the image and measured at the patient. The bar shows how far the two are apart under the fit, and is full at ${mm(scale, scale < 10 ? 1 : 0)}; press a point for its coordinates.`
      : "Confirm beads above, or put the crosshair on a point and add it.";
    this.pointerWords.hidden = !this.pointer;
    this.pointerWords.textContent = this.pointer ? `Pointer: ${this.pointer.words}. Rest its tip on a point, choose the point below and press ‘Measure’.` : "";
    this.pointerWords.classList.toggle("caution", this.pointer !== null && this.pointer.state !== "fresh");
    this.touchBox.hidden = !pairs.length;
    this.touchButton.classList.toggle("primary", wanted > 0);
    this.touchButton.textContent = wanted ? "Touch all points (simulated)" : "Touch all again (simulated)";
    this.clearButton.hidden = !pairs.some((pair) => pair.measured);
    for (const button of [this.touchButton, this.tableButton, this.addButton, this.clearButton]) button.disabled = locked;
    keyed(this.list, pairs, (pair) => pair.id, () => this.row(),
      (row, pair) => fillPair(row, pair, { scale, locked, selected: pair.id === selected, wrong: wrongOf(pair, fit) }));
    this.places.update(pairs.find((pair) => pair.id === selected), locked, this.pointer, this.measuring);
  }

  /** @returns {Row<PairEntry>} */
  row() {
    const { connection } = this;
    /** @type {HTMLInputElement} */
    const used = h("input", { type: "checkbox", title: "Whether the fit uses it", onchange: () => connection.send("pair.change", { pair_id: row.item.id, enabled: used.checked }) });
    const main = h("button", { type: "button", class: "row-main", title: "Show it, and its coordinates", onclick: () => connection.send("pair.select", { pair_id: row.item.id }) }, h("span"), h("span", { class: "row-sub" }));
    const touch = h("button", { type: "button", class: "touch", title: "Measure it with the simulated pointer", onclick: () => this.touch(row.item.id) }, "Touch");
    /** @type {Row<PairEntry>} */
    const row = Object.assign(h("li", { class: "row pair" }, h("span", { class: "pair-name" }, used, main), h("span", { class: "number residual" }), touch,
      h("span", { class: "residual-bar" }, h("span"))), { item: /** @type {any} */ (null) });
    return row;
  }

  /** @param {string | null} pairId null for all */
  touch(pairId) {
    const noise = Number(this.noise.value);
    this.connection.send("pair.touch", { pair_id: pairId, noise_mm: Number.isFinite(noise) && noise >= 0 ? noise : 0.3 });
  }

  /** @param {string} pairId */
  async measure(pairId) {
    const { registration } = this;
    if (!registration) return;
    this.measuring = true;
    this.update(registration, this.pointer);
    try {
      const answer = await send(`/api/registrations/${encodeURIComponent(registration.id)}/pairs/${encodeURIComponent(pairId)}/measure`, {});
      await this.connection.request("registration.look");
      note(`Measured; the tip was still within ${mm(answer.spread_mm, 2)} rms.`);
    } catch (error) {
      note(/** @type {Error} */ (error).message, { error: true });
    } finally {
      this.measuring = false;
      if (this.registration) this.update(this.registration, this.pointer);
    }
  }

  async readTable() {
    const file = this.chooser.files?.[0];
    this.chooser.value = "";
    if (!file || !this.registration) return;
    const form = new FormData();
    form.append("file", file);
    try {
      await upload(`/api/registrations/${encodeURIComponent(this.registration.id)}/measured`, form, () => {});
      await this.connection.request("registration.look");
      note("The points were read. Check that each belongs to its bead, or press ‘Match order’.");
    } catch (error) {
      note(/** @type {Error} */ (error).message, { error: true });
    }
  }
}

/** The name and the coordinates of the selected point, to be typed. */
class PairFields {
  /**
   * @param {Connection} connection
   * @param {(pairId: string) => void} touch
   * @param {(pairId: string) => void} measure
   */
  constructor(connection, touch, measure) {
    this.connection = connection;
    /** @type {PairEntry | undefined} */
    this.pair = undefined;
    /** @type {HTMLInputElement} */
    this.label = h("input", { type: "text", id: "pair-label", maxLength: 120, onchange: () => this.send({ label: this.label.value }) });
    this.image = h("input", { type: "text", id: "pair-image", placeholder: "L 72.7 P 77.1 S 20.4", onchange: () => this.typedImage() });
    this.measured = ["x", "y", "z"].map((axis) => h("input", { type: "text", inputMode: "decimal", "aria-label": `Measured, ${axis}`, placeholder: axis, onchange: () => this.typedMeasured() }));
    this.weight = h("input", { type: "number", id: "pair-weight", min: 0.01, max: 1000, step: "any", onchange: () => this.typedWeight() });
    this.touchButton = h("button", { type: "button", id: "touch-selected", onclick: () => { if (this.pair) touch(this.pair.id); } }, "Touch (simulated)");
    this.measureButton = h("button", { type: "button", class: "primary wide", id: "measure-selected", onclick: () => { if (this.pair) measure(this.pair.id); } }, "Measure");
    this.deleteButton = h("button", { type: "button", id: "delete-pair", onclick: () => { if (this.pair) connection.send("pair.delete", { pair_id: this.pair.id }); } }, "Delete");
    this.element = h("div", { class: "fields pair-fields", hidden: true }, field("Name", this.label), field("In the image, mm", this.image),
      h("div", { class: "field" }, h("span", { class: "field-label" }, "Measured at the patient, mm"), h("div", { class: "three" }, this.measured)),
      h("div", { class: "field inline", title: "How much the fit trusts this point beside the others; 1 is as much" }, h("label", { class: "field-label", for: "pair-weight" }, "Weight in the fit"), this.weight),
      this.measureButton, h("div", { class: "buttons even" }, this.touchButton, this.deleteButton));
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
    const free = (/** @type {HTMLInputElement} */ input) => other || document.activeElement !== input;
    if (free(this.label)) this.label.value = pair.label;
    if (free(this.weight)) this.weight.value = String(pair.weight);
    if (free(this.image)) this.image.value = image ? placeWords(image, 2).replace(" mm", "") : "";
    const typing = !other && !measured && this.measured.includes(/** @type {HTMLInputElement} */ (document.activeElement));
    if (!typing) this.measured.forEach((input, index) => { input.value = measured ? String(Math.round(measured[index] * 1000) / 1000) : ""; });
    for (const control of [this.label, this.image, this.weight, ...this.measured, this.deleteButton]) control.disabled = locked;
    this.touchButton.disabled = locked || !image;
    this.measureButton.hidden = !pointer;
    this.measureButton.disabled = locked || measuring || pointer?.state !== "fresh";
    this.measureButton.textContent = measuring ? "Hold still …" : "Measure with the pointer";
  }

  typedImage() {
    try {
      this.send({ in_image: this.image.value.trim() === "" ? null : placeOf(this.image.value) });
    } catch (error) {
      note(/** @type {Error} */ (error).message, { error: true });
    }
  }

  typedWeight() {
    const weight = Number(this.weight.value);
    if (weight > 0) this.send({ weight });
    else note("A weight is above 0; leave a point out of the fit by its switch.", { error: true });
  }

  typedMeasured() {
    const { place, complete } = threeNumbers(this.measured.map((input) => input.value));
    if (complete) this.send({ measured: place });
  }

  /** @param {Record<string, unknown>} fields */
  send(fields) {
    if (this.pair) this.connection.send("pair.change", { pair_id: this.pair.id, ...fields });
  }
}

/**
 * What is wrong with a point: 'outlier' or 'suspect' of the one that is named, 'misfit' where all of them do not fit.
 * @param {PairEntry} pair
 * @param {FitView} fit
 */
function wrongOf({ id }, { wrong, state }) {
  if (wrong?.pair === id) return wrong.certainty;
  return state === "misfit" && !wrong ? "misfit" : "";
}

/**
 * @param {HTMLElement} row
 * @param {PairEntry} pair
 * @param {{ scale: number, locked: boolean, selected: boolean, wrong: string }} how
 */
function fillPair(row, pair, { scale, locked, selected, wrong }) {
  const [name, sub] = row.querySelectorAll(".row-main > span");
  name.textContent = pair.label || "Point";
  sub.textContent = pairWords(pair);
  const used = /** @type {HTMLInputElement} */ (row.querySelector("input"));
  used.checked = pair.enabled;
  used.disabled = locked;
  used.setAttribute("aria-label", `Fit ${name.textContent}`);
  const share = barShare(pair.residual_mm, scale);
  const bar = /** @type {HTMLElement} */ (row.querySelector(".residual-bar"));
  bar.hidden = pair.residual_mm === null;
  /** @type {HTMLElement} */ (bar.firstElementChild).style.width = `${(100 * share).toFixed(1)}%`;
  /** @type {HTMLElement} */ (row.querySelector(".residual")).textContent = pair.residual_mm === null ? "" : mm(pair.residual_mm, 2);
  row.dataset.wrong = wrong;
  row.classList.toggle("left-out", !pair.enabled);
  row.setAttribute("aria-current", String(selected));
  const touch = /** @type {HTMLButtonElement} */ (row.querySelector(".touch"));
  touch.hidden = Boolean(pair.measured) || !pair.in_image;
  touch.disabled = locked;
  touch.setAttribute("aria-label", `Touch ${name.textContent}, simulated`);
}
