// A suggested way as a card: its verdict and figures, in the words of the verdict card, one below another as in each card.
import { html, iconTemplate, nothing } from "/static/js/template.js";
import { valueOf } from "/static/js/verdict-card.js";
import { LEVEL_ICONS, shortWords } from "/static/js/verdict-line.js";
import { ARRIVES_MM, figuresOf } from "./way-figures.js";

/** @import { AlternativePublic, VerdictFigure } from "/static/js/types.js" */
/** @typedef {{ key: string, number: number, shown: boolean, followed: boolean, locked: boolean, picture: unknown }} Standing */
/** @typedef {{ show: () => void, use: () => void }} Does */

/**
 * @param {AlternativePublic} way
 * @param {string[]} rows names of the figures, in order
 * @param {Standing} standing shown: in the head; followed: by the path; picture: an element, or words until there is one
 * @param {Does} does
 */
export function wayCard(way, rows, { key, number, shown, followed, locked, picture }, does) {
  const figures = new Map(figuresOf(way).map((figure) => [figure.name, figure]));
  const short = way.short_of_target_mm > ARRIVES_MM ? shortWords(way.short_of_target_mm) : "";
  // a pointer that rests is not asking, though the list may move below it
  const pointed = (/** @type {PointerEvent} */ { movementX, movementY }) => {
    if ((movementX || movementY) && !shown) does.show();
  };
  return html`<li class="way" aria-current=${String(followed)}>
    <button type="button" class="alternative" data-shown=${key} data-level=${way.verdict} aria-pressed=${String(shown)}
      @click=${does.show} @pointermove=${pointed}>
      <span class="way-name">Way ${number + 1}</span>
      <span class="way-picture">${picture}</span>
      <span class="way-verdict" title=${way.short}><span class="card-icon">${iconTemplate(LEVEL_ICONS[way.verdict])}</span>${way.word}${short ? html`<span class="pill">${short}</span>` : nothing}</span>
      ${rows.map((name) => row(name, figures.get(name)))}
    </button>
    ${shown ? html`<button type="button" class="primary" id="use-suggestion" data-command="suggestion.use" ?disabled=${locked} @click=${does.use}>Use path</button>` : html`<span class="way-room"></span>`}
  </li>`;
}

/**
 * @param {string} name
 * @param {VerdictFigure | undefined} figure
 */
function row(name, figure) {
  return html`<span class="way-figure" data-level=${figure?.level ?? "fits"}><span class="way-of" title=${name}>${name}</span>
    <span class="way-value">${figure ? valueOf(figure) : "–"}</span></span>`;
}
