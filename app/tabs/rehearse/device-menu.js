// The menu of devices: which one drives, whether it is there, and what each of its axes does, live.
import { h } from "/static/js/dom.js";
import { DEVICES, HandDevices } from "/static/js/devices/hand-devices.js";
import { isTrial } from "/static/js/led-study.js";
import { draw, hintLine, html, nothing, titled } from "/static/js/template.js";
import { isFree } from "./modes.js";

/** @import { Parts } from "/static/js/panel.js" */
/** @import { DeviceKind } from "/static/js/devices/hand-devices.js" */
/** @import { Commands, ViewModel } from "/static/js/types.js" */

/** What an axis does, from −1 to 1, and what moves it. @typedef {readonly [string, string]} AxisWords */

/** @type {Record<DeviceKind, string>} */
const NAMES = { mouse: "Mouse", keys: "Keys", gamepad: "Gamepad", "space-mouse": "SpaceMouse" };
const ACROSS = /** @type {const} */ (["Left, right", "Up, down", "Out, in", "Look down, up", "Look left, right", "Roll ↺ ↻"]);
const STICKS = ["Left stick ↔", "Triggers", "Left stick ↕", "Right stick ↕", "Right stick ↔", "Shoulders"];
const CAP = ["Slide ↔", "Lift, press", "Pull, push", "Tilt ↕", "Twist", "Lean ↔"];
/** @type {Record<DeviceKind, AxisWords[]>} */
const AXES = {
  mouse: [["Pull", "Drag the sphere"]],
  keys: [["Back, forward", "S W, or ↓ ↑"], ["Twist ↺ ↻", "A D"]],
  gamepad: ACROSS.map((what, axis) => [what, STICKS[axis]]),
  "space-mouse": ACROSS.map((what, axis) => [what, CAP[axis]]),
};
const HELP = "Directions are those of the endoscope’s picture. Keys drive whatever is chosen here. A device drives while this window has the focus, holds the handle, and the robot runs.";

export class DeviceMenu {
  /** @param {Parts} parts */
  constructor({ connection, keys }) {
    this.connection = connection;
    this.keys = keys;
    this.devices = new HandDevices(keys, (axes) => connection.send("rate", { axes }));
    this.owed = false; // the planner is to be told which kind of device was chosen
    this.led = false; // a teleoperated tool is led by this window
    /** @type {string | undefined} mode, device and task as they were told last */
    this.way = undefined;
    connection.on("state", ({ state }) => this.follow(state)); // also while another tab is shown
    connection.on("link", () => this.follow(connection.state));
    this.devices.addEventListener("change", () => this.render());
    this.devices.addEventListener("axes", () => this.showAxes());
    this.element = h("div", { class: "group", id: "devices" });
    this.words = "";
    this.render();
  }

  /** @param {ViewModel} state */
  update(state) {
    this.follow(state);
    this.tell(state);
    this.showAxes();
  }

  /** @param {ViewModel} state */
  follow({ step, rehearsal }) {
    const { mode, device, preset } = rehearsal?.control ?? {};
    const way = JSON.stringify([mode, device, preset, rehearsal?.mode]);
    if (way !== this.way) this.devices.letGo(); // what is held now was meant for what was before
    this.way = way;
    const held = this.connection.connected && step?.name === "rehearse" && Boolean(rehearsal?.mine);
    this.devices.follow(held, held && rehearsal?.state === "running");
  }

  render() {
    const { devices } = this;
    this.words = this.wordsNow;
    const choice = (/** @type {DeviceKind} */ kind) => html`<button type="button" data-device=${kind} aria-pressed=${String(kind === devices.kind)}
      @click=${() => this.choose(kind)}>${NAMES[kind]}</button>`;
    const rows = AXES[devices.kind].map(([what, by]) => html`<li class="axis"><span>${what}</span><span class="axis-bar" aria-hidden="true"><i></i></span><span class="axis-by">${by}</span></li>`);
    const ask = devices.kind === "space-mouse" && devices.spaceMouse.askable;
    draw(this.element, titled("Hand device", null, html`
      <div class="segmented devices" role="group" aria-label="Device">${DEVICES.map(choice)}</div>
      ${hintLine("device-words", this.words, HELP, Boolean(devices.source?.trouble))}
      ${ask ? html`<button type="button" class="wide" id="connect-device" @click=${() => devices.spaceMouse.ask()}>Connect SpaceMouse</button>` : nothing}
      ${devices.source?.trouble ? nothing : html`<ul class="axes">${rows}</ul>`}`));
    this.showAxes();
  }

  /** @param {DeviceKind} kind */
  choose(kind) {
    this.owed = true;
    this.devices.choose(kind);
  }

  /**
   * A teleoperated tool is led by a position or by a rate: a device that is chosen brings its own along, and one that is
   * read knows no other. With mouse and keys both can be had.
   * @param {ViewModel} state
   */
  tell(state) {
    const { rehearsal } = state;
    if (isTrial(state)) return; // it says which
    const led = Boolean(rehearsal?.mine) && rehearsal?.control?.mode === "teleoperated", begins = led && !this.led;
    this.led = led;
    if (!rehearsal || !rehearsal.control || !led || !(this.owed || (begins && this.devices.source))) return;
    this.owed = false;
    const device = this.devices.source ? "rate" : "position";
    const preset = /** @type {Commands["rehearsal.control"]["preset"]} */ (rehearsal.control.preset);
    if (rehearsal.control.device !== device) this.connection.send("rehearsal.control", { mode: "teleoperated", device, preset });
  }

  get wordsNow() {
    const { source, kind, watched, isAway, isAskew } = this.devices;
    if (source?.trouble) return source.trouble;
    if (source && !watched) return `${source.name} drives once this window holds the handle.`;
    if (source && isAway) return `${source.name} drives once this window has the focus.`;
    if (isAskew) return "Let go of it once, then it drives.";
    if (source) return source.name;
    const free = isFree(this.connection.state.rehearsal);
    return kind === "keys" ? "Hold a key." : free ? "Drag the sphere; with Shift it turns the tool." : "Drag the sphere on the shaft.";
  }

  /** The bars, which move with each frame in which a device is read. */
  showAxes() {
    if (this.words !== this.wordsNow) this.render();
    const bars = /** @type {NodeListOf<HTMLElement>} */ (this.element.querySelectorAll(".axis-bar > i"));
    const values = this.values;
    bars.forEach((bar, axis) => {
      const to = `${(50 * (values[axis] ?? 0)).toFixed(1)}%`;
      bar.style.setProperty("--to", to);
      bar.classList.toggle("back", (values[axis] ?? 0) < 0);
    });
  }

  /** @returns {readonly number[]} each from −1 to 1 */
  get values() {
    const { kind, axes } = this.devices;
    if (kind === "keys") return [this.keys.directions.drive, this.keys.directions.twist];
    if (kind !== "mouse") return axes;
    const { rehearsal, settings } = this.connection.state;
    const most = settings?.fields.find(({ name }) => name === "force_cap_n")?.value ?? 0;
    return [most > 0 ? Math.min(1, (rehearsal?.force_n ?? 0) / most) : 0];
  }
}
