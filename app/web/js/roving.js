// Roving focus: controls of one kind are one tab stop, arrow keys go from one to the other.

const KEYS = {
  vertical: { ArrowUp: -1, ArrowDown: 1, Home: -Infinity, End: Infinity },
  horizontal: { ArrowLeft: -1, ArrowRight: 1, Home: -Infinity, End: Infinity },
  both: { ArrowUp: -1, ArrowDown: 1, ArrowLeft: -1, ArrowRight: 1, Home: -Infinity, End: Infinity }, // of a strip that lies or stands
};

export class Roving {
  /**
   * @param {HTMLElement} element that holds the controls
   * @param {string} controls their selector
   * @param {{ axis?: keyof typeof KEYS, first?: string, columns?: () => number }} [options]
   *   first: selector of the one that Tab leads to; else it is the first one. columns: of a grid, in which ↑ ↓ go from row to row
   */
  constructor(element, controls, { axis = "vertical", first, columns } = {}) {
    this.element = element;
    this.controls = controls;
    this.keys = /** @type {Record<string, number>} */ (KEYS[axis]);
    this.first = first;
    this.columns = columns;
    element.addEventListener("focusin", () => this.update());
    element.addEventListener("focusout", () => this.update());
    element.addEventListener("keydown", (event) => this.key(event));
  }

  /** Those that can have the focus; what is folded away has none. */
  all() {
    return [.../** @type {NodeListOf<HTMLElement>} */ (this.element.querySelectorAll(this.controls))].filter((one) => !one.matches(":disabled"));
  }

  /** Make one of them the tab stop; call it once they are drawn. */
  update() {
    const all = this.all();
    const stop = all.find((one) => one === document.activeElement) ?? (this.first ? all.find((one) => one.matches(/** @type {string} */ (this.first))) : undefined) ?? all[0];
    for (const one of all) one.tabIndex = one === stop ? 0 : -1;
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const by = this.keys[event.key];
    const all = this.all();
    const at = all.findIndex((one) => one === event.target);
    if (by === undefined || at < 0 || event.ctrlKey || event.metaKey || event.altKey) return;
    const rows = this.columns && event.key.match(/Up|Down/u) ? this.columns() : 0;
    all[rows ? rowStep(at, by, all.length, rows) : Math.min(Math.max(at + by, 0), all.length - 1)].focus();
    event.preventDefault();
    event.stopPropagation();
  }
}

/**
 * Where ↑ or ↓ leads in a grid: to the row above or below, whose last control stands for one that it lacks.
 * @param {number} at
 * @param {number} by −1 or 1
 * @param {number} count
 * @param {number} columns
 */
export function rowStep(at, by, count, columns) {
  const row = Math.floor(at / columns) + by;
  if (row < 0 || row > Math.floor((count - 1) / columns)) return at;
  return Math.min(at + by * columns, count - 1);
}
