// The points: where each is in the image, where it was measured, and how far the two are apart under the fit.
import { group, h, keyed, whenChanged } from "/static/js/dom.js";
import { mm } from "/static/js/format.js";
import { note, noteEdit } from "/static/js/dialogs.js";
import { heldNumber, ownNumber } from "/static/js/fields.js";
import { send, upload } from "/static/js/rest.js";
import { line, say } from "/static/js/said.js";
import { readPlace } from "/static/js/typed-place.js";
import { field } from "./beads.js";
import { PairFields } from "./pair-fields.js";
import { barScale, barShare, canPractise, listWords, pairWords, practiceWords } from "./words.js";

/** @import { Row } from "/static/js/dom.js" */
/** @import { Connection } from "/static/js/connection.js" */
/** @import { FitView, PairEntry, RegistrationPublic, RegistrationSection, TrackerView } from "/static/js/types.js" */

export class PointsGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.words = h("p", { class: "words" });
    this.noise = ownNumber("touch-noise", 0, 20, 0.1, 0.3);
    this.touchButton = h("button", { type: "button", class: "wide", id: "touch-all", onclick: () => this.touch(null) }, "Simulate all");
    this.touchBox = h("div", { class: "fields" }, this.touchButton, h("details", { class: "folded" }, h("summary", {}, "Simulated pointer"), h("div", { class: "fields" },
      line("Practice only; no patient is measured. The simulated pointer touches the points of a head that lies somewhere, with this error."),
      field("Error of one touch, mm rms", this.noise))));
    this.practiceWords = h("p", { class: "words", id: "practice-words", hidden: true });
    /** @type {TrackerView | null} */
    this.pointer = null;
    this.measuring = false; // the tracked pointer rests on a point
    this.pointerWords = h("p", { class: "words", id: "pointer-words", role: "status" });
    this.chooser = h("input", { type: "file", hidden: true, accept: ".csv", id: "measured-file", onchange: () => this.readTable() });
    this.tableButton = h("button", { type: "button", id: "read-measured", title: "CSV: label, x, y, z; above ‘# unit=mm’ and ‘# frame=patient’", onclick: () => this.chooser.click() }, "Read table …");
    this.addButton = h("button", { type: "button", id: "add-pair", "data-operation": "pair.add", title: "Adds a point where the slices cross", onclick: () => connection.send("pair.add") }, "Add point");
    this.clearButton = h("button", { type: "button", class: "plain", id: "clear-measured", "data-operation": "pair.clear_measured", title: "Forget all that was measured", onclick: () => this.clear() }, "Clear");
    this.list = h("ul", { class: "list fiducials", id: "pairs", "aria-label": "Points" });
    this.pressed = ""; // the point whose row was pressed last: its fields are brought into sight
    this.places = new PairFields(connection, { touch: (pairId) => this.touch(pairId), measure: (pairId) => this.measure(pairId), drafted: () => this.again() });
    this.element = group("2  Measured points", [this.clearButton], this.words, this.pointerWords, this.list, this.touchBox, this.practiceWords,
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
    this.places.keepDrafts(pairs);
    this.changed([pairs, fit.wrong, locked, selected, registration.id, pointer, this.measuring, [...this.places.drafts]], () => this.render(registration));
  }

  again() {
    if (this.registration) this.update(this.registration, this.pointer);
  }

  /** @param {RegistrationSection} registration */
  render({ pairs, fit, locked, selected }) {
    const scale = barScale(pairs);
    const wanted = pairs.filter((pair) => pair.in_image && !pair.measured).length;
    say(this.words, listWords(pairs));
    say(this.practiceWords, practiceWords(pairs));
    this.practiceWords.hidden = !practiceWords(pairs);
    this.pointerWords.hidden = !this.pointer;
    say(this.pointerWords, this.pointer ? `Pointer: ${this.pointer.words}. Rest its tip on a point, choose that point, then Measure.` : "");
    this.pointerWords.classList.toggle("caution", this.pointer !== null && this.pointer.state !== "fresh");
    this.touchBox.hidden = !canPractise(pairs); // what was really measured is never written over
    this.touchButton.classList.toggle("primary", wanted > 0);
    this.touchButton.textContent = wanted ? "Simulate all" : "Simulate again";
    this.clearButton.hidden = !pairs.some((pair) => pair.measured);
    for (const button of [this.touchButton, this.tableButton, this.addButton, this.clearButton]) button.disabled = locked;
    keyed(this.list, pairs, (pair) => pair.id, () => this.row(),
      (row, pair) => fillPair(row, pair, {
        scale, locked, selected: pair.id === selected, wrong: wrongOf(pair, fit),
        practice: canPractise(pairs), typed: readPlace(this.places.drafts.get(pair.id)?.texts ?? ["", "", ""]).words,
      }));
    this.renderPlaces(pairs.find((pair) => pair.id === selected), locked);
  }

  /**
   * The fields of the selected point, below its row.
   * @param {PairEntry | undefined} pair
   * @param {boolean} locked
   */
  renderPlaces(pair, locked) {
    const { element } = this.places;
    const row = [...this.list.children].find((child) => child instanceof HTMLElement && child.dataset.key === pair?.id);
    if (row && element.parentElement !== row) row.append(element);
    this.places.update(pair, locked, this.pointer, this.measuring);
    if (!pair || this.pressed !== pair.id) return;
    this.pressed = "";
    element.scrollIntoView({ block: "nearest" });
  }

  /** @returns {Row<PairEntry>} */
  row() {
    const { connection } = this;
    /** @type {HTMLInputElement} */
    const used = h("input", { type: "checkbox", title: "Whether the fit uses it", onchange: () => connection.send("pair.change", { pair_id: row.item.id, enabled: used.checked }) });
    const main = h("button", { type: "button", class: "row-main", title: "Show it, and its coordinates", onclick: () => this.select(row.item.id) }, h("span"), h("span", { class: "row-sub" }));
    const touch = h("button", { type: "button", class: "touch", title: "Practice: touch it with the simulated pointer", onclick: () => this.touch(row.item.id) }, "Simulate");
    /** @type {Row<PairEntry>} */
    const row = Object.assign(h("li", { class: "row pair" }, h("span", { class: "pair-name" }, used, main), h("span", { class: "number residual" }), touch,
      h("span", { class: "residual-bar" }, h("span"))), { item: /** @type {any} */ (null) });
    return row;
  }

  /** @param {string} pairId */
  select(pairId) {
    const shown = this.registration?.selected === pairId;
    if (shown) this.places.element.scrollIntoView({ block: "nearest" });
    this.pressed = shown ? "" : pairId;
    this.connection.send("pair.select", { pair_id: pairId });
  }

  clear() {
    noteEdit(this.connection, "registration", this.connection.request("pair.clear_measured"), "Measured points cleared.");
  }

  /** @param {string | null} pairId null for all */
  touch(pairId) {
    this.connection.send("pair.touch", { pair_id: pairId, noise_mm: heldNumber(this.noise) ?? 0.3 });
  }

  /** @param {string} pairId */
  async measure(pairId) {
    const { registration } = this;
    if (!registration) return;
    this.measuring = true;
    this.update(registration, this.pointer);
    try {
      const answer = await send(`/api/v1/registrations/${encodeURIComponent(registration.id)}/pairs/${encodeURIComponent(pairId)}/measure`, {});
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
      /** @type {RegistrationPublic} */
      const read = await upload(`/api/v1/registrations/${encodeURIComponent(this.registration.id)}/measured`, form, () => {});
      if (read.told) note(read.told, { stay: true });
      note("Points read. Check each, or press ‘Match order’.");
    } catch (error) {
      note(/** @type {Error} */ (error).message, { error: true });
    }
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
 * @param {{ scale: number, locked: boolean, selected: boolean, wrong: string, practice: boolean, typed: string }} how typed: what is wrong or missing in what was typed
 */
function fillPair(row, pair, { scale, locked, selected, wrong, practice, typed }) {
  const [name, sub] = row.querySelectorAll(".row-main > span");
  name.textContent = pair.label || "Point";
  sub.textContent = typed ? `${pairWords(pair)}; ${typed}` : pairWords(pair);
  sub.classList.toggle("caution", Boolean(typed));
  const used = /** @type {HTMLInputElement} */ (row.querySelector("input"));
  used.checked = pair.enabled;
  used.disabled = locked;
  used.setAttribute("aria-label", `Fit ${name.textContent}`);
  const share = barShare(pair.residual_mm, scale);
  const bar = /** @type {HTMLElement} */ (row.querySelector(".residual-bar"));
  bar.hidden = pair.residual_mm === null;
  /** @type {HTMLElement} */ (bar.firstElementChild).style.width = `${(100 * share).toFixed(1)}%`;
  const residual = /** @type {HTMLElement} */ (row.querySelector(".residual"));
  residual.hidden = pair.residual_mm === null;
  residual.textContent = pair.residual_mm === null ? "" : mm(pair.residual_mm, 2);
  row.dataset.wrong = wrong;
  row.classList.toggle("left-out", !pair.enabled);
  row.setAttribute("aria-current", String(selected));
  const touch = /** @type {HTMLButtonElement} */ (row.querySelector(".touch"));
  touch.hidden = !practice || Boolean(pair.measured) || !pair.in_image;
  touch.disabled = locked;
  touch.setAttribute("aria-label", `Simulate touch of ${name.textContent}`);
}
