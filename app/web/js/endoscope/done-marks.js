// Which marks of a task are done, and which of them just now: those have a tick for a moment.

export const FRESH_MS = 1200;

export class DoneMarks {
  /** @param {() => void} changed the tick of one is over */
  constructor(changed) {
    this.changed = changed;
    /** @type {boolean[]} of each mark, as it was last told */
    this.before = [];
    /** @type {Set<number>} numbers from 0 of those that have a tick */
    this.fresh = new Set();
  }

  /**
   * What a mark that was seen undone before shows once it is done; one that was done when the page first heard of it has no tick.
   * @param {boolean[]} done of each mark
   */
  follow(done) {
    done.forEach((one, index) => {
      if (!one) this.fresh.delete(index);
      else if (this.before[index] === false) this.begin(index);
    });
    this.before = done;
  }

  /** @param {number} index */
  begin(index) {
    this.fresh.add(index);
    setTimeout(() => {
      this.fresh.delete(index);
      this.changed();
    }, FRESH_MS);
  }
}
