// Roving focus: one tab stop among controls in sight, and the keys that go from one to the other.
import assert from "node:assert/strict";
import { test } from "node:test";
import { layOutPage } from "./page.js";

const { document } = layOutPage();
const sizes = [];
Object.assign(globalThis, { ResizeObserver: class { constructor(changed) { sizes.push(changed); } observe() {} } });
const { Roving, rowStep } = await import("../../app/web/js/roving.js");

/** Controls, each `row name`, of an element that shows those that are not in `hidden`. */
function list(names, options, { hidden = [], disabled = [] } = {}) {
  const controls = names.map((name) => ({
    name, tabIndex: 0,
    matches: (selector) => (selector === ":disabled" ? disabled.includes(name) : selector === `#${name}`),
    checkVisibility: () => !hidden.includes(name),
    closest: () => name[0],
    focus() { document.activeElement = this; },
  }));
  const element = Object.assign(new EventTarget(), { querySelectorAll: () => controls });
  const roving = new Roving(/** @type {any} */ (element), "button", options);
  const press = (key) => {
    const event = Object.assign(new Event("keydown", { cancelable: true }), { key });
    Object.defineProperty(event, "target", { value: document.activeElement });
    roving.key(/** @type {any} */ (event));
    roving.update();
    return [document.activeElement.name, event.defaultPrevented];
  };
  return { roving, hidden, disabled, press, focus: (name) => controls.find((one) => one.name === name)?.focus(), stops: () => controls.filter(({ tabIndex }) => tabIndex === 0).map(({ name }) => name) };
}

test("one of the controls is the tab stop, and arrow keys pass over what is out of sight or disabled", () => {
  document.activeElement = null;
  const { roving, press, focus, stops } = list(["a", "b", "c", "d", "e"], {}, { hidden: ["a", "c"], disabled: ["d"] });
  roving.update();
  assert.deepEqual(stops().filter((name) => !["a", "c", "d"].includes(name)), ["b"]); // nobody can reach the others
  focus("b");
  assert.deepEqual(press("ArrowDown"), ["e", true]);
  assert.deepEqual(press("ArrowDown"), ["e", true]);
  assert.deepEqual(press("Home"), ["b", true]);
  assert.deepEqual(press("ArrowRight"), ["b", false]);
});

test("what comes into sight later has its tab stop among what is seen", () => {
  document.activeElement = null;
  const hidden = ["a", "b", "c"];
  const { roving, stops } = list(["a", "b", "c"], { first: "#c" }, { hidden });
  roving.update();
  assert.deepEqual(stops(), ["c"]); // none is drawn yet
  hidden.splice(0, 3, "c");
  sizes.at(-1)();
  assert.ok(stops().includes("a") && !stops().includes("b"));
});

test("of rows with several controls, up and down go from row to row, left and right within one", () => {
  const { press, focus } = list(["1a", "1b", "1c", "2a", "3a", "3b", "3c"], { row: "li" }, { hidden: ["3b"] });
  focus("1a");
  assert.deepEqual(press("ArrowLeft"), ["1a", true]);
  assert.equal(press("ArrowRight")[0], "1b");
  assert.equal(press("ArrowRight")[0], "1c");
  assert.equal(press("ArrowRight")[0], "1c");
  assert.equal(press("ArrowDown")[0], "2a"); // which has no more
  assert.equal(press("End")[0], "3a");
  assert.equal(press("ArrowRight")[0], "3c");
  assert.equal(press("Home")[0], "1b");
});

test("an arrow down leads to the row below, and to its last control where that row is shorter", () => {
  const down = (/** @type {number} */ at) => rowStep(at, 1, 5, 3); // three above two
  assert.deepEqual([0, 1, 2, 3, 4].map(down), [3, 4, 4, 3, 4]);
  assert.deepEqual([0, 2, 3, 4].map((at) => rowStep(at, -1, 5, 3)), [0, 2, 0, 1]);
  assert.equal(rowStep(1, 1, 2, 2), 1, "the only row");
});
