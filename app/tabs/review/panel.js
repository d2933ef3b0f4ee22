// Review: which runs there are, what the open one is worth, and how it went, replayed and plotted.
import { assignment } from "/static/js/assignments.js";
import { confirm } from "/static/js/dialogs.js";
import { h } from "/static/js/dom.js";
import { jobWatch } from "/static/js/jobs.js";
import { ownsSpace } from "/static/js/keys.js";
import { LearningCurve } from "/static/js/learning-curve.js";
import { takeRunRequest } from "/static/js/open-run.js";
import { feltHolds, holdList, itemList, learningPart, modeLine, scoreFacts } from "/static/js/run-score.js";
import { drivenAs, isUncertified, lastOf, markTeacher, modeWord, runName, runsOf, saveReport, scoreOf, seriesOfRun } from "/static/js/runs.js";
import { resultLine, viewOf, withScore } from "/static/js/run-views.js";
import { remove } from "/static/js/rest.js";
import { draw, html, live, nothing, titled } from "/static/js/template.js";
import { RunComments } from "./comments.js";
import { Dock } from "./dock.js";
import { ExportMenu } from "./export-menu.js";
import { InScene } from "./in-scene.js";
import { Player } from "./player.js";
import { ReplayedTask } from "./replayed-task.js";
import { RunsList } from "./runs-list.js";

/** @import { Parts } from "/static/js/panel.js" */
/** @import { AnyScore, AnySeries } from "/static/js/runs.js" */
/** @import { RunTitle, ViewModel } from "/static/js/types.js" */

const MOST_BESIDE = 4;

export default class ReviewPanel {
  /** @param {Parts} parts */
  constructor({ connection, keys }) {
    this.connection = connection;
    this.player = new Player();
    this.dock = new Dock(this.player, (run) => this.open(run));
    this.task = new ReplayedTask(connection, this.player);
    this.list = new RunsList({ open: (id) => this.open(id), toggle: (id) => this.toggle(id) });
    this.about = h("div", { class: "group", id: "run-score", hidden: true });
    this.exports = new ExportMenu();
    this.curve = new LearningCurve();
    this.laid = new InScene();
    this.comments = new RunComments(this.player, {
      changed: (run, change) => this.commented(run, change), failed: (error) => { this.tell(error); this.render(); }, goTo: (t) => this.goTo(t),
    });
    this.element = h("div", {}, this.list.element, this.about, this.comments.element, this.laid.element, this.exports.element);
    this.overlay = this.dock.element;
    /** @type {string | null} */
    this.caseId = null;
    /** @type {RunTitle[]} newest first */
    this.runs = [];
    /** @type {string | null} */
    this.openId = null;
    /** @type {string[]} ids of the runs beside it; the first one is replayed with it */
    this.beside = [];
    this.loading = false;
    this.trouble = "";
    this.asked = 0; // counts requests: an answer to an earlier one is dropped
    this.shown = false;
    /** @type {Map<string, AnyScore>} */
    this.scores = new Map();
    /** @type {Map<string, AnySeries>} */
    this.series = new Map();
    /** @type {Map<string, Promise<void>>} answers on their way, by what was asked */
    this.asking = new Map();
    /** @type {Map<string, string>} why there is none, by what was asked */
    this.troubles = new Map();
    /** @type {string[]} ids of the jobs that store a run now */
    this.storing = [];
    jobWatch.addEventListener("change", () => this.hear());
    connection.on("state", ({ state }) => { if (this.shown && state.step?.name !== "review") this.leave(); });
    keys.shortcuts.push((event) => this.key(event));
  }

  /** @param {ViewModel} state */
  update(state) {
    const head = state.case?.id ?? null;
    const request = takeRunRequest();
    assignment.follow(state);
    if (head !== this.caseId) {
      Object.assign(this, { caseId: head, runs: [], openId: null, beside: [], trouble: "" });
      for (const known of [this.scores, this.series, this.troubles]) known.clear();
      this.player.load(null, null);
      this.shown = false;
    }
    if (request) Object.assign(this, { openId: request.run, beside: request.compare ?? [] });
    if (request?.compare) this.dock.turn("compare");
    if (!this.shown || request) {
      this.shown = true;
      this.refresh(request?.at);
    }
    this.render();
  }

  /** A run is stored by a job; once that is gone the list has another run. */
  hear() {
    const now = jobWatch.items.filter(({ kind }) => kind === "run").map(({ id }) => id);
    const stored = this.storing.some((id) => !now.includes(id));
    this.storing = now;
    if (stored && this.shown) this.refresh();
  }

  leave() {
    this.shown = false;
    this.player.hide();
    this.laid.hide();
    this.task.of(null);
  }

  /** Read the list anew, and open what is to be open. @param {number} [at] s */
  async refresh(at) {
    const { caseId } = this;
    if (!caseId) return;
    this.loading = true;
    try {
      const runs = await runsOf(caseId);
      if (caseId !== this.caseId) return;
      Object.assign(this, { runs, loading: false, trouble: "" });
      if (!runs.some(({ id }) => id === this.openId)) this.openId = runs[0]?.id ?? null;
      this.beside = this.beside.filter((id) => id !== this.openId && runs.some((run) => run.id === id));
      await this.load(at);
    } catch (error) {
      this.tell(error);
    }
    this.render();
  }

  /** @param {unknown} error */
  tell(error) {
    this.loading = false;
    this.trouble = error instanceof Error ? error.message : String(error);
  }

  /** @param {string} id */
  open(id) {
    this.openId = id;
    this.beside = this.beside.filter((one) => one !== id);
    this.load();
  }

  /** @param {string} id */
  toggle(id) {
    this.beside = this.beside.includes(id) ? this.beside.filter((one) => one !== id) : [...this.beside, id].slice(-MOST_BESIDE);
    this.load();
  }

  /** Fetch what is not known yet of the open run and those beside it, and show them. @param {number} [at] s */
  async load(at) {
    const request = ++this.asked;
    if (this.player.main?.run.id !== this.openId) this.player.load(null, null); // nothing of another run while it comes
    this.render();
    const ids = [this.openId, ...this.beside].filter((id) => id !== null), taught = this.teacher()?.id;
    await Promise.all([...ids.flatMap((id, index) => [this.know(this.scores, id, scoreOf), ...(index < 2 ? [this.know(this.series, id, seriesOfRun)] : [])]), ...(taught ? [this.know(this.scores, taught, scoreOf)] : [])]);
    if (request !== this.asked || !this.shown) return;
    const [main, ghost] = [this.openId, this.beside[0]].map((id) => {
      const run = this.runs.find((one) => one.id === id), series = this.series.get(id ?? "");
      return run && series ? { run, series } : null;
    });
    this.player.load(main, ghost);
    this.runs = this.runs.map((run) => { const score = this.scores.get(run.id); return score ? withScore(run, score) : run; });
    if (at !== undefined) this.player.seek(at);
    this.render();
  }

  /**
   * Ask for what is neither known nor on its way; why it cannot be had is noted.
   * @template Value
   * @param {Map<string, Value>} known
   * @param {string} id
   * @param {(id: string) => Promise<Value>} ask
   */
  async know(known, id, ask) {
    if (known.has(id)) return;
    const name = askedOf(ask, id);
    const answer = this.asking.get(name) ?? ask(id).then((value) => {
      known.set(id, value);
      this.troubles.delete(name);
    }, (error) => { this.troubles.set(name, error instanceof Error ? error.message : String(error)); }).finally(() => this.asking.delete(name));
    this.asking.set(name, answer);
    await answer;
  }

  /** The run of the open run's plan that is the teacher's; null for none. */
  teacher() {
    const plan = this.runs.find(({ id }) => id === this.openId)?.plan_id ?? null;
    return (plan !== null && this.runs.find(({ plan_id: id, teacher }) => teacher && id === plan)) || null;
  }

  /** @param {RunTitle} run @param {boolean} on */
  async mark({ id, plan_id: plan }, on) {
    try {
      const { teacher } = await markTeacher(id, on);
      this.runs = this.runs.map((run) => (run.plan_id === plan ? { ...run, teacher: teacher && run.id === id } : run));
    } catch (error) {
      this.tell(error);
    }
    this.render();
  }

  /** @param {string} id @param {(now: RunTitle["comments"]) => RunTitle["comments"]} change */
  commented(id, change) {
    this.trouble = "";
    this.runs = this.runs.map((run) => (run.id === id ? { ...run, comments: change(run.comments) } : run));
    this.render();
  }

  /** Name of a plan, or of a route. @param {string | null} id */
  planName = (id) => {
    const { plans, routes } = this.connection.state, { of } = viewOf(this.runs[0]);
    return id === null ? `no ${of}` : [...plans?.items ?? [], ...routes?.items ?? []].find((one) => one.id === id)?.name ?? `a ${of} that is gone`;
  };

  /** Delete the open run for good. @param {RunTitle} run */
  async drop({ id }) {
    if (!await confirm("Delete this run?", "Its recording, score and comments go for good.", "Delete")) return;
    try {
      await remove(`/api/v1/runs/${encodeURIComponent(id)}`);
    } catch (error) {
      this.tell(error);
      this.render();
      return;
    }
    if (this.openId === id) this.openId = this.beside.shift() ?? null;
    await this.refresh();
  }

  render() {
    const { runs, openId: open, beside, loading, trouble, planName } = this;
    this.list.show({ runs, open, beside, planName, loading, trouble });
    const run = runs.find(({ id }) => id === open), score = open ? this.scores.get(open) : undefined;
    this.about.hidden = !run;
    this.exports.of(run?.id ?? null, viewOf(run).formats);
    if (run) draw(this.about, this.result(run, score));
    this.laid.of(this.shown ? this.laidRuns(run) : []);
    const played = run && this.player.main?.run.id === run.id ? run : null;
    this.comments.of(played);
    this.task.of(played && score && viewOf(played).items(score).length ? played.id : null);
    this.dock.marks(score ?? null, played?.comments ?? []);
    const scored = [open, ...beside].flatMap((id) => {
      const one = runs.find((title) => title.id === id), its = this.scores.get(id ?? "");
      return one && its ? [{ run: one, score: its }] : [];
    });
    this.dock.compare.show(scored, runs, planName);
  }

  /** The open run and the one that is replayed beside it. @param {RunTitle | undefined} run */
  laidRuns(run) {
    const ghost = this.runs.find(({ id }) => id === this.beside[0]);
    return [run, ghost].flatMap((one, index) => (run && one && viewOf(one).laid ? [{ id: one.id, ghost: index > 0, name: modeWord(drivenAs(one)) }] : []));
  }

  /**
   * @param {RunTitle} run
   * @param {AnyScore | undefined} score
   */
  result(run, score) {
    const how = drivenAs(run), view = viewOf(run), trouble = this.troubles.get(askedOf(scoreOf, run.id)), unplayed = this.troubles.get(askedOf(seriesOfRun, run.id));
    const { replayed_task: told } = this.connection.state, { waits, words: untold } = told?.run === run.id ? told : { waits: false, words: "" };
    if (!score) {
      return titled(`Run of ${runName(run)}`, null, html`${modeLine(how, isUncertified(run))}
        <p class=${trouble ? "words caution" : "words"} role="status">${trouble ? `No score: ${trouble}` : "Scoring the run …"}</p>
        ${trouble ? this.deleting(run) : nothing}`);
    }
    const holds = feltHolds(score), items = view.items(score), teacher = this.teacher();
    const last = lastOf(this.runs.filter(({ plan_id: plan }) => plan === run.plan_id), how ?? "");
    this.curve.show(last, teacher);
    return html`${titled(`Run of ${runName(run)}`, null, html`
      ${modeLine(how, !score.certified, view.certificate(score))}
      ${unplayed ? html`<p class="words caution" role="status">No replay: ${unplayed}</p>` : nothing}
      ${waits ? html`<p class="words" role="status">Reading polyps and labels …</p>` : nothing}
      ${untold ? html`<p class="words caution" role="status">No polyps or labels: ${untold}</p>` : nothing}
      ${resultLine(view, this.connection.state, run, score)}
      ${scoreFacts(view.facts(score))}
      ${items.length ? itemList(items, (at) => this.goTo(at)) : nothing}
      ${holds.length ? html`<h3>${score.certified ? "Held" : "Contacts"}</h3>${holdList(score, ({ t_s: at }) => this.goTo(at), null)}` : nothing}
      ${view.learning ? learningPart(last, teacher, this.curve) : nothing}
      ${run.plan_id === null || !view.learning ? nothing : html`<label class="check" title="Learning curves of this plan show its level"><input type="checkbox" id="teacher-run" .checked=${live(run.teacher)}
        @change=${() => this.mark(run, !run.teacher)}>The teacher’s run</label>`}
      <div class="buttons even">${view.report ? html`<button type="button" id="report-runs" title="A page to print, with the runs beside" @click=${() => saveReport([run.id, ...this.beside])}>Report</button>` : nothing}${this.exports.button}${this.deleting(run)}</div>`)}`;
  }

  /** @param {RunTitle} run */
  deleting(run) {
    return html`<button type="button" id="delete-run" title="Delete this run for good" @click=${() => this.drop(run)}>Delete</button>`;
  }

  /** @param {number} t */
  goTo(t) {
    this.player.pause();
    this.player.seek(t);
  }

  /**
   * Space plays, unless a control has it.
   * @param {KeyboardEvent} event
   */
  key(event) {
    if (!this.shown || event.code !== "Space" || event.repeat || event.ctrlKey || event.metaKey || event.altKey) return false;
    if (ownsSpace(event)) return false;
    this.player.toggle();
    return true;
  }
}

/**
 * @param {(id: string) => Promise<unknown>} ask
 * @param {string} id of a run
 */
function askedOf(ask, id) {
  return `${ask.name} ${id}`;
}
