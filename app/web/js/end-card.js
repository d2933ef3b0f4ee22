// The end of a run: what it is worth, why it was held, and the runs before it.
import { assignment, criteriaList } from "./assignments.js";
import { note } from "./dialogs.js";
import { h } from "./dom.js";
import { jobWatch } from "./jobs.js";
import { LearningCurve } from "./learning-curve.js";
import { openRun } from "./open-run.js";
import { holdList, learningPart, modeLine, scoreFacts } from "./run-score.js";
import { jobNow } from "./rest.js";
import { resultLine, viewOf } from "./run-views.js";
import { UNCERTIFIED, drivenAs, isUncertified, lastOf, modeWord, otherModes, runsOf, saveReport, scoreOf, teacherOf } from "./runs.js";
import { draw, html, nothing, titled } from "./template.js";

/** @import { Connection } from "./connection.js" */
/** @import { AnyScore } from "./runs.js" */
/** @import { RunTitle, ViewModel } from "./types.js" */

const LOOK_MS = 1500;

/** The part of the drive that this card reads, for any world. @typedef {{ state?: string, mine?: boolean, path_done?: boolean }} Now */
/** @typedef {{ run: RunTitle, score: AnyScore, runs: RunTitle[], teacher: RunTitle | null }} Ended runs: of the same plan, newest first */

export class EndCard {
  /**
   * @param {Connection} connection
   * @param {() => void} [start] the next run
   * @param {(state: ViewModel) => { id: string } | null | undefined} [driven] the plan or route that is driven
   * @param {string} [thing] that is driven, in words
   * @param {boolean} [apart] the panel has the `finishButton` elsewhere
   */
  constructor(connection, start = () => connection.send("rehearsal.start"), driven = ({ plan }) => plan, thing = "tool", apart = false) {
    this.connection = connection;
    this.start = start;
    this.of = driven;
    this.thing = thing;
    this.apart = apart;
    this.element = h("div", { class: "group", id: "end-card", hidden: true });
    this.curve = new LearningCurve();
    /** @type {string | null} the plan that it is about */
    this.plan = null;
    /** @type {string | null | undefined} id of the newest run before this drive */
    this.before = null;
    this.moved = false; // a tool ran since the plan was opened here
    this.driven = false; // and since the last run was stored
    this.ending = false; // the planner ends the run, and it was not found yet
    this.fetching = 0; // runs that are being read
    this.trouble = "";
    this.fresh = false; // a result that was not in sight yet
    /** @type {string[]} ids of the jobs that store a run of the plan now */
    this.storing = [];
    /** @type {Ended | null} */
    this.ended = null;
    jobWatch.addEventListener("change", () => this.hear());
  }

  /** A tool is out: what is stored now was driven before. */
  get driving() {
    return ["running", "paused"].includes(this.connection.state.rehearsal?.state ?? "");
  }

  get waiting() {
    return !this.driving && (this.ending || this.fetching > 0 || (this.moved && this.storing.length > 0));
  }

  /** @param {ViewModel} state */
  update(state) {
    const { rehearsal } = state, plan = this.of(state)?.id ?? null;
    if (plan !== this.plan) Object.assign(this, { plan, ended: null, moved: false, driven: false, ending: false, fetching: 0, trouble: "", storing: [] });
    if (rehearsal?.state === "running") {
      if (!this.driven) this.begin();
      Object.assign(this, { moved: true, driven: true, ended: null, trouble: "" });
    }
    this.render(rehearsal ?? {});
  }

  /** A run of the plan is stored by a job; once that is gone the run is there. */
  hear() {
    const now = jobWatch.items.filter(({ kind, document_id: plan }) => kind === "run" && plan === this.plan).map(({ id }) => id);
    const gone = this.storing.filter((id) => !now.includes(id));
    if (!gone.length && now.length === this.storing.length) return;
    this.storing = now;
    if (this.moved) for (const id of gone) this.show(id);
    this.update(this.connection.state);
  }

  /** Runs of the plan that were driven on the page, newest first, and its teacher's, however that was driven. */
  async known() {
    const { plan } = this, { case: head } = this.connection.state;
    const runs = (head ? await runsOf(head.id) : []).filter(({ plan_id: id }) => id === plan);
    return { runs: runs.filter(({ origin }) => origin === "page"), teacher: await teacherOf(runs, plan) };
  }

  /** Note which run is the newest, so that an older one is never taken for this drive's. */
  async begin() {
    this.before = undefined;
    const { runs } = await this.known().catch(() => ({ runs: [] }));
    this.before = runs[0]?.id ?? null;
  }

  /**
   * Show a run with its score, unless the tool is out again.
   * @param {string | null} job that stored it; null: the newest run, where that is none of before
   */
  async show(job) {
    const { plan } = this;
    this.fetching += 1;
    const found = await this.find(job).catch((error) => ({ trouble: error instanceof Error ? error.message : String(error) }));
    if (plan !== this.plan) return;
    this.fetching = Math.max(0, this.fetching - 1); // the plan may have been left and opened again
    if ("run" in found) this.before = found.run.id;
    if (!this.driving) {
      Object.assign(this, { ended: null, trouble: "", ...("run" in found ? { ended: found } : found), fresh: true, driven: false, ending: false });
    }
    this.update(this.connection.state);
  }

  /**
   * @param {string | null} job
   * @returns {Promise<Ended | { trouble: string }>}
   */
  async find(job) {
    const told = job === null ? null : await jobNow(job);
    const { runs, teacher } = await this.known();
    const run = told ? runs.find(({ id }) => id === told.result) : runs.slice(0, 1).find(({ id }) => id !== this.before);
    if (run) {
      const score = await scoreOf(run.id);
      await assignment.refresh();
      return { run, runs, teacher, score };
    }
    return { trouble: told?.error?.message ?? "this run was not recorded." };
  }

  /** @param {Now} now */
  render(now) {
    const { ended, driving } = this;
    const finish = !this.apart && driving && now.mine;
    this.element.hidden = !finish && !ended && !this.waiting && !this.trouble;
    if (this.element.hidden) return;
    draw(this.element, ended && !driving ? this.result(ended) : html`${titled("This run", null, html`
      ${this.waiting ? html`<p class="words" role="status">Scoring the run …</p>` : nothing}
      ${this.trouble ? html`<p class="words caution" role="status">No score: ${this.trouble}</p>` : nothing}
      ${finish ? html`<p class="words">${now.path_done ? "At the end of the path." : `Ends where the ${this.thing} is.`}</p>
        ${this.finishButton(now, now.path_done ? "primary wide" : "wide")}` : nothing}`)}`);
    if (!ended) return;
    this.curve.show(lastOf(ended.runs, drivenAs(ended.run) ?? ""), ended.teacher);
    if (this.fresh) this.element.scrollIntoView({ block: "start" });
    this.fresh = false;
  }

  /**
   * What ends a run in the window that drives; nothing elsewhere.
   * @param {Now} now
   * @param {string} [look] classes
   */
  finishButton(now, look = "") {
    if (!this.driving || !now.mine) return nothing;
    return html`<button type="button" class=${look} id="finish-run" data-command="rehearsal.end" title="End this run and score it" @click=${this.finish}>Finish run</button>`;
  }

  finish = async () => {
    const { plan } = this;
    try {
      await this.connection.request("rehearsal.end");
    } catch (error) { // as to a window that has lost the handle
      note(error instanceof Error ? error.message : String(error), { error: true });
      return;
    }
    if (plan !== this.plan) return;
    this.ending = true;
    this.update(this.connection.state);
    setTimeout(() => this.look(), LOOK_MS);
  };

  /** The job that stores a short run may begin and end between two messages. */
  look() {
    if (!this.ending || this.fetching) return;
    if (this.driving || this.storing.length) setTimeout(() => this.look(), LOOK_MS);
    else this.show(null);
  }

  /** What the assignment asks of this run, where there is one. @param {string} run */
  criteria(run) {
    const judged = assignment.results?.runs.find((one) => one.run === run);
    return judged ? html`<h3 class="assignment-verdict" data-passed=${String(judged.passed)}>${judged.passed ? "Passed" : `Not passed${judged.trouble ? `: ${judged.trouble.split(":")[0]}` : ""}`}</h3>${criteriaList(judged.criteria)}` : nothing;
  }

  /** @param {Ended} ended */
  result({ run, score, runs, teacher }) {
    const how = drivenAs(run), view = viewOf(run), last = lastOf(runs, how ?? ""), others = otherModes(runs, how ?? "");
    const task = "task" in score ? score.task : null;
    const title = task ? (task.completed ? "Task completed" : "Task ended") : score.completed ? view.done : "Run ended";
    return html`${titled(title, null, html`
      ${modeLine(how, isUncertified(run), view.certificate(score))}
      ${this.criteria(run.id)}
      ${resultLine(view, this.connection.state, run, score)}
      ${scoreFacts(view.facts(score))}
      ${holdList(score, ({ t_s: at }) => openRun(this.connection, { run: run.id, at }))}
      ${view.learning ? learningPart(last, teacher, this.curve) : nothing}
      ${others.length ? html`<ul class="other-modes" aria-label="Other ${view.how}s">${others.map((other) => html`<li>
        <button type="button" class="plain" title="Compare with this run" @click=${() => openRun(this.connection, { run: run.id, compare: [other.id] })}><span>${modeWord(drivenAs(other))}${isUncertified(other) ? html` <span class="pill">${UNCERTIFIED}</span>` : nothing}</span><span class="number">${view.brief(other.score)}</span>${other.score && view.certificate(other.score) ? html`<span class="certified-of">${view.certificate(other.score)}</span>` : nothing}</button></li>`)}</ul>` : nothing}
      <div class="buttons even"><button type="button" class="primary" id="run-again" data-command="rehearsal.start" @click=${() => this.start()}>Again</button
        ><button type="button" id="run-replay" data-command="step.set" @click=${() => openRun(this.connection, { run: run.id })}>Replay</button></div>
      <div class="buttons even"><button type="button" id="run-compare" ?disabled=${runs.length < 2} title=${runs.length < 2 ? `This is the first run of the ${view.of}` : "Beside the run before"}
        @click=${() => openRun(this.connection, { run: run.id, compare: [runs[1].id] })}>Compare</button
        >${view.report ? html`<button type="button" id="run-report" title="A page to print" @click=${() => saveReport([run.id])}>Report</button>` : nothing}</div>`)}`;
  }
}
