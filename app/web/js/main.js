// Wires the page: one connection, and parts that draw what it says.
import { Connection } from "./connection.js";
import { barWord, byId, h, renderAnew, whenChanged } from "./dom.js";
import { clearErrors, note } from "./dialogs.js";
import { EndoscopeView } from "./endoscope/view.js";
import { FirstTask } from "./first-task.js";
import { pacing } from "./frame-pacing.js";
import { Help } from "./help.js";
import { HintLine } from "./hint-line.js";
import { jobWatch } from "./jobs.js";
import { Keys, letGoOfEverything } from "./keys.js";
import { Layouts } from "./layout.js";
import { chooseStudy, fixedLayout, followStudy } from "./led-study.js";
import { LoopFigures } from "./loop-figures.js";
import { Palette } from "./palette.js";
import { loadPanel } from "./panel.js";
import { say } from "./said.js";
import { SceneFrame } from "./scene.js";
import { SceneLook } from "./scene-look.js";
import { Slices } from "./slices.js";
import { StatusBar } from "./status.js";
import { Theme } from "./theme.js";
import { VerdictCard } from "./verdict-card.js";

/** @import { Link } from "./connection.js" */
/** @import { Panel } from "./panel.js" */
/** @import { TabEntry, ViewModel } from "./types.js" */

class Page {
  constructor() {
    this.connection = new Connection();
    this.keys = new Keys(this.connection);
    /** @type {Map<string, Panel>} by the name of its step */
    this.panels = new Map();
    /** @type {HTMLButtonElement[]} */
    this.steps = [];
    this.layouts = new Layouts(byId("bench"));
    this.theme = new Theme();
    this.scene = new SceneFrame(this.connection, this.keys);
    this.look = new SceneLook(this.connection, (view) => this.scene.look(view), this.scene.follower, this.scene.window);
    this.firstTask = new FirstTask();
    this.hint = new HintLine(this.connection);
    this.help = new Help(() => this.firstTask.again(), () => this.palette.tabs.find(({ name }) => name === this.connection.state.step?.name)?.label);
    this.slices = new Slices(byId("slices"), this.connection);
    this.endoscope = new EndoscopeView(byId("endoscope"), this.connection, { planned: () => this.slices.poses, swap: () => this.layouts.swapEndoscope(), keys: this.keys });
    this.status = new StatusBar(byId("statusbar"));
    this.figures = new LoopFigures();
    this.card = new VerdictCard(this.connection);
    this.palette = new Palette({ connection: this.connection, slices: this.slices, panels: this.panels, actions: () => this.actions() });
    byId("find").append(barWord("Find"));
    this.keys.shortcuts.push((event) => this.palette.key(event), (event) => this.help.key(event), (event) => this.layouts.key(event), (event) => this.scene.key(event));
    /** @type {HTMLElement | null | undefined} what had the focus when the line was lost */
    this.focused = null;
    this.planned = false;
    this.anew = false; // something was refused or undone since the panel was last drawn: its controls may show it still
    this.changedTabs = whenChanged();
    this.changedTitle = whenChanged();
    this.changedPlace = whenChanged();
    this.connection.on("hello", ({ steps, operations }) => {
      this.palette.operations = operations;
      this.palette.tabs = steps;
      this.changedTabs([steps], () => this.offer(steps));
    });
    jobWatch.follow(this.connection);
    followStudy(this.connection);
    this.connection.on("state", () => this.schedule());
    this.connection.on("link", (link) => this.link(link));
    for (const name of /** @type {("refused" | "anew")[]} */ (["refused", "anew"])) {
      this.connection.on(name, () => {
        this.anew = true;
        this.schedule();
      });
    }
    this.connection.on("note", ({ words, error }) => note(words, { error }));
    byId("retry").addEventListener("click", () => this.connection.open());
    byId("where-plan").addEventListener("click", () => { if (this.connection.state.step?.name !== "plan") this.palette.use("plan", "#plans"); }); // in Plan it opens the list itself
    this.connection.open();
    this.scene.open();
  }

  /**
   * A tab for each step of the planner, and its panel as soon as it is there.
   * @param {TabEntry[]} steps
   */
  offer(steps) {
    this.panels.clear();
    this.steps = steps.map(({ name, label }) => h("button", { type: "button", "data-step": name, onclick: () => this.connection.send("step.set", { name }) }, label));
    byId("steps").replaceChildren(...this.steps);
    for (const step of steps) this.load(step);
  }

  /** What the page itself can do, for the palette. */
  actions() {
    const { layouts, theme, help, figures, look } = this;
    return [
      ...layouts.actions(),
      ...look.actions(),
      { group: "Page", name: "Open study …", run: () => chooseStudy(this.connection) },
      { group: "Page", name: theme.words, run: () => theme.turn() },
      { group: "Page", name: "Keys and first steps", does: "help", run: () => help.open() },
      { group: "Page", name: "Figures of the control loop", run: () => { figures.show(); this.schedule(); } },
    ];
  }

  /** @param {TabEntry} step */
  async load(step) {
    try {
      this.panels.set(step.name, await loadPanel(step, this));
    } catch (error) {
      console.error(error);
      note(`The panel of ‘${step.label}’ could not be loaded. Reload the page.`, { error: true });
    }
    this.schedule();
  }

  /** Draw once per frame, whatever arrives in between. */
  schedule() {
    if (this.planned) return;
    this.planned = true;
    pacing.request(() => {
      this.planned = false;
      this.draw(this.connection.state);
    });
  }

  /** @param {ViewModel} state */
  draw(state) {
    this.changedTitle([state.case?.name, state.plan?.name, state.step, [...this.panels.keys()]], () => this.renderTitle(state));
    const current = state.step?.name;
    this.changedPlace([state.case?.id, state.plan?.id, current], clearErrors);
    const panel = current && this.panels.get(current);
    if (panel && this.anew) renderAnew(() => panel.update(state));
    else if (panel) panel.update(state);
    this.anew = false;
    this.layouts.offer(!state.case || state.case.has_volume, (state.curve?.points.length ?? 0) > 1, state.step?.endoscope ?? "none", state.case?.sliced ?? true);
    this.layouts.fix(fixedLayout(state));
    this.scene.update(state);
    this.look.update(state);
    this.slices.update(state);
    this.endoscope.update(state);
    this.card.update(state);
    this.status.update(state, panel ? panel.status : undefined);
    this.figures.update(state);
    this.firstTask.update(state);
  }

  /** @param {ViewModel} state */
  renderTitle(state) {
    byId("where-case").textContent = state.case?.name ?? "No head open";
    byId("where-plan").textContent = state.plan?.name ?? "";
    byId("where-separator").hidden = byId("where-plan").hidden = !state.plan;
    byId("where").title = [state.case?.name, state.plan?.name].filter(Boolean).join(" / ");
    document.title = state.case ? `${state.case.name} – vfix` : "vfix";
    this.hint.update(state.step, this.palette.tabs);
    for (const button of this.steps) {
      const name = button.dataset.step ?? "";
      if (name === state.step?.name) button.setAttribute("aria-current", "step");
      else button.removeAttribute("aria-current");
      button.disabled = !state.step?.available.includes(name);
      button.hidden = !(state.step?.offered ?? [name]).includes(name);
    }
    const panel = state.step && this.panels.get(state.step.name);
    if (!panel) return;
    if (show(byId("panel-content"), [panel.element])) byId("panel").scrollTop = 0; // else a step opens where the last was left
    show(byId("step-overlay"), panel.overlay ? [panel.overlay] : []);
  }

  /**
   * While the line is lost, what is shown is old and nothing can be asked for: figures are grey, controls off.
   * @param {Link} link
   */
  link({ connected, again, words, refused }) {
    const activeElement = /** @type {HTMLElement | null} */ (document.activeElement);
    const banner = byId("banner");
    const idle = activeElement === document.body || banner.contains(activeElement);
    banner.hidden = connected;
    say(byId("banner-words"), words ?? "");
    document.body.classList.toggle("offline", !connected);
    if (!connected) {
      if (activeElement?.closest("[data-live] *")) this.focused = activeElement;
      letGoOfEverything();
    }
    for (const part of document.querySelectorAll("[data-live]")) part.toggleAttribute("inert", !connected);
    if (connected) {
      if (idle) this.focused?.focus({ preventScroll: true });
      this.focused = null;
    }
    if (refused) this.scene.close();
    if (connected && (again || this.scene.isClosed)) this.scene.open();
    else if (connected) this.scene.sayWhoWrites();
  }
}

/**
 * What is there already is not moved: that would take its focus away.
 * @param {HTMLElement} parent
 * @param {HTMLElement[]} children
 */
function show(parent, children) {
  const other = parent.firstElementChild !== (children[0] ?? null);
  if (other) parent.replaceChildren(...children);
  return other;
}

const page = new Page();

// What automated tests and curious people may read: the state as shown, and requests to the planner.
Object.assign(window, { vfix: {
  get state() { return page.connection.state; },
  get connected() { return page.connection.connected; },
  get tab() { return page.connection.tab; },
  get slices() { return page.slices; },
  get endoscope() { return page.endoscope; },
  get layer() { return page.scene.layer; },
  request: page.connection.request.bind(page.connection),
} });
