// The dry run of the open plan: its verdict, how far a run is, and a button that cancels it.
import { h, whenChanged } from "./dom.js";
import { sentence } from "./format.js";
import { remove } from "./rest.js";

/** @import { Connection } from "./connection.js" */
/** @import { EvaluationSection, VerdictPart } from "./types.js" */

const QUIET_MS = 400; // a run that ends sooner shows no bar

/**
 * Whether the verdict and plot are of an earlier path, or of an earlier place of the hand that drags a point.
 * @param {EvaluationSection | null | undefined} corridor
 */
export function isOld(corridor) {
  return corridor?.state === "waits" || corridor?.state === "drag_waits";
}

/**
 * The verdict's sentence, which banner and bar have too.
 * @param {string} words
 */
function headOf(words) {
  return h("strong", { class: "verdict-head" }, words);
}

export class DryRun {
  /**
   * @param {Connection} connection
   * @param {string} id of the verdict's element
   */
  constructor(connection, id) {
    this.changed = whenChanged();
    /** @type {string | null} */
    this.job = null;
    /** @type {ReturnType<typeof setTimeout> | undefined} until the bar of that job may be shown */
    this.quiet = undefined;
    this.connection = connection;
    this.verdict = h("p", { class: "words", id });
    this.moreWords = h("p", { class: "words" });
    this.more = h("details", { class: "verdict-more", hidden: true }, h("summary", { title: "More about this verdict", "aria-label": "More about this verdict" }, "?"), this.moreWords);
    this.state = h("p", { class: "words verdict-state", id: `${id}-state`, hidden: true });
    this.showMe = h("button", { type: "button", class: "plain", "data-tool": "show-me", hidden: true }, "Show me");
    this.stage = h("p", { class: "words" });
    this.bar = h("div");
    this.cancelButton = h("button", { type: "button", "data-tool": "cancel", onclick: () => this.cancel() }, "Cancel");
    this.progress = h("div", { class: "job", "data-job": "dry_run", hidden: true }, this.stage, h("div", { class: "progress" }, this.bar), this.cancelButton);
    this.again = h("button", { type: "button", class: "wide", "data-tool": "again", hidden: true, onclick: () => connection.send("dry_run.again") }, "Run it again");
    this.element = h("div", { class: "fields" }, this.verdict, this.more, this.state, this.showMe, this.progress, this.again);
  }

  /** @param {EvaluationSection | undefined} corridor */
  update(corridor) {
    this.changed([corridor?.words, corridor?.level, corridor?.short, corridor?.caution, corridor?.cancelled, corridor?.job, corridor?.verdict, corridor?.state_words], () => {
      this.say(corridor);
      this.again.hidden = !corridor?.cancelled;
      this.follow(corridor?.job ?? null);
    });
    this.show();
  }

  /**
   * The verdict, where each figure about a place shows the tool there; without one the words of what goes on.
   * @param {EvaluationSection | undefined} corridor
   */
  say(corridor) {
    const verdict = corridor?.verdict;
    const level = verdict?.level ?? corridor?.level; // without a drive, where the tool does not fit at the entry
    this.verdict.className = level ? "words verdict" : "words";
    this.showMe.hidden = !verdict;
    const details = verdict?.parts.filter((part) => part.detail) ?? [];
    this.more.hidden = !details.length;
    this.state.hidden = !verdict;
    this.state.textContent = corridor?.state_words ?? "";
    if (!verdict) {
      if (level) this.verdict.dataset.level = level;
      else delete this.verdict.dataset.level;
      const head = corridor?.short ? `${corridor.short}.` : "";
      const words = sentence(corridor?.words ?? "");
      if (head) this.verdict.replaceChildren(headOf(head), words.startsWith(head) ? words.slice(head.length) : ""); // of a run that failed the head says it all
      else this.verdict.textContent = words;
      return;
    }
    this.verdict.dataset.level = verdict.level;
    const old = isOld(corridor);
    this.verdict.classList.toggle("stale", old);
    this.showMe.disabled = old;
    const shown = (/** @type {VerdictPart[]} */ parts) => parts.map(({ words, s_mm: s }) => (s === null || old ? document.createTextNode(words) : this.place(words, s)));
    const head = `${old || !corridor?.short ? verdict.short : corridor.short}.`; // as banner and bar have it
    this.verdict.replaceChildren(headOf(head), ...shown(verdict.parts.slice(1).filter((part) => !part.detail)));
    this.moreWords.replaceChildren(...shown(details));
    this.showMe.onclick = () => this.connection.send("clearance.show", { s_mm: verdict.show_mm });
  }

  /**
   * @param {string} words
   * @param {number} s arc length, mm
   */
  place(words, s) {
    const title = "Show the tool and the slices there";
    return h("button", { type: "button", class: "place", title, onclick: () => this.connection.send("clearance.show", { s_mm: s }) }, words);
  }

  /**
   * Show how far a job is, until it has ended or another one is followed.
   * @param {string | null} job its id; null where none runs
   */
  follow(job) {
    if (job === this.job) return;
    this.job = job;
    this.cancelButton.disabled = false;
    clearTimeout(this.quiet);
    this.quiet = setTimeout(() => {
      this.quiet = undefined;
      this.show();
    }, QUIET_MS);
  }

  /** How far the job is, from when on it may be shown. */
  show() {
    const now = this.quiet === undefined && this.connection.state.jobs?.items.find(({ id }) => id === this.job);
    this.progress.hidden = !now;
    if (!now) return;
    const percent = `${Math.round(now.fraction * 100)} %`;
    this.stage.textContent = now.state === "queued" ? "Waiting for another one" : `${sentence(now.stage).replace(/\.$/, "")}, ${percent}`;
    this.bar.style.width = percent.replace(" ", "");
  }

  async cancel() {
    this.cancelButton.disabled = true;
    if (this.job) await remove(`/api/v1/jobs/${encodeURIComponent(this.job)}`).catch(() => { this.cancelButton.disabled = false; });
  }
}
