// The points: where each is in the image, where it was measured, and how far the two are apart under the fit.
import { h, whenChanged } from "/static/js/dom.js";
import { mm } from "/static/js/format.js";
import { note, noteEdit } from "/static/js/dialogs.js";
import { heldNumber, ownNumber } from "/static/js/fields.js";
import { ListFilter } from "/static/js/list-filter.js";
import { send, upload } from "/static/js/rest.js";
import { rovingRows } from "/static/js/roving.js";
import { line, say } from "/static/js/said.js";
import { draw, html, live, nothing, repeat } from "/static/js/template.js";
import { readPlace } from "/static/js/typed-place.js";
import { field } from "./beads.js";
import { PairFields } from "./pair-fields.js";
import { barScale, barShare, barWords, canPractise, pairWords, practiceWords } from "./words.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { FitView, PairEntry, RegistrationPublic, RegistrationSection, TrackerView } from "/static/js/types.js" */

export class PointsGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.words = line("Confirm beads, or add points.");
    this.noise = ownNumber("touch-noise", 0, 20, 0.1, 0.3);
    this.touchButton = h("button", { type: "button", class: "wide", id: "touch-all", onclick: () => this.touch(null) }, "Simulate all");
    this.touchBox = h("div", { class: "fields" }, this.touchButton, h("details", { class: "folded" }, h("summary", {}, "Simulated pointer"), h("div", { class: "fields" },
      line("Practice: no patient. The simulated pointer touches the points of a head that lies somewhere, with this error."),
      field("Error of one touch, mm rms", this.noise))));
    this.practiceWords = h("p", { class: "words", id: "practice-words", hidden: true });
    /** @type {TrackerView | null} */
    this.pointer = null;
    this.measuring = false; // the tracked pointer rests on a point
    this.pointerWords = h("p", { class: "words", id: "pointer-words", role: "status" });
    this.chooser = h("input", { type: "file", hidden: true, accept: ".csv", id: "measured-file", onchange: () => this.readTable() });
    this.tableButton = h("button", { type: "button", id: "read-measured", title: "CSV: label, x, y, z; ‘# unit=mm’, ‘# frame=patient’", onclick: () => this.chooser.click() }, "Read table …");
    this.addButton = h("button", { type: "button", id: "add-pair", "data-operation": "pair.add", title: "At the crosshair", onclick: () => connection.send("pair.add") }, "Add point");
    this.clearButton = h("button", { type: "button", id: "clear-measured", "data-operation": "pair.clear_measured", title: "Forgets all measured points", onclick: () => this.clear() }, "Clear");
    this.filter = new ListFilter("points", () => { if (this.registration) this.render(this.registration); });
    this.list = h("div", { class: "fields" });
    this.roving = rovingRows(this.list, ".pair-name > input, .touch");
    this.pressed = ""; // the point whose row was pressed last: its fields are brought into sight
    this.places = new PairFields(connection, { touch: (pairId) => this.touch(pairId), measure: (pairId) => this.measure(pairId), drafted: () => this.again() });
    this.element = h("div", { class: "fields" }, this.words, this.pointerWords, this.list, this.touchBox, this.practiceWords,
      h("div", { class: "buttons even" }, this.addButton, this.tableButton, this.clearButton), this.chooser);
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
    this.words.hidden = pairs.length > 0;
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
    const practice = canPractise(pairs);
    const shown = this.filter.of(pairs, ({ label }) => label || "Point");
    this.places.update(pairs.find((pair) => pair.id === selected), locked, this.pointer, this.measuring);
    draw(this.list, html`${this.filter.field(pairs.length)}
      <ul class="list fiducials" id="pairs" aria-label="Points" ?hidden=${!pairs.length}>${repeat(shown, ({ id }) => id, (pair) => this.row(pair, {
        scale, locked, selected: pair.id === selected, wrong: wrongOf(pair, fit), practice, typed: readPlace(this.places.drafts.get(pair.id)?.texts ?? ["", "", ""]).words,
      }))}</ul>
      ${shown.length || !pairs.length ? nothing : html`<p class="empty">None found.</p>`}`);
    this.roving.update();
    if (!selected || this.pressed !== selected) return;
    this.pressed = "";
    this.places.element.scrollIntoView({ block: "nearest" });
  }

  /**
   * A point, with its fields below it where it is the selected one.
   * @param {PairEntry} pair
   * @param {{ scale: number, locked: boolean, selected: boolean, wrong: string, practice: boolean, typed: string }} how
   *   typed: what is wrong or missing in what was typed
   */
  row(pair, { scale, locked, selected, wrong, practice, typed }) {
    const { id, residual_mm: residual } = pair;
    const name = pair.label || "Point";
    const use = (/** @type {Event} */ { currentTarget }) => this.connection.send("pair.change", { pair_id: id, enabled: /** @type {HTMLInputElement} */ (currentTarget).checked });
    return html`<li class=${pair.enabled ? "row pair" : "row pair left-out"} data-wrong=${wrong || nothing} aria-current=${String(selected)}>
      <span class="pair-name"><input type="checkbox" title="Used by the fit" aria-label=${`Fit ${name}`} .checked=${live(pair.enabled)} ?disabled=${locked} @change=${use}
        ><button type="button" class="row-main" title="Show it" @click=${() => this.select(id)}><span>${name}</span><span
        class=${typed ? "row-sub caution" : "row-sub"}>${typed ? `${pairWords(pair)}; ${typed}` : pairWords(pair)}</span></button></span>
      <span class="number residual" ?hidden=${residual === null}>${residual === null ? "" : mm(residual, 2)}</span>
      <button type="button" class="touch" title="Practice" aria-label=${`Simulate touch of ${name}`}
        ?hidden=${!practice || Boolean(pair.measured) || !pair.in_image} ?disabled=${locked} @click=${() => this.touch(id)}>Simulate</button>
      <span class="residual-bar" title=${barWords(scale)} ?hidden=${residual === null}><span style=${`width: ${(100 * barShare(residual, scale)).toFixed(1)}%`}></span></span>
      ${selected ? this.places.element : nothing}
    </li>`;
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
      note(`Measured; tip still within ${mm(answer.spread_mm, 2)} rms.`);
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
      note("Check each, or ‘Match order’.");
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
