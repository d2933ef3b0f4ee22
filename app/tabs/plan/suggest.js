// Suggested paths: asked for, compared, shown in the head, and used.
import { noteEdit } from "/static/js/dialogs.js";
import { group, h, whenChanged } from "/static/js/dom.js";
import { hintLine } from "/static/js/hint-line.js";
import { moveFocus } from "/static/js/roving.js";
import { draw, html, nothing, repeat } from "/static/js/template.js";
import { endThere, noWay, removeThere } from "./no-way.js";
import { entryOf, PathSearch, targetOf } from "./suggestion.js";
import { wayCard } from "./way-card.js";
import { rowsOf } from "./way-figures.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { PlanSection, ShaftSection, SuggestionPublic, ViewModel } from "/static/js/types.js" */

const ORDER = "First are those that fit, then those that are tight; of these the one with the shortest tool in soft tissue, then the least deep, then the widest of bone. "
  + "Each was simulated with the chosen tool; its verdict and figures are those of the plan when it follows this way.";

/**
 * How many ways stand beside each other.
 * @param {number} ways
 */
const columnsOf = (ways) => (ways < 3 || ways === 4 ? 2 : 3);

export class SuggestGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.target = ""; // id of the chosen one
    /** @type {string | undefined} the suggestion that was brought into sight */
    this.seen = undefined;
    this.search = new PathSearch(connection, () => this.searched());
    this.body = h("div", { class: "fields" });
    this.element = group("Suggest a path", null, this.body);
  }

  /** @param {ViewModel} state */
  update({ plan, shaft }) {
    const { search } = this;
    if (search.suggestion && search.suggestion.plan_id !== plan?.id) search.forget();
    const of = [plan?.id, plan?.points, plan?.ghost, plan?.targets, plan?.locked, shaft?.shown, this.target, search.suggestion?.id, search.busy, search.problem, search.drawing];
    this.changed(of, () => draw(this.body, this.template(plan, shaft)));
  }

  /** The search has gone on: what it found is brought into sight once, the focus stays. */
  searched() {
    const { busy, suggestion } = this.search;
    this.update(this.connection.state);
    if (busy || this.seen === suggestion?.id) return;
    this.seen = suggestion?.id;
    this.body.querySelector(".way, #no-way")?.scrollIntoView({ block: "nearest" });
  }

  /**
   * @param {PlanSection | null | undefined} plan
   * @param {ShaftSection | undefined} shaft
   */
  template(plan, shaft) {
    const { search } = this;
    const targets = plan?.targets ?? [];
    const ready = Boolean(entryOf(plan) && targets.length);
    const wanted = (plan?.points.length ?? 0) < 2 && !search.suggestion && !search.busy;
    return html`
      ${targets.length > 1 ? this.targets(plan, targets) : nothing}
      <button type="button" class=${wanted ? "wide primary" : "wide"} id="suggest" ?disabled=${!ready} aria-disabled=${String(search.busy)}
        @click=${() => search.look(this.connection.state.plan, this.target)}>Suggest a path</button>
      ${search.work.element}
      ${plan && search.suggestion ? this.answer(plan, search.suggestion, shaft?.shown ?? null) : this.hint(plan, ready)}`;
  }

  /**
   * @param {PlanSection | null | undefined} plan
   * @param {PlanSection["targets"]} targets
   */
  targets(plan, targets) {
    const chosen = targetOf(plan, this.target)?.id;
    const choose = (/** @type {Event} */ { currentTarget }) => { this.target = /** @type {HTMLSelectElement} */ (currentTarget).value; };
    return html`<label class="field"><span class="field-label"><span>Target</span></span><select id="suggest-target" @change=${choose}>
      ${repeat(targets, ({ id }) => id, ({ id, label }) => html`<option value=${id} ?selected=${id === chosen}>${label}</option>`)}</select></label>`;
  }

  /**
   * @param {PlanSection | null | undefined} plan
   * @param {boolean} ready
   */
  hint(plan, ready) {
    const { busy, problem } = this.search;
    const idle = ready ? `From ${plan?.points[0]?.label ?? "the clicked place"}, with this tool.` : "Needs an entry and a target.";
    return html`<p class="words" id="suggest-words" role="status">${busy ? "" : problem || idle}</p>`;
  }

  /**
   * @param {PlanSection} plan
   * @param {SuggestionPublic} suggestion
   * @param {string | null} shown
   */
  answer(plan, suggestion, shown) {
    const { search, connection } = this;
    const { followed, earlier } = search.standing(plan);
    if (suggestion.none) {
      const { ends_at: place } = suggestion.none;
      return noWay(suggestion, suggestion.none, plan, earlier, {
        end: () => endThere(connection, search, this.target),
        remove: () => removeThere(connection, search),
        show: () => connection.send("slice.cross", { position: place }),
      });
    }
    const words = earlier ? "Points changed since. Use a way, or suggest again." : followed < 0 ? "Choose a way to see it." : `The path follows way ${followed + 1}.`;
    const rows = rowsOf(suggestion.alternatives);
    const ofShown = search.numberOf(shown);
    const tabbed = Math.max(ofShown < 0 ? followed : ofShown, 0);
    return html`${hintLine("suggest-words", words, ORDER, earlier)}
      <ul class=${earlier ? "ways earlier" : "ways"} id="alternatives" aria-label="Suggested ways" style=${`--rows: ${rows.length}; --columns: ${columnsOf(suggestion.alternatives.length)}`}>
        ${suggestion.alternatives.map((way, number) => wayCard(way, rows, {
          key: search.keyOf(number), number, shown: number === ofShown, followed: number === followed, tabbed: number === tabbed, locked: plan.locked, picture: search.pictures[number] ?? search.drawing,
        }, { show: () => search.preview(number), use: () => this.use(number), moved: (event) => this.move(event) }))}
      </ul>`;
  }

  /**
   * The focus moves among the ways, and each is shown that gets it.
   * @param {KeyboardEvent} event
   */
  move(event) {
    const number = moveFocus(event, [.../** @type {NodeListOf<HTMLElement>} */ (this.body.querySelectorAll("button.alternative"))]);
    if (number !== null) this.search.preview(number);
  }

  /** @param {number} number */
  use(number) {
    const { suggestion } = this.search;
    if (!suggestion) return;
    const done = this.connection.request("suggestion.use", { suggestion_id: suggestion.id, alternative: number });
    noteEdit(this.connection, "plan", done, "The path follows the suggestion.");
    // the button leaves, its card stays
    /** @type {HTMLElement | undefined} */ (this.body.querySelectorAll("button.alternative")[number])?.focus({ preventScroll: true });
  }
}
