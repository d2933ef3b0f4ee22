// Below the views: the time of the run, its plots, and the comparison.
import { assignment } from "/static/js/assignments.js";
import { h } from "/static/js/dom.js";
import { fixed } from "/static/js/format.js";
import { feltHolds } from "/static/js/run-score.js";
import { keep, recall } from "/static/js/remember.js";
import { viewOf } from "/static/js/run-views.js";
import { draw, html, live, nothing } from "/static/js/template.js";
import { CompareTable } from "./compare.js";
import { pathPlotsOf } from "./path-plots.js";
import { ResultsTable } from "./results.js";
import { SPEEDS, STEP_S } from "./player.js";
import { plotsOf } from "./plots.js";

/** @import { AnyScore } from "/static/js/runs.js" */
/** @import { CommentPublic } from "/static/js/types.js" */
/** @import { Player } from "./player.js" */

const PLAY = "M4.5 3v10l8-5z", PAUSE = "M5 3v10M11 3v10";
const COARSE_S = 1; // of PageUp and PageDown
/** @typedef {"plots" | "path" | "compare" | "results"} Shown */
/** @type {[Shown, string][]} */
const SHOWN = [["plots", "Plots"], ["path", "Path"], ["compare", "Compare"], ["results", "Results"]];

export class Dock {
  /**
   * @param {Player} player
   * @param {(run: string) => void} open
   */
  constructor(player, open) {
    this.player = player;
    this.plots = plotsOf(player);
    this.path = pathPlotsOf(player);
    this.compare = new CompareTable();
    this.results = new ResultsTable(open);
    this.shows = /** @type {Shown} */ (recall("review-dock", SHOWN.map(([what]) => what), "plots"));
    /** @type {AnyScore | null} */
    this.score = null;
    /** @type {CommentPublic[]} */
    this.comments = [];
    this.bar = h("div", { class: "timeline" });
    this.body = h("div", { class: "review-body", tabIndex: 0, role: "region", "aria-label": "Plots and comparison" });
    this.element = h("section", { class: "review-dock", "aria-label": "Run over time" }, this.bar, this.body);
    this.element.addEventListener("keydown", (event) => this.key(event));
    player.addEventListener("change", () => this.render());
    player.addEventListener("state", () => this.render());
    assignment.addEventListener("change", () => this.render());
    this.render();
  }

  /**
   * @param {AnyScore | null} score of the run that is played
   * @param {CommentPublic[]} [comments] on it
   */
  marks(score, comments = []) {
    Object.assign(this, { score, comments });
    this.render();
  }

  /** @param {Shown} what */
  turn(what) {
    this.shows = what;
    keep("review-dock", what);
    this.render();
  }

  /** Only a tool that follows a path is beside one, and only an assignment has results. @param {Shown} what */
  offers(what) {
    const { main } = this.player;
    return what === "results" ? Boolean(assignment.results) : what !== "path" || !main || "flat_mm" in main.series;
  }

  render() {
    const { player } = this, { main, end } = player;
    const offered = SHOWN.filter(([what]) => this.offers(what)), shows = this.offers(this.shows) ? this.shows : "plots";
    const shown = this[shows].element;
    if (this.body.firstElementChild !== shown) {
      this.body.replaceChildren(shown);
      if (shows === "plots" || shows === "path") this[shows].update(); // they are marked only while they are in sight
    }
    const label = player.playing ? "Pause" : "Play";
    draw(this.bar, html`
      <button type="button" class="icon" id="play-run" title="${label} (Space)" aria-label=${label} ?disabled=${!main} @click=${() => player.toggle()}>
        <svg viewBox="0 0 16 16" aria-hidden="true"><path d=${player.playing ? PAUSE : PLAY} fill=${player.playing ? "none" : "currentColor"} stroke="currentColor" stroke-width=${player.playing ? 2.4 : 1} stroke-linejoin="round"></path></svg></button>
      <div class="timeline-track">
        <div class="timeline-marks" aria-hidden="true">${this.score && end ? feltHolds(this.score).map(({ t_s: at, duration_s: length, kind }) => html`<i data-kind=${kind === "contact" ? "contact" : "hold"} style="left: ${(100 * at) / end}%; width: ${(100 * length) / end}%"></i>`) : nothing}</div>
        <input type="range" id="run-time" min="0" max=${end || 1} step=${STEP_S} .value=${live(String(player.t))} ?disabled=${!main} aria-label="Time of the run" aria-valuetext="${fixed(player.t, 1)} of ${fixed(end, 1)} s"
          @input=${(/** @type {Event} */ { currentTarget }) => this.scrub(Number(/** @type {HTMLInputElement} */ (currentTarget).value))}>
        <div class="timeline-comments">${this.score && end ? viewOf(this.score).items(this.score).filter(({ done_s: t }) => t !== null).map(({ name, done_s: t }) => html`<button type="button" class="plain" tabindex="-1" data-kind="done" style="left: ${(100 * (t ?? 0)) / end}%"
          title="${name} done at ${fixed(t, 1)} s" aria-label="${name} done at ${fixed(t, 1)} s" @click=${() => this.scrub(t ?? 0)}></button>`) : nothing}${end ? this.comments.filter(({ t_s: t }) => t !== null).map(({ t_s: t, text }) => html`<button type="button" class="plain" tabindex="-1" style="left: ${(100 * (t ?? 0)) / end}%"
          title=${text} aria-label="Comment at ${fixed(t, 1)} s" @click=${() => this.scrub(t ?? 0)}></button>`) : nothing}</div>
      </div>
      <span class="timeline-time number">${fixed(player.t, 1)} / ${fixed(end, 1)} s</span>
      <select id="run-speed" aria-label="Speed" @change=${(/** @type {Event} */ { currentTarget }) => { player.speed = Number(/** @type {HTMLSelectElement} */ (currentTarget).value); }}>
        ${SPEEDS.map((speed) => html`<option value=${speed} ?selected=${speed === player.speed}>${fixed(speed, speed % 1 ? 2 : 0).replace(/0$/u, "")}×</option>`)}</select>
      <div class="segmented" role="group" aria-label="Below the views">
        ${offered.map(([what, name]) => html`<button type="button" id="show-${what}" aria-pressed=${String(shows === what)} @click=${() => this.turn(what)}>${name}</button>`)}</div>`);
  }

  /** @param {number} t */
  scrub(t) {
    this.player.pause();
    this.player.seek(t);
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { player } = this;
    const target = /** @type {Partial<HTMLElement>} */ (event.target);
    if (target.id !== "run-time") return;
    if (event.code === "Space") { // the page leaves it to a field that has the focus
      event.preventDefault();
      event.stopPropagation();
      if (!event.repeat) player.toggle();
      return;
    }
    const by = { ArrowLeft: -STEP_S, ArrowRight: STEP_S, PageDown: -COARSE_S, PageUp: COARSE_S, Home: -Infinity, End: Infinity }[event.key];
    if (by === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    player.pause();
    player.seek(Number.isFinite(by) ? player.t + by : by < 0 ? 0 : player.end);
  }
}
