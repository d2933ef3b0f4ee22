// Clearance along the path: to bone and to each protected structure, depth in soft tissue, and the tool at one place of it.
import { h, whenChanged } from "/static/js/dom.js";
import { captionWords, deepestOf, marginWords, placeDetail, placeWords, structureColour } from "/static/js/clearance-words.js";
import { mm } from "/static/js/format.js";
import { isOld } from "/static/js/verdict-line.js";
import { draw, html, more, nothing, unlessFocused } from "/static/js/template.js";
import { clearancePlot, placeUnder } from "./clearance-plot.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { EvaluationSection, ScaleView, VerdictView } from "/static/js/types.js" */

const STEP_MM = 0.5; // of the slider

export class ClearanceGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.element = h("div", { class: "fields", id: "profile", hidden: true });
    this.old = false;
  }

  /** @param {number} s arc length, mm */
  show(s) {
    if (!this.old) this.connection.send("clearance.show", { s_mm: s });
  }

  /** @param {EvaluationSection | undefined} corridor */
  update(corridor) {
    const verdict = corridor?.verdict ?? null, scale = corridor?.scale ?? null;
    const shown = corridor?.shown_mm ?? null, regions = this.connection.state.regions?.items ?? [];
    this.old = isOld(corridor);
    this.element.classList.toggle("stale", this.old);
    this.element.hidden = !verdict || !scale;
    if (!verdict || !scale) return;
    const colours = verdict.profile.curves.map(({ name }, index) => (index ? structureColour(name, regions) : "var(--text-soft)"));
    this.changed([verdict, scale, shown, colours, this.old], () => draw(this.element, this.content(verdict, scale, shown, colours)));
  }

  /**
   * @param {VerdictView} verdict
   * @param {ScaleView} scale
   * @param {number | null} shown arc length of the tool that is shown, mm
   * @param {string[]} colours of the curves
   */
  content(verdict, scale, shown, colours) {
    const { length_mm: length } = verdict;
    const place = shown ?? verdict.show_mm; // before somebody goes to another one: what 'Show me' shows
    const at = this.old ? null : place;
    const words = at === null ? "" : placeWords(verdict, at), detail = at === null ? "" : placeDetail(verdict, at);
    const slide = (/** @type {Event} */ { currentTarget }) => this.show(/** @type {HTMLInputElement} */ (currentTarget).valueAsNumber);
    return html`${clearancePlot(verdict, scale, colours, at, (event) => this.show(placeUnder(event, length)))}
      <div class="profile-line">
        <input type="range" id="profile-place" min="0" max=${Math.floor(length / STEP_MM) * STEP_MM} step=${STEP_MM} aria-label="Place of the tool along the path"
          aria-valuetext=${`${words} ${detail}`.trim()} .value=${unlessFocused(String(place))} @input=${slide}>
        <button type="button" class="plain" id="profile-hide" ?hidden=${shown === null} @click=${() => this.connection.send("clearance.hide")}>Hide tool</button>
      </div>
      <div class="words"><span id="profile-reading">${words || "Updating …"}</span>
        ${more(`${detail} ${captionWords(verdict)}`.trim(), "profile-help", "About the plot")}</div>
      ${keys(verdict, scale, colours)}`;
  }
}

/**
 * Whose each curve is, and what the areas are.
 * @param {VerdictView} verdict
 * @param {ScaleView} scale
 * @param {string[]} colours of the curves
 */
function keys({ profile }, scale, colours) {
  const swatch = (/** @type {number} */ index) => (index ? colours[index] : `linear-gradient(to right, ${scale.colours.join(", ")})`);
  const area = (/** @type {string} */ kind, /** @type {string} */ name, /** @type {number[]} */ values) => html`<li><i class=${`profile-swatch ${kind}`}></i><span>${name}</span>
    <span class="number">up to ${mm(Math.max(...values))}</span></li>`;
  return html`<ul class="profile-keys" aria-label="Lines of the plot">${profile.curves.map((curve, index) => html`<li>
    <i class="profile-swatch" style=${`background: ${swatch(index)}`}></i><span>${curve.name}</span><span class="number">${marginWords(curve)}</span></li>`)}
    ${deepestOf(profile) && profile.tissue_depth_mm ? area("area", "depth in tissue (right)", profile.tissue_depth_mm) : nothing}
    ${profile.registration_mm ? area("band", "registration error", profile.registration_mm) : nothing}</ul>`;
}
