// Elements are made here and only here; text from data goes in as text, never as markup.

/** @typedef {string | Node | null | undefined} Child null and undefined are left out */
/**
 * @typedef {{ [K in keyof HTMLElementEventMap as `on${K}`]?: (event: HTMLElementEventMap[K]) => unknown } & Record<string, unknown>} Props
 */
/**
 * An element of an entry of a list; its listeners read the entry as it is now.
 * @template Item
 * @typedef {HTMLElement & { item: Item }} Row
 */

const SVG = "http://www.w3.org/2000/svg";

/**
 * An element of index.html by its id.
 * @param {string} id
 */
export function byId(id) {
  const element = document.getElementById(id);
  if (!element) throw new Error(`index.html has no element with the id ${id}.`);
  return element;
}

/**
 * Make an element: `on…` props are listeners, `aria-…`/`data-…` attributes, the rest properties.
 * @template {keyof HTMLElementTagNameMap} T
 * @param {T} tag
 * @param {Props} [props]
 * @param {...(Child | Child[])} children
 * @returns {HTMLElementTagNameMap[T]}
 */
export function h(tag, props = {}, ...children) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(props)) {
    if (value === undefined || value === null) continue;
    if (key.startsWith("on")) element.addEventListener(key.slice(2), /** @type {EventListener} */ (value));
    else if (key === "class") element.className = String(value);
    else if (key.includes("-") || key === "role" || key === "for" || key === "list") element.setAttribute(key, String(value));
    else Reflect.set(element, key, value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return element;
}

/**
 * @template {keyof SVGElementTagNameMap} T
 * @param {T} tag
 * @param {Record<string, string | number>} [attributes]
 * @param {...Node} children
 * @returns {SVGElementTagNameMap[T]}
 */
export function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
  element.append(...children);
  return element;
}

export const ICONS = {
  undo: "M6 4 2.5 7.5 6 11M3 7.5h6.5a3.5 3.5 0 0 1 0 7H7",
  redo: "M10 4l3.5 3.5L10 11M13 7.5H6.5a3.5 3.5 0 0 0 0 7H9",
  lock: "M4 7.5h8v6H4zM5.5 7.5V5a2.5 2.5 0 0 1 5 0v2.5",
  unlock: "M4 7.5h8v6H4zM5.5 7.5V5a2.5 2.5 0 0 1 4.8-1",
  swap: "M3 5.5h9.5M10 3l2.5 2.5L10 8M13 10.5H3.5M6 8l-2.5 2.5L6 13",
  trash: "M3 4.5h10M6 4.5V3h4v1.5M4.5 4.5l.6 9h5.8l.6-9",
  restore: "M3 8a5 5 0 1 0 1.6-3.7M3 2.5v2.8h2.8",
  download: "M8 2.5v8M4.8 7.5L8 10.7l3.2-3.2M3 13.5h10",
  target: "M8 2.5a5.5 5.5 0 1 0 0 11a5.5 5.5 0 1 0 0-11M8 6a2 2 0 1 0 0 4a2 2 0 1 0 0-4",
  pencil: "M3 13l.6-2.8L10.8 3l2.2 2.2-7.2 7.2L3 13z",
  copy: "M5.5 5.5h7.5V13H5.5zM3 10.5V3h7.5",
  insert: "M3 4h10M3 12h10M8 6v4M6 8h4",
  panel: "M2.5 3h11v10h-11zM6 3v10",
  layoutOneThree: "M2.5 3h11v10h-11zM10 3v10M10 6.3h3.5M10 9.7h3.5",
  layoutTwoByTwo: "M2.5 3h11v10h-11zM8 3v10M2.5 8h11",
  layoutOne: "M2.5 3h11v10h-11z",
  layoutPath: "M2.5 3h11v10h-11zM8 5.4a2.6 2.6 0 1 0 0 5.2 2.6 2.6 0 0 0 0-5.2",
  endoscope: "M8 2.5a5.5 5.5 0 1 0 0 11a5.5 5.5 0 1 0 0-11M8 5.2a2.8 2.8 0 1 0 0 5.6 2.8 2.8 0 0 0 0-5.6M8 7.9v.2",
  fits: "M3 8.5l3.2 3.2L13 4.8",
  tight: "M8 3v6.4M8 12.4v.2",
  unknown: "M5.8 6a2.2 2.2 0 1 1 3.3 1.9c-.8.5-1.1.9-1.1 1.8M8 12.4v.2",
  blocked: "M4 4l8 8M12 4l-8 8",
  waiting: "M4 8v.1M8 8v.1M12 8v.1",
  cross: "M8 2v4.2M8 9.8V14M2 8h4.2M9.8 8H14M8 8v.1",
  window: "M2.5 2.5v11h11M2.5 11h3l4-6H13",
  distance: "M3.8 12.2l8.4-8.4M2.3 9.7l4 4M9.7 2.3l4 4",
  angle: "M13.5 13h-11L10 3.2M8 13a5.4 5.4 0 0 0-2.2-4.3",
  paint: "M13.3 2.7L7.6 8.4M5.9 8.6c1.1 0 1.7.8 1.6 1.8-.2 1.9-2 2.9-4.6 2.8.9-.6.8-1.5.9-2.5.2-1.2 1-2.1 2.1-2.1z",
  adjust: "M2.5 5h5.5M11.5 5h2M9.75 3.2v3.6M2.5 11h2M8 11h5.5M6.25 9.2v3.6",
  large: "M9.5 3H13v3.5M6.5 13H3V9.5M13 3L9 7M3 13l4-4",
  theme: "M8 2.5a5.5 5.5 0 1 0 0 11zM8 2.5a5.5 5.5 0 0 1 0 11",
  find: "M7 2.5a4.5 4.5 0 1 0 0 9 4.5 4.5 0 0 0 0-9M10.3 10.3l3.2 3.2",
  help: "M6 6a2 2 0 1 1 3 1.8c-.7.4-1 .8-1 1.6M8 11.8v.1M8 2a6 6 0 1 0 0 12A6 6 0 0 0 8 2z",
};

/** @param {keyof typeof ICONS} name */
export function icon(name) {
  const path = svg("path", {
    d: ICONS[name], fill: "none", stroke: "currentColor", "stroke-width": 1.4, "stroke-linecap": "round", "stroke-linejoin": "round",
  });
  return svg("svg", { viewBox: "0 0 16 16", "aria-hidden": "true" }, path);
}

/**
 * A small square button with a picture and a name for those who cannot see it.
 * @param {keyof typeof ICONS} name
 * @param {string} label
 * @param {(event: MouseEvent) => unknown} onclick
 * @param {Props} [props]
 */
export function iconButton(name, label, onclick, props = {}) {
  return h("button", { type: "button", class: "icon plain", title: label, "aria-label": label, onclick, ...props }, icon(name));
}

/**
 * A button of the title bar: a picture, with its word beside it where the window is wide.
 * @param {keyof typeof ICONS} name
 * @param {string} word
 * @param {string} title
 * @param {() => unknown} onclick
 * @param {Props} [props]
 */
export function barButton(name, word, title, onclick, props = {}) {
  return h("button", { type: "button", class: "icon plain", title, onclick, ...props }, icon(name), barWord(word));
}

/** @param {string} word beside the picture of a button of the title bar */
export function barWord(word) {
  return h("span", { class: "bar-word" }, word);
}

/**
 * A titled part of a panel.
 * @param {string} title
 * @param {Child[] | null} tools
 * @param {...Child} children
 */
export function group(title, tools, ...children) {
  const head = h("div", { class: "group-head" }, h("h2", {}, title), tools ? h("div", { class: "buttons" }, tools) : null);
  return h("div", { class: "group" }, head, ...children);
}

let anew = false;

/**
 * Render all that `update` shows, whether the data behind it changed or not: after a refusal a control shows what was
 * asked for, which is nowhere in the data.
 * @param {() => void} update
 */
export function renderAnew(update) {
  anew = true;
  try {
    update();
  } finally {
    anew = false;
  }
}

/** Replace the children only when the data behind them changed, so that focus and hover survive. */
export function whenChanged() {
  /** @type {string | undefined} */
  let last;
  return (/** @type {unknown} */ data, /** @type {() => void} */ render) => {
    const key = JSON.stringify(data);
    if (key === last && !anew) return;
    last = key;
    render();
  };
}

/**
 * Children of `parent` by key: those that stay keep their element, and with it focus, hover and a press in the middle.
 * make(item) builds an element once; fill(element, item) brings it up to date. Listeners read `element.item`.
 * @template Item
 * @param {HTMLElement} parent
 * @param {Item[]} items
 * @param {(item: Item) => string} keyOf
 * @param {(item: Item) => Row<Item>} make
 * @param {(element: Row<Item>, item: Item) => void} fill
 */
export function keyed(parent, items, keyOf, make, fill) {
  const children = /** @type {HTMLCollectionOf<Row<Item>>} */ (parent.children);
  const known = new Map([...children].map((element) => [element.dataset.key, element]));
  const wanted = items.map((item) => {
    const key = keyOf(item);
    const element = known.get(key) ?? make(item);
    element.dataset.key = key;
    element.item = item;
    fill(element, item);
    return element;
  });
  const focused = parent.contains(document.activeElement) ? document.activeElement : null;
  const at = [...children].findIndex((element) => element.contains(focused));
  for (const element of [...children]) if (!wanted.includes(element)) element.remove();
  wanted.forEach((element, index) => {
    // only what is elsewhere is moved: moving an element takes its focus away
    if (parent.children[index] !== element) parent.insertBefore(element, parent.children[index] ?? null);
  });
  if (!focused) return;
  const next = focused.isConnected ? focused : wanted[Math.min(at, wanted.length - 1)];
  const target = next?.matches("[tabindex], button") ? next : next?.querySelector("button:enabled");
  if (target instanceof HTMLElement) target.focus({ preventScroll: true });
}

/**
 * The choices of a list, as [value, words] pairs. Those that stay keep their element: a list that is open, or in which
 * somebody is typing, is not taken out of their hands by a redraw.
 * @param {HTMLSelectElement | HTMLOptGroupElement} list
 * @param {(readonly [string, string])[]} choices
 */
export function fillOptions(list, choices) {
  const options = list.getElementsByTagName("option");
  choices.forEach(([value, words], index) => {
    const option = options[index] ?? list.appendChild(h("option"));
    if (option.getAttribute("value") !== value) option.value = value; // without one, its words are its value
    if (option.textContent !== words) option.textContent = words;
  });
  while (options.length > choices.length) options[choices.length].remove();
}
