// The search for a path: its job, the ways that it found, and whether the path is still the one that they were found for.
import { clearErrors, note } from "/static/js/dialogs.js";
import { sentence } from "/static/js/format.js";
import { JobLine } from "/static/js/job-line.js";
import { finished } from "/static/js/jobs.js";
import { read, readPicture, send } from "/static/js/rest.js";
import { itemAt, pathKey, samePath, surroundingsKey, toolKey } from "./same-path.js";
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
    this.unknown = false; // whether these are of another revision of the plan than the search is
    /** @type {string | undefined} the plan that is searched in, or whose search has failed */
    this.of = undefined;
    /** @type {object | null} the search that is waited for */
    this.waiting = null;
    /** @type {string[]} searches that ran beside the one whose answer is shown */
    this.beside = [];
    this.aim = ""; // the name of the target that is searched for, until it is known which one that is
    this.asked = ""; // the way whose preview is on its way
    this.problem = ""; // why there is no answer
    /** @type {Element[]} of the ways, once they are drawn */
    this.pictures = [];
    this.drawing = ""; // how far the pictures are
  }

  /** Whether there is a search of the open plan. */
  get busy() {
    return this.waiting !== null;
  }

  /**
   * Another plan is open: the search of the one before goes on without this page.
   * @param {string | undefined} plan its id
   */
  keepTo(plan) {
    if (plan === this.of || !(this.busy || this.suggestion || this.problem)) return;
    this.waiting = null;
    this.work.leave();
    this.forget();
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
    await this.wait(plan, () => send(`/api/v1/plans/${encodeURIComponent(plan.id)}/suggestions`, { entry, target }));
  }

  /**
   * Follow a search of the open plan that this page has not begun: it was loaded anew, or another window began it.
   * @param {ViewModel} state
   */
  join(state) {
    const job = searchesOf(state).find(({ id }) => !this.beside.includes(id));
    if (job && state.plan && !this.busy) this.wait(state.plan, async () => job, state.plan.revision);
  }

  /**
   * @param {PlanSection} plan
   * @param {() => Promise<JobEntry>} begin
   * @param {number} [revision] of the plan, where the search may have begun at another one
   */
  async wait(plan, begin, revision) {
    this.forget();
    const mine = this.waiting = {};
    this.askedOf = pathKey(plan.points);
    this.askedAmong = surroundingsKey(this.connection.state);
    this.askedFor = toolKey(plan);
    this.of = plan.id;
    this.changed();
    /** @type {SuggestionPublic | null} */
    let answer = null;
    let problem = "";
    try {
      const job = await begin();
      if (mine === this.waiting) {
        this.aim = job.subject;
        this.changed();
      }
      const found = mine === this.waiting ? await this.work.follow(job) : null;
      if (found && mine === this.waiting) answer = await read(`/api/v1/suggestions/${encodeURIComponent(found)}`);
      else problem = "The search was cancelled.";
    } catch (error) {
      problem = sentence(/** @type {Error} */ (error).message);
    }
    if (mine !== this.waiting) return; // another plan was opened meanwhile
    this.waiting = null;
    this.problem = problem;
    if (answer) this.beside = searchesOf(this.connection.state).map(({ id }) => id);
    if (answer) this.show(answer, revision !== undefined && revision !== answer.revision);
    this.changed();
  }

  /**
   * @param {SuggestionPublic} suggestion
   * @param {boolean} unknown whether what it was asked of is
   */
  show(suggestion, unknown) {
    if (suggestion.plan_id !== this.connection.state.plan?.id) return; // another plan was opened meanwhile
    this.suggestion = suggestion;
    this.unknown = unknown;
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
   * surroundings, or may be, or the path follows no way, and it or the target is not the one that they were asked for.
   * @param {PlanSection} plan
   */
  standing(plan) {
    const { suggestion } = this;
    const followed = suggestion?.alternatives.findIndex((one) => samePath(plan.points, one.points)) ?? -1;
    const other = this.unknown || toolKey(plan) !== this.askedFor || surroundingsKey(this.connection.state) !== this.askedAmong;
    const elsewhere = pathKey(plan.points) !== this.askedOf || (suggestion !== null && !itemAt(plan.targets, suggestion.target));
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
    this.unknown = false;
    this.problem = this.drawing = this.aim = "";
    this.pictures = [];
    this.beside = [];
  }
}

/**
 * The searches for a path of the open plan, whoever began them.
 * @param {ViewModel} state
 * @returns {JobEntry[]}
 */
function searchesOf({ jobs, plan }) {
  return jobs?.items.filter(({ kind, document_id: of }) => kind === "suggestion" && of === plan?.id) ?? [];
}

/**
 * The first of them.
 * @param {ViewModel} state
 * @returns {JobEntry | undefined}
 */
export function runningSearch(state) {
  return searchesOf(state)[0];
}

/**
 * Where the tool goes in: the first path point, or the place of a click that is not added yet.
 * @param {PlanSection | null | undefined} plan
 */
export function entryOf(plan) {
  return plan?.points[0]?.position ?? (plan?.ghost?.kind === "point" ? plan.ghost.position : null);
}
