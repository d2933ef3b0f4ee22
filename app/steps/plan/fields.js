// Fields of the panel: a label with a unit over a control, and numbers that are checked where they are typed.
import { h } from "/static/js/dom.js";
import { note } from "/static/js/dialogs.js";

/**
 * @param {string} label
 * @param {string} unit
 * @param {HTMLElement} control
 */
export function field(label, unit, control) {
  return h("label", { class: "field" }, h("span", { class: "field-label" }, h("span", {}, label), unit ? " " : null, unit ? h("span", {}, unit) : null), control);
}

/**
 * A number within bounds; one that is not is said at once, and what is in force is shown again.
 * @param {string} id
 * @param {number} low
 * @param {number} high
 * @param {number} step
 * @param {(value: number) => void} changed
 * @param {() => void} [emptied] where an empty field means something
 */
export function numberInput(id, low, high, step, changed, emptied) {
  /** @type {HTMLInputElement} */
  const input = h("input", { type: "number", id, min: low, max: high, step: "any", onchange: () => {
    const value = Number(input.value);
    if (input.value === "" && emptied) emptied();
    else if (input.value === "" || value < low || value > high) {
      note(`${low} to ${high} can be used.`.replace("-", "−"), { error: true });
      input.value = input.dataset.known ?? "";
    } else changed(value);
  } });
  watchTyping(input);
  input.addEventListener("keydown", (event) => {
    if (event.key !== "ArrowUp" && event.key !== "ArrowDown") return;
    event.preventDefault();
    const wanted = Number(input.value) + (event.key === "ArrowUp" ? step : -step);
    input.value = String(Math.round(Math.min(high, Math.max(low, wanted)) * 1000) / 1000);
    delete input.dataset.typing;
    changed(Number(input.value));
  });
  return input;
}

/**
 * Note that something is being typed, until it is done.
 * @param {HTMLInputElement} input
 */
export function watchTyping(input) {
  input.addEventListener("input", () => { input.dataset.typing = "yes"; });
  for (const end of ["change", "blur"]) input.addEventListener(end, () => { delete input.dataset.typing; });
}

/**
 * Whether an input is in the middle of being typed in: what the planner tells meanwhile must not replace it.
 * @param {HTMLInputElement} input
 */
export function isTyped(input) {
  return document.activeElement === input && input.dataset.typing === "yes";
}

/**
 * Show a number; what is being typed stays, and is checked against this number when it is done.
 * @param {HTMLInputElement} input
 * @param {number | null} value
 * @param {number} [digits] after the point
 */
export function showNumber(input, value, digits = 3) {
  const text = value === null ? "" : String(Number(value.toFixed(digits)));
  input.dataset.known = text;
  if (isTyped(input)) return;
  if (document.activeElement !== input || input.value === "" || Number(input.value) !== value) input.value = text;
}
