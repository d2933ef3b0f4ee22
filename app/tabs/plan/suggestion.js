// The searches for a path: their jobs, the ways that they found, and whether the path is still the one that they were found for.
import { clearErrors, note } from "/static/js/dialogs.js";
import { sentence } from "/static/js/format.js";
import { JobList } from "/static/js/job-list.js";
import { finished, stageWords } from "/static/js/jobs.js";
import { read, readPicture, send, wasCancelled } from "/static/js/rest.js";
import { itemAt, pathKey, samePath, surroundingsKey, toolKey } from "./same-path.js";
import { targetOf } from "./wanted-target.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { JobEntry, JobPublic, PlanSection, SuggestionPublic, ViewModel } from "/static/js/types.js" */

/**
 * What a search was asked of: path, surroundings and tool. revision: of the plan then, where it may have begun at another.
 * @typedef {{ path: string, among: string, tool: string, revision?: number }} Asked
 */
/**
 * An answer. aim: name of the target that was searched for. pictures: of the ways, once they are drawn; drawing: how far
 * they are. unknown: it is of another revision of the plan than what it was asked of.
 * @typedef {{ suggestion: SuggestionPublic, asked: Asked, aim: string, unknown: boolean, pictures: Element[], drawing: string }} Found
 */

export class PathSearch {
  /**
   * @param {Connection} connection
   * @param {() => void} changed called when there is something else to show
   */
  constructor(connection, changed) {
    this.connection = connection;
    this.changed = changed;
    this.work = new JobList((job, error) => this.ended(job, error), {
      holds: (job) => isSearchOf(job, this.of),
      words: (job) => `${job.subject}: ${stageWords(job)}`,
      begun: (job) => this.begun(job),
    });
    /** @type {Found[]} of the searches since the last one that was begun while none ran; one for each target */
    this.found = [];
    this.at = 0; // the one that is shown
    /** @type {Map<string, Asked>} by the job's id */
    this.asked = new Map();
    this.pending = 0; // requests and answers that are on their way
    /** @type {string | undefined} the open plan */
    this.of = undefined;
    this.aim = ""; // the name of the target that is searched for, until it is known which one that is
    this.previewed = ""; // the way whose preview is on its way
    this.problem = ""; // why there is no answer
  }

  /** Whether there is a search of the open plan. */
  get busy() {
    return this.pending > 0 || this.work.shown.length > 0;
  }

  /** @returns {Found | undefined} what is shown */
  get current() {
    return this.found[this.at];
  }

  get suggestion() {
    return this.current?.suggestion ?? null;
  }

  /** Names of the targets that are searched for; what waits for its turn, too. */
  get aims() {
    return this.work.shown.map(({ subject }) => subject);
  }

  /**
   * Another plan is open: the search of the one before goes on without this page, and those of this one are followed,
   * also those that the page has not begun: it was loaded anew, or another window began them.
   * @param {string | undefined} plan its id
   */
  keepTo(plan) {
    if (plan === this.of) return;
    this.of = plan;
    if (this.found.length || this.problem) this.forget();
    this.work.again();
  }

  /**
   * Search, after what is searched for already.
   * @param {PlanSection | null | undefined} plan
   * @param {string} targetId where there is no such one, as `targetOf` says
   * @param {number[]} [place] the end of the path in place of the target's
   */
  async look(plan, targetId, place) {
    const wanted = targetOf(plan, targetId), target = place ?? wanted?.position;
    const entry = entryOf(plan);
    if (!plan || !target || !entry || this.pending) return;
    if (!place && this.aims.includes(wanted?.label ?? "")) {
      note(`The search to ${wanted?.label} goes on already.`);
      return;
    }
    clearErrors();
    if (!this.busy) this.forget();
    this.problem = "";
    const asked = this.askedNow(plan);
    await this.during(async () => {
      /** @type {JobEntry} */
      const job = await send(`/api/v1/plans/${encodeURIComponent(plan.id)}/suggestions`, { entry, target });
      this.asked.set(job.id, asked);
      this.work.watch(job);
    });
  }

  /**
   * @param {PlanSection} plan
   * @returns {Asked}
   */
  askedNow(plan) {
    return { path: pathKey(plan.points), among: surroundingsKey(this.connection.state), tool: toolKey(plan) };
  }

  /**
   * A search of the open plan is seen for the first time.
   * @param {JobEntry} job
   */
  begun(job) {
    const { plan } = this.connection.state;
    if (!plan || plan.id !== this.of) return;
    const first = !this.work.shown.length;
    if (first && !this.asked.has(job.id) && !this.pending) this.forget();
    if (!this.asked.has(job.id)) this.asked.set(job.id, { ...this.askedNow(plan), revision: plan.revision });
    if (first) this.aim = job.subject;
    queueMicrotask(this.changed);
  }

  /**
   * A search has ended, of this plan or of one that was open before.
   * @param {JobEntry & Partial<JobPublic>} job
   * @param {unknown} error
   */
  async ended(job, error) {
    const asked = this.asked.get(job.id);
    this.asked.delete(job.id);
    if (!isSearchOf(job, this.of) || !asked) return;
    await this.during(async () => {
      if (error) throw error;
      const answer = await read(`/api/v1/suggestions/${encodeURIComponent(job.result ?? "")}`);
      if (isSearchOf(job, this.of)) this.show(answer, asked, job.subject);
    }, job.subject);
  }

  /**
   * Do something for the open plan, and say why it could not be done.
   * @param {() => Promise<void>} act
   * @param {string} [aim] the target's name
   */
  async during(act, aim = "") {
    const { of } = this;
    this.pending += 1;
    this.changed();
    let problem = "";
    try {
      await act();
    } catch (error) {
      problem = wasCancelled(error) ? "The search was cancelled." : sentence(/** @type {Error} */ (error).message);
    }
    this.pending -= 1;
    if (problem && of === this.of) this.tell(problem, aim);
    this.changed();
  }

  /**
   * Why there is no answer, in the place of one; where there is another answer, as a message.
   * @param {string} problem
   * @param {string} aim
   */
  tell(problem, aim) {
    if (this.suggestion || this.busy) note(`${aim ? `${aim}: ` : ""}${problem}`, { error: true });
    else this.problem = problem;
  }

  /**
   * Keep an answer beside those to other targets. The first is shown, and a later one once somebody chooses it.
   * @param {SuggestionPublic} suggestion
   * @param {Asked} asked
   * @param {string} aim
   */
  show(suggestion, asked, aim) {
    const unknown = asked.revision !== undefined && asked.revision !== suggestion.revision;
    /** @type {Found} */
    const found = { suggestion, asked, aim, unknown, pictures: [], drawing: "" };
    const same = this.found.findIndex((one) => itemAt([{ position: one.suggestion.target }], suggestion.target));
    if (same >= 0) this.found[same] = found;
    else this.found.push(found);
    this.problem = "";
    if (this.current === found) this.choose(this.at);
  }

  /**
   * Show another answer.
   * @param {number} at its index
   */
  choose(at) {
    this.at = at;
    const { current } = this;
    if (!current?.suggestion.alternatives.length) {
      this.hide();
      return;
    }
    this.preview(0);
    if (!current.drawing && !current.pictures.length) this.illustrate(current);
  }

  /**
   * The pictures of the ways follow them: drawn once by a job.
   * @param {Found} found
   */
  async illustrate(found) {
    const { id, alternatives } = found.suggestion;
    const told = (/** @type {string} */ words) => {
      found.drawing = words;
      if (this.current === found) this.changed();
    };
    const address = `/api/v1/suggestions/${encodeURIComponent(id)}/pictures`;
    told("Drawing …");
    try {
      await finished(await send(address, {}), ({ fraction }) => told(`Drawing, ${Math.round(100 * fraction)} %`));
      found.pictures = await Promise.all([...alternatives.keys()].map((number) => readPicture(`${address}/${number}`)));
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
    const { current } = this;
    if (!current) return { followed: -1, earlier: false };
    const { suggestion, asked, unknown } = current, now = this.askedNow(plan);
    const followed = suggestion.alternatives.findIndex((one) => samePath(plan.points, one.points));
    const other = unknown || now.tool !== asked.tool || now.among !== asked.among;
    const elsewhere = now.path !== asked.path || !itemAt(plan.targets, suggestion.target);
    return { followed, earlier: other || (followed < 0 && elsewhere) };
  }

  /**
   * Show a way in the head.
   * @param {number} number
   */
  preview(number) {
    const { suggestion } = this;
    const key = this.keyOf(number);
    if (!suggestion || this.previewed === key) return; // a pointer asks again with each move until it is shown
    this.previewed = key;
    this.connection.request("suggestion.show", { suggestion_id: suggestion.id, alternative: number })
      .catch((error) => note(error.message, { error: true })).finally(() => { this.previewed = ""; });
  }

  /** Show no way in the head. */
  hide() {
    if (this.connection.state.shaft?.shown) this.connection.send("suggestion.hide");
  }

  /** Show no suggestion any more; what is searched for goes on. */
  forget() {
    this.hide();
    this.found = [];
    this.at = 0;
    this.problem = this.aim = "";
  }
}

/**
 * @param {JobEntry} job
 * @param {string | undefined} plan its id
 */
function isSearchOf({ kind, document_id: of }, plan) {
  return kind === "suggestion" && plan !== undefined && of === plan;
}

/**
 * The search for a path of the open plan that runs, or waits longest, whoever began it.
 * @param {ViewModel} state
 * @returns {JobEntry | undefined}
 */
export function runningSearch({ jobs, plan }) {
  return jobs?.items.find((job) => isSearchOf(job, plan?.id));
}

/**
 * Where the tool goes in: the first path point, or the place of a click that is not added yet.
 * @param {PlanSection | null | undefined} plan
 */
export function entryOf(plan) {
  return plan?.points[0]?.position ?? (plan?.ghost?.kind === "point" ? plan.ghost.position : null);
}
