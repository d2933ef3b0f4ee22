// The verdict on the plan's path, above the panel: one word, and the figures that decide it, the worst first.
import { byId, whenChanged } from "./dom.js";
import { fixed, sentence } from "./format.js";
import { stageWords } from "./jobs.js";
import { remove } from "./rest.js";
import { draw, html, iconTemplate, nothing } from "./template.js";
import { LEVEL_ICONS, UPDATING, figureWords, isOld, shortWords, unbroken } from "./verdict-line.js";

/** @import { Connection } from "./connection.js" */
/** @import { EvaluationSection, FigureView, JobEntry, VerdictPart, VerdictView, ViewModel } from "./types.js" */

const QUIET_MS = 400; // a run that ends sooner shows no bar
const TABS = ["plan", "register", "rehearse"]; // that show it
/** @type {Record<string, string>} figures whose name alone could be taken for the way to the target */
const SHOWN = { reach: "along path" };

export class VerdictCard {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.element = byId("card");
    this.changed = whenChanged();
    this.open = false; // whether the sentences are shown
    /** @type {string | null} the job that is followed */
    this.job = null;
    this.cancelling = false;
    /** @type {ReturnType<typeof setTimeout> | undefined} until the bar of that job may be shown */
    this.quiet = undefined;
  }

  /** @param {ViewModel} state */
  update(state) {
    const { corridor, plan, step } = state;
    const shown = TABS.includes(step?.name ?? "") && (plan?.points.length ?? 0) > 1 && corridor !== undefined && corridor.status !== "none";
    this.element.hidden = !shown;
    if (!shown) {
      draw(this.element, html``); // nothing of an earlier plan is there to be read or spoken
      this.changed([], () => {});
      return;
    }
    this.follow(corridor.job);
    const job = this.quiet === undefined ? state.jobs?.items.find(({ id }) => id === this.job) : undefined;
    const aside = step?.name === "register" && corridor.verdict && !isOld(corridor) && !corridor.verdict.figures.some(({ name }) => name === "registration error");
    this.changed([corridor, job, this.open, this.cancelling, aside, plan?.short_mm], () => draw(this.element, this.card(corridor, job, Boolean(aside), shortWords(plan?.short_mm ?? 0))));
  }

  /**
   * @param {EvaluationSection} corridor
   * @param {JobEntry | undefined} job
   * @param {boolean} unregistered whether it is said that no registration error is in the verdict
   * @param {string} short how far before a target the path ends, '' where it ends at one
   */
  card(corridor, job, unregistered, short) {
    const { verdict } = corridor;
    const old = isOld(corridor);
    const level = verdict && old ? verdict.level : corridor.level;
    const mark = stateWords(corridor);
    return html`
      <div class=${`card-body${old ? " stale" : ""}${this.open ? " open" : ""}`} id="verdict" data-level=${level ?? ""}>
        <div class="card-head">
          <span class="card-icon">${iconTemplate(level ? LEVEL_ICONS[level] : "waiting")}</span>
          <div class="card-verdict"><strong class="card-word" role="status">${corridor.word || "Simulating"}<span class="visually-hidden">${spoken(corridor)}</span></strong>
          ${short ? html`<span class="pill" id="ends-short" title="From the path's end to the nearest target">${short}</span>` : nothing}</div>
          <span class="updating" id="verdict-state" title=${corridor.state_words} ?hidden=${!mark}>${mark}</span>
          <button type="button" class="plain" data-tool="show-me" ?hidden=${!verdict || Boolean(mark)} title="Show the tool where the path decides"
            @click=${() => this.show(verdict?.show_mm ?? 0)}>Show me</button>
          <button type="button" class="icon plain" id="verdict-why" title="Why: the verdict in sentences" aria-label="Why" aria-expanded=${this.open} aria-controls="verdict-words"
            @click=${() => this.toggle()}>?</button>
        </div>
        ${verdict && corridor.warning ? html`<p class="words caution" id="verdict-warning">${sentence(corridor.warning)}.</p>` : nothing}
        <ul class="chips" aria-label="Figures of the verdict" ?hidden=${!verdict}>${(verdict?.figures ?? []).map((figure) => this.chip(figure, old))}
          ${unregistered ? html`<li class="chip-words">registration error not included</li>` : nothing}</ul>
        <p class="words verdict-words" id="verdict-words" ?hidden=${!this.open && Boolean(verdict)}>${this.sentences(corridor, old)}</p>
        ${job ? this.progress(job) : nothing}
        <button type="button" class="wide" data-tool="again" ?hidden=${!corridor.cancelled} @click=${() => this.connection.send("dry_run.again")}>Run it again</button>
      </div>`;
  }

  /**
   * @param {FigureView} figure
   * @param {boolean} old
   */
  chip(figure, old) {
    const { name, level, s_mm: s } = figure;
    return html`<li><button type="button" class="chip" data-level=${level} ?disabled=${old || s === null} title="Show the tool and the slices there"
      @click=${() => this.show(s ?? 0)}>${SHOWN[name] ?? name} ${valueOf(figure)}</button></li>`;
  }

  /**
   * The sentences, whose figures show the tool at their places; without a simulation the words of what goes on.
   * @param {EvaluationSection} corridor
   * @param {boolean} old
   */
  sentences(corridor, old) {
    const { verdict } = corridor;
    if (!verdict) return sentence(corridor.words);
    const head = `${old || !corridor.short ? verdict.short : corridor.short}.`;
    const parts = unbroken(verdict.parts.slice(1));
    return html`<strong class="verdict-head">${head}</strong>${parts.map(({ before, part, after }) => (before || after ? html`<span class="unbroken">${before}${this.part(part, old)}${after}</span>` : this.part(part, old)))}`;
  }

  /**
   * @param {VerdictPart} part
   * @param {boolean} old
   */
  part({ words, s_mm: s }, old) {
    if (s === null || old) return words;
    return html`<button type="button" class="place" title="Show the tool and the slices there" @click=${() => this.show(s)}>${words}</button>`;
  }

  /** @param {JobEntry} job */
  progress(job) {
    return html`<div class="job" data-job="dry_run"><span class="words">${sentence(stageWords(job))}</span>
      <div class="progress"><div style=${`width: ${Math.round(job.fraction * 100)}%`}></div></div>
      <button type="button" data-tool="cancel" ?disabled=${this.cancelling} @click=${() => this.cancel()}>Cancel</button></div>`;
  }

  /** @param {number} s arc length, mm */
  show(s) {
    this.connection.send("clearance.show", { s_mm: s });
  }

  toggle() {
    this.open = !this.open;
    this.update(this.connection.state);
  }

  /**
   * Show how far a job is, until it has ended or another one is followed.
   * @param {string | null} job its id; null where none runs
   */
  follow(job) {
    if (job === this.job) return;
    this.job = job;
    this.cancelling = false;
    clearTimeout(this.quiet);
    this.quiet = setTimeout(() => {
      this.quiet = undefined;
      this.update(this.connection.state);
    }, QUIET_MS);
  }

  async cancel() {
    this.cancelling = true;
    this.update(this.connection.state);
    if (this.job) await remove(`/api/v1/jobs/${encodeURIComponent(this.job)}`).catch(() => { this.cancelling = false; });
  }
}

/**
 * The value of a figure with its unit; nothing where it has none.
 * @param {FigureView} figure
 */
export function valueOf({ value, digits, whole_mm: whole, level, at_least: more }) {
  if (value === null) return level === "unknown" ? html`<b>?</b>` : nothing;
  return html`<b>${more ? "≥ " : ""}${fixed(value, digits)}${whole === null ? "" : ` of ${fixed(whole, digits)}`}</b> mm`;
}

/**
 * What the card says to a screen reader besides its word, once for each verdict.
 * @param {EvaluationSection} corridor
 */
function spoken({ verdict, state }) {
  if (!verdict || state !== "current") return "";
  return `: ${verdict.figures.map(figureWords).join(", ")}`;
}

/**
 * What stands in the place of 'Show me' while the verdict is not that of the path.
 * @param {EvaluationSection} corridor
 */
function stateWords({ state, verdict }) {
  if (state === "waits") return verdict ? UPDATING : "";
  return state === "drag" || state === "drag_waits" ? "while you drag" : "";
}
