// A short line with the rest of what there is to say behind a question mark.
import { html } from "./template.js";

/**
 * @param {string} id of the short line
 * @param {string} words
 * @param {unknown} help
 * @param {boolean} [caution]
 */
export function hintLine(id, words, help, caution = false) {
  return html`<div class=${caution ? "words caution" : "words"}><span id=${id} role="status">${words}</span>
    <details class="more"><summary aria-label="More" title="More">?</summary><span class="help">${help}</span></details></div>`;
}
