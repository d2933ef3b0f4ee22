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
   * @param {{ axis?: keyof typeof KEYS, first?: string | string[], columns?: () => number, row?: string }} [options]
   *   first: selectors of the one that Tab leads to, the best first; else it is the first one. columns: of a grid, in which
   *   ↑ ↓ go from row to row. row: selector of the rows, where each holds its own controls: ↑ ↓ go from row to row, and ← → within one
   */
  constructor(element, controls, { axis = "vertical", first, columns, row } = {}) {
    this.element = element;
    this.controls = controls;
    this.keys = /** @type {Record<string, number>} */ (KEYS[row ? "both" : axis]);
    this.firsts = [first ?? []].flat();
    this.columns = columns;
    this.row = row;
    element.addEventListener("focusin", () => this.update());
    element.addEventListener("focusout", () => this.update());
    element.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => this.update()).observe(element); // it comes into sight: which of its controls do is known now
  }

  /** Those that can have the focus: neither disabled nor out of sight. While none is in sight, all that are not disabled. */
  all() {
    const enabled = [.../** @type {NodeListOf<HTMLElement>} */ (this.element.querySelectorAll(this.controls))].filter((one) => !one.matches(":disabled"));
    const seen = enabled.filter((one) => one.checkVisibility({ visibilityProperty: true }));
    return seen.length ? seen : enabled;
  }

  /** Make one of them the tab stop; call it once they are drawn. */
  update() {
    const all = this.all();
    const firsts = this.firsts.map((selector) => all.find((one) => one.matches(selector)));
    const stop = all.find((one) => one === document.activeElement) ?? firsts.find(Boolean) ?? all[0];
    for (const one of all) one.tabIndex = one === stop ? 0 : -1;
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const by = this.keys[event.key];
    const all = this.all();
    const at = all.findIndex((one) => one === event.target);
    if (by === undefined || at < 0 || event.ctrlKey || event.metaKey || event.altKey) return;
    const columns = this.columns && event.key.match(/Up|Down/u) ? this.columns() : 0;
    const to = columns ? all[rowStep(at, by, all.length, columns)] : this.row ? this.inRows(all, at, by, event.key) : towards(all, at, by);
    to.focus();
    event.preventDefault();
    event.stopPropagation();
  }

  /**
   * @param {HTMLElement[]} all
   * @param {number} at index of the one that has the focus
   * @param {number} by
   * @param {string} key
   */
  inRows(all, at, by, key) {
    const rowOf = (/** @type {HTMLElement} */ one) => one.closest(/** @type {string} */ (this.row));
    const within = (/** @type {Element | null} */ row) => all.filter((one) => rowOf(one) === row);
    const row = rowOf(all[at]), beside = within(row), column = beside.indexOf(all[at]);
    if (key === "ArrowLeft" || key === "ArrowRight") return towards(beside, column, by);
    const rows = [...new Set(all.map(rowOf))];
    return towards(within(towards(rows, rows.indexOf(row), by)), 0, column);
  }
}

/**
 * Roving focus of a list whose rows are a name and its tools: see `nameRow` of template.js.
 * @param {HTMLElement} element that holds the list
 * @param {string} [also] controls of a row besides these
 */
export function rovingRows(element, also) {
  return new Roving(element, `button.row-main, .row-tools button${also ? `, ${also}` : ""}`, { row: ".row", first: ['[aria-current="true"] button.row-main', "button.row-main"] });
}

/**
 * The item so many places on, or the last one in that direction.
 * @template Item
 * @param {Item[]} items
 * @param {number} at
 * @param {number} by
 */
function towards(items, at, by) {
  return items[Math.min(Math.max(at + by, 0), items.length - 1)];
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
