// The robot and the tool of a plan: which they are, the tool's shape, and a robot of one's own.
import { fillOptions, h, group, whenChanged } from "/static/js/dom.js";
import { sentence } from "/static/js/format.js";
import { clearErrors, note } from "/static/js/dialogs.js";
import { upload } from "/static/js/rest.js";
import { field, heldNumber, numberInput, showNumber } from "/static/js/fields.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { InstrumentsSection, OwnRobotPublic, PlanRobotView, PlanSection, PlanToolView, ViewModel } from "/static/js/types.js" */

const OWN = "own";
const LOCKED = "The plan is locked. Unlock it to choose another robot or tool.";

export class InstrumentsGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.robot = h("select", { id: "plan-robot", "data-operation": "plan.robot", onchange: () => this.chooseRobot() });
    this.robotWords = h("p", { class: "words", id: "robot-words" });
    this.frame = h("select", { id: "tool-frame", onchange: () => this.chooseFrame() });
    this.frameField = field("Link that holds the tool", "", this.frame);
    this.chooser = h("input", { type: "file", hidden: true, accept: ".urdf", id: "urdf-file", onchange: () => this.uploadRobot() });
    this.uploadButton = h("button", { type: "button", class: "wide", id: "upload-robot", onclick: () => this.chooser.click() }, "Use a URDF of your own …");
    /** @type {HTMLSelectElement} */
    this.tool = h("select", { id: "plan-tool", "data-operation": "plan.tool", onchange: () => this.connection.send("plan.tool", { name: this.tool.value }) });
    this.toolWords = h("p", { class: "words", id: "tool-words" });
    this.bend = numberInput("tool-bend", 0, 0, 5, () => this.shape()); // the planner tells the bounds
    this.radius = numberInput("tool-radius", 0, 0, 0.1, () => this.shape());
    this.bendField = field("Bend", "°", this.bend);
    this.radiusField = field("Shaft radius", "mm", this.radius);
    this.shippedShape = h("button", { type: "button", class: "plain", id: "tool-shipped", onclick: () => this.connection.send("plan.tool", { name: this.tool.value }) }, "As it comes");
    this.lockedWords = h("p", { class: "words" }, LOCKED);
    this.element = group("Robot and tool", [this.shippedShape],
      field("Robot", "", this.robot), this.robotWords, this.frameField, this.uploadButton, this.chooser,
      field("Tool", "", this.tool), this.toolWords, h("div", { class: "buttons even" }, this.bendField, this.radiusField), this.lockedWords);
  }

  /** @param {ViewModel} state */
  update({ plan, instruments }) {
    this.changed([plan?.robot, plan?.tool, plan?.locked, Boolean(plan), instruments], () => {
      if (instruments) this.render(plan, instruments);
    });
  }

  /**
   * @param {PlanSection | null | undefined} plan
   * @param {InstrumentsSection} instruments
   */
  render(plan, instruments) {
    const frozen = !plan || plan.locked;
    const why = !plan ? "Open a plan first." : plan.locked ? LOCKED : "";
    for (const control of [this.robot, this.frame, this.uploadButton, this.tool, this.bend, this.radius, this.shippedShape]) {
      control.disabled = frozen;
      control.title = why;
    }
    this.lockedWords.hidden = !plan?.locked;
    if (!plan) return;
    this.renderRobot(plan.robot, instruments);
    this.renderTool(plan.tool, instruments, frozen);
  }

  /**
   * @param {PlanRobotView} robot
   * @param {InstrumentsSection} instruments
   */
  renderRobot(robot, instruments) {
    const own = robot.urdf !== null;
    /** @type {[string, string][]} */
    const choices = instruments.robots.map(({ name, title }) => [name, title]);
    const known = instruments.robots.some(({ name }) => name === robot.name);
    if (own || !known) choices.push([OWN, own ? `${robot.name} (your URDF)` : robot.name]);
    fillOptions(this.robot, choices);
    this.robot.value = own || !known ? OWN : robot.name;
    const words = robot.trouble || [robot.words, ...robot.notes.map(sentence)].filter(Boolean).join(" ");
    this.robotWords.textContent = sentence(words);
    this.robotWords.classList.toggle("caution", Boolean(robot.trouble));
    this.frameField.hidden = !own;
    fillOptions(this.frame, robot.links.map((link) => [link, link]));
    this.frame.value = robot.tool_frame ?? "";
  }

  /**
   * @param {PlanToolView} tool
   * @param {InstrumentsSection} instruments
   * @param {boolean} frozen
   */
  renderTool(tool, instruments, frozen) {
    /** @type {[string, string][]} */
    const choices = instruments.tools.map(({ name, title }) => [name, name === tool.name && tool.changed ? `${title}, changed` : title]);
    if (!instruments.tools.some(({ name }) => name === tool.name)) choices.push([tool.name, tool.name]);
    fillOptions(this.tool, choices);
    this.tool.value = tool.name;
    const [bendLow, bendHigh] = instruments.bend_bounds_deg;
    const [radiusLow, radiusHigh] = instruments.radius_bounds_mm;
    fill(this.bend, tool.bend_deg, bendLow, bendHigh, "Bend of the tip", "°");
    fill(this.radius, tool.shaft_radius_mm, radiusLow, radiusHigh, "Radius of the shaft", "mm");
    const straight = tool.bend_deg === null;
    const bounds = straight ? `Radius ${radiusLow} to ${radiusHigh} mm. A straight tool has no bend to change.`
      : `Bend ${bendLow} to ${bendHigh}°, radius ${radiusLow} to ${radiusHigh} mm.`;
    this.toolWords.textContent = tool.trouble ? sentence(tool.trouble) : `${tool.words} ${bounds}`;
    this.toolWords.classList.toggle("caution", Boolean(tool.trouble));
    this.bend.disabled = frozen || straight;
    if (straight && !frozen) this.bend.title = "This tool is straight: it has no bend that could be changed.";
    this.shippedShape.hidden = !tool.changed;
  }

  chooseRobot() {
    if (this.robot.value !== OWN) this.connection.send("plan.robot", { name: this.robot.value });
  }

  chooseFrame() {
    const robot = this.connection.state.plan?.robot;
    if (!robot?.urdf) return;
    this.connection.request("plan.robot", { name: robot.name, urdf: robot.urdf, tool_frame: this.frame.value }).catch((error) => {
      this.frame.value = robot.tool_frame ?? "";
      note(error.message, { error: true });
    });
  }

  shape() {
    const tool = this.connection.state.plan?.tool;
    if (!tool) return;
    const [bend, radius] = [heldNumber(this.bend), heldNumber(this.radius)];
    this.connection.send("plan.tool", { name: tool.name, ...(tool.bend_deg === null || bend === null ? {} : { bend_deg: bend }), shaft_radius_mm: radius ?? tool.shaft_radius_mm });
  }

  async uploadRobot() {
    const file = this.chooser.files?.[0];
    this.chooser.value = "";
    clearErrors();
    if (!file) return;
    const form = new FormData();
    form.append("file", file);
    try {
      /** @type {OwnRobotPublic} */
      const own = await upload("/api/v1/robots", form, () => {});
      await this.connection.request("plan.robot", { name: own.name, urdf: own.urdf, tool_frame: own.tool_frame });
      if (own.ends.length > 1) note(`‘${file.name}’ has ${own.ends.length} ends. The tool is held by ‘${own.tool_frame}’; choose another link where that is wrong.`);
    } catch (error) {
      note(`‘${file.name}’: ${/** @type {Error} */ (error).message}`, { error: true });
    }
  }
}

/**
 * @param {HTMLInputElement} input
 * @param {number | null} value
 * @param {number} low
 * @param {number} high
 * @param {string} label
 * @param {string} unit
 */
function fill(input, value, low, high, label, unit) {
  input.min = String(low);
  input.max = String(high);
  input.setAttribute("aria-label", `${label} in ${unit}`);
  if (!input.disabled) input.title = `${low} to ${high} ${unit}`;
  showNumber(input, value);
}
