// The button of the tool of a task: X, or the right mouse button in the picture, while it is held.
import { isFresh } from "/static/js/fresh-press.js";
import { LET_GO } from "/static/js/keys.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { Keys } from "/static/js/keys.js" */

const KEY = "KeyX";
const AGAIN_MS = 80; // a mouse moves more often than that

export class ToolButton {
  /**
   * @param {Connection} connection
   * @param {Keys} keys
   */
  constructor(connection, keys) {
    this.connection = connection;
    this.keys = keys;
    this.on = false; // there is a tool
    /** @type {Set<string>} what holds the button */
    this.held = new Set();
    this.told = 0; // when it was told last
    keys.shortcuts.push((event) => this.key(event));
    window.addEventListener("keyup", ({ code }) => { if (code === KEY) this.hold("key", false); });
    window.addEventListener("pointerdown", (event) => { if (this.on && event.button === 2 && inPicture(event)) this.hold("mouse", true); });
    // pressed while the left one is held a button makes no `pointerdown` of its own: what is held is told with each move
    window.addEventListener("pointermove", (event) => { if (this.on && (this.held.has("mouse") || inPicture(event))) this.hold("mouse", Boolean(event.buttons & 2), event); });
    window.addEventListener("pointerup", ({ buttons }) => { if (!(buttons & 2)) this.hold("mouse", false); });
    window.addEventListener("contextmenu", (event) => { if (this.on && inPicture(event)) event.preventDefault(); });
    window.addEventListener(LET_GO, () => this.letGo());
  }

  /** @param {boolean} on */
  follow(on) {
    this.on = on;
    if (!on) this.letGo();
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const { code, ctrlKey, metaKey, altKey } = event;
    if (!this.on || code !== KEY || ctrlKey || metaKey || altKey) return false;
    this.hold("key", true, event);
    return true;
  }

  /**
   * A button that a busy machine has lost takes hold again by a repeat of the key or a motion of the mouse.
   * @param {string} what
   * @param {boolean} on
   * @param {UIEvent} [event] that holds it
   */
  hold(what, on, event) {
    const before = this.held.size > 0;
    if (on) this.held.add(what);
    else this.held.delete(what);
    const now = this.held.size > 0;
    const again = now && event !== undefined && isFresh(event) && performance.now() - this.told > AGAIN_MS;
    if (before === now && !again) return;
    this.told = performance.now();
    this.keys.hold("tool", now);
    this.connection.send("drive.cut", { on: now });
  }

  letGo() {
    for (const what of [...this.held]) this.hold(what, false);
  }
}

/** On the picture or the black around it. @param {Pick<MouseEvent, "target">} event */
function inPicture({ target }) {
  return target instanceof Element && ["scope-picture", "endoscope"].some((name) => target.classList.contains(name));
}
