// What stands where a slice has no picture yet.
import { h } from "../dom.js";

export class Waiting {
  constructor() {
    this.words = h("span");
    this.bar = h("progress", { max: 1, hidden: true, "aria-label": "CT that is loaded" });
    this.element = h("div", { class: "slice-wait" }, this.words, this.bar);
    this.load();
  }

  /** @param {number | null} [share] of the CT that is loaded, where the picture needs all of it */
  load(share = null) {
    this.say(share === null ? "Loading …" : `Loading the CT, ${Math.round(share * 100)} %`, false);
    this.bar.hidden = share === null;
    this.bar.value = share ?? 0;
  }

  /** @param {string} words why there is none */
  fail(words) {
    this.say(words, true);
    this.bar.hidden = true;
  }

  done() {
    this.element.hidden = true;
  }

  /**
   * @param {string} words
   * @param {boolean} failed
   */
  say(words, failed) {
    this.words.textContent = words;
    this.element.classList.toggle("failed", failed);
    this.element.hidden = false;
  }
}
