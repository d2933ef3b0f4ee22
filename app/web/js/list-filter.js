// A field that shortens a long list to the names that hold what is typed.
import { html, nothing } from "./template.js";

const MOST = 7; // rows that need no filter

export class ListFilter {
  /**
   * @param {string} what the list holds, such as 'heads'
   * @param {() => void} changed draws the list anew
   */
  constructor(what, changed) {
    this.what = what;
    this.changed = changed;
    this.typed = "";
  }

  /**
   * The field, where a list is long enough for one.
   * @param {number} count of all rows
   */
  field(count) {
    if (count <= MOST) {
      this.typed = "";
      return nothing;
    }
    const label = `Filter ${this.what}`;
    return html`<input type="text" class="filter" id=${`filter-${this.what}`} autocomplete="off" aria-label=${label} placeholder=${label} .value=${this.typed} @input=${this.take}>`;
  }

  take = (/** @type {Event} */ { currentTarget }) => {
    this.typed = /** @type {HTMLInputElement} */ (currentTarget).value;
    this.changed();
  };

  /**
   * Those whose names hold what is typed, in whatever case of letters.
   * @template Item
   * @param {Item[]} items
   * @param {(item: Item) => string} [nameOf]
   */
  of(items, nameOf = nameIn) {
    const typed = this.typed.trim().toLocaleLowerCase();
    return items.filter((item) => nameOf(item).toLocaleLowerCase().includes(typed));
  }
}

/** @param {unknown} item */
function nameIn(item) {
  return /** @type {{ name: string }} */ (item).name;
}
