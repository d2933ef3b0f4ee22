// Rows that are one stop of the Tab key: arrow keys, Home and End move the focus among them.

/** @type {Record<string, number>} */
const STEPS = { ArrowDown: 1, ArrowRight: 1, ArrowUp: -1, ArrowLeft: -1, Home: -Infinity, End: Infinity };

/**
 * Move the focus as a key says, from the row that has it; returns the number of the row that gets it, null where the
 * key means nothing here.
 * @param {KeyboardEvent} event
 * @param {HTMLElement[]} rows in order
 */
export function moveFocus(event, rows) {
  const at = rows.findIndex((row) => row === event.target);
  const step = event.ctrlKey || event.metaKey || event.altKey || event.shiftKey ? undefined : STEPS[event.key];
  if (at < 0 || !step) return null;
  event.preventDefault();
  event.stopPropagation();
  const next = Math.min(Math.max(at + step, 0), rows.length - 1);
  rows[next].focus();
  return next;
}
