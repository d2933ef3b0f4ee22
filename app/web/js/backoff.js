// How long a lost connection waits before it is tried again.

const RETRY_MS = [250, 500, 1000, 2000];
const STEADY_MS = 10_000; // a connection that held for so long lets the next loss begin with the shortest wait again

export class Backoff {
  constructor() {
    this.attempt = 0;
  }

  /**
   * A connection was lost after so long.
   * @param {number} heldMs
   */
  lost(heldMs) {
    if (heldMs > STEADY_MS) this.attempt = 0;
  }

  /** The wait before the next attempt, in ms; the longest one again and again. */
  next() {
    const wait = RETRY_MS[Math.min(this.attempt, RETRY_MS.length - 1)];
    this.attempt += 1;
    return wait;
  }
}
