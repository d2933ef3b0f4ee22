// Every text of the page's modules and of index.html is within the limit of its kind; tests/test_page_words.py has the
// planner's. Free are what stands behind ‘?’, the bodies of dialogs, and names that the user gave.
import assert from "node:assert/strict";
import { test } from "node:test";
import { brief, countWords, inTwo } from "../../app/web/js/brief.js";
import { LIMITS, pageTexts, textsOf } from "./page-texts.js";

// what is still to be shortened, by where it stands: how many texts are past their limit at most, and why. It may only shrink.
/** @type {[string, number, string][]} */
const EXCEPTIONS = [
  ["app/tabs/plan/clearance.js", 4, "being rewritten, as all of these"],
  ["app/tabs/plan/instruments.js", 3, ""],
  ["app/tabs/plan/regions.js", 3, ""],
  ["app/tabs/plan/shaft.js", 3, ""],
  ["app/web/js/clearance-words.js", 15, ""],
];
const EXCEPTED_WORDS = ["app/tabs/plan/regions.js", "app/tabs/plan/paths.js"];

const TEXTS = pageTexts();

const over = (/** @type {import("./page-texts.js").PageText} */ { kind, words }) => words > (/** @type {Record<string, number>} */ (LIMITS)[kind] ?? Infinity);

test("no text of the page is past the limit of its kind", () => {
  assert.ok(TEXTS.length > 1000, "the modules were read");
  const long = TEXTS.filter(over);
  const told = (/** @type {typeof long} */ found) => found.map(({ file, line, kind, words, text }) => `${file}:${line} ${kind} of ${words}: ${text}`).join("\n");
  for (const [place, most] of EXCEPTIONS) {
    const there = long.filter(({ file }) => file.startsWith(place));
    assert.ok(there.length <= most, told(there));
  }
  assert.equal(told(long.filter(({ file }) => !EXCEPTIONS.some(([place]) => file.startsWith(place)))), "");
});

test("no text of the page has a word that a surgeon does not know", () => {
  const unknown = TEXTS.filter(({ file, text }) => !EXCEPTED_WORDS.some((place) => file.startsWith(place)) && /\b(driven dry|not said|to spare|dry runs?)\b/iu.test(text));
  assert.deepEqual(unknown, []);
});

/* eslint no-template-curly-in-string: "off" -- the sources below have templates */
test("a text is found wherever it stands, with its kind", () => {
  const of = (/** @type {string} */ source) => textsOf(source, "x.js").map(({ kind, text }) => `${kind}: ${text}`);
  assert.deepEqual(of('h("button", { type: "button", title: "Why it is" }, "Press this big thing");'), ["hint: Why it is", "button: Press this big thing"]);
  assert.deepEqual(of('words.textContent = a ? "One of two" : `Two of ${n} and ${b ? "more of them" : "less"}`;'),
    ["hint: One of two", "hint: Two of □ and more of them", "hint: Two of □ and less"]);
  assert.deepEqual(of('const A = "In sight"; const t = html`<p class="words" title="${A}">A <b>bold</b> word</p><button @click=${() => note("Done at last")}>Do it</button>`;'),
    ["hint: In sight", "hint: A bold word", "button: Do it", "said: Done at last"]);
  assert.deepEqual(of('const LONG = "Never shown anywhere";'), ["hint: Never shown anywhere"], "what nobody shows here may be shown elsewhere");
  assert.deepEqual(of('say(x, words(1)); function words(n) { return n ? "A short one" : "Another one"; }'), ["said: A short one", "said: Another one"]);
  assert.deepEqual(of('say(x, words(1)); y.title = words(2); function words() { return "Shown in two ways"; }'), ["hint: Shown in two ways"]);
  assert.deepEqual(of('function f() { throw new Error("It did " + "not work"); }'), ["said: It did not work"]);
});

test("a text begins with a dozen words, and the rest of it stands behind ‘?’", () => {
  assert.equal(countWords("3 mm · bone … 0.55"), 4);
  assert.deepEqual(inTwo("Locked. Unlock it first."), ["Locked. Unlock it first.", ""]);
  assert.deepEqual(inTwo("Images can identify the patient. An export that holds them asks first, each time."),
    ["Images can identify the patient.", "An export that holds them asks first, each time."]);
  assert.deepEqual(inTwo("the points of both tables lie in different frames; measure all of them in one way."),
    ["the points of both tables lie in different frames.", "Measure all of them in one way."]);
  assert.deepEqual(inTwo("Bone may lie 0.08 mm off its surface (0.08 mm: surface thinned or smoothed, added to the margin)."),
    ["Bone may lie 0.08 mm off its surface.", "(0.08 mm: surface thinned or smoothed, added to the margin)."]);
  assert.equal(brief("one two three four five six seven eight nine ten eleven twelve thirteen."), "one two three four five six seven eight nine ten eleven twelve thirteen.");
});
