// The command palette, on Ctrl K: every operation, tab, view, head, plan and place by its name.
import { show } from "./dialogs.js";
import { byId, h, iconButton } from "./dom.js";
import { rank } from "./fuzzy.js";
import { isFindKey } from "./keys.js";
import { keysOf } from "./shortcuts.js";
import { placeOf, placeWords } from "./slices/place-words.js";

/** @import { Connection } from "./connection.js" */
/** @import { Panel } from "./panel.js" */
/** @import { Slices } from "./slices.js" */
/** @import { OperationEntry, TabEntry, ViewModel } from "./types.js" */

/**
 * What can be chosen. does: a name for its keys, see `shortcuts.js`. off: why not now.
 * @typedef {{ group: string, name: string, does?: string, off?: string, run: () => void }} Entry
 */

/**
 * What the palette uses of the page. actions: of the page itself, which are no operations of the planner.
 * @typedef {{ connection: Connection, slices: Slices, panels: Map<string, Panel>, actions: () => Entry[] }} Sources
 */

const MOST = 60; // entries that are listed
const NOTHING = "Nothing has that name.";

export class Palette {
  /** @param {Sources} sources */
  constructor(sources) {
    this.sources = sources;
    /** @type {OperationEntry[]} */
    this.operations = [];
    /** @type {TabEntry[]} */
    this.tabs = [];
    /** @type {Entry[]} those that fit what is typed */
    this.found = [];
    this.chosen = 0;
    this.list = h("ul", { class: "palette-list", id: "palette-list", role: "listbox", "aria-label": "Actions, heads, plans and places" });
    this.none = h("p", { class: "empty", hidden: true }, NOTHING);
    /** @type {HTMLInputElement} */
    this.input = h("input", {
      type: "text", id: "palette", role: "combobox", "aria-expanded": "true", "aria-controls": "palette-list", "aria-autocomplete": "list",
      "aria-label": "Find an action, a head, a plan or a place", placeholder: "Action, head, plan, or place: R 24 A 10 S 3", autocomplete: "off", spellcheck: false,
      oninput: () => this.search(), onkeydown: (event) => this.move(event),
    });
    this.form = h("form", { method: "dialog", class: "palette" }, this.input, this.list, this.none);
    byId("titlebar-tools").append(iconButton("find", "Find an action, head, plan or place (Ctrl+K)", () => this.open(), { id: "find" }));
  }

  /**
   * Whether the key opens the palette.
   * @param {KeyboardEvent} event
   */
  key(event) {
    if (!isFindKey(event)) return false;
    this.open();
    return true;
  }

  async open() {
    this.input.value = "";
    this.entries = this.every(this.sources.connection.state);
    this.search();
    const answer = await show(this.form, () => this.input.focus());
    if (answer === "run") this.found[this.chosen]?.run(); // after the dialog has given the focus back
  }

  /**
   * Everything that can be chosen now, the nearest at hand first.
   * @param {ViewModel} state
   * @returns {Entry[]}
   */
  every(state) {
    const { connection, actions } = this.sources;
    const here = state.step?.name;
    const tabs = this.tabs.filter(({ name }) => state.step?.offered.includes(name) && name !== here).map(({ name, label }) => ({
      group: "Go to", name: label, off: state.step?.available.includes(name) ? undefined : "not yet", run: () => connection.send("step.set", { name }),
    }));
    const heads = (state.cases?.items ?? []).filter(({ id, deleted }) => !deleted && id !== state.case?.id).map(({ id, name }) => ({
      group: "Head", name, run: () => connection.send("case.open", { case_id: id }),
    }));
    const plans = (state.plans?.items ?? []).filter(({ id, deleted }) => !deleted && id !== state.plan?.id).map(({ id, name }) => ({
      group: "Plan", name, run: () => connection.send("plan.open", { plan_id: id }),
    }));
    const paths = (state.paths?.items ?? []).filter(({ id }) => id !== state.paths?.chosen).map(({ id, name }) => ({
      group: "Path", name, run: () => connection.send("path.choose", { path_id: id }),
    }));
    const places = [...(state.plan?.points ?? []), ...(state.plan?.targets ?? [])].map((item) => ({
      group: placeWords(item.position), name: item.label, run: () => connection.send("item.select", { item_id: item.id }),
    }));
    const operations = this.operations.flatMap((operation) => this.operation(operation) ?? []);
    return [...tabs, ...operations, ...actions(), ...paths, ...plans, ...heads, ...places];
  }

  /**
   * An operation of the planner: its control on the page, which is pressed, or gets the focus where it needs more words.
   * @param {OperationEntry} operation
   * @returns {Entry | null}
   */
  operation({ type, name }) {
    for (const [tab, panel] of this.sources.panels) {
      const control = controlOf(panel, type);
      if (control) return { group: this.labelOf(tab), name, does: type, off: isOff(control) ? "not now" : undefined, run: () => this.use(tab, type) };
    }
    const control = controlIn(byId("slices"), type);
    return control && { group: "Slices", name, does: type, off: isOff(control) ? "not now" : undefined, run: () => press(control) };
  }

  /** @param {string} tab */
  labelOf(tab) {
    return this.tabs.find(({ name }) => name === tab)?.label ?? tab;
  }

  /**
   * Show the tab with the control of an operation, and use that.
   * @param {string} tab
   * @param {string} type of the operation's message
   */
  use(tab, type) {
    const { connection, panels } = this.sources;
    const go = () => {
      if (connection.state.step?.name !== tab) return; // another one was chosen meanwhile
      const panel = panels.get(tab);
      const control = panel && controlOf(panel, type);
      if (control?.isConnected) press(control);
      else if (control) requestAnimationFrame(go); // its panel is not drawn yet
    };
    if (connection.state.step?.name === tab) {
      go();
      return;
    }
    const shown = () => {
      if (connection.state.step?.name !== tab) return;
      connection.removeEventListener("state", shown);
      requestAnimationFrame(() => requestAnimationFrame(go)); // once the panel shows the planner's values
    };
    connection.addEventListener("state", shown);
    connection.send("step.set", { name: tab });
  }

  search() {
    const typed = this.input.value;
    const ranked = (this.entries ?? []).flatMap((entry) => {
      const found = rank(typed, `${entry.name} ${entry.group}`);
      return found === null ? [] : [{ entry, found }];
    });
    ranked.sort((a, b) => a.found - b.found);
    this.found = [...this.place(typed), ...ranked.map(({ entry }) => entry)].slice(0, MOST);
    this.none.hidden = this.found.length > 0;
    this.list.replaceChildren(...this.found.map((entry, index) => this.row(entry, index)));
    this.choose(0);
  }

  /**
   * The place that is typed, where it is one.
   * @param {string} typed
   * @returns {Entry[]}
   */
  place(typed) {
    const { slices, connection } = this.sources;
    if (!/[\d]/u.test(typed) || !connection.state.slices) return [];
    try {
      const place = placeOf(typed);
      const run = () => {
        slices.crosshair.move(place);
        slices.centreAll();
      };
      return [{ group: "Place", name: placeWords(place), run }];
    } catch {
      return [];
    }
  }

  /**
   * @param {Entry} entry
   * @param {number} index
   */
  row({ group, name, does, off }, index) {
    const keys = does ? keysOf(does) : "";
    return h("li", {
      id: `palette-${index}`, role: "option", "aria-disabled": String(Boolean(off)),
      onpointermove: () => this.choose(index), onclick: () => { this.choose(index); this.run(); },
    }, h("span", { class: "palette-name" }, name), h("span", { class: "palette-group" }, off ? `${group}, ${off}` : group), keys ? h("kbd", {}, keys) : null);
  }

  /** @param {number} index */
  choose(index) {
    this.chosen = index;
    this.list.querySelectorAll("li").forEach((row, number) => row.setAttribute("aria-selected", String(number === index)));
    const row = this.list.children[index];
    if (row) this.input.setAttribute("aria-activedescendant", row.id);
    else this.input.removeAttribute("aria-activedescendant");
    row?.scrollIntoView?.({ block: "nearest" });
  }

  /** @param {KeyboardEvent} event */
  move(event) {
    const count = this.found.length;
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (step && count) this.choose((this.chosen + step + count) % count);
    else if (event.key === "Enter") this.run();
    else return;
    event.preventDefault();
  }

  run() {
    const entry = this.found[this.chosen];
    if (entry && !entry.off) /** @type {HTMLDialogElement} */ (byId("dialog")).close("run");
  }
}

/**
 * @param {Panel} panel
 * @param {string} type
 */
function controlOf({ element, overlay }, type) {
  return controlIn(element, type) ?? (overlay ? controlIn(overlay, type) : null);
}

/**
 * The control of an operation: of a list that of the row which is open, else the first.
 * @param {HTMLElement} part
 * @param {string} type
 * @returns {HTMLElement | null}
 */
function controlIn(part, type) {
  const named = `[data-operation~="${type}"]`;
  return part.querySelector(`[aria-current="true"] ${named}, [aria-selected="true"] ${named}`) ?? part.querySelector(named);
}

/**
 * Bring a control into sight and press it; what needs more words gets the focus.
 * @param {HTMLElement} control
 */
function press(control) {
  for (let folded = control.closest("details"); folded; folded = folded.parentElement?.closest("details") ?? null) folded.open = true;
  control.scrollIntoView({ block: "center" });
  control.focus();
  if (control instanceof HTMLButtonElement) control.click();
}

/** @param {HTMLElement} control */
function isOff(control) {
  if (control.closest("[hidden]")) return true;
  return /** @type {Partial<HTMLButtonElement>} */ (control).disabled === true;
}
