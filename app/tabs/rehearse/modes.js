// Who leads the tool: a free hand, a hand on the robot, or a device far from it; and by which parameters.
import { h, whenChanged } from "/static/js/dom.js";
import { mm } from "/static/js/format.js";
import { draw, hintLine, html, nothing, titled } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { Commands, ContactView, RehearsalSection, ViewModel } from "/static/js/types.js" */
/** @typedef {Commands["rehearsal.control"]} Control */

/** @type {[Control["mode"], string][]} */
const MODES = [["freehand", "Freehand"], ["hands-on", "Hands-on"], ["teleoperated", "Teleoperated"]];
/** @type {[NonNullable<Control["device"]>, string][]} */
const DEVICES = [["position", "Position"], ["rate", "Rate"]];
/** @type {[NonNullable<Control["preset"]> | "", string][]} */
const PRESETS = [["", "Default"], ["li2004", "Li 2004"], ["li2007", "Li 2007"]];
export const WITHOUT = "Without the certificate: nothing keeps the tool off bone.";
/** @type {Record<Control["mode"], string>} */
const WORDS = {
  freehand: "Your hand alone holds the tool. No robot, no margin.",
  "hands-on": "Your hand pushes the robot, which keeps off bone.",
  teleoperated: "A device leads the robot, which keeps off bone.",
};
const HELP = "Freehand: the tool alone, as in your hand; bone gives way like a spring. Drag the sphere to move it, with Shift to turn it. "
  + "Hands-on: your hand pushes the tool on the robot. Teleoperated: a device far from the robot moves it. "
  + "To or from freehand the run ends, and the next begins at the entry.";
const DEVICE_HELP = "Position: the tool goes as far as the device, or the sphere that you drag, at half scale, and stops with it. "
  + "Rate: a constant deflection is a constant speed; hold the sphere aside, with Shift to turn.";
const PRESET_HELP = "Printed parameters of a paper, at 30 Hz. The run ends, and the next begins at the entry.";

/**
 * Whether the tool that is there, or will be, is moved without the certificate, whatever mode was chosen since.
 * @param {Partial<RehearsalSection> | undefined} rehearsal
 */
export function isFree(rehearsal) {
  return rehearsal?.control?.certified === false;
}

export class ModesGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.element = h("div", { class: "group", id: "control-modes" });
  }

  /**
   * @param {ViewModel} state
   * @param {boolean} open the mode can be changed by this window
   */
  update({ rehearsal }, open) {
    const contacts = (rehearsal?.contacts ?? []).slice(0, 4);
    this.changed([rehearsal?.control, contacts, open], () => this.render(rehearsal, contacts, open));
  }

  /**
   * @param {RehearsalSection | undefined} rehearsal
   * @param {ContactView[]} contacts
   * @param {boolean} open
   */
  render(rehearsal, contacts, open) {
    const { mode, device, preset } = rehearsal?.control ?? { mode: "hands-on", device: "position", preset: null };
    const free = isFree(rehearsal);
    const send = (/** @type {Partial<Control>} */ change) =>
      this.connection.send("rehearsal.control", /** @type {Control} */ ({ mode, device, preset, ...change }));
    draw(this.element, titled("Mode", null, html`
      <div class="segmented devices" role="group" aria-label="Control mode">${MODES.map(([name, label]) => html`<button type="button" data-control=${name}
        aria-pressed=${String(name === mode)} ?disabled=${!open} @click=${() => send({ mode: name })}>${label}</button>`)}</div>
      ${hintLine("control-words", WORDS[free ? "freehand" : mode], HELP)}
      ${free ? html`<p class="words uncertified" id="uncertified" role="status">${WITHOUT}</p>` : nothing}
      ${free ? contactList(contacts) : nothing}
      ${mode !== "teleoperated" ? nothing : html`<div class="beside">${hintLine("kind-words", "Device", DEVICE_HELP)}
        <div class="segmented" role="group" aria-label="Kind of device">${DEVICES.map(([name, label]) => html`<button type="button" data-kind=${name}
          aria-pressed=${String(name === device)} ?disabled=${!open} @click=${() => send({ device: name })}>${label}</button>`)}</div></div>`}
      ${mode === "freehand" ? nothing : html`<div class="beside">${hintLine("preset-words", "Parameters", PRESET_HELP)}
        <select id="preset" aria-label="Parameters" ?disabled=${!open} .value=${preset ?? ""}
          @change=${(/** @type {Event} */ event) => send({ preset: /** @type {Control["preset"]} */ (/** @type {HTMLSelectElement} */ (event.target).value || null) })}>
          ${PRESETS.map(([name, label]) => html`<option value=${name} ?selected=${name === (preset ?? "")}>${label}</option>`)}</select></div>`}`));
  }
}

/** @param {ContactView[]} contacts */
function contactList(contacts) {
  if (!contacts.length) return html`<p class="words" id="contacts">Nothing was touched so far.</p>`;
  return html`<ul class="contacts" id="contacts">${contacts.map(({ structure, part, count, depth_mm: depth, max_depth_mm: most }) => html`
    <li class=${depth ? "touching" : ""}><span>${part} in ${structure}</span><span class="number">${depth ? mm(depth, 1) : "off"}</span>
      <span class="number">deepest ${mm(most ?? 0, 1)}, ${count} ×</span></li>`)}</ul>`;
}
