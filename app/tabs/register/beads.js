// Beads in the CT: found as a job, and each confirmed or rejected by the user.
import { h, whenChanged } from "/static/js/dom.js";
import { count, mm, sentence } from "/static/js/format.js";
import { note, noteEdit } from "/static/js/dialogs.js";
import { heldNumber, ownNumber } from "/static/js/fields.js";
import { JobList } from "/static/js/job-list.js";
import { stageWords } from "/static/js/jobs.js";
import { ListFilter } from "/static/js/list-filter.js";
import { rovingRows } from "/static/js/roving.js";
import { send, wasCancelled } from "/static/js/rest.js";
import { line, say } from "/static/js/said.js";
import { placeWords } from "/static/js/slices/place-words.js";
import { draw, html, nothing, repeat } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { BeadEntry, JobEntry, RegistrationSection } from "/static/js/types.js" */

const WHAT = "Beads were glued to the skin before the scan.";
const JUDGED = { yes: ["Confirm", "Confirmed"], no: ["Reject", "Rejected"] };

export class BeadsGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.asks = false; // a search is on its way to the planner
    this.words = h("p", { class: "words" });
    this.findButton = h("button", { type: "button", class: "primary", id: "find-beads", onclick: () => this.find() }, "Find beads");
    this.allButton = h("button", { type: "button", id: "confirm-beads", "data-operation": "bead.confirm_all", onclick: () => connection.send("bead.confirm_all") }, "Confirm all");
    this.work = new JobList((job, error) => this.ended(job, error), {
      holds: ({ kind, document_id: of }) => kind === "beads" && of === this.registration?.id,
      words: (job) => sentence(stageWords(job)),
      begun: () => queueMicrotask(() => this.again()),
    });
    this.diameter = ownNumber("bead-diameter", 0.5, 20, 0.5, null);
    this.diameter.placeholder = "any";
    this.threshold = ownNumber("bead-threshold", 300, 3000, 50, 800);
    this.options = h("details", { class: "folded" }, h("summary", {}, "Size and threshold"), h("div", { class: "fields" },
      field("Diameter, mm", this.diameter), field("Brighter than, HU", this.threshold)));
    this.filter = new ListFilter("beads", () => { if (this.registration) this.renderList(this.registration); });
    this.list = h("div", { class: "fields" });
    this.roving = rovingRows(this.list);
    this.said = h("p", { class: "words", id: "beads-said", role: "status" });
    this.cautions = h("div", { class: "fields" });
    this.element = h("div", { class: "fields" }, this.words, h("div", { class: "buttons even" }, this.findButton, this.allButton),
      this.work.element, this.options, this.said, this.cautions, this.list);
  }

  /** @param {RegistrationSection} registration */
  update(registration) {
    const other = registration.id !== this.registration?.id;
    this.registration = registration;
    if (other) this.work.again();
    const { beads, search, locked, selected, has_volume: hasVolume } = registration;
    this.changed([beads, search, locked, selected, hasVolume, this.looking], () => this.render(registration));
  }

  /** Whether beads are looked for, whoever asked for it. */
  get looking() {
    return this.asks || this.work.shown.length > 0;
  }

  again() {
    if (this.registration) this.update(this.registration);
  }

  /** @param {RegistrationSection} registration */
  render({ beads, search, locked, selected, has_volume: hasVolume }) {
    say(this.words, hasVolume ? WHAT : "No CT: add points at the crosshair.");
    this.words.hidden = beads.length > 0;
    const open = beads.filter((bead) => bead.state === "found").length;
    this.findButton.hidden = this.options.hidden = !hasVolume;
    this.findButton.disabled = locked || this.looking;
    this.findButton.classList.toggle("primary", !beads.length);
    this.findButton.textContent = this.looking ? "Looking …" : beads.length ? "Find again" : "Find beads";
    this.allButton.hidden = open === 0;
    this.allButton.classList.toggle("primary", open > 0);
    this.allButton.disabled = locked;
    say(this.said, search ? saidOf(beads.length, search.left_out) : "");
    this.said.hidden = !this.said.textContent;
    this.cautions.hidden = !search?.cautions.length;
    this.cautions.replaceChildren(...(search?.cautions ?? []).map((text) => line(text, { class: "words caution" })));
    this.list.hidden = !beads.length;
    this.renderList({ beads, locked, selected });
  }

  /** @param {Pick<RegistrationSection, "beads" | "locked" | "selected">} registration */
  renderList({ beads, locked, selected }) {
    const shown = this.filter.of(beads);
    draw(this.list, html`${this.filter.field(beads.length)}
      <ul class="list fiducials" id="beads" aria-label="Beads">${repeat(shown, ({ id }) => id, (bead) => this.row(bead, locked, bead.id === selected))}</ul>
      ${shown.length ? nothing : html`<p class="empty">None found.</p>`}`);
    this.roving.update();
  }

  /**
   * @param {BeadEntry} bead
   * @param {boolean} locked
   * @param {boolean} selected
   */
  row(bead, locked, selected) {
    const button = (/** @type {"yes" | "no"} */ judge, /** @type {boolean} */ pressed) => {
      const words = JUDGED[judge][Number(pressed)];
      return html`<button type="button" class="plain" data-judge=${judge} data-operation="bead.judge" ?disabled=${locked}
        aria-pressed=${String(pressed)} aria-label=${`${words} ${bead.name}`} @click=${() => this.judge(bead, judge === "yes")}>${words}</button>`;
    };
    return html`<li class="row" data-state=${bead.state} aria-current=${String(selected)}>
      <button type="button" class="row-main" title="Show it" @click=${() => this.connection.send("bead.show", { bead_id: bead.id })}><span>${bead.name}</span></button>
      <div class="row-tools bead-judge">${button("yes", bead.state === "confirmed")}${button("no", bead.state === "rejected")}</div>
      <span class="row-sub">⌀ ${mm(bead.diameter_mm)} · ${placeWords(bead.position).replace(" mm", "")}</span>
    </li>`;
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
    this.asks = true;
    this.again();
    try {
      const wish = { diameter_mm: heldNumber(this.diameter), threshold_hu: heldNumber(this.threshold) };
      this.work.watch(await send(`/api/v1/registrations/${encodeURIComponent(registration.id)}/beads`, wish));
    } catch (error) {
      note(/** @type {Error} */ (error).message, { error: true });
    } finally {
      this.asks = false;
      this.again();
    }
  }

  /**
   * What was found stands in the registration.
   * @param {JobEntry} job
   * @param {unknown} error
   */
  ended({ document_id: of }, error) {
    if (error && of === this.registration?.id) {
      if (wasCancelled(error)) note("Search cancelled; beads found before stay.");
      else note(/** @type {Error} */ (error).message, { error: true });
    }
    this.again();
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
 * What the list of beads does not show of a search.
 * @param {number} found
 * @param {number} leftOut
 */
function saidOf(found, leftOut) {
  const none = found ? "" : "No bead found. Try another size or threshold, or add points. ";
  return leftOut ? `${none}${count(leftOut, "similar place", "similar places")} left out. Teeth and edges of bone look alike.` : none.trim();
}
