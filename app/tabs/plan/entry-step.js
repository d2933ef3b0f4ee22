// Step 1: where the tool goes in, which is the first point of the path, and the side that this is on.
import { h, whenChanged } from "/static/js/dom.js";
import { placeWords } from "/static/js/slices/place-words.js";
import { draw, html, live, nothing, said } from "/static/js/template.js";
import { Openings } from "./openings.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { Commands, ItemEntry, PathsSection, PlanSection, ViewModel } from "/static/js/types.js" */

/** @typedef {Commands["path.side"]["side"]} Side */

/** @type {[Side, string][]} */
const SIDES = [["", "Not set"], ["left", "Left nostril"], ["right", "Right nostril"], ["midline", "Midline"]];

export class EntryStep {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.openings = new Openings(connection);
    this.element = h("div", { class: "fields" });
  }

  /** @param {ViewModel} state */
  update({ plan, paths, openings }) {
    const entry = plan?.points[0];
    const chose = this.openings.element.contains(document.activeElement);
    this.openings.update(openings);
    this.changed([Boolean(plan), entry, entry?.id === plan?.selected, paths, openings?.words], () => draw(this.element, html`
      ${entry ? this.entry(entry, plan) : nothing}
      ${entry || openings?.words ? nothing : html`<p class="empty">Click a nostril.</p>`}
      ${this.openings.element}
      ${this.side(paths)}`));
    const shown = chose && entry ? this.element.querySelector("#entry-point") : null; // the button that was pressed is gone
    if (shown instanceof HTMLElement) shown.focus({ preventScroll: true });
  }

  /**
   * @param {ItemEntry} entry
   * @param {PlanSection | null | undefined} plan
   */
  entry(entry, plan) {
    return html`<button type="button" class="entry-point" id="entry-point" title="Show it" aria-pressed=${String(entry.id === plan?.selected)}
      @click=${() => this.connection.send("item.select", { item_id: entry.id })}><span class="dot"></span><span class="entry-name">${entry.label}</span><span class="number">${placeWords(entry.position)}</span></button>`;
  }

  /** @param {PathsSection | null | undefined} paths */
  side(paths) {
    const chosen = paths?.items.find(({ id }) => id === paths.chosen);
    const send = (/** @type {Event} */ { currentTarget }) => {
      const side = /** @type {Side} */ (/** @type {HTMLSelectElement} */ (currentTarget).value);
      if (paths) this.connection.send("path.side", { path_id: paths.chosen, side });
    };
    return html`<label class="field"><span class="field-label"><span>Side</span></span>
        <select id="entry-side" data-operation="path.side" ?disabled=${!paths || paths.locked} .value=${live(chosen?.entry_side ?? "")} @change=${send}>
          ${SIDES.map(([value, words]) => html`<option value=${value} ?selected=${value === (chosen?.entry_side ?? "")}>${words}</option>`)}
        </select></label>
      <p class="words caution" id="side-caution" ?hidden=${!paths?.side_caution}>${paths?.side_caution ? said(paths.side_caution) : nothing}</p>`;
  }
}
