// Lets panels be imported as the page does, by the addresses of its server, and gives them elements that they can fill.
import { register } from "node:module";
import { layOutPage, noted } from "./page.js";

const WEB = new URL("../../app/web/", import.meta.url).href, TEMPLATES = new URL("./templates.js", import.meta.url).href;
const RESOLVER = `export function resolve(name, context, next) {
  if (name.startsWith("/static/lib/lit-html/")) return next(${JSON.stringify(TEMPLATES)}, context);
  if (name.startsWith("/static/lib/uplot/")) return { url: "data:text/javascript,export default class {}", shortCircuit: true };
  return next(name.startsWith("/static/") ? ${JSON.stringify(WEB)} + name.slice("/static/".length) : name, context);
}`;
register(`data:text/javascript,${encodeURIComponent(RESOLVER)}`);

/** As much of an element as panels touch: its text is that of its children, or of what was drawn into it. */
export class FakeElement extends EventTarget {
  style = { setProperty() {} };
  hidden = false;
  attributes = new Map();
  children = [];
  text = "";

  constructor(tag) {
    super();
    this.tagName = tag.toUpperCase();
    this.className = "";
    this.classList = { toggle: (name, on) => this.mark(name, on), add: (name) => this.mark(name, true), contains: (name) => this.names.includes(name) };
  }

  get names() { return this.className.split(" ").filter(Boolean); }

  mark(name, on) { this.className = [...this.names.filter((one) => one !== name), ...(on ? [name] : [])].join(" "); }

  get textContent() { return this.text + this.children.map((child) => (child instanceof FakeElement ? child.textContent : child)).join(""); }

  set textContent(text) { Object.assign(this, { text, children: [] }); }

  get firstElementChild() { return this.children.find((child) => child instanceof FakeElement) ?? null; }

  get dataset() { return Object.fromEntries([...this.attributes].flatMap(([name, value]) => (name.startsWith("data-") ? [[name.slice(5), value]] : []))); }

  append(...children) { this.children.push(...children); }

  replaceChildren(...children) { Object.assign(this, { text: "", children }); }

  setAttribute(name, value) { this.attributes.set(name, value); }

  matches() { return false; }

  contains() { return false; }

  querySelectorAll() { return []; }

  closest() { return null; }

  querySelector() { return null; }

  scrollIntoView() {}
}

/** Lets the page's connection be a double: what the planner says is said by `tell`, what is sent to it is noted. */
export function connectionOf(state) {
  const connection = Object.assign(new EventTarget(), noted(state), { on(name, listener) { connection.addEventListener(name, ({ detail }) => listener(detail)); } });
  connection.send = (type, fields) => connection.sent.push(fields === undefined ? [type] : [type, fields]);
  connection.tell = (name, detail) => connection.dispatchEvent(new CustomEvent(name, { detail }));
  return connection;
}

/** A page with elements; `window` and `document` are globals then, as the rest that panels name. */
export function layOutElements() {
  const page = layOutPage();
  Object.assign(page.document, { createElement: (tag) => new FakeElement(tag), createElementNS: (...[, tag]) => new FakeElement(tag), documentElement: new FakeElement("html") });
  Object.assign(globalThis, { HTMLElement: FakeElement, ResizeObserver: class { observe() {} disconnect() {} }, getComputedStyle: () => ({ getPropertyValue: () => "" }) });
  return page;
}

/** Lets a document make fields that numbers are typed in; returns them by id. */
export function layOutInputs(document) {
  const inputs = new Map(), { createElement } = document;
  class FakeInput extends FakeElement {
    after_ = null;
    data = {};

    get dataset() { return this.data; }

    set id(id) { inputs.set(id, this); this.name = id; }

    get id() { return this.name; }

    getAttribute(name) { return this.attributes.get(name) ?? null; }

    removeAttribute(name) { this.attributes.delete(name); }

    after(problem) { this.after_ = problem; problem.remove = () => { this.after_ = null; }; }

    get said() { return this.after_?.textContent ?? ""; }

    typed(text) {
      this.value = text;
      this.dispatchEvent(new Event("change"));
    }

    press(key) { this.dispatchEvent(Object.assign(new Event("keydown"), { key })); }
  }
  document.createElement = (tag) => (tag === "input" ? new FakeInput(tag) : createElement(tag));
  return inputs;
}
