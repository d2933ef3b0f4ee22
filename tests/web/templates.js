// Stands for lit-html: a template is the text of its markup, which an element holds once it was drawn.

export const nothing = "", noChange = Symbol("no change");

/** @type {[string, Function][]} listeners of the templates that were made, newest first, each behind the markup of its tag before it */
const listeners = [];

/** The newest listener whose tag has such markup before it, such as `id="task-seed"` and then `@change=`. */
export function listenerOf(markup, event) {
  return listeners.find(([tag]) => tag.includes(markup) && tag.endsWith(`@${event}=`))?.[1];
}

/** The text of a template; of a listener and an object nothing. */
export function html(strings, ...values) {
  const text = (value) => (Array.isArray(value) ? value.map(text).join("") : typeof value === "function" || value === null || value === undefined || typeof value === "object" ? "" : String(value));
  return strings.reduce((all, part, index) => {
    if (typeof values[index - 1] === "function") listeners.unshift([all.slice(all.lastIndexOf("<")), values[index - 1]]);
    return all + text(values[index - 1]) + part;
  });
}

export const svg = html;

export function render(template, element) {
  element.textContent = template;
}

export class Directive {}

export const directive = (Kind) => (...values) => new Kind().render(...values);
export const live = (value) => value;
export const repeat = (items, key, template) => items.map((item, index) => (template ?? key)(item, index));
export function setCommittedValue() {}
