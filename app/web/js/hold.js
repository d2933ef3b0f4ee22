// A button that acts as long as it is held down, by pointer or by key, and lets go whatever happens.
import { h } from "./dom.js";
import { takeHold } from "./fresh-press.js";
import { LET_GO } from "./keys.js";

/**
 * What is held or not: each change is reported once, and a press again with each repeat of the key that holds it, by
 * which a hand that a busy machine has lost takes hold again.
 * @param {() => boolean} allowed whether it may be pressed now
 * @param {(down: boolean) => void} onchange
 */
export function hold(allowed, onchange) {
  let down = false;
  const press = (/** @type {PointerEvent | KeyboardEvent} */ event) => {
    const repeat = "repeat" in event && event.repeat;
    if (down !== repeat || !allowed()) return;
    down = true;
    takeHold(event, () => down, () => onchange(true));
  };
  const release = () => {
    if (!down) return;
    down = false;
    onchange(false);
  };
  return { press, release };
}

/**
 * The button; `letGo` is for whoever disables it: a disabled one may not hear the pointer come up.
 * @param {string} label
 * @param {string} keys their names
 * @param {(down: boolean) => void} onchange
 */
export function holdButton(label, keys, onchange) {
  const { press, release } = hold(() => !button.disabled, onchange);
  /** @type {HTMLButtonElement} */
  const button = h("button", {
    type: "button", class: "hold", title: `Hold. Key: ${keys}`,
    onpointerdown: (event) => { button.setPointerCapture(event.pointerId); press(event); },
    onpointerup: release, onpointercancel: release, onlostpointercapture: release, onblur: release,
    onkeydown: (event) => { if (event.key === " " || event.key === "Enter") press(event); },
    onkeyup: (event) => { if (event.key === " " || event.key === "Enter") release(); },
  }, label);
  window.addEventListener(LET_GO, release);
  return Object.assign(button, { letGo: release });
}
