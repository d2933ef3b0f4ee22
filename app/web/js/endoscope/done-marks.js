// Which marks of a task are done, and which of them just now: those have a tick for a moment.

export const FRESH_MS = 1200;

export class DoneMarks {
  /** @param {() => void} changed the tick of one is over */
  constructor(changed) {
    this.changed = changed;
    /** @type {boolean[]} of each mark, as it was last told */
    this.before = [];
    /** @type {Map<number, number>} when those were done that have a tick, by number from 0 */
    this.since = new Map();
  }

  /**
   * What a mark that was seen undone before shows once it is done; one that was done when the page first heard of it has no tick.
   * @param {boolean[]} done of each mark
   * @param {number} [now] ms
   */
  follow(done, now = performance.now()) {
    done.forEach((one, index) => {
      if (!one) this.since.delete(index);
      else if (this.before[index] === false) {
        this.since.set(index, now);
        setTimeout(this.changed, FRESH_MS);
      }
    });
    this.before = done;
  }

  /**
   * Whether a mark has its tick.
   * @param {number} index
   * @param {number} [now] ms
   */
  isFresh(index, now = performance.now()) {
    return now - (this.since.get(index) ?? -Infinity) < FRESH_MS;
  }
}
