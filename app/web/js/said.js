// A text of the page: a dozen words in sight, and the rest of it behind ‘?’. In a template: `said` of template.js.
import { inTwo } from "./brief.js";
import { h } from "./dom.js";
import { sentence } from "./format.js";

/** @type {WeakMap<HTMLElement, string>} what each element says */
const shown = new WeakMap();

/**
 * Put a text into an element, which holds nothing else.
 * @param {HTMLElement} element
 * @param {string} text
 */
export function say(element, text) {
  if (shown.get(element) === text) return; // what is unfolded stays so
  shown.set(element, text);
  const [first, rest] = inTwo(sentence(text));
  const more = () => h("details", { class: "more" }, h("summary", { "aria-label": "More", title: "More" }, "?"), h("span", { class: "help" }, rest));
  element.replaceChildren(first, ...(rest ? [" ", more()] : []));
}

/**
 * A paragraph that says something.
 * @param {string} text
 * @param {import("./dom.js").Props} [props]
 */
export function line(text, props = {}) {
  const element = h("p", { class: "words", ...props });
  say(element, text);
  return element;
}

/**
 * Escape folds the explanation that is open, before it means anything else.
 * @param {KeyboardEvent} event
 */
export function foldExplanation(event) {
  if (event.key !== "Escape") return false;
  const open = [...document.querySelectorAll("details.more[open]")].find((one) => one.checkVisibility({ visibilityProperty: true }));
  if (!open) return false;
  open.removeAttribute("open");
  /** @type {HTMLElement | null} */ (open.querySelector("summary"))?.focus({ preventScroll: true });
  return true;
}
