// Refining on a surface: points touched on bone, the refinement as a job, and what it says and does not say.
import { fillOptions, h, whenChanged } from "/static/js/dom.js";
import { sentence } from "/static/js/format.js";
import { JobList } from "/static/js/job-list.js";
import { stageWords } from "/static/js/jobs.js";
import { note } from "/static/js/dialogs.js";
import { heldNumber, ownNumber } from "/static/js/fields.js";
import { remove, send, upload, wasCancelled } from "/static/js/rest.js";
import { line, say } from "/static/js/said.js";
import { field } from "./beads.js";
import { RecordButton } from "./record.js";
import { isUsable, refinementRows, touchedWords } from "./words.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { JobEntry, RegistrationSection, StructureEntry, TrackerView } from "/static/js/types.js" */

const WHAT = "Touch edges and several sides. The touched points are moved onto the bone of the CT. The registration has to be right within some millimetres before.";

export class SurfaceGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.busy = ""; // what this window waits for, in words
    this.work = new JobList((job, error) => this.ended(job, error), {
      holds: ({ kind, document_id: of }) => kind === "refinement" && of === this.registration?.id,
      words: (job) => sentence(stageWords(job)),
      begun: () => queueMicrotask(() => this.again()),
    });
    /** @type {RegistrationSection | undefined} */
    this.registration = undefined;
    /** @type {TrackerView | null} */
    this.pointer = null;
    this.structure = h("select", { id: "surface-structure" });
    this.chooser = h("input", { type: "file", hidden: true, accept: ".csv", id: "surface-file", onchange: () => this.readTable() });
    this.tableButton = h("button", { type: "button", id: "read-surface", title: "CSV: x, y, z; ‘# unit=mm’, ‘# frame=patient’", onclick: () => this.chooser.click() }, "Read table …");
    this.touchButton = h("button", { type: "button", id: "touch-surface", title: "Practice", onclick: () => this.touch() }, "Simulate");
    this.record = new RecordButton("stroke-surface", "Stroke", (seconds) => this.stroked(seconds));
    this.count = ownNumber("surface-count", 10, 2000, 10, 60);
    this.noise = ownNumber("surface-noise", 0, 20, 0.1, 0.3);
    this.keep = ownNumber("surface-keep", 50, 100, 5, 75);
    this.options = h("details", { class: "folded" }, h("summary", {}, "Simulated pointer, share"), h("div", { class: "fields" },
      field("Points", this.count), field("Error of a touch, mm rms", this.noise), field("Nearest points used, %", this.keep)));
    this.state = h("p", { class: "words", id: "surface-state", role: "status" });
    this.refineButton = h("button", { type: "button", class: "wide", id: "refine-surface", onclick: () => this.refine() }, "Refine");
    this.figures = h("dl", { class: "facts", id: "surface-figures" });
    this.warning = line("The residual is not the accuracy. Touched points slide along the surface, and the worst are left out. Judge by the measured points: they took no part.", { class: "words caution", id: "surface-warning" });
    this.forgetButton = h("button", { type: "button", class: "wide", id: "forget-surface", onclick: () => this.forget() }, "Forget");
    this.element = h("div", { class: "fields" }, line(WHAT),
      h("div", { class: "field" }, h("label", { class: "field-label", for: "surface-structure" }, "Touched structure"), this.structure),
      this.record.element, h("div", { class: "buttons even" }, this.touchButton, this.tableButton), this.options, this.state,
      this.work.element, this.refineButton, this.figures, this.warning, this.forgetButton, this.chooser);
  }

  /**
   * @param {RegistrationSection} registration
   * @param {StructureEntry[]} structures
   * @param {TrackerView | null | undefined} pointer
   */
  update(registration, structures, pointer) {
    const other = registration.id !== this.registration?.id;
    this.registration = registration;
    this.structures = structures;
    this.pointer = pointer ?? null;
    if (other) this.work.again();
    const { touched, fit, locked, anatomy } = registration;
    this.changed([registration.id, touched, fit, locked, anatomy, structures.map(({ id, name }) => [id, name]), pointer, this.busy, this.works], () => this.render(registration, structures, other));
  }

  /**
   * @param {RegistrationSection} registration
   * @param {StructureEntry[]} structures
   * @param {boolean} other it was not shown before
   */
  render({ touched, fit, locked, anatomy }, structures, other) {
    const usable = isUsable(fit);
    const free = !locked && !this.busy && !this.works;
    fillOptions(this.structure, [["", anatomy], ...structures.map(({ id, name }) => /** @type {[string, string]} */ ([id, name]))]);
    if (other) this.structure.value = structures.some(({ id }) => id === touched?.structure) ? touched?.structure ?? "" : "";
    const name = structures.find(({ id }) => id === touched?.structure)?.name ?? anatomy;
    say(this.state, this.busy || touchedWords(touched, name, usable));
    for (const control of [this.structure, this.touchButton, this.tableButton]) control.disabled = !free;
    this.record.update(this.pointer, free);
    this.refineButton.disabled = !free || !touched || !usable;
    this.refineButton.classList.toggle("primary", Boolean(touched && usable && !touched.refinement));
    this.refineButton.textContent = touched?.refinement ? "Refine again" : "Refine";
    const rows = touched?.refinement && fit.state === "refined" ? refinementRows(touched, fit) : [];
    this.figures.replaceChildren(...rows.flatMap(([term, words, title]) => [h("dt", { title }, term), h("dd", { class: "number" }, words)]));
    this.warning.hidden = !rows.length;
    this.forgetButton.hidden = !touched;
    this.forgetButton.disabled = !free;
  }

  address() {
    return `/api/v1/registrations/${encodeURIComponent(this.registration?.id ?? "")}/surface`;
  }

  /**
   * Do something that takes a while; what it cannot do is told.
   * @param {string} words
   * @param {() => Promise<unknown>} work
   */
  async during(words, work) {
    if (!this.registration) return;
    this.busy = words;
    this.again();
    try {
      await work();
    } catch (error) {
      note(/** @type {Error} */ (error).message, { error: true });
    } finally {
      this.busy = "";
      this.again();
    }
  }

  again() {
    if (this.registration) this.update(this.registration, this.structures ?? [], this.pointer);
  }

  /** Whether the surface is touched or refined on by a job, whoever began it. */
  get works() {
    return this.work.shown.length > 0;
  }

  /**
   * What was made stands in the registration.
   * @param {JobEntry} job
   * @param {unknown} error
   */
  ended({ document_id: of }, error) {
    if (error && of === this.registration?.id) note(/** @type {Error} */ (error).message, { error: !wasCancelled(error) });
    this.again();
  }

  /** @param {JobEntry} job */
  watch(job) {
    this.work.watch(job); // goes on beside what is asked next
  }

  touch() {
    const request = { structure: this.structure.value || null, count: heldNumber(this.count), noise_mm: heldNumber(this.noise) };
    return this.during("Touching the surface …", async () => this.watch(await send(`${this.address()}/touch`, request)));
  }

  /** @param {number} seconds */
  stroked(seconds) {
    return this.during("Reading the pointer …", () => send(`${this.address()}/tracked`, { seconds, structure: this.structure.value || null }));
  }

  refine() {
    const keep = (heldNumber(this.keep) ?? 75) / 100;
    return this.during("Refining …", async () => this.watch(await send(`${this.address()}/refine`, { keep })));
  }

  forget() {
    return this.during("", () => remove(this.address()));
  }

  readTable() {
    const file = this.chooser.files?.[0];
    this.chooser.value = "";
    if (!file) return;
    const form = new FormData();
    form.append("file", file);
    if (this.structure.value) form.append("structure", this.structure.value);
    this.during("Reading the table …", () => upload(this.address(), form, () => {}));
  }
}
