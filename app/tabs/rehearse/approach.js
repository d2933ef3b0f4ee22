// The place of the path that the tip goes to first, straight, before it follows the path: a path point, or a number of mm.
import { h, whenChanged } from "/static/js/dom.js";
import { fixed } from "/static/js/format.js";
import { draw, html, live, nothing, unlessFocused } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { ApproachSection, ViewModel } from "/static/js/types.js" */

const STEP_MM = 0.5;

export class ApproachRow {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.selected = whenChanged();
    /** @type {string | null} id of the chosen path point, '' for a place in between, null before anything is */
    this.point = null;
    this.mm = 0;
    this.element = h("div", { id: "approach" });
  }

  /** @param {ViewModel} state */
  update({ approach, plan, rehearsal }) {
    const points = approach?.points ?? [], selected = points.find(({ id }) => id === plan?.selected);
    this.selected([selected?.id, points], () => {
      const to = selected ?? (points.some(({ id }) => id === this.point) || this.point === "" ? undefined : points[0]);
      if (to) this.choose(to.id, to.at_mm);
    });
    const led = Boolean(approach) && rehearsal?.mode === "path";
    this.element.hidden = !led;
    if (approach && led) this.changed([approach, this.point, this.mm], () => this.render(approach));
  }

  /** @param {ApproachSection} approach */
  render({ points, length_mm: length, refusal }) {
    const off = refusal !== "";
    draw(this.element, html`
      <div class="approach-row"><select id="approach-point" aria-label="Place to approach" ?disabled=${off} .value=${live(this.point ?? "")}
        @change=${(/** @type {Event} */ event) => this.take(event, points)}>
        ${points.map(({ id, label }) => html`<option value=${id} ?selected=${id === this.point}>${label}</option>`)}<option value="" ?selected=${this.point === ""}>In between</option></select>
      <input type="number" id="approach-mm" aria-label="Place to approach in mm along the path" min="0" max=${length} step=${STEP_MM} ?disabled=${off}
        .value=${unlessFocused(fixed(this.mm, 1))} @change=${(/** @type {Event} */ event) => this.type(event, length)}><span class="unit">mm</span>
      <button type="button" id="approach-go" title="The tip goes straight to this place, then along the path" data-command="rehearsal.approach" ?disabled=${off} @click=${this.go}>Approach</button></div>
      ${off ? html`<p class="words">${refusal}</p>` : nothing}`);
  }

  /**
   * @param {string} point
   * @param {number} at mm
   */
  choose(point, at) {
    Object.assign(this, { point, mm: at });
  }

  /**
   * @param {Event} event
   * @param {ApproachSection["points"]} points
   */
  take({ target }, points) {
    const { value } = /** @type {HTMLSelectElement} */ (target);
    this.choose(value, points.find(({ id }) => id === value)?.at_mm ?? this.mm);
    this.update(this.connection.state);
  }

  /**
   * @param {Event} event
   * @param {number} length mm
   */
  type({ target }, length) {
    const typed = Number(/** @type {HTMLInputElement} */ (target).value);
    this.choose("", Number.isFinite(typed) ? Math.min(Math.max(typed, 0), length) : this.mm);
    this.update(this.connection.state);
  }

  go = () => this.connection.send("rehearsal.approach", this.point ? { point: this.point } : { at_mm: this.mm });
}
