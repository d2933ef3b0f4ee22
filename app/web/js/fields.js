// Fields of the panel: a label with a unit over a control, and what is typed checked where it is typed.
import { h } from "./dom.js";
import { letterOf } from "./letters.js";

/**
 * @param {string} label
 * @param {string} unit
 * @param {HTMLElement} control
 */
export function field(label, unit, control) {
  return h("label", { class: "field" }, h("span", { class: "field-label" }, h("span", {}, label), unit ? " " : null, unit ? h("span", {}, unit) : null), control);
}

/** @type {WeakMap<HTMLInputElement, HTMLElement>} the sentence below a field that cannot be taken */
const problems = new WeakMap();

/** @type {WeakSet<object>} fields that the page keeps in step with the planner, but for what is being typed */
const watched = new WeakSet();

/**
 * Say below a field why what stands in it cannot be taken, and mark it; '' where it can. What was typed stays.
 * @param {HTMLInputElement} input
 * @param {string} words
 */
export function complain(input, words) {
  problems.get(input)?.remove();
  problems.delete(input);
  for (const name of ["aria-invalid", "aria-describedby"]) input.removeAttribute(name);
  if (!words) return;
  input.setAttribute("aria-invalid", "true");
  const problem = h("p", { class: "words field-problem", role: "alert", ...(input.id ? { id: `${input.id}-problem` } : {}) }, words);
  if (input.id) input.setAttribute("aria-describedby", problem.id);
  problems.set(input, problem);
  (input.closest(".field") ?? input).after(problem);
}

/**
 * Whether what stands in a field cannot be taken.
 * @param {HTMLInputElement} input
 */
export function isWrong(input) {
  return input.getAttribute("aria-invalid") === "true";
}

/**
 * Show again what is held, and nothing of what was typed.
 * @param {HTMLInputElement} input
 */
export function putBack(input) {
  complain(input, "");
  delete input.dataset.typing;
  input.value = input.dataset.known ?? "";
}

/**
 * Let Escape put a field back, where something was typed; `back` is called then. So does undo, once what was typed is
 * done and could not be taken: nothing of it is in the history that the planner would undo.
 * @param {HTMLInputElement} input
 * @param {() => void} [back]
 * @param {() => boolean} [more] whether there is something else to put back
 */
export function escapePutsBack(input, back = () => putBack(input), more = () => false) {
  input.addEventListener("keydown", (event) => {
    const typed = input.dataset.typing === "yes";
    const kept = isWrong(input) || more();
    if (event.key === "Escape" ? !typed && !kept : !isUndoKey(event) || typed || !kept) return;
    event.preventDefault();
    event.stopPropagation();
    back();
  });
}

/**
 * Why a text is no number that a field takes; '' where it is one.
 * @param {string} text
 * @param {number} low
 * @param {number} high
 */
export function whyNoNumber(text, low, high) {
  const range = `${low} to ${high} can be used.`.replace("-", "−");
  const value = numberOf(text);
  if (text.trim() === "") return `Nothing is typed. ${range}`;
  if (Number.isNaN(value)) return `That is no number. ${range}`;
  return value < low || value > high ? range : "";
}

/**
 * A typed number, with a point or a comma and a minus of any kind; NaN where it is none.
 * @param {string} text
 */
export function numberOf(text) {
  const plain = text.trim().replace("−", "-").replace(",", ".");
  return /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/iu.test(plain) ? Number(plain) : NaN;
}

/**
 * A number within the bounds of the field. One that is not is said below it, and what is held stays in force.
 * @param {string} id
 * @param {number} low
 * @param {number} high
 * @param {number} step of an arrow key; 0: arrows change nothing
 * @param {(value: number) => void} changed
 * @param {() => void} [emptied] where an empty field means something
 */
export function numberInput(id, low, high, step, changed, emptied) {
  /** @type {HTMLInputElement} */
  const input = h("input", { type: "text", inputMode: "decimal", autocomplete: "off", id, min: low, max: high, onchange: () => { // a browser's own number field drops a comma
    const empty = input.value.trim() === "";
    const why = empty && emptied ? "" : whyNoNumber(input.value, Number(input.min), Number(input.max));
    complain(input, why && `${why}${heldWords(input.dataset.known)}`);
    if (why) return;
    input.value = input.dataset.known = empty ? "" : String(numberOf(input.value));
    if (empty) emptied?.();
    else changed(numberOf(input.value));
  } });
  watchTyping(input);
  escapePutsBack(input);
  input.addEventListener("keydown", (event) => {
    if (!step || (event.key !== "ArrowUp" && event.key !== "ArrowDown")) return;
    event.preventDefault();
    const wanted = (numberOf(input.value) || 0) + (event.key === "ArrowUp" ? step : -step);
    input.value = String(Math.round(Math.min(Number(input.max), Math.max(Number(input.min), wanted)) * 1000) / 1000);
    delete input.dataset.typing;
    complain(input, "");
    input.dataset.known = input.value;
    changed(Number(input.value));
  });
  return input;
}

/**
 * A text that is taken where it can be; why one cannot is said below it, and what is held stays in force.
 * @param {string} id
 * @param {(text: string) => string} why it cannot be taken; '' where it can
 * @param {(text: string) => void} changed
 */
export function textInput(id, why, changed) {
  /** @type {HTMLInputElement} */
  const input = h("input", { type: "text", autocomplete: "off", id, onchange: () => {
    const wrong = why(input.value);
    complain(input, wrong && `${wrong}${heldWords(input.dataset.known)}`);
    if (!wrong) changed(input.value);
  } });
  watchTyping(input);
  escapePutsBack(input);
  return input;
}

/**
 * Show a text that the planner holds, but for what is being typed and what cannot be taken.
 * @param {HTMLInputElement} input
 * @param {string} text
 */
export function showText(input, text) {
  const same = input.dataset.known === text;
  input.dataset.known = text;
  if (isTyped(input) || (same && isWrong(input))) return;
  complain(input, "");
  if (input.value !== text) input.value = text;
}

/**
 * A number that only the page holds, until a button uses it.
 * @param {string} id
 * @param {number} low
 * @param {number} high
 * @param {number} step
 * @param {number | null} value null: empty, which means something
 * @param {() => void} [changed] called once another number is held
 */
export function ownNumber(id, low, high, step, value, changed = () => {}) {
  const input = numberInput(id, low, high, step, changed, value === null ? () => {} : undefined);
  watched.delete(input);
  showNumber(input, value);
  return input;
}

/**
 * The number that a field holds, whatever is typed in it; null where it holds none.
 * @param {HTMLInputElement} input
 */
export function heldNumber(input) {
  return input.dataset.known ? Number(input.dataset.known) : null;
}

/**
 * What stays in force, as words behind what is wrong.
 * @param {string | undefined} held
 */
export function heldWords(held) {
  return held ? ` ${held} is kept; Escape shows it again.`.replace("-", "−") : " Escape empties the field.";
}

/**
 * Note that something is being typed, until it is done or taken back to what stood there.
 * @param {HTMLInputElement} input
 */
export function watchTyping(input) {
  watched.add(input);
  /** @type {string | null} what stood there before the typing */
  let before = null;
  input.addEventListener("beforeinput", () => { before ??= input.value; });
  input.addEventListener("input", () => {
    if (input.value === before) delete input.dataset.typing;
    else input.dataset.typing = "yes";
  });
  for (const end of ["change", "blur"]) {
    input.addEventListener(end, () => {
      before = null;
      delete input.dataset.typing;
    });
  }
}

/** @param {Pick<KeyboardEvent, "ctrlKey" | "metaKey" | "key" | "code">} event */
export function isUndoKey(event) {
  return (event.ctrlKey || event.metaKey) && ["Z", "Y"].includes(letterOf(event));
}

/**
 * Whether undo and redo in a field are those of its text: while something is typed in it, and in a field whose text only
 * the page knows. Else the field shows what the planner has, and undo is the planner's.
 * @param {object | null} input
 */
export function hasTextUndo(input) {
  if (!input || !watched.has(input)) return true;
  return isTyped(/** @type {HTMLInputElement} */ (input));
}

/**
 * Whether an input is in the middle of being typed in: what the planner tells meanwhile must not replace it.
 * @param {HTMLInputElement} input
 */
export function isTyped(input) {
  return document.activeElement === input && input.dataset.typing === "yes";
}

/**
 * Show a number. What is being typed stays, and is checked against this number when it is done; so does what cannot be
 * taken, until another number is held.
 * @param {HTMLInputElement} input
 * @param {number | null} value
 * @param {number} [digits] after the point
 */
export function showNumber(input, value, digits = 3) {
  const text = value === null ? "" : String(Number(value.toFixed(digits)));
  const same = input.dataset.known === text;
  input.dataset.known = text;
  if (isTyped(input) || (same && isWrong(input))) return;
  complain(input, "");
  if (document.activeElement !== input || input.value === "" || numberOf(input.value) !== value) input.value = text;
}
