// Every text of the page's modules and of index.html, by its kind: `node tests/web/page-texts.js` lists them.
// The modules are parsed. A string is a text unless its place says that it is none, so that none is missed silently.
import { readFileSync, readdirSync } from "node:fs";
import { dirname, join, relative } from "node:path";
import { fileURLToPath } from "node:url";
import { KEYS, parse } from "./page-syntax.js";
import { countWords, brief } from "../../app/web/js/brief.js";

export const ROOT = join(dirname(fileURLToPath(import.meta.url)), "../..");

/** Words that a kind may have; 'said' is cut by `brief`, with the rest behind ‘?’; what is not here is free. */
export const LIMITS = { button: 3, verdict: 8, hint: 12, said: 12 };

/** @typedef {{ file: string, line: number, kind: string, text: string, words: number }} PageText */

// what a module's own constant or function is, where another module shows it
const ELSEWHERE = {
  "app/web/js/dom.js": { ICONS: "none" }, // paths of SVG
  "app/web/js/endoscope/shaders.js": Object.fromEntries(["TISSUE_VERTEX", "COMMON", "LEAN", "FULL", "TISSUE_FRAGMENT", "LINE_VERTEX", "RING_VERTEX", "INK_FRAGMENT", "RING_FRAGMENT", "TICK_FRAGMENT", "BALL_VERTEX", "BALL_FRAGMENT", "FLAT_VERTEX", "FLAT_FRAGMENT"].map((name) => [name, "none"])),
  "app/web/js/scene-layer/tool-window.js": { DECLARED: "none", DITHERED: "none" }, // of a shader
  "app/web/js/connection.js": { REFUSALS: "said", LOCKED: "said", GONE: "said" }, // by the banner
  "app/web/js/used-registration.js": { DRIVEN: "said" },
  "app/tabs/register/calibration.js": { NO_TIP: "said", NO_ROBOT: "said" }, // by Tool
  "app/tabs/patient/files-in.js": { refusal: "said" }, // by `note`, behind the name of the file
};

const HOLE = "□"; // a value that only the page knows: one word
const MOST_ALTERNATIVES = 200;

// what a property, an attribute or an argument is that is never read by a person
const TECHNICAL = new Set(["class", "className", "id", "type", "role", "for", "list", "d", "style", "name", "value", "href", "src", "accept", "autocomplete",
  "inputMode", "viewBox", "transform", "cssText", "font", "key", "tag", "selector", "rel", "target", "download", "method", "fill", "stroke", "points", "operation", "tool"]);
const TEXT_ATTRIBUTES = new Set(["title", "aria-label", "placeholder", "alt", "aria-description", "aria-valuetext", "aria-roledescription", "label"]);
const QUERIES = new Set(["querySelector", "querySelectorAll", "closest", "matches", "getElementById", "byId", "addEventListener", "removeEventListener", "add",
  "remove", "toggle", "contains", "import", "getItem", "setItem", "send", "request"]);
// functions of the page whose argument is shown: which one, and as what
const SHOWN = { note: { 0: "said" }, noteDone: { 1: "said" }, noteEdit: { 3: "said" }, whenReady: { 0: "said", 1: "button" }, say: { 1: "said" }, said: { 0: "said" }, line: { 0: "said" },
  brief: { 0: "said" }, Error: { 0: "said" }, TypeError: { 0: "said" }, PlannerError: { 0: "said" }, complain: { 1: "said" }, help: { 0: "help" },
  confirm: { 0: "hint", 1: "help", 2: "button" }, askChoices: { 0: "hint", 1: "help", 3: "button" }, askName: { 0: "hint", 2: "button" }, hintLine: { 1: "hint", 2: "help" }, helpText: { 0: "none", 1: "help" } };
const INLINE = new Set(["b", "strong", "em", "i", "code", "kbd", "span", "a", "sub", "sup", "abbr"]);
const TAG_KINDS = { button: "button", title: "none" };

/** @returns {PageText[]} */
export function pageTexts() {
  const files = ["app/tabs", "app/web/js"].flatMap((folder) => modules(join(ROOT, folder)));
  const index = join(ROOT, "app/web/index.html");
  const texts = textsOfAll(files.map((file) => [readFileSync(file, "utf-8"), relative(ROOT, file)]));
  return [...texts, ...markup(readFileSync(index, "utf-8"), "hint").map((found) => finish("app/web/index.html", found.line, found.kind, found.text))];
}

/** @param {string} folder @returns {string[]} */
function modules(folder) {
  return readdirSync(folder, { withFileTypes: true }).flatMap((entry) => {
    const path = join(folder, entry.name);
    return entry.isDirectory() ? modules(path) : /\.(js|mjs)$/u.test(entry.name) ? [path] : [];
  }).sort();
}

/** @param {string} file @param {number} line @param {string} kind @param {string} text @returns {PageText} */
function finish(file, line, kind, text) {
  const shown = text.replace(/\s+/gu, " ").trim();
  return { file, line, kind, text: shown, words: countWords(kind === "said" ? brief(shown) : shown) };
}

/**
 * The texts of one module.
 * @param {string} source
 * @param {string} file
 */
export function textsOf(source, file) {
  return textsOfAll([[source, file]]);
}

/** @param {[string, string][]} sources and the names of their modules */
function textsOfAll(sources) {
  const parsed = sources.map(([source, file]) => /** @type {const} */ ([parse(source), file]));
  /** @type {Map<string, Set<string>>} */
  let calls = new Map();
  /** @type {Module[]} */
  let read = [];
  for (let round = 0; round < 4; round += 1) { // what a function says may be what another one says
    read = parsed.map(([program, file]) => new Module(program, file, calls));
    calls = new Map();
    for (const { calling } of read) for (const [name, kinds] of calling) calls.set(name, new Set([...calls.get(name) ?? [], ...kinds]));
  }
  return [...new Map(read.flatMap(({ texts }) => texts).map((text) => [JSON.stringify(text), text])).values()];
}

class Module {
  /** @param {any} program @param {string} file @param {Map<string, Set<string>>} calls */
  constructor(program, file, calls) {
    this.file = file;
    this.calls = calls; // the kinds as which each function is called, by its name
    /** @type {Map<string, Set<string>>} */
    this.calling = new Map();
    /** @type {PageText[]} */
    this.texts = [];
    /** @type {Map<string, any>} */
    this.constants = new Map();
    /** @type {Set<string>} constants that were met where they are shown */
    this.met = new Set();
    this.depth = 0; // of constants that are made of others
    this.elsewhere = /** @type {Record<string, Record<string, string>>} */ (ELSEWHERE)[file] ?? {};
    findConstants(program, this.constants);
    this.visit(program, "hint");
    for (const [name, init] of this.constants) if (isShown(init) && !this.met.has(name)) this.show(init, this.elsewhere[name] ?? "hint");
  }

  /** How a module's own constant is used decides what it is. @param {any} declarator @param {string} kind */
  declared({ id, init }, kind) {
    if (!(init && isShown(init) && this.constants.get(id.name) === init)) this.visit(init, this.elsewhere[id.name] ?? kind);
  }

  /** @param {any} node @param {string} kind */
  visit(node, kind) {
    if (!node || kind === "none") {
      // not shown
    } else if (Array.isArray(node)) node.forEach((each) => this.visit(each, kind));
    else if (node.type.startsWith("Import") || node.type === "ExportAllDeclaration") this.visit(null, "none");
    else if (isTextual(node)) this.record(node, kind);
    else if (node.type === "TaggedTemplateExpression") this.template(node, kind);
    else if (node.type === "CallExpression" || node.type === "NewExpression") this.call(node, kind);
    else if (node.type === "AssignmentExpression") this.visit(node.right, this.assigned(node.left, kind));
    else if (node.type === "Property" || node.type === "PropertyDefinition") this.visit(node.value, property(nameOf(node.key), kind));
    else if (node.type === "BinaryExpression" && /^[=!]==?$|^in$/u.test(node.operator)) this.visit([node.left, node.right].filter((side) => !isTextual(side)), kind);
    else if (node.type === "SwitchCase") this.visit(node.consequent, "hint");
    else if (node.type === "MemberExpression") this.visit(node.object.type === "Identifier" ? null : node.object, kind);
    else if (node.type === "VariableDeclarator") this.declared(node, kind);
    else if (node.type === "UnaryExpression" && node.argument.type === "CallExpression") this.visit(node.argument.arguments, "hint");
    else if (node.type === "Identifier") this.used(node.name, kind);
    else if (isFunction(node)) for (const key of KEYS[node.type]) this.visit(node[key], this.returned(node, kind));
    else for (const key of KEYS[node.type] ?? []) this.visit(node[key], kind);
  }

  /** @param {string} name @param {string} kind */
  used(name, kind) {
    const known = this.constants.get(name);
    if (!known || !isShown(known) || name in this.elsewhere) return;
    this.met.add(name);
    if (this.depth > 8) return;
    this.depth += 1;
    this.show(known, kind);
    this.depth -= 1;
  }

  /** @param {any} node a text or a template @param {string} kind */
  show(node, kind) {
    if (kind === "none") return;
    if (isTextual(node)) this.record(node, kind);
    else this.template(node, kind);
  }

  /** What a function returns is: 'said' or 'help', where each call of it shows it as that, else outer. @param {any} node @param {string} outer */
  returned({ id }, outer) {
    const kinds = [...this.elsewhere[id?.name] ? [this.elsewhere[id.name]] : this.calls.get(id?.name) ?? []];
    const [kind] = kinds.length === 1 ? kinds : [outer];
    return ["help", "said"].includes(kind) ? kind : "hint";
  }

  /** What stands in one place: each of its alternatives. @param {any} node @param {string} kind */
  record(node, kind) {
    const alternatives = new Set(this.alternatives(node));
    for (const text of alternatives) {
      if (/\p{L}/u.test(text.replaceAll(HOLE, ""))) this.texts.push(finish(this.file, node.loc.start.line, kind, text));
    }
    this.holes(node, kind);
  }

  /** The strings that an expression may be; a part that is not known is one word. @param {any} node @param {number} [depth] @returns {string[]} */
  alternatives(node, depth = 0) {
    if (!node) return [""];
    if (node.type === "Literal") return [typeof node.value === "string" ? node.value : String(node.value ?? "")];
    if (node.type === "ConditionalExpression") return [...this.alternatives(node.consequent, depth), ...this.alternatives(node.alternate, depth)];
    if (node.type === "LogicalExpression") return [...(node.operator === "&&" ? [""] : this.alternatives(node.left, depth)), ...this.alternatives(node.right, depth)];
    if (node.type === "BinaryExpression" && node.operator === "+") return product([this.alternatives(node.left, depth), this.alternatives(node.right, depth)]);
    if (node.type === "TemplateLiteral") {
      return product(node.quasis.flatMap((/** @type {any} */ quasi, /** @type {number} */ at) => [[quasi.value.cooked], ...(at < node.expressions.length ? [this.alternatives(node.expressions[at], depth)] : [])]));
    }
    const known = node.type === "Identifier" && depth < 4 ? this.constants.get(node.name) : undefined;
    if (!known || !isTextual(known)) return [HOLE];
    this.met.add(node.name);
    return this.alternatives(known, depth + 1);
  }

  /** What is called or chosen within a text has texts of its own. @param {any} node @param {string} kind */
  holes(node, kind) {
    if (!node || node.type === "Literal") return;
    if (node.type === "ConditionalExpression") this.visit(node.test, "hint");
    for (const part of [...(node.expressions ?? []), node.left, node.right, node.consequent, node.alternate]) {
      if (!part) continue;
      if (isTextual(part)) this.holes(part, kind);
      else this.visit(part, kind);
    }
  }

  /** @param {any} node @param {string} kind */
  call(node, kind) {
    const { callee, arguments: args } = node;
    const name = nameOf(callee.type === "MemberExpression" ? callee.property : callee);
    if (callee.type === "MemberExpression") this.visit(callee.object.type === "Identifier" ? null : callee.object, kind);
    else this.calling.set(name, (this.calling.get(name) ?? new Set()).add(kind));
    if ((name === "h" || name === "svg") && callee.type === "Identifier") this.element(args, kind);
    else if (name === "setAttribute") this.visit(args[1], property(String(args[0]?.value), this.assigned(callee, "hint")));
    else if (name === "iconButton" || name === "iconTool") this.visit(args.slice(1), "hint");
    else if (name in SHOWN) args.forEach((/** @type {any} */ each, /** @type {number} */ at) => this.visit(each, /** @type {any} */ (SHOWN)[name][at] ?? "hint"));
    else if (QUERIES.has(name)) this.visit(args.filter((/** @type {any} */ each) => !isTextual(each)), "hint");
    else this.visit(args, kind);
  }

  /** An element made by `h`: its strings and those of the words within it are one text. @param {any[]} args @param {string} kind */
  element([tag, props, ...children], kind) {
    const classes = props?.type === "ObjectExpression" ? props.properties.find((/** @type {any} */ each) => each.key && nameOf(each.key) === "class")?.value.value ?? "" : "";
    const inner = kindOf(String(tag?.value), String(classes), kind);
    this.visit(props, inner === "button" ? "hint" : inner);
    const flat = children.flatMap((/** @type {any} */ child) => (child.type === "ArrayExpression" ? child.elements : [child]));
    const texts = flat.filter((child) => child && isTextual(child));
    if (texts.length > 1) for (const text of new Set(product(texts.map((each) => this.alternatives(each))))) this.texts.push(finish(this.file, tag.loc.start.line, inner, text));
    if (texts.length > 1) texts.forEach((each) => this.holes(each, inner));
    this.visit(texts.length > 1 ? flat.filter((child) => !texts.includes(child)) : flat, inner);
  }

  /** A template of lit-html. @param {any} node @param {string} kind */
  template({ tag, quasi, loc }, kind) {
    if (!["html", "svg"].includes(nameOf(tag))) {
      this.visit(quasi, kind);
      return;
    }
    const source = quasi.quasis.map((/** @type {any} */ each, /** @type {number} */ at) => each.value.cooked + (at < quasi.expressions.length ? `⟦${at}⟧` : "")).join("");
    const placed = new Map();
    for (const found of markup(source, kind, placed)) {
      const pieces = found.text.split(/⟦(\d+)⟧/u).map((piece, at) => (at % 2 ? this.alternatives(quasi.expressions[Number(piece)]) : [piece]));
      for (const text of new Set(product(pieces))) {
        if (/\p{L}/u.test(text.replaceAll(HOLE, ""))) this.texts.push(finish(this.file, loc.start.line + found.line - 1, found.kind, text));
      }
    }
    quasi.expressions.forEach((/** @type {any} */ each, /** @type {number} */ at) => (isTextual(each) ? this.holes(each, placed.get(at) ?? "hint") : this.visit(each, placed.get(at) ?? "hint")));
  }

  /** What something shown is, by what it is assigned to. @param {any} left @param {string} kind */
  assigned(left, kind) {
    const name = left.type === "MemberExpression" ? nameOf(left.property) : "";
    if (name === "textContent" && /(button|Button)$/u.test(nameOf(left.object.type === "MemberExpression" ? left.object.property : left.object))) return "button";
    return property(name, kind);
  }
}

/** What a name of a module stands for, where that is one thing. @param {any} node @param {Map<string, any>} constants @param {Set<string>} [twice] */
function findConstants(node, constants, twice = new Set()) {
  if (Array.isArray(node)) node.forEach((each) => findConstants(each, constants, twice));
  if (!node?.type) return;
  for (const name of isFunction(node) ? names(node.params) : []) { // it may stand for another thing there
    constants.delete(name);
    twice.add(name);
  }
  if (node.type === "VariableDeclaration") {
    for (const { id, init } of node.declarations) {
      if (node.kind === "const" && init && !constants.has(id.name) && !twice.has(id.name)) constants.set(id.name, init);
      else constants.delete(id.name);
      twice.add(id.name);
    }
  }
  for (const key of KEYS[node.type] ?? []) findConstants(node[key], constants, twice);
}

/** @param {any} node @returns {string[]} the names within parameters */
function names(node) {
  if (Array.isArray(node)) return node.flatMap(names);
  if (!node?.type) return [];
  return node.type === "Identifier" ? [node.name] : (KEYS[node.type] ?? []).flatMap((key) => names(node[key]));
}

/** @param {any} node @returns {boolean} whether it is made of strings */
function isTextual(node) {
  if (node.type === "Literal") return typeof node.value === "string";
  if (node.type === "TemplateLiteral") return true;
  if (node.type === "BinaryExpression") return node.operator === "+" && (isTextual(node.left) || isTextual(node.right));
  if (node.type === "ConditionalExpression") return isTextual(node.consequent) || isTextual(node.alternate);
  return node.type === "LogicalExpression" && isTextual(node.right);
}

/** @param {any} node whether it is a text or a template of lit-html */
function isShown(node) {
  return isTextual(node) || node.type === "TaggedTemplateExpression";
}

/** @param {any} node */
function isFunction(node) {
  return ["FunctionDeclaration", "FunctionExpression", "ArrowFunctionExpression"].includes(node.type);
}

/** @param {any} node @returns {string} */
function nameOf(node) {
  return node?.name ?? String(node?.value ?? "");
}

/** @param {string} name @param {string} kind */
function property(name, kind) {
  if (TEXT_ATTRIBUTES.has(name)) return kind === "none" ? "hint" : kind === "button" ? "hint" : kind;
  return TECHNICAL.has(name) || name.startsWith("data-") ? "none" : kind;
}

/** @param {string} tag @param {string} classes @param {string} outer */
function kindOf(tag, classes, outer) {
  if (/\bhelp\b/u.test(classes)) return "help";
  if (/\b(row|chip|place|order|card|alternative)(-main)?\b/u.test(classes)) return "hint"; // a button with what it stands for, not with what it does
  return /** @type {Record<string, string>} */ (TAG_KINDS)[tag] ?? outer;
}

/** @param {string[][]} parts */
function product(parts) {
  let made = [""];
  for (const part of parts) {
    const options = made.length * part.length > MOST_ALTERNATIVES ? [part.reduce((most, each) => (countWords(each) > countWords(most) ? each : most))] : part;
    made = made.flatMap((begun) => options.map((option) => begun + option));
  }
  return made;
}

/**
 * The texts of markup: attributes that are read, and what stands in an element with the words in its inline elements.
 * @param {string} source ⟦n⟧ is the nth hole
 * @param {string} outer kind
 * @param {Map<number, string>} [placed] gets the kind of each hole
 */
function markup(source, outer, placed = new Map()) {
  /** @type {{ kind: string, text: string, line: number }[]} */
  const found = [];
  const stack = [{ tag: "", kind: outer, text: "", line: 1 }];
  const put = (/** @type {string} */ text, /** @type {string} */ kind) => { for (const [, at] of text.matchAll(/⟦(\d+)⟧/gu)) placed.set(Number(at), kind); };
  const close = () => {
    const { text, kind, line, tag } = /** @type {any} */ (stack.pop());
    if (INLINE.has(tag) && stack.length && stack.at(-1)?.kind === kind) /** @type {any} */ (stack.at(-1)).text += text;
    else if (text.trim()) found.push({ kind, text, line });
  };
  let at = 0;
  let line = 1;
  for (const match of source.matchAll(/<!--.*?-->|<!doctype[^>]*>|<(\/?)([a-z][\w-]*)((?:\s+[^\s=>]+(?:=(?:"[^"]*"|⟦\d+⟧|[^\s">]+))?)*)\s*\/?>/gisu)) {
    const before = source.slice(at, match.index);
    /** @type {any} */ (stack.at(-1)).text += before;
    put(before, /** @type {any} */ (stack.at(-1)).kind);
    line += before.split("\n").length - 1;
    const [whole, slash, tag, attributes] = match;
    if (tag && slash) while (stack.length > 1) { const done = stack.at(-1)?.tag === tag; close(); if (done) break; }
    if (tag && !slash) {
      const classes = /\sclass="([^"]*)"/u.exec(attributes)?.[1] ?? "";
      const kind = kindOf(tag, classes, /** @type {any} */ (stack.at(-1)).kind);
      for (const [, name, quoted, bare] of attributes.matchAll(/\s([.?@]?[\w-]+)=(?:"([^"]*)"|(⟦\d+⟧|[^\s">]+))/gu)) {
        const value = quoted ?? bare;
        const plain = name.replace(/^\./u, "");
        const as = TEXT_ATTRIBUTES.has(plain) ? (kind === "button" ? "hint" : kind) : plain === "textContent" ? kind : name.startsWith("@") ? "hint" : "none";
        put(value, as);
        if (as !== "none" && !name.startsWith("@")) found.push({ kind: as, text: value, line });
      }
      if (!/\/>$/u.test(whole) && !["input", "br", "img", "link", "meta", "hr"].includes(tag)) stack.push({ tag, kind: ["script", "style"].includes(tag) ? "none" : kind, text: "", line });
    }
    line += whole.split("\n").length - 1;
    at = match.index + whole.length;
  }
  /** @type {any} */ (stack.at(-1)).text += source.slice(at);
  put(source.slice(at), /** @type {any} */ (stack.at(-1)).kind);
  while (stack.length) close();
  return found.filter(({ kind, text }) => kind !== "none" && (/\p{L}/u.test(text.replace(/⟦\d+⟧/gu, "")) || text.includes("⟦")));
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const texts = pageTexts();
  const long = process.argv.includes("--long");
  for (const { file, line, kind, words, text } of texts) {
    if (!long || words > (/** @type {Record<string, number>} */ (LIMITS)[kind] ?? Infinity)) console.log(`${file}:${line} ${kind} ${words} ${text}`);
  }
  const all = texts.reduce((sum, { text }) => sum + countWords(text), 0);
  const seen = texts.reduce((sum, { kind, words }) => sum + (kind === "help" ? 0 : words), 0);
  const over = texts.filter(({ kind, words }) => words > (/** @type {Record<string, number>} */ (LIMITS)[kind] ?? Infinity)).length;
  console.log(`${texts.length} texts of ${all} words, ${seen} of them in sight, ${over} past their limit`);
}
