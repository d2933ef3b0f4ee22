// The search for a path: its job, the ways that it found, and whether the path is still the one that they were found for.
import { clearErrors, note } from "/static/js/dialogs.js";
import { sentence } from "/static/js/format.js";
import { JobLine } from "/static/js/job-line.js";
import { finished } from "/static/js/jobs.js";
import { read, readPicture, send } from "/static/js/rest.js";
import { hasPlace, pathKey, samePath, surroundingsKey, toolKey } from "./same-path.js";
import { targetOf } from "./wanted-target.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { JobEntry, PlanSection, SuggestionPublic, ViewModel } from "/static/js/types.js" */

export class PathSearch {
  /**
   * @param {Connection} connection
   * @param {() => void} changed called when there is something else to show
   */
  constructor(connection, changed) {
    this.connection = connection;
    this.changed = changed;
    this.work = new JobLine();
    /** @type {SuggestionPublic | null} */
    this.suggestion = null;
    this.askedOf = ""; // the path when the ways were asked for
    this.askedAmong = ""; // its surroundings
    this.askedFor = ""; // and the tool
    /** @type {string | undefined} the plan that is searched in, or whose search has failed */
    this.of = undefined;
    this.asked = ""; // the way whose preview is on its way
    this.busy = false;
    this.problem = ""; // why there is no answer
    /** @type {Element[]} of the ways, once they are drawn */
    this.pictures = [];
    this.drawing = ""; // how far the pictures are
  }

  /**
   * @param {PlanSection | null | undefined} plan
   * @param {string} targetId where there is no such one, as `targetOf` says
   * @param {number[]} [place] the end of the path in place of the target's
   */
  async look(plan, targetId, place) {
    const target = place ?? targetOf(plan, targetId)?.position;
    const entry = entryOf(plan);
    if (!plan || !target || !entry || this.busy) return;
    clearErrors();
    await this.wait(plan, () => this.work.run(`/api/v1/plans/${encodeURIComponent(plan.id)}/suggestions`, { entry, target }));
  }

  /**
   * Follow a search of the open plan that this page has not begun: it was loaded anew, or another window began it.
   * @param {ViewModel} state
   */
  join(state) {
    const job = runningSearch(state);
    if (job && state.plan && !this.busy) this.wait(state.plan, () => this.work.follow(job));
  }

  /**
   * @param {PlanSection} plan
   * @param {() => Promise<string | null>} search the id of what was found, null where it was cancelled
   */
  async wait(plan, search) {
    this.forget();
    this.askedOf = pathKey(plan.points);
    this.askedAmong = surroundingsKey(this.connection.state);
    this.askedFor = toolKey(plan);
    this.of = plan.id;
    this.busy = true;
    this.changed();
    try {
      const found = await search();
      if (found) this.show(await read(`/api/v1/suggestions/${encodeURIComponent(found)}`));
      else this.problem = "The search was cancelled.";
    } catch (error) {
      this.problem = sentence(/** @type {Error} */ (error).message);
    } finally {
      this.busy = false;
      this.changed();
    }
  }

  /** @param {SuggestionPublic} suggestion */
  show(suggestion) {
    if (suggestion.plan_id !== this.connection.state.plan?.id) return; // another plan was opened meanwhile
    this.suggestion = suggestion;
    if (!suggestion.alternatives.length) return;
    this.preview(0);
    this.illustrate(suggestion);
  }

  /**
   * The pictures of the ways follow them: drawn once by a job.
   * @param {SuggestionPublic} suggestion
   */
  async illustrate({ id, alternatives }) {
    const told = (/** @type {string} */ words) => {
      if (this.suggestion?.id !== id) return;
      this.drawing = words;
      this.changed();
    };
    const address = `/api/v1/suggestions/${encodeURIComponent(id)}/pictures`;
    told("Drawing …");
    try {
      await finished(await send(address, {}), ({ fraction }) => told(`Drawing, ${Math.round(100 * fraction)} %`));
      const pictures = await Promise.all([...alternatives.keys()].map((number) => readPicture(`${address}/${number}`)));
      if (this.suggestion?.id === id) this.pictures = pictures;
      told("");
    } catch {
      told("No picture"); // the figures say the same
    }
  }

  /**
   * A way as the planner names it, and the number of a way that it names so; −1 where that is none of these.
   * @param {number} number
   */
  keyOf(number) {
    return `${this.suggestion?.id} ${number}`;
  }

  /** @param {string | null} key */
  numberOf(key) {
    const [id, number] = (key ?? "").split(" ");
    return id === this.suggestion?.id ? Number(number) : -1;
  }

  /**
   * The number of the way that the path follows, or −1; earlier: what was found is of another tool or of other
   * surroundings, or the path follows no way, and it or the target is not the one that they were asked for.
   * @param {PlanSection} plan
   */
  standing(plan) {
    const { suggestion } = this;
    const followed = suggestion?.alternatives.findIndex((one) => samePath(plan.points, one.points)) ?? -1;
    const other = toolKey(plan) !== this.askedFor || surroundingsKey(this.connection.state) !== this.askedAmong;
    const elsewhere = pathKey(plan.points) !== this.askedOf || (suggestion !== null && !hasPlace(plan.targets, suggestion.target));
    return { followed, earlier: other || (followed < 0 && elsewhere) };
  }

  /**
   * Show a way in the head.
   * @param {number} number
   */
  preview(number) {
    const { suggestion } = this;
    const key = this.keyOf(number);
    if (!suggestion || this.asked === key) return; // a pointer asks again with each move until it is shown
    this.asked = key;
    this.connection.request("suggestion.show", { suggestion_id: suggestion.id, alternative: number })
      .catch((error) => note(error.message, { error: true })).finally(() => { this.asked = ""; });
  }

  /** Show no suggestion any more. */
  forget() {
    if (this.connection.state.shaft?.shown) this.connection.send("suggestion.hide");
    this.suggestion = null;
    this.problem = this.drawing = "";
    this.pictures = [];
  }
}

/**
 * The search for a path of the open plan, whoever began it.
 * @param {ViewModel} state
 * @returns {JobEntry | undefined}
 */
export function runningSearch({ jobs, plan }) {
  return jobs?.items.find(({ kind, document_id: of }) => kind === "suggestion" && of === plan?.id);
}

/**
 * Where the tool goes in: the first path point, or the place of a click that is not added yet.
 * @param {PlanSection | null | undefined} plan
 */
export function entryOf(plan) {
  return plan?.points[0]?.position ?? (plan?.ghost?.kind === "point" ? plan.ghost.position : null);
}
