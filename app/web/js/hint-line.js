// A short line with the rest of what there is to say behind a question mark.
import { html } from "./template.js";

/**
 * @param {string} id of the short line
 * @param {string} words
 * @param {unknown} help
 * @param {boolean} [caution]
 */
export function hintLine(id, words, help, caution = false) {
  return html`<details class="hint-line">
    <summary><span class=${caution ? "words caution" : "words"} id=${id} role="status">${words}</span><span class="hint-more" title="More" aria-hidden="true">?</span></summary>
    <div class="words help">${help}</div>
  </details>`;
}
