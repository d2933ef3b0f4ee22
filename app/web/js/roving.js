// A row of buttons as one tab stop: arrow keys move within it, Home and End to its ends.

const STEPS = /** @type {Record<string, number>} */ ({ ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 });

/**
 * The index after a key; null where the key means nothing here.
 * @param {string} key
 * @param {number} at
 * @param {number} count
 */
export function nextAt(key, at, count) {
  if (key === "Home") return 0;
  if (key === "End") return count - 1;
  const step = STEPS[key];
  return step && count ? (at + step + count) % count : null;
}

/**
 * Let the arrow keys move between the buttons of an element. Returns what has to be called where buttons have come or
 * gone: exactly one of those that can be used is reached with Tab.
 * @param {HTMLElement} element
 */
export function roving(element) {
  const all = () => [...element.querySelectorAll("button")];
  const usable = () => all().filter((button) => !button.disabled && !button.closest("[hidden]"));
  const settle = (/** @type {HTMLButtonElement | undefined} */ stop) => {
    const buttons = usable();
    const one = stop ?? buttons.find((button) => button.tabIndex === 0) ?? buttons[0];
    for (const button of all()) button.tabIndex = button === one ? 0 : -1;
  };
  element.addEventListener("focusin", ({ target }) => {
    if (target instanceof HTMLButtonElement) settle(target);
  });
  element.addEventListener("keydown", (event) => {
    const buttons = usable();
    const at = buttons.findIndex((button) => button === document.activeElement);
    const next = at < 0 || event.ctrlKey || event.metaKey || event.altKey ? null : nextAt(event.key, at, buttons.length);
    if (next === null) return;
    event.preventDefault();
    event.stopPropagation();
    buttons[next].focus();
  });
  return () => settle(undefined);
}
