// The use of a registration: by the open plan, or as a file.
import { brief } from "/static/js/brief.js";
import { h, whenChanged } from "/static/js/dom.js";
import { download } from "/static/js/rest.js";
import { draw, html, nothing, said } from "/static/js/template.js";
import { isBlocked } from "./guide.js";
import { exportWords, isUsable } from "./words.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { PlanUseSection, RegistrationSection } from "/static/js/types.js" */

const EXPORTS = [["tfm", "ITK transform (.tfm)", "For 3D Slicer and ITK"], ["json", "Transform (.json)", "Matrix, frames, unit"]];

export class UseGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.element = h("div", { class: "fields" });
  }

  /**
   * @param {RegistrationSection} registration
   * @param {PlanUseSection | null | undefined} use
   */
  update(registration, use) {
    const { fit, deleted, calibration } = registration;
    this.changed([use, fit, registration.id, deleted, calibration.to], () => draw(this.element, this.template(registration, use)));
  }

  /**
   * @param {RegistrationSection} registration
   * @param {PlanUseSection | null | undefined} use
   */
  template(registration, use) {
    const { fit, deleted, calibration } = registration;
    const usable = isUsable(fit) && !deleted;
    const words = use?.words ?? "Open a plan first.";
    const send = (/** @type {boolean} */ used) => this.connection.send("registration.use", { used });
    const why = usable ? "" : notUsable(registration);
    return html`<p class=${isBlocked(use) ? "words caution" : "words"} id="plan-use-words">${said(use?.here ? words.replace(fit.words, "").trim() : words)}</p>
      <button type="button" class="primary wide" id="use-registration" data-command="registration.use" ?hidden=${!use || (use.here && use.state === "ready")} ?disabled=${!usable || Boolean(use?.locked)}
        title=${use?.locked ? "The plan is locked." : why || nothing} @click=${() => send(true)}>Use for plan</button>
      <button type="button" class="wide" id="drop-registration" ?hidden=${!use?.registration} ?disabled=${Boolean(use?.locked)} @click=${() => send(false)}>Use none</button>
      <div class="fields">${EXPORTS.map(([format, label, title]) => html`<button type="button" data-format=${format} title=${why || title} ?disabled=${!usable}
        @click=${() => download(`/api/v1/registrations/${encodeURIComponent(registration.id)}/export?format=${format}`)}>${label}</button>`)}</div>
      <p class="words" id="export-words">${said(exportWords(calibration.to))}</p>`;
  }
}

/**
 * Why a registration can neither be used nor exported.
 * @param {RegistrationSection} registration
 */
function notUsable({ deleted, fit }) {
  if (deleted) return "Restore it first.";
  if (fit.state === "inconsistent") return brief(fit.words);
  return fit.state === "misfit" ? "Points do not fit: match order or remeasure." : "Fit the points first.";
}
