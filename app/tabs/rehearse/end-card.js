// The end of a run: what it is worth, why it was held, and the runs before it.
import { h } from "/static/js/dom.js";
import { jobWatch } from "/static/js/jobs.js";
import { LearningCurve } from "/static/js/learning-curve.js";
import { openRun } from "/static/js/open-run.js";
import { feltHolds, holdList, learningPart, modeLine, scoreFacts } from "/static/js/run-score.js";
import { UNCERTIFIED, isUncertified, lastOf, otherModes, runsOf, saveReport, scoreOf, teacherOf } from "/static/js/runs.js";
import { draw, html, nothing, titled } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { RehearsalSection, RunTitle, ScorePublic, ViewModel } from "/static/js/types.js" */

const LOOK_MS = 1500;

/** @typedef {{ run: RunTitle, score: ScorePublic, runs: RunTitle[], teacher: RunTitle | null }} Ended runs: of the same plan, newest first */

export class EndCard {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.element = h("div", { class: "group", id: "end-card", hidden: true });
    this.curve = new LearningCurve();
    /** @type {string | null} the plan that it is about */
    this.plan = null;
    /** @type {string | null | undefined} id of the newest run before this drive */
    this.before = null;
    this.driven = false; // a tool was moved since the last run was stored
    this.waiting = false; // a run is being stored or scored
    this.trouble = "";
    this.fresh = false; // a result that was not in sight yet
    /** @type {Set<string>} ids of the jobs that store a run now */
    this.storing = new Set();
    /** @type {Ended | null} */
    this.ended = null;
    jobWatch.addEventListener("change", () => this.hear());
  }

  /** @param {ViewModel} state */
  update(state) {
    const { rehearsal, plan } = state;
    if ((plan?.id ?? null) !== this.plan) Object.assign(this, { plan: plan?.id ?? null, ended: null, driven: false, waiting: false, trouble: "" });
    const { state: drive, progress_mm: progress } = /** @type {Partial<RehearsalSection>} */ (rehearsal ?? {});
    if (drive === "running") {
      if (!this.driven) this.begin();
      this.driven = true;
      this.ended = null;
      this.trouble = "";
    }
    this.render(rehearsal ?? {}, drive === "running" || drive === "paused", progress ?? 0);
  }

  /** A run is stored by a job; once it is gone the run is there. */
  hear() {
    const now = new Set(jobWatch.items.filter(({ kind }) => kind === "run").map(({ id }) => id));
    const done = [...this.storing].some((id) => !now.has(id));
    if (now.size && this.driven) this.waiting = true;
    this.storing = now;
    if (done && this.driven && !now.size) this.fetch();
    else if (this.waiting) this.update(this.connection.state);
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

  async fetch() {
    const { plan } = this;
    this.driven = false;
    try {
      const { runs, teacher } = await this.known();
      const isNew = runs.length > 0 && runs[0].id !== this.before;
      const score = isNew ? await scoreOf(runs[0].id) : null;
      if (plan !== this.plan) return;
      if (score) this.ended = { run: runs[0], score, runs, teacher };
      else this.trouble = "this run was not recorded.";
      this.fresh = true;
    } catch (error) {
      this.trouble = error instanceof Error ? error.message : String(error);
    }
    this.waiting = false;
    this.update(this.connection.state);
  }

  /**
   * @param {Partial<RehearsalSection>} now
   * @param {boolean} driving
   * @param {number} progress
   */
  render(now, driving, progress) {
    const { ended } = this;
    const finish = driving && now.mine && progress !== null;
    this.element.hidden = !finish && !ended && !this.waiting && !this.trouble;
    if (this.element.hidden) return;
    draw(this.element, ended && !driving ? this.result(ended) : html`${titled("This run", null, html`
      ${this.waiting ? html`<p class="words" role="status">Scoring the run …</p>` : nothing}
      ${this.trouble ? html`<p class="words caution" role="status">No score: ${this.trouble}</p>` : nothing}
      ${finish ? html`<p class="words">${now.path_done ? "At the end of the path." : "Ends where the tool is."}</p>
        <button type="button" class=${now.path_done ? "primary wide" : "wide"} id="finish-run" data-command="rehearsal.end" title="End this run and score it" @click=${this.finish}>Finish run</button>` : nothing}`)}`);
    if (!ended) return;
    this.curve.show(lastOf(ended.runs, ended.run.mode ?? ""), ended.teacher);
    if (this.fresh) this.element.scrollIntoView({ block: "start" });
    this.fresh = false;
  }

  finish = () => {
    this.waiting = true;
    this.connection.send("rehearsal.end");
    setTimeout(() => this.look(), LOOK_MS);
  };

  /** The job that stores a short run may begin and end between two messages. */
  look() {
    if (!this.waiting || !this.driven) return;
    const stored = this.connection.state.rehearsal?.state === "absent" && !jobWatch.items.some(({ kind }) => kind === "run");
    if (stored) this.fetch();
    else setTimeout(() => this.look(), LOOK_MS);
  }

  /** @param {Ended} ended */
  result({ run, score, runs, teacher }) {
    const last = lastOf(runs, run.mode ?? ""), others = otherModes(runs, run.mode ?? "");
    return html`${titled(score.completed ? "Path completed" : "Run ended", null, html`
      ${modeLine(run.mode, isUncertified(run) || !score.certified)}
      ${scoreFacts(score)}
      ${holdList(feltHolds(score), ({ t_s: at }) => openRun(this.connection, { run: run.id, at }))}
      ${learningPart(last, teacher, this.curve)}
      ${others.length ? html`<ul class="other-modes" aria-label="Other modes">${others.map(({ id, name, words, uncertified }) => html`<li>
        <button type="button" class="plain" title="Compare with this run" @click=${() => openRun(this.connection, { run: run.id, compare: [id] })}><span>${name}${uncertified ? html` <span class="pill">${UNCERTIFIED}</span>` : nothing}</span><span class="number">${words}</span></button></li>`)}</ul>` : nothing}
      <div class="buttons even"><button type="button" class="primary" id="run-again" data-command="rehearsal.start" @click=${() => this.connection.send("rehearsal.start")}>Again</button
        ><button type="button" id="run-replay" data-command="step.set" @click=${() => openRun(this.connection, { run: run.id })}>Replay</button></div>
      <div class="buttons even"><button type="button" id="run-compare" ?disabled=${runs.length < 2} title=${runs.length < 2 ? "This is the first run of the plan" : "Beside the run before"}
        @click=${() => openRun(this.connection, { run: run.id, compare: [runs[1].id] })}>Compare</button
        ><button type="button" id="run-report" title="A page to print" @click=${() => saveReport([run.id])}>Report</button></div>`)}`;
  }
}
