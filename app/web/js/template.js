// Templates of panels: what a part of a panel shows, written as the HTML of its section. lit-html draws it, and with each
// update only what differs, so that focus, hover and a press in the middle survive. Text from data goes in as text.
import { html, noChange, nothing, render, svg } from "/static/lib/lit-html/lit-html.js";
import { setCommittedValue } from "/static/lib/lit-html/directive-helpers.js";
import { Directive, directive } from "/static/lib/lit-html/directive.js";
import { live } from "/static/lib/lit-html/directives/live.js";
import { repeat } from "/static/lib/lit-html/directives/repeat.js";
import { inTwo } from "./brief.js";
import { ICONS } from "./dom.js";
import { sentence } from "./format.js";

/** @import { PropertyPart, TemplateResult } from "/static/lib/lit-html/lit-html.js" */

export { html, live, nothing, repeat, svg };

/**
 * Draw a template into an element. The focus stays where it is; where its row of a list has gone, the next row gets it.
 * @param {HTMLElement} element
 * @param {TemplateResult} template
 */
export function draw(element, template) {
  const focused = element.contains(document.activeElement) ? document.activeElement : null;
  const row = focused?.closest("li, tr");
  const list = row?.parentElement;
  const at = row && list ? [...list.children].indexOf(row) : -1;
  render(template, element);
  if (!focused || document.activeElement === focused) return;
  const next = focused.isConnected ? focused : list?.children[Math.min(at, list.children.length - 1)];
  const target = next?.matches("[tabindex], button, input, select, textarea") ? next : next?.querySelector("button:enabled");
  if (target instanceof HTMLElement) target.focus({ preventScroll: true });
}

/**
 * A value of a control as the planner has it, unless the control has the focus: what is being typed or chosen stays.
 * `live` is for a control whose every change is sent, such as a checkbox: it shows the planner's value after a refusal.
 */
export const unlessFocused = directive(class extends Directive {
  /** @param {unknown} value */
  render(value) {
    return value;
  }

  /**
   * @override
   * @param {PropertyPart} part
   * @param {[unknown]} values
   */
  update(part, [value]) {
    if (part.element === document.activeElement || Reflect.get(part.element, part.name) === value) return noChange;
    setCommittedValue(part); // whatever was drawn last: by hand it may be another value since
    return value;
  }
});

/**
 * A text of a dozen words in sight, and the rest of it behind ‘?’; outside a template: `say` of said.js.
 * @param {string} text
 */
export function said(text) {
  const [first, rest] = inTwo(sentence(text));
  return html`${first}${rest ? html` ${more(rest)}` : nothing}`;
}

/**
 * An explanation behind ‘?’.
 * @param {unknown} help
 * @param {string} [id] of the explanation
 * @param {string} [label] of the ‘?’
 */
export function more(help, id, label = "More") {
  return html`<details class="more"><summary aria-label=${label} title=${label}>?</summary><span class="help" id=${id ?? nothing}>${help}</span></details>`;
}

/**
 * A short line with the rest of what there is to say behind ‘?’.
 * @param {string} id of the short line
 * @param {string} words
 * @param {unknown} help
 * @param {boolean} [caution]
 */
export function hintLine(id, words, help, caution = false) {
  return html`<div class=${caution ? "words caution" : "words"}><span id=${id} role="status">${words}</span> ${more(help)}</div>`;
}

/**
 * The content of a titled group of a panel.
 * @param {string} title
 * @param {unknown} tools beside the title
 * @param {unknown} content
 */
export function titled(title, tools, content) {
  return html`<div class="group-head"><h2>${title}</h2>${tools ? html`<div class="buttons">${tools}</div>` : nothing}</div>${content}`;
}

/** @param {keyof typeof ICONS} name */
export function iconTemplate(name) {
  return html`<svg viewBox="0 0 16 16" aria-hidden="true"><path d=${ICONS[name]} fill="none" stroke="currentColor" stroke-width="1.4"
    stroke-linecap="round" stroke-linejoin="round"></path></svg>`;
}

/**
 * A small square button with a picture, and with a name as its tooltip and for those who cannot see it.
 * @param {keyof typeof ICONS} name
 * @param {string} label
 * @param {(event: MouseEvent) => unknown} onclick
 * @param {{ id?: string, operation?: string, tool?: string, title?: string, off?: boolean, hidden?: boolean }} [more]
 *   operation: message that it sends. title: of the tooltip, where that says more. off: it cannot be pressed now
 */
export function iconTool(name, label, onclick, { id, operation, tool, title = label, off = false, hidden = false } = {}) {
  return html`<button type="button" class="icon plain" id=${id ?? nothing} data-operation=${operation ?? nothing} data-tool=${tool ?? nothing} title=${title} aria-label=${label}
    ?disabled=${off} ?hidden=${hidden} @click=${onclick}>${iconTemplate(name)}</button>`;
}

/**
 * A row of a list: a button with the name, and small tools beside it.
 * @param {{ name: string, deleted?: boolean }} item
 * @param {string} sub the small words below the name
 * @param {() => void} onclick
 * @param {unknown} tools
 * @param {boolean} [current]
 */
export function nameRow({ name, deleted = false }, sub, onclick, tools, current = false) {
  return html`<li class=${deleted ? "row deleted" : "row"} aria-current=${String(current)}>
    <button type="button" class="row-main" ?disabled=${deleted} @click=${onclick}><span title=${name}>${name}</span><span class="row-sub">${sub}</span></button>
    <div class="row-tools">${tools}</div>
  </li>`;
}

/**
 * A button that asks for files, and calls with those that were chosen.
 * @param {{ id: string, input: string, words: string, disabled: boolean, title?: string, folder?: boolean, accept?: string }} what
 *   id of the button, input: id of the chooser
 * @param {(files: File[]) => unknown} chosen
 */
export function filesButton({ id, input, words, disabled, title, folder, accept }, chosen) {
  const ask = (/** @type {Event} */ { currentTarget }) => {
    const chooser = /** @type {HTMLElement} */ (currentTarget).nextElementSibling;
    if (chooser instanceof HTMLInputElement) chooser.click();
  };
  const take = (/** @type {Event} */ { currentTarget }) => {
    const chooser = /** @type {HTMLInputElement} */ (currentTarget);
    const files = [...chooser.files ?? []];
    chooser.value = ""; // so that the same file can be chosen again
    if (files.length) chosen(files);
  };
  return html`<button type="button" id=${id} title=${title ?? nothing} ?disabled=${disabled} @click=${ask}>${words}</button
    ><input type="file" hidden multiple id=${input} accept=${accept ?? nothing} ?webkitdirectory=${folder} @change=${take}>`;
}
