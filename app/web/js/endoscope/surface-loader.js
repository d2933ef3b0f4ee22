// The surface that a scope sees, made by the planner as a job when it is first looked at, and loaded.
import { JobLine } from "../job-line.js";
import { readBytes } from "../rest.js";
import { h } from "../dom.js";
import { say } from "../said.js";

export class SurfaceLoader {
  /** @param {(data: ArrayBuffer | null) => void} loaded null: there is none, or not yet */
  constructor(loaded) {
    this.loaded = loaded;
    this.key = ""; // of what is loaded, or being made
    this.address = "";
    this.etag = ""; // of what is loaded
    this.job = new JobLine();
    this.words = h("p", { class: "words", role: "status" });
    this.againButton = h("button", { type: "button", hidden: true, onclick: () => this.make() }, "Make picture");
    this.element = h("div", { class: "scope-wait" }, this.words, this.job.element, this.againButton);
  }

  /**
   * Load a surface, unless that is the one which is there.
   * @param {string} address of the planner, which makes it by POST and has it by GET
   * @param {string} key another for another surface
   */
  want(address, key) {
    if (key === this.key) return;
    if (address !== this.address) this.drop("");
    this.key = key;
    this.address = address;
    this.make();
  }

  /**
   * There is none, for a reason.
   * @param {string} why
   * @param {boolean} [again] whether it can be made by a button
   */
  drop(why, again = false) {
    if (!again) this.key = "";
    this.etag = "";
    this.loaded(null);
    say(this.words, why);
    this.againButton.hidden = !again;
  }

  async make() {
    const { key, address } = this;
    say(this.words, "");
    this.againButton.hidden = true;
    try {
      const made = await this.job.run(address, {});
      const { etag, data } = made === null ? { etag: "", data: null } : await readBytes(address, this.etag);
      if (key !== this.key) return;
      if (made === null) this.drop("The picture was cancelled.", true);
      else if (data) this.loaded(data);
      this.etag = etag;
    } catch (error) {
      if (key === this.key) this.drop(/** @type {Error} */ (error).message, true);
    }
  }
}
