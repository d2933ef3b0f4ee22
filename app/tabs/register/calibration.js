// Pointer and robot: where the pointer's tip is, where the tracker stands beside the robot, and registrations to its base.
import { fillOptions, h, whenChanged } from "/static/js/dom.js";
import { note } from "/static/js/dialogs.js";
import { heldNumber, ownNumber } from "/static/js/fields.js";
import { brief } from "/static/js/brief.js";
import { change, remove, send, upload } from "/static/js/rest.js";
import { line, say } from "/static/js/said.js";
import { field } from "./beads.js";
import { pointerRows, robotRows, robotsTable, sentence } from "./calibration-words.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { RegistrationPublic, RegistrationSection, TrackerView } from "/static/js/types.js" */

const SWUNG_S = 15;
const WHAT = "Only needed with a tracker. It reports how a pointer and a marker on the robot lie; where the tip is in the pointer, and where the tracker stands beside the robot, is found once and kept here.";
const NO_TIP = "Pointer tip is not calibrated. Stand the tip in a dimple and swing the pointer by 30° to all sides. Until then the tracker has to report the tip itself.";
const NO_ROBOT = "Robot and tracker are not calibrated. The robot turns its flange with a marker on it about two axes or more, by 20° or more; its poses and those of the marker are read from two tables.";

export class CalibrationGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.busy = ""; // what goes on, in words
    /** @type {RegistrationSection | undefined} */
    this.registration = undefined;
    /** @type {TrackerView | null} */
    this.pointer = null;
    /** @type {HTMLSelectElement} */
    this.to = h("select", { id: "registered-to", onchange: () => this.choose() });
    fillOptions(this.to, [["patient", "the patient"], ["base", "the robot's base"]]);
    this.stays = h("p", { class: "words", id: "registered-to-words" });
    this.tip = new Tool("tip", "Pointer's tip", NO_TIP);
    this.robot = new Tool("tracker", "Robot and tracker", NO_ROBOT);
    this.swingButton = h("button", { type: "button", class: "wide", id: "swing-pointer", onclick: () => this.swing() }, "Swing pointer");
    this.tipFile = h("input", { type: "file", hidden: true, accept: ".csv", id: "pointer-file", onchange: () => this.readPointer() });
    this.robotFiles = h("input", { type: "file", hidden: true, multiple: true, accept: ".csv", id: "robot-files", onchange: () => this.readRobot() });
    this.noise = ownNumber("calibration-noise", 0, 20, 0.1, 0.3);
    this.baseWords = h("p", { class: "words", id: "to-base-words" });
    this.baseButton = h("button", { type: "button", class: "wide", id: "to-base", onclick: () => this.toBase() }, "Make base registration");
    this.status = h("p", { class: "words", id: "calibration-status", role: "status" });
    this.listen();
    this.element = h("div", { class: "fields" }, line(WHAT),
      h("div", { class: "field" }, h("label", { class: "field-label", for: "registered-to" }, "Registers to"), this.to), this.stays, this.status, this.tip.head, this.swingButton, this.tip.buttons,
      this.robot.head, this.robot.buttons,
      h("details", { class: "folded" }, h("summary", {}, "Simulated noise"), h("div", { class: "fields" }, field("Noise, mm rms", this.noise))),
      h("div", { class: "calibration-head" }, h("h3", {}, "To the robot's base"), this.baseWords), this.baseButton, this.tipFile, this.robotFiles);
  }

  listen() {
    this.tip.fileButton.addEventListener("click", () => this.tipFile.click());
    this.tip.simulateButton.addEventListener("click", () => this.run("simulate", () => send(`${this.path()}/pointer/simulate`, { noise_mm: heldNumber(this.noise) })));
    this.tip.clearButton.addEventListener("click", () => this.run("clear", () => remove(`${this.path()}/pointer`)));
    this.robot.fileButton.addEventListener("click", () => this.robotFiles.click());
    this.robot.simulateButton.addEventListener("click", () => this.run("simulate", () => send(`${this.path()}/robot/simulate`, { noise_mm: heldNumber(this.noise) })));
    this.robot.clearButton.addEventListener("click", () => this.run("clear", () => remove(`${this.path()}/robot`)));
  }

  path() {
    return `/api/v1/registrations/${encodeURIComponent(this.registration?.id ?? "")}`;
  }

  /**
   * @param {RegistrationSection} registration
   * @param {TrackerView | null | undefined} pointer
   */
  update(registration, pointer) {
    this.registration = registration;
    this.pointer = pointer ?? null;
    this.changed([registration.id, registration.calibration, registration.locked, registration.deleted, pointer, this.busy], () => this.render(registration));
  }

  /** @param {RegistrationSection} registration */
  render({ calibration, locked, deleted }) {
    const free = !locked && !deleted && !this.busy;
    this.to.value = calibration.to;
    this.to.disabled = !free || calibration.stays !== "";
    this.to.title = brief(sentence(calibration.stays));
    this.stays.hidden = calibration.to !== "base";
    say(this.stays, calibration.robot
      ? "Tracker points go through the calibration. Its error is counted."
      : "The robot touches the points itself. They are typed, or read from a table of the frame base; points of the tracker need the calibration below.");
    this.status.hidden = !this.busy;
    this.status.textContent = this.busy;
    this.tip.render(calibration.pointer, calibration.pointer ? pointerRows(calibration.pointer) : [], free);
    this.robot.render(calibration.robot, calibration.robot ? robotRows(calibration.robot) : [], free);
    this.swingButton.hidden = !this.pointer;
    this.swingButton.disabled = !free || this.pointer?.state !== "fresh";
    this.swingButton.title = this.pointer?.state === "fresh" ? "" : brief(sentence(this.pointer?.words ?? ""));
    this.baseButton.disabled = Boolean(this.busy) || deleted || calibration.no_base !== "";
    say(this.baseWords, sentence(calibration.no_base) || "Points go to the base as a new registration. A plan that uses it is driven from where the robot stands.");
  }

  /**
   * Do something that changes the registration.
   * @template Answer
   * @param {string} what goes on
   * @param {() => Promise<Answer>} act
   * @returns {Promise<Answer | null>}
   */
  async run(what, act) {
    if (!this.registration || this.busy) return null;
    this.say(what === "swing" ? this.swung(SWUNG_S) : "One moment …");
    try {
      return await act();
    } catch (error) {
      note(/** @type {Error} */ (error).message, { error: true });
      return null;
    } finally {
      this.say("");
    }
  }

  /** @param {string} busy */
  say(busy) {
    this.busy = busy;
    if (this.registration) this.update(this.registration, this.pointer);
  }

  /** @param {number} left */
  swung(left) {
    return `Swing it … ${left} s`;
  }

  choose() {
    const to = this.to.value; // the list shows what is stored while it is asked for
    return this.run("to", () => change(this.path(), { to }));
  }

  async swing() {
    let left = SWUNG_S;
    const timer = setInterval(() => this.say(this.swung(left = Math.max(left - 1, 0))), 1000);
    try {
      await this.run("swing", () => send(`${this.path()}/pointer/track`, { seconds: SWUNG_S }));
    } finally {
      clearInterval(timer);
    }
  }

  async readPointer() {
    const file = this.tipFile.files?.[0];
    this.tipFile.value = "";
    if (!file) return;
    const form = new FormData();
    form.append("file", file);
    await this.run("read", () => upload(`${this.path()}/pointer`, form, () => {}));
  }

  async readRobot() {
    const files = [...this.robotFiles.files ?? []];
    this.robotFiles.value = "";
    if (!files.length) return;
    const robot = robotsTable(await Promise.all(files.map((file) => file.text())));
    if (robot === null) {
      note("Choose both tables together. One says ‘# pose=flange_to_base’, the other ‘# pose=marker_to_tracker’.", { error: true });
      return;
    }
    const form = new FormData();
    form.append("file", files[1 - robot]);
    form.append("robot", files[robot]);
    await this.run("read", () => upload(`${this.path()}/robot`, form, () => {}));
  }

  async toBase() {
    /** @type {RegistrationPublic | null} */
    const made = await this.run("base", () => send(`${this.path()}/to-base`, {}));
    if (!made) return;
    try {
      await this.connection.request("registration.open", { registration_id: made.id });
      note(`‘${made.name}’ was made and opened.`);
    } catch (error) {
      note(/** @type {Error} */ (error).message, { error: true });
    }
  }
}

/** One calibration: its figures or what it is for, and the buttons of its sources. */
class Tool {
  /**
   * @param {string} name
   * @param {string} title
   * @param {string} missing
   */
  constructor(name, title, missing) {
    this.missing = missing;
    this.words = h("p", { class: "words", id: `${name}-words` });
    this.figures = h("dl", { class: "facts calibration", id: `${name}-figures` });
    this.cautions = h("div", { class: "fields", hidden: true });
    this.fileButton = h("button", { type: "button", id: `read-${name}` }, name === "tracker" ? "Read tables …" : "Read table …");
    this.simulateButton = h("button", { type: "button", id: `simulate-${name}`, title: "Practice" }, "Simulate");
    this.clearButton = h("button", { type: "button", class: "plain", id: `clear-${name}` }, "Forget");
    this.head = h("div", { class: "calibration-head" }, h("h3", {}, title), this.words, this.figures, this.cautions);
    this.buttons = h("div", { class: "buttons even" }, this.fileButton, this.simulateButton, this.clearButton);
  }

  /**
   * @param {{ cautions: string[], measured_from: string } | null} tool
   * @param {[string, string, string][]} rows
   * @param {boolean} free
   */
  render(tool, rows, free) {
    const simulated = tool?.measured_from === "simulated";
    this.words.hidden = Boolean(tool) && !simulated;
    say(this.words, simulated ? "Simulated, for practice." : this.missing);
    this.words.classList.toggle("caution", simulated);
    this.figures.hidden = !rows.length;
    this.figures.replaceChildren(...rows.flatMap(([term, words, title]) => [h("dt", { title }, term), h("dd", { class: "number" }, words)]));
    this.cautions.replaceChildren(...(tool?.cautions ?? []).map((text) => line(text, { class: "words caution" })));
    this.cautions.hidden = !tool?.cautions.length;
    this.clearButton.hidden = !tool;
    for (const button of [this.fileButton, this.simulateButton, this.clearButton]) button.disabled = !free;
  }
}
