// A gamepad of the standard layout, as six axes. A browser shows it once one of its buttons was pressed, and has no event
// for a stick that moves: it is polled.
import { REST, shaped } from "./six-axes.js";

/** @import { SixAxes } from "./six-axes.js" */

const STANDARD = "standard";
const [LEFT_SHOULDER, RIGHT_SHOULDER, LEFT_TRIGGER, RIGHT_TRIGGER] = [4, 5, 6, 7]; // buttons of that layout

/** Says `change` when one comes or goes. */
export class GamepadSource extends EventTarget {
  /** @param {Partial<Pick<Navigator, "getGamepads">>} browser */
  constructor(browser) {
    super();
    this.browser = browser;
    this.tell = () => this.dispatchEvent(new Event("change"));
  }

  start() {
    for (const event of ["gamepadconnected", "gamepaddisconnected"]) window.addEventListener(event, this.tell);
  }

  stop() {
    for (const event of ["gamepadconnected", "gamepaddisconnected"]) window.removeEventListener(event, this.tell);
  }

  /** Those that are plugged in; the browser's list has gaps. */
  get pads() {
    return this.browser.getGamepads?.().filter((pad) => pad?.connected) ?? [];
  }

  get pad() {
    return this.pads.find((pad) => pad?.mapping === STANDARD) ?? null;
  }

  get name() {
    return this.pad ? this.pad.id.replace(/\s*\(.*$/, "") || "Gamepad" : ""; // without vendor and product
  }

  get trouble() {
    if (this.pad) return "";
    if (!this.browser.getGamepads) return "This browser reads no gamepads.";
    return this.pads.length ? "This gamepad’s layout is not known." : "No gamepad. Plug one in and press a button.";
  }

  /** @returns {SixAxes} */
  read() {
    return this.pad ? axesOf(this.pad) : [...REST];
  }
}

/**
 * Left stick: across and into the picture. Right stick: where the view turns. Triggers: up and down. Shoulders: roll.
 * @param {Pick<Gamepad, "axes" | "buttons">} pad
 * @returns {SixAxes}
 */
export function axesOf({ axes, buttons }) {
  const [leftX, leftY, rightX, rightY] = axes.map(shaped);
  const pressed = (/** @type {number} */ button) => buttons[button]?.value ?? 0;
  const down = shaped(pressed(LEFT_TRIGGER) - pressed(RIGHT_TRIGGER));
  const roll = shaped(pressed(RIGHT_SHOULDER) - pressed(LEFT_SHOULDER));
  return [leftX, down, 0 - leftY, 0 - rightY, rightX, roll]; // 0 − 0 is no −0
}
