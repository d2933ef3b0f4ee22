// The command palette, on Ctrl K: every operation, tab, view, head, plan and place by its name.
import { note, show } from "./dialogs.js";
import { byId, h, iconButton } from "./dom.js";
import { rank } from "./fuzzy.js";
import { isFindKey } from "./keys.js";
import { keysOf } from "./shortcuts.js";
import { placeOf, placeWords } from "./slices/place-words.js";

/** @import { Connection } from "./connection.js" */
/** @import { Panel } from "./panel.js" */
/** @import { Slices } from "./slices.js" */
/** @import { Triple } from "./slices/grid.js" */
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
const PLACE = /^\s*(?:[LRPASI]\s*[-−]?\d+(?:[.,]\d*)?[\s,;]*)+(?:[LRPASI]\s*[-−]?|mm)?\s*$/iu; // as far as it is typed
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
    const heads = (state.cases?.items ?? []).filter(({ deleted }) => !deleted).map(({ id, name }) => ({
      group: "Case", name, off: id === state.case?.id ? "open now" : undefined, run: () => connection.send("case.open", { case_id: id }),
    }));
    const plans = (state.plans?.items ?? []).filter(({ deleted }) => !deleted).map(({ id, name }) => ({
      group: "Plan", name, off: id === state.plan?.id ? "open now" : undefined, run: () => connection.send("plan.open", { plan_id: id }),
    }));
    const paths = (state.paths?.items ?? []).map(({ id, name }) => ({
      group: "Path", name, off: id === state.paths?.chosen ? "chosen now" : undefined, run: () => connection.send("path.choose", { path_id: id }),
    }));
    const places = [...(state.plan?.points ?? []), ...(state.plan?.targets ?? [])].map((item) => ({
      group: placeWords(item.position), name: item.label, run: () => connection.send("item.select", { item_id: item.id }),
    }));
    const shown = this.tabs.filter(({ name }) => state.step?.offered.includes(name) && state.step.available.includes(name));
    shown.sort((a, b) => Number(b.name === here) - Number(a.name === here)); // what the tab at hand can do comes first
    const operations = [...shown.flatMap(({ name }) => this.ofPanel(name)), ...this.ofSlices()];
    return [...tabs, ...operations, ...actions(), ...paths, ...plans, ...heads, ...places];
  }

  /**
   * What a tab can do: the controls of the planner's operations by their names, and those marked as commands by their own.
   * They are pressed, or get the focus where they need more words.
   * @param {string} tab
   * @returns {Entry[]}
   */
  ofPanel(tab) {
    const panel = this.sources.panels.get(tab);
    if (!panel) return [];
    const group = this.tabs.find(({ name }) => name === tab)?.label ?? tab;
    return partsOf(panel).flatMap((part) => this.controls(part, group, (named) => this.use(tab, named)));
  }

  /** @returns {Entry[]} */
  ofSlices() {
    const slices = byId("slices");
    return this.controls(slices, "Slices", (named) => {
      const control = controlIn(slices, named);
      if (control) press(control);
    });
  }

  /**
   * @param {HTMLElement} part
   * @param {string} group
   * @param {(named: string) => void} use of the control of a selector
   * @returns {Entry[]}
   */
  controls(part, group, use) {
    const operations = this.operations.flatMap(({ type, name }) => {
      const named = `[data-operation~="${type}"]`;
      const control = controlIn(part, named);
      return control ? [{ group, name, does: type, off: whyOff(control), run: () => use(named) }] : [];
    });
    const commands = [...part.querySelectorAll("[data-command]")].map((control) => {
      const named = `[data-command="${/** @type {HTMLElement} */ (control).dataset.command}"]`;
      return { group, name: control.textContent?.trim() ?? "", off: whyOff(/** @type {HTMLElement} */ (control)), run: () => use(named) };
    });
    return [...operations, ...commands.filter(({ name }) => name)];
  }

  /**
   * Show a tab, and use a control of its panel.
   * @param {string} tab
   * @param {string} named selector of the control
   */
  async use(tab, named) {
    const { connection, panels } = this.sources;
    const go = () => {
      if (connection.state.step?.name !== tab) return; // another one was chosen meanwhile
      const control = partsOf(panels.get(tab)).map((part) => controlIn(part, named)).find(Boolean);
      if (control?.isConnected) press(control);
      else if (control) requestAnimationFrame(go); // its panel is not drawn yet
    };
    if (connection.state.step?.name === tab) {
      go();
      return;
    }
    try {
      await connection.request("step.set", { name: tab });
      requestAnimationFrame(() => requestAnimationFrame(go)); // once the panel shows the planner's values
    } catch (error) {
      note(/** @type {Error} */ (error).message, { error: true });
    }
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
   * The place that is typed, where it is one, or begins as one.
   * @param {string} typed
   * @returns {Entry[]}
   */
  place(typed) {
    const { slices, connection } = this.sources;
    if (!/\d/u.test(typed) || !connection.state.slices) return [];
    /** @type {Triple} */
    let place;
    try {
      place = placeOf(typed);
    } catch {
      const off = "R or L, A or P, S or I, in mm";
      return PLACE.test(typed) ? [{ group: "Place", name: typed, off, run: () => {} }] : [];
    }
    const run = () => {
      slices.crosshair.move(place);
      slices.centreAll();
    };
    return [{ group: "Place", name: placeWords(place), off: slices.holds(place) ? undefined : "outside the scan", run }];
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
 * @param {Panel | undefined} panel
 * @returns {HTMLElement[]}
 */
function partsOf(panel) {
  return [panel?.element, panel?.overlay].flatMap((part) => part ?? []);
}

/**
 * The control of a selector: in a list that of the row which is open or selected, else the first.
 * @param {HTMLElement} part
 * @param {string} named
 * @returns {HTMLElement | null}
 */
function controlIn(part, named) {
  return part.querySelector(`[aria-current="true"] ${named}, [aria-selected="true"] ${named}`) ?? part.querySelector(named);
}

/**
 * Why a control cannot be used; undefined where it can. Of a list's rows none is meant unless one is open or selected.
 * @param {HTMLElement} control
 */
function whyOff(control) {
  if (control.closest("[hidden]") || /** @type {Partial<HTMLButtonElement>} */ (control).disabled === true) return "not now";
  const row = control.closest("li, tbody tr");
  const isMeant = !row || control.closest('[aria-current="true"], [aria-selected="true"]') || row.querySelector(':scope > [aria-pressed="true"]');
  return isMeant ? undefined : "choose one first";
}

/**
 * Bring a control into sight and press it; what needs more words gets the focus.
 * @param {HTMLElement} control
 */
function press(control) {
  for (let folded = control.closest("details"); folded; folded = folded.parentElement?.closest("details") ?? null) folded.open = true;
  /** @type {HTMLElement | null} */ (control.closest("[popover]:not(:popover-open)"))?.showPopover();
  control.scrollIntoView({ block: "center" });
  control.focus();
  if (control instanceof HTMLButtonElement) control.click();
}
