// From where the selected target can be inspected, in words; the scene draws the same as a cone on it.
import { h, whenChanged } from "/static/js/dom.js";
import { draw, html, nothing } from "/static/js/template.js";
import { UPDATING } from "/static/js/verdict-line.js";

/** @import { ViewModel } from "/static/js/types.js" */

export class ConeGroup {
  constructor() {
    this.changed = whenChanged();
    this.element = h("div", { class: "fields", id: "cone", hidden: true });
  }

  /** @param {ViewModel} state */
  update({ cones, plan }) {
    this.changed([cones, plan?.selected], () => {
      const cone = cones?.items.find(({ target }) => target === plan?.selected);
      const old = cones?.state === "waits";
      this.element.hidden = !cone;
      draw(this.element, !cone ? html`` : html`<p class=${old ? "words cone-words stale" : "words cone-words"} id="cone-words">${cone.words}</p>
        ${old ? html`<p class="words"><span class="updating">${UPDATING}</span></p>` : nothing}`);
    });
  }
}
