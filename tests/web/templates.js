// Stands for lit-html: a template is the text of its markup, which an element holds once it was drawn.

export const nothing = "", noChange = Symbol("no change");

/** The text of a template; of a listener and an object nothing. */
export function html(strings, ...values) {
  const text = (value) => (Array.isArray(value) ? value.map(text).join("") : typeof value === "function" || value === null || value === undefined || typeof value === "object" ? "" : String(value));
  return strings.reduce((all, part, index) => all + text(values[index - 1]) + part);
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
