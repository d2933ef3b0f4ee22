// A path that a pointer has traced at the patient, brought through the open registration into the open plan.
import { h, whenChanged } from "/static/js/dom.js";
import { note } from "/static/js/dialogs.js";
import { heldNumber, ownNumber } from "/static/js/fields.js";
import { send, upload } from "/static/js/rest.js";
import { line, say } from "/static/js/said.js";
import { field } from "./beads.js";
import { RecordButton } from "./record.js";
import { isUsable } from "./words.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { RegistrationSection, TracedPublic, TrackerView, ViewModel } from "/static/js/types.js" */

const WHAT = "Lead the pointer in; a path follows. Go from outside to inside. The other paths of the open plan stay.";

export class TraceGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.busy = false;
    this.told = ""; // of the last traced path, and of which plan, through which registration
    this.toldOf = this.toldBy = "";
    this.path = ""; // its id; once it is undone nothing is told of it any more
    /** @type {ViewModel} */
    this.state = connection.state;
    this.record = new RecordButton("record-trace", "Trace", (seconds) => this.during(() => send(this.address("/tracked"), { seconds, ...this.named() })));
    this.chooser = h("input", { type: "file", hidden: true, accept: ".csv", id: "trace-file", onchange: () => this.readTable() });
    this.tableButton = h("button", { type: "button", id: "read-trace", title: "CSV: x, y, z; ‘# unit=mm’, ‘# frame=patient’", onclick: () => this.chooser.click() }, "Read table …");
    this.practiceButton = h("button", { type: "button", id: "trace-simulated", title: "Practice", onclick: () => this.practise() }, "Simulate");
    this.noise = ownNumber("trace-noise", 0, 20, 0.1, 0.3);
    this.why = h("p", { class: "words caution", id: "trace-why" });
    this.words = h("p", { class: "words", id: "trace-words", role: "status" });
    this.element = h("div", { class: "fields" }, line(WHAT), this.why, this.record.element,
      h("div", { class: "buttons even" }, this.practiceButton, this.tableButton),
      h("details", { class: "folded" }, h("summary", {}, "Simulated pointer"), h("div", { class: "fields" },
        line("Practice: follows the path. The patient is that of the simulated touches."), field("Error, mm rms", this.noise))),
      this.words, this.chooser);
  }

  /**
   * @param {RegistrationSection} registration
   * @param {ViewModel} state
   */
  update(registration, state) {
    this.registration = registration;
    this.state = state;
    const { plan, pointer } = state;
    this.changed([registration.id, registration.deleted, registration.fit.state, plan?.id, plan?.locked, pointer, this.busy, this.told, this.isThere(registration, state)], () => this.render(registration, state));
  }

  /**
   * @param {RegistrationSection} registration
   * @param {ViewModel} state
   */
  render(registration, state) {
    const { plan, pointer } = state;
    const why = whyNot(registration, plan);
    say(this.why, why);
    this.why.hidden = !why;
    for (const button of [this.practiceButton, this.tableButton]) button.disabled = Boolean(why) || this.busy;
    this.record.update(pointer ?? null, !why && !this.busy);
    say(this.words, this.busy ? "Fitting the path …" : this.isThere(registration, state) ? this.told : "");
  }

  /**
   * Whether the path that was told of last is one of the open plan, traced through the open registration.
   * @param {RegistrationSection} registration
   * @param {ViewModel} state
   */
  isThere({ id }, { plan, paths }) {
    return id === this.toldBy && plan?.id === this.toldOf && Boolean(paths?.items.some((path) => path.id === this.path));
  }

  /** @param {string} end */
  address(end) {
    return `/api/v1/plans/${encodeURIComponent(this.state.plan?.id ?? "")}/traced${end}`;
  }

  named() {
    return { registration: this.registration?.id ?? null };
  }

  /** @param {() => Promise<TracedPublic>} work */
  async during(work) {
    if (!this.registration) return;
    const { id } = this.registration;
    this.busy = true;
    this.update(this.registration, this.state);
    try {
      const traced = await work();
      [this.told, this.toldOf, this.toldBy, this.path] = [`${traced.words} Undo in Plan takes it back.`, traced.plan.id, id, traced.path];
    } catch (error) {
      note(/** @type {Error} */ (error).message, { error: true });
    } finally {
      this.busy = false;
      this.update(this.registration, this.state);
    }
  }

  practise() {
    return this.during(() => send(this.address("/simulated"), { noise_mm: heldNumber(this.noise), ...this.named() }));
  }

  readTable() {
    const file = this.chooser.files?.[0];
    this.chooser.value = "";
    if (!file || !this.registration) return;
    const form = new FormData();
    form.append("file", file);
    form.append("registration", this.registration.id);
    this.during(() => upload(this.address(""), form, () => {}));
  }
}

/**
 * Why no path can be traced into the open plan, in words; '' where one can.
 * @param {RegistrationSection} registration
 * @param {ViewModel["plan"]} plan
 */
function whyNot(registration, plan) {
  if (!plan) return "Open a plan first.";
  if (plan.locked) return "The plan is locked.";
  if (registration.deleted || !isUsable(registration.fit)) return "Fit the points first.";
  return "";
}
