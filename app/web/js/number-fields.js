// Numbers of a template that the planner holds: each is a field of its own, which stays while the template is drawn anew.
import { numberInput, showNumber } from "./fields.js";

/**
 * value: as the planner has it, null for none. changed: is called with what was typed, where it can be taken. emptied:
 * where an empty field means something.
 * @typedef {{ low: number, high: number, value: number | null, off: boolean, changed: (value: number) => void, emptied?: () => void }} NumberField
 */

export class NumberFields {
  constructor() {
    /** @type {Map<string, { input: HTMLInputElement, now: NumberField }>} by id */
    this.known = new Map();
  }

  /**
   * The field as it is now; what cannot be taken is said below it, and sent to nobody.
   * @param {string} id
   * @param {NumberField} now
   * @param {Record<string, string>} [attributes]
   */
  of(id, now, attributes = {}) {
    const known = this.known.get(id) ?? this.make(id, now);
    known.now = now;
    known.input.disabled = now.off;
    for (const [name, value] of Object.entries(attributes)) known.input.setAttribute(name, value);
    showNumber(known.input, now.value);
    return known.input;
  }

  /**
   * @param {string} id
   * @param {NumberField} now
   */
  make(id, now) {
    const of = () => /** @type {{ now: NumberField }} */ (this.known.get(id)).now;
    const input = numberInput(id, now.low, now.high, 0, (value) => of().changed(value), now.emptied && (() => of().emptied?.()));
    const made = { input, now };
    this.known.set(id, made);
    return made;
  }
}
