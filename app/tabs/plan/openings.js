// The openings of the head at which an empty path can begin: a button for each, as they are marked in scene and slices.
import { h, whenChanged } from "/static/js/dom.js";
import { draw, html, nothing, repeat } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { OpeningsSection } from "/static/js/types.js" */

export class Openings {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.element = h("div", { class: "openings", id: "openings", role: "group", "aria-label": "Openings of the head" });
  }

  /** @param {OpeningsSection | undefined} openings */
  update(openings) {
    this.changed([openings], () => this.render(openings));
  }

  /** @param {OpeningsSection | undefined} openings */
  render(openings) {
    const { state, items, words } = openings ?? { state: "none", items: [], words: "" };
    this.element.hidden = state === "none";
    const said = state === "waiting" ? "Finding the nostrils …" : words;
    draw(this.element, html`
      ${items.length ? html`<div class="buttons even">${repeat(items, ({ id }) => id, ({ id, name }) => html`
        <button type="button" data-opening=${id} data-command=${`opening.${id}`} title="The path enters here"
          @click=${() => this.connection.send("opening.use", { opening_id: id })}>${name}</button>`)}</div>` : nothing}
      <p class="words" role="status" ?hidden=${!said}>${said}</p>`);
  }
}
