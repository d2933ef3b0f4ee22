// What is sent of a hand whose axes are rates: news at most 60 times a second, the same again while it is held, and rest once.
import { REST, atRest } from "./six-axes.js";

/** @import { SixAxes } from "./six-axes.js" */

const NEWS_MS = 16;
const AGAIN_MS = 80; // a planner that hears nothing for 0.25 s lets go: of every three one may be late
const DIGITS = 1000;

export class RateChannel {
  /**
   * @param {(axes: SixAxes) => void} send
   * @param {(on: boolean) => void} hold whether the hand holds anything
   */
  constructor(send, hold) {
    this.send = send;
    this.hold = hold;
    this.held = false;
    this.armed = false; // it was at rest since it was last taken away: a stick that lies askew drives nothing
    this.sentAt = -Infinity;
    /** @type {Readonly<SixAxes>} */
    this.sent = REST;
  }

  /**
   * Where the hand is now.
   * @param {Readonly<SixAxes>} axes
   * @param {number} now ms
   */
  set(axes, now) {
    if (atRest(axes)) {
      this.armed = true;
      this.release();
    }
    if (atRest(axes) || !this.armed) return;
    const news = /** @type {SixAxes} */ (axes.map((value) => Math.round(value * DIGITS) / DIGITS));
    const same = news.every((value, index) => value === this.sent[index]);
    if (this.held && now - this.sentAt < (same ? AGAIN_MS : NEWS_MS)) return;
    if (!this.held) this.hold(true);
    this.held = true;
    this.sent = news;
    this.sentAt = now;
    this.send(news);
  }

  release() {
    if (!this.held) return;
    this.held = false;
    this.sent = REST;
    this.send([...REST]);
    this.hold(false);
  }

  /** The hand is taken away: it has to come to rest before it drives again. */
  letGo() {
    this.release();
    this.armed = false;
  }
}
