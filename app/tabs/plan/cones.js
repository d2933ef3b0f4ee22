// From where the selected target can be inspected, in words; the scene draws the same as a cone on it.
import { h, whenChanged } from "/static/js/dom.js";

/** @import { ViewModel } from "/static/js/types.js" */

export class ConeGroup {
  constructor() {
    this.changed = whenChanged();
    this.words = h("p", { class: "words cone-words", id: "cone-words" });
    this.state = h("p", { class: "words verdict-state", id: "cone-state" });
    this.element = h("div", { class: "fields", id: "cone", hidden: true }, this.words, this.state);
  }

  /** @param {ViewModel} state */
  update({ cones, plan }) {
    this.changed([cones, plan?.selected], () => {
      const cone = cones?.items.find(({ target }) => target === plan?.selected);
      const old = cones?.state === "waits";
      this.element.hidden = !cone;
      this.words.textContent = cone?.words ?? "";
      this.words.classList.toggle("stale", old);
      this.state.textContent = old ? "Greyed: of the path and target before, until this one is judged." : "Drawn on the target in the head.";
    });
  }
}
