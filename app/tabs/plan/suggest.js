// Suggested paths: asked for, compared, shown in the head, and used.
import { note, noteEdit } from "/static/js/dialogs.js";
import { group, h, whenChanged } from "/static/js/dom.js";
import { count } from "/static/js/format.js";
import { Roving } from "/static/js/roving.js";
import { draw, hintLine, html, live, nothing, repeat, said } from "/static/js/template.js";
import { endThere, noWay, removeThere } from "./no-way.js";
import { surroundingsKey } from "./same-path.js";
import { entryOf, PathSearch } from "./suggestion.js";
import { NewTarget, targetOf } from "./wanted-target.js";
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
  /**
   * @param {Connection} connection
   * @param {() => void} found called when a search has begun or ended
   * @param {() => void} begun called when another path has been begun
   */
  constructor(connection, found, begun) {
    this.connection = connection;
    this.found = found;
    this.begun = begun;
    this.changed = whenChanged();
    this.target = ""; // id of the one that was chosen for this path
    this.newest = new NewTarget();
    /** @type {string | undefined} id of the path */
    this.path = undefined;
    /** @type {string | undefined} the suggestion that was brought into sight */
    this.seen = undefined;
    this.begins = false; // another path is asked for
    this.search = new PathSearch(connection, () => this.searched());
    this.body = h("div", { class: "fields" });
    this.roving = new Roving(this.body, "button.alternative", { axis: "both", first: '[aria-pressed="true"]', columns: () => columnsOf(this.suggestion?.alternatives.length ?? 0) });
    this.body.addEventListener("keydown", (event) => this.moved(event)); // after the keys have moved the focus
    this.element = group("Suggest a path", null, this.body);
  }

  /** @param {ViewModel} state */
  update(state) {
    const { plan, shaft, paths } = state;
    const { search } = this;
    if (this.path !== paths?.chosen) this.target = "";
    this.path = paths?.chosen;
    this.newest.follow(plan, this.path);
    search.keepTo(plan?.id);
    const aim = search.aim && plan?.targets.find(({ label }) => label === search.aim);
    if (aim) [this.target, search.aim] = [aim.id, ""]; // the search may be another window's
    const of = [plan?.id, plan?.points, plan?.ghost, plan?.targets, plan?.nearest_target, plan?.locked, shaft?.shown, this.wanted, search.suggestion?.id, search.found.length, plan?.tool, surroundingsKey(state), search.pending, search.busy, search.aims, search.problem, search.current?.drawing];
    this.changed(of, () => {
      draw(this.body, this.template(plan, shaft));
      this.roving.update();
    });
  }

  /** Id of the target that the path is to lead to: the chosen one, else one that was added since; '' without either. */
  get wanted() {
    return this.target || this.newest.id;
  }

  /** What was found last; null where nothing was asked for yet. */
  get suggestion() {
    return this.search.suggestion;
  }

  /** The search has gone on: what it found is brought into sight once, the focus stays. */
  searched() {
    const { suggestion } = this.search;
    this.update(this.connection.state);
    this.found();
    if (this.seen === suggestion?.id) return;
    this.seen = suggestion?.id;
    for (const part of ["#alternatives, #no-way", ".way"]) this.body.querySelector(part)?.scrollIntoView({ block: "nearest" });
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
      <button type="button" class=${wanted ? "wide primary" : "wide"} id="suggest" data-command="suggest" ?disabled=${!ready} aria-disabled=${String(search.pending > 0 || search.aims.includes(targetOf(plan, this.wanted)?.label ?? ""))}
        @click=${() => search.look(this.connection.state.plan, this.wanted)}>Suggest a path</button>
      ${this.newPath(plan)}
      ${search.work.element}
      ${plan && search.suggestion ? this.answer(plan, search.suggestion, shaft?.shown ?? null) : this.hint(plan, ready)}`;
  }

  /**
   * @param {PlanSection | null | undefined} plan
   * @param {PlanSection["targets"]} targets
   */
  targets(plan, targets) {
    const chosen = targetOf(plan, this.wanted)?.id;
    const choose = (/** @type {Event} */ { currentTarget }) => {
      this.target = /** @type {HTMLSelectElement} */ (currentTarget).value;
      this.update(this.connection.state);
    };
    return html`<label class="field"><span class="field-label"><span>Target</span></span><select @change=${choose}>
      ${repeat(targets, ({ id }) => id, ({ id, label }) => html`<option value=${id} .selected=${live(id === chosen)}>${label}</option>`)}</select></label>`;
  }

  /**
   * @param {PlanSection | null | undefined} plan
   * @param {boolean} ready
   */
  hint(plan, ready) {
    const { busy, problem } = this.search;
    const idle = ready ? `From ${plan?.points[0]?.label ?? "the clicked place"}, with this tool.` : "Needs an entry and a target.";
    return html`<p class="words" id="suggest-words" role="status">${busy ? "" : problem ? said(problem) : idle}</p>`;
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
      return html`${this.answers()}${noWay(suggestion, suggestion.none, plan, earlier, {
        end: () => endThere(connection, search),
        remove: () => removeThere(connection, search),
        show: () => connection.send("slice.cross", { position: place }),
      })}`;
    }
    const words = earlier ? "Plan changed. Suggest again." : followed < 0 ? "Choose a way to see it." : `The path follows way ${followed + 1}.`;
    const rows = rowsOf(suggestion.alternatives);
    const ofShown = search.numberOf(shown);
    return html`${this.answers()}${hintLine("suggest-words", words, ORDER, earlier)}
      <ul class=${earlier ? "ways earlier" : "ways"} id="alternatives" aria-label="Suggested ways" style=${`--rows: ${rows.length}; --columns: ${columnsOf(suggestion.alternatives.length)}`}>
        ${suggestion.alternatives.map((way, number) => wayCard(way, rows, {
          key: search.keyOf(number), number, shown: number === ofShown, followed: number === followed, locked: plan.locked, picture: search.current?.pictures[number] ?? search.current?.drawing,
        }, { show: () => search.preview(number), use: () => this.use(number) }))}
      </ul>`;
  }

  /** The answers to several targets, of which one is shown. */
  answers() {
    const { found, at } = this.search;
    if (found.length < 2) return nothing;
    const choose = (/** @type {number} */ number) => {
      this.search.choose(number);
      this.update(this.connection.state);
    };
    return html`<div class="buttons even" id="answers" role="group" aria-label="Ways to each target">
      ${found.map(({ aim, suggestion: { alternatives } }, number) => html`<button type="button" aria-pressed=${String(number === at)} @click=${() => choose(number)}>${aim}: ${alternatives.length ? count(alternatives.length, "way", "ways") : "no way"}</button>`)}
    </div>`;
  }

  /**
   * A way is shown that an arrow key has led to.
   * @param {KeyboardEvent} event
   */
  moved({ defaultPrevented }) {
    const number = this.roving.all().findIndex((card) => card === document.activeElement);
    if (defaultPrevented && number >= 0) this.search.preview(number);
  }

  /**
   * Another path of the plan, to the chosen target; while the path has no points there is nothing to begin.
   * @param {PlanSection | null | undefined} plan
   */
  newPath(plan) {
    const target = targetOf(plan, this.wanted);
    const title = target ? `An empty path to ${target.label}, same tool` : "Empty, same tool";
    return html`<button type="button" id="new-path" data-operation="path.new" title=${title} ?hidden=${(plan?.points.length ?? 0) < 2} ?disabled=${!plan || plan.locked}
      @click=${() => this.begin(target?.id ?? "")}>New path</button>`;
  }

  /**
   * Begin an empty path, which is to lead to a target.
   * @param {string} target
   */
  async begin(target) {
    if (this.begins) return;
    this.begins = true;
    try {
      await this.connection.request("path.new");
    } catch (error) {
      note(/** @type {Error} */ (error).message, { error: true });
      return;
    } finally {
      this.begins = false;
    }
    this.search.forget();
    this.path = this.connection.state.paths?.chosen; // else the target would be taken for that of the path before
    this.target = target;
    this.update(this.connection.state);
    this.begun();
  }

  /** @param {number} number */
  use(number) {
    const { suggestion } = this.search;
    if (!suggestion) return;
    const done = this.connection.request("suggestion.use", { suggestion_id: suggestion.id, alternative: number });
    noteEdit(this.connection, "plan", done, "The path follows the suggestion.");
    // the button leaves, its card stays
    this.roving.all()[number]?.focus({ preventScroll: true });
  }
}
