// The tool and the robot of a plan: which they are, the tool's shape, a robot of one's own, the margin, and where the base stands.
import { h, whenChanged } from "/static/js/dom.js";
import { fixed, sentence } from "/static/js/format.js";
import { clearErrors, note, noteDone, noteEdit } from "/static/js/dialogs.js";
import { upload } from "/static/js/rest.js";
import { field, heldNumber, numberInput, showNumber } from "/static/js/fields.js";
import { draw, filesButton, html, live, more, nothing, repeat, said } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { EvaluationSection, InstrumentsSection, OwnRobotPublic, PlanRobotView, PlanSection, PlanToolView, PlanUseSection, ViewModel } from "/static/js/types.js" */

const OWN = "own";

export class InstrumentsGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.bend = numberInput("tool-bend", 0, 0, 5, () => this.shape()); // the planner tells the bounds
    this.radius = numberInput("tool-radius", 0, 0, 0.1, () => this.shape());
    this.margin = numberInput("plan-margin", 0, 0, 0.05, (value) => this.setMargin(value));
    this.margin.dataset.operation = "plan.settings";
    this.bendField = field("Bend", "°", this.bend);
    this.radiusField = field("Shaft radius", "mm", this.radius);
    this.marginField = field("Margin to bone", "mm", this.margin);
    this.body = h("div", { class: "fields" });
    this.element = h("div", { class: "group" }, h("div", { class: "group-head" }, h("h2", {}, "Tool and robot")), this.body);
  }

  /** @param {ViewModel} state */
  update({ plan, instruments, corridor, plan_use: use }) {
    const placed = corridor?.state === "current" ? corridor.verdict?.base_mm : undefined;
    this.changed([plan?.robot, plan?.tool, plan?.margin_mm, plan?.locked, Boolean(plan), instruments, placed, corridor?.scale?.margin, use?.state], () => {
      if (instruments) this.render(plan ?? null, instruments, corridor, use ?? null);
    });
  }

  /**
   * @param {PlanSection | null} plan
   * @param {InstrumentsSection} instruments
   * @param {EvaluationSection | undefined} corridor
   * @param {PlanUseSection | null} use the registration
   */
  render(plan, instruments, corridor, use) {
    const frozen = !plan || plan.locked;
    if (!plan) {
      draw(this.body, html`<p class="empty">Open a plan first.</p>`);
      return;
    }
    const [low, high] = instruments.margin_bounds_mm;
    this.renderShape(plan.tool, instruments, frozen);
    fill(this.margin, plan.margin_mm, low, high, "Margin to bone", "mm");
    this.margin.disabled = frozen;
    draw(this.body, html`${this.tool(plan.tool, instruments, frozen)}${this.robot(plan.robot, instruments, frozen)}
      ${this.marginField}${marginMore(plan, corridor)}${this.base(plan.robot, corridor, use, frozen)}`);
  }

  /**
   * @param {PlanToolView} tool
   * @param {InstrumentsSection} instruments
   * @param {boolean} frozen
   */
  renderShape(tool, instruments, frozen) {
    const [bendLow, bendHigh] = instruments.bend_bounds_deg;
    const [radiusLow, radiusHigh] = instruments.radius_bounds_mm;
    const straight = tool.bend_deg === null;
    fill(this.bend, tool.bend_deg, bendLow, bendHigh, "Bend of the tip", "°");
    fill(this.radius, tool.shaft_radius_mm, radiusLow, radiusHigh, "Radius of the shaft", "mm");
    this.bend.disabled = frozen || straight;
    this.radius.disabled = frozen;
    if (straight) this.bend.title = "This tool is straight.";
  }

  /**
   * @param {PlanToolView} tool
   * @param {InstrumentsSection} instruments
   * @param {boolean} frozen
   */
  tool(tool, instruments, frozen) {
    /** @type {[string, string][]} */
    const choices = instruments.tools.map(({ name, title }) => [name, name === tool.name && tool.changed ? `${title}, changed` : title]);
    if (!instruments.tools.some(({ name }) => name === tool.name)) choices.push([tool.name, tool.name]);
    const choose = (/** @type {string} */ name) => this.connection.send("plan.tool", { name });
    return html`<div class="field"><div class="words"><label for="plan-tool">Tool</label> ${tool.words ? more(tool.words, "tool-words", "About the tool") : nothing}</div>
        ${list({ id: "plan-tool", "data-operation": "plan.tool" }, choices, tool.name, frozen, choose)}</div>${trouble(tool.trouble)}
      <div class="buttons even">${this.bendField}${this.radiusField}</div>
      <button type="button" class="wide" id="tool-shipped" ?hidden=${!tool.changed} ?disabled=${frozen} @click=${() => choose(tool.name)}>Reset shape</button>`;
  }

  /**
   * @param {PlanRobotView} robot
   * @param {InstrumentsSection} instruments
   * @param {boolean} frozen
   */
  robot(robot, instruments, frozen) {
    const own = robot.urdf !== null;
    /** @type {[string, string][]} */
    const choices = instruments.robots.map(({ name, title }) => [name, title]);
    const known = !own && instruments.robots.some(({ name }) => name === robot.name);
    if (!known) choices.push([OWN, own ? `${robot.name} (own URDF)` : robot.name]);
    const choose = (/** @type {string} */ name) => { if (name !== OWN) this.connection.send("plan.robot", { name }); };
    const words = [robot.words, ...robot.notes].filter(Boolean).map(sentence).join(" ");
    return html`<div class="field"><div class="words"><label for="plan-robot">Robot</label> ${words ? more(words, "robot-words", "About the robot") : nothing}</div>
        ${list({ id: "plan-robot", "data-operation": "plan.robot" }, choices, known ? robot.name : OWN, frozen, choose)}</div>${trouble(robot.trouble)}
      ${own ? html`<div class="field"><label class="field-label" for="tool-frame">Tool link</label>
        ${list({ id: "tool-frame" }, robot.links.map((link) => [link, link]), robot.tool_frame ?? "", frozen, (link) => this.chooseFrame(link))}</div>` : nothing}
      <div class="buttons even">${filesButton({ id: "upload-robot", input: "urdf-file", words: "Own URDF …", disabled: frozen, accept: ".urdf" }, ([file]) => this.uploadRobot(file))}</div>`;
  }

  /**
   * Where the base stands: as each simulation places it, as the plan keeps it, or as the registration says.
   * @param {PlanRobotView} robot
   * @param {EvaluationSection | undefined} corridor
   * @param {PlanUseSection | null} use the registration
   * @param {boolean} frozen
   */
  base({ is_placed: kept }, corridor, use, frozen) {
    const away = corridor?.state === "current" ? corridor.verdict?.base_mm ?? null : null;
    const registered = use?.to === "base";
    const how = registered ? "By registration" : kept ? "Kept" : "Automatic";
    const edit = (/** @type {"base.keep" | "base.free"} */ type, /** @type {string} */ done) => () => noteEdit(this.connection, "plan", this.connection.request(type), done);
    return html`<div class="field"><div class="field-label"><span>Base</span><span id="base-place">${away === null ? nothing : `${fixed(away, 0)} mm from entry`}</span></div>
      <div class="base-line"><p id="base-words">${how}</p>
      <button type="button" id="keep-base" data-operation="base.keep" title="Simulations start from here" ?hidden=${registered || kept}
        ?disabled=${frozen || away === null} @click=${edit("base.keep", "Base kept.")}>Keep base</button>
      <button type="button" id="free-base" data-operation="base.free" title="Placed anew each time" ?hidden=${!kept}
        ?disabled=${frozen} @click=${edit("base.free", "Base placed automatically.")}>Place automatically</button></div></div>`;
  }

  /** @param {string} link of the own URDF */
  chooseFrame(link) {
    const robot = this.connection.state.plan?.robot;
    if (!robot?.urdf) return;
    this.connection.send("plan.robot", { name: robot.name, urdf: robot.urdf, tool_frame: link });
  }

  shape() {
    const tool = this.connection.state.plan?.tool;
    if (!tool) return;
    const [bend, radius] = [heldNumber(this.bend), heldNumber(this.radius)];
    this.connection.send("plan.tool", { name: tool.name, ...(tool.bend_deg === null || bend === null ? {} : { bend_deg: bend }), shaft_radius_mm: radius ?? tool.shaft_radius_mm });
  }

  /** @param {number} margin mm */
  setMargin(margin) {
    const { plan } = this.connection.state;
    if (!plan || plan.margin_mm === margin) return;
    const { id, margin_mm: before } = plan;
    const run = () => { // settings are no step of the history; what is open or set by now may be another one
      const now = this.connection.state.plan;
      if (now?.id === id && now.margin_mm === margin) this.connection.send("plan.settings", { settings: { margin_mm: before } });
    };
    noteDone(this.connection.request("plan.settings", { settings: { margin_mm: margin } }), `Margin is ${margin} mm.`, { label: "Undo", run });
  }

  /** @param {File} file */
  async uploadRobot(file) {
    clearErrors();
    const form = new FormData();
    form.append("file", file);
    try {
      /** @type {OwnRobotPublic} */
      const own = await upload("/api/v1/robots", form, () => {});
      await this.connection.request("plan.robot", { name: own.name, urdf: own.urdf, tool_frame: own.tool_frame });
      if (own.ends.length > 1) note(`URDF has several ends; held by ‘${own.tool_frame}’. Change under Tool link.`);
    } catch (error) {
      note(`‘${file.name}’: ${/** @type {Error} */ (error).message}`, { error: true });
    }
  }
}

/**
 * A list of choices; those that stay keep their element, so that an open list is not closed.
 * @param {{ id: string, "data-operation"?: string }} attributes
 * @param {[string, string][]} choices value and words
 * @param {string} chosen
 * @param {boolean} disabled
 * @param {(value: string) => void} choose
 */
function list({ id, "data-operation": operation = "" }, choices, chosen, disabled, choose) {
  const changed = (/** @type {Event} */ { currentTarget }) => choose(/** @type {HTMLSelectElement} */ (currentTarget).value);
  return html`<select id=${id} data-operation=${operation || nothing} ?disabled=${disabled} @change=${changed}>${repeat(choices, ([value]) => value,
    ([value, words]) => html`<option value=${value} .selected=${live(value === chosen)}>${words}</option>`)}</select>`;
}

/** @param {string} words why something cannot be read, '' where it can */
function trouble(words) {
  return words ? html`<p class="words caution">${said(words)}</p>` : nothing;
}

/**
 * What is kept beside the margin, since the surface may be off.
 * @param {PlanSection} plan
 * @param {EvaluationSection | undefined} corridor
 */
function marginMore({ margin_mm: margin }, corridor) {
  const kept = corridor?.scale?.margin ?? margin;
  const added = kept - margin;
  return added < 0.005 ? nothing : html`<p class="words" id="margin-words">${fixed(kept, 2)} mm with ${fixed(added, 2)} mm of scan error</p>`;
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
  input.title = `${low} to ${high} ${unit}`;
  showNumber(input, value);
}
