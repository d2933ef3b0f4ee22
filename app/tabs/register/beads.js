// Beads in the CT: found as a job, and each confirmed or rejected by the user.
import { group, h, keyed, whenChanged } from "/static/js/dom.js";
import { count, mm } from "/static/js/format.js";
import { note, noteEdit } from "/static/js/dialogs.js";
import { heldNumber, ownNumber } from "/static/js/fields.js";
import { JobLine } from "/static/js/job-line.js";
import { line, say } from "/static/js/said.js";
import { placeWords } from "/static/js/slices/place-words.js";

/** @import { Row } from "/static/js/dom.js" */
/** @import { Connection } from "/static/js/connection.js" */
/** @import { BeadEntry, RegistrationSection } from "/static/js/types.js" */

export class BeadsGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.looking = false;
    this.words = h("p", { class: "words" });
    this.findButton = h("button", { type: "button", class: "primary", id: "find-beads", onclick: () => this.find() }, "Find beads");
    this.allButton = h("button", { type: "button", id: "confirm-beads", "data-operation": "bead.confirm_all", onclick: () => connection.send("bead.confirm_all") }, "Confirm all");
    this.work = new JobLine();
    this.diameter = ownNumber("bead-diameter", 0.5, 20, 0.5, null);
    this.diameter.placeholder = "any";
    this.threshold = ownNumber("bead-threshold", 300, 3000, 50, 800);
    this.options = h("details", { class: "folded" }, h("summary", {}, "Size and threshold"), h("div", { class: "fields" },
      field("Diameter, mm", this.diameter), field("Brighter than, HU", this.threshold)));
    this.list = h("ul", { class: "list fiducials", id: "beads", "aria-label": "Beads that were found" });
    this.said = h("p", { class: "words", id: "beads-said", role: "status" });
    this.cautions = h("div", { class: "fields" });
    this.element = group("1  Beads in the CT", null, this.words, h("div", { class: "buttons even" }, this.findButton, this.allButton),
      this.work.element, this.options, this.said, this.cautions, this.list);
  }

  /** @param {RegistrationSection} registration */
  update(registration) {
    this.registration = registration;
    const { beads, search, locked, selected, has_volume: hasVolume } = registration;
    this.changed([beads, search, locked, selected, hasVolume, this.looking], () => this.render(registration));
  }

  /** @param {RegistrationSection} registration */
  render({ beads, search, locked, selected, has_volume: hasVolume }) {
    say(this.words, hasVolume
      ? "Confirm each bead that is real. Beads are small dense balls that were glued to the skin before the scan; look at each one in the slices."
      : "No CT: add points at the crosshair.");
    const open = beads.filter((bead) => bead.state === "found").length;
    this.findButton.hidden = this.options.hidden = !hasVolume;
    this.findButton.disabled = locked || this.looking;
    this.findButton.classList.toggle("primary", !beads.length);
    this.findButton.textContent = this.looking ? "Looking …" : beads.length ? "Find again" : "Find beads";
    this.allButton.hidden = open === 0;
    this.allButton.classList.toggle("primary", open > 0);
    this.allButton.disabled = locked;
    say(this.said, search ? saidOf(beads.length, search.left_out) : "");
    this.cautions.replaceChildren(...(search?.cautions ?? []).map((text) => line(text, { class: "words caution" })));
    keyed(this.list, beads, (bead) => bead.id, () => this.row(), (row, bead) => fillBead(row, bead, locked, bead.id === selected));
  }

  /** @returns {Row<BeadEntry>} */
  row() {
    const main = h("button", { type: "button", class: "row-main", title: "Show it in the slices", onclick: () => this.connection.send("bead.show", { bead_id: row.item.id }) }, h("span"));
    const yes = h("button", { type: "button", class: "plain", "data-judge": "yes", "data-operation": "bead.judge", onclick: () => this.judge(row.item, true) }, "Confirm");
    const no = h("button", { type: "button", class: "plain", "data-judge": "no", onclick: () => this.judge(row.item, false) }, "Reject");
    /** @type {Row<BeadEntry>} */
    const row = Object.assign(h("li", { class: "row" }, main, h("div", { class: "buttons bead-judge" }, yes, no), h("span", { class: "row-sub" })), { item: /** @type {any} */ (null) });
    return row;
  }

  /**
   * A press on what a bead is already does nothing: its point, with what was measured of it, is not taken away by the way.
   * @param {BeadEntry} bead
   * @param {boolean} confirmed
   */
  judge(bead, confirmed) {
    if (bead.state === (confirmed ? "confirmed" : "rejected")) return;
    const judged = this.connection.request("bead.judge", { bead_id: bead.id, confirmed });
    const pair = this.registration?.pairs.find((one) => one.bead === bead.id);
    if (!confirmed && pair?.measured) {
      noteEdit(this.connection, "registration", judged, `‘${pair.label}’ and its measured point removed.`);
    } else judged.catch((error) => note(error.message, { error: true }));
  }

  async find() {
    const { registration } = this;
    if (!registration) return;
    this.looking = true;
    this.update(registration);
    try {
      const wish = { diameter_mm: heldNumber(this.diameter), threshold_hu: heldNumber(this.threshold) };
      const found = await this.work.run(`/api/v1/registrations/${encodeURIComponent(registration.id)}/beads`, wish);
      if (found === null) note("Search cancelled; beads found before stay.");
    } catch (error) {
      note(/** @type {Error} */ (error).message, { error: true });
    } finally {
      this.looking = false;
      if (this.registration) this.update(this.registration);
    }
  }
}

/**
 * @param {string} words
 * @param {HTMLInputElement} input
 */
export function field(words, input) {
  return h("div", { class: "field" }, h("label", { class: "field-label", for: input.id }, words), input);
}

/**
 * @param {number} found
 * @param {number} leftOut
 */
function saidOf(found, leftOut) {
  const words = found ? `${count(found, "bead", "beads")} found.` : "No bead found. Try another size or threshold, or add points at the crosshair.";
  return leftOut ? `${words} ${count(leftOut, "similar place", "similar places")} left out, such as teeth and edges of bone.` : words;
}

/**
 * @param {HTMLElement} row
 * @param {BeadEntry} bead
 * @param {boolean} locked
 * @param {boolean} selected
 */
function fillBead(row, bead, locked, selected) {
  const [name, sub] = row.querySelectorAll(".row-main > span, .row-sub");
  name.textContent = bead.name;
  sub.textContent = `⌀ ${mm(bead.diameter_mm)} · ${placeWords(bead.position).replace(" mm", "")}`;
  row.dataset.state = bead.state;
  row.setAttribute("aria-current", String(selected));
  for (const button of row.querySelectorAll("button")) {
    const said = { yes: "confirmed", no: "rejected" }[button.dataset.judge ?? ""];
    if (!said) continue;
    button.disabled = locked;
    button.textContent = (bead.state === said ? { yes: "Confirmed", no: "Rejected" } : { yes: "Confirm", no: "Reject" })[/** @type {"yes" | "no"} */ (button.dataset.judge)];
    button.setAttribute("aria-pressed", String(bead.state === said));
    button.setAttribute("aria-label", `${button.textContent} ${name.textContent}`);
  }
}
