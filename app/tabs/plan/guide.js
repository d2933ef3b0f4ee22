// The steps of a plan: which one is open, and the result of each in one line. Pure: it reads the view model, no document.
import { samePath } from "./same-path.js";

/** @import { Line } from "/static/js/step-list.js" */
/** @import { PlanSection, SuggestionPublic, ViewModel } from "/static/js/types.js" */

/** @typedef {"entry" | "targets" | "protect" | "path" | "tool" | "check" | "export"} StepName */
/**
 * What the panel knows besides the view model. searching: share of the search for a path that is done, null where none
 * runs. verdict: the line of the verdict. short: how far before its target the path ends, '' where it ends at it.
 * @typedef {{ suggestion: SuggestionPublic | null, searching: number | null, verdict: Line, short: string }} Known
 */

/** @type {{ name: StepName, title: string }[]} */
export const STEPS = [
  { name: "entry", title: "Entry" },
  { name: "targets", title: "Targets" },
  { name: "protect", title: "Protect" },
  { name: "path", title: "Path" },
  { name: "tool", title: "Tool and robot" },
  { name: "check", title: "Check" },
  { name: "export", title: "Export" },
];

/** @type {Record<StepName, "point" | "target" | "none">} what a click adds once a step is opened */
export const ADDS = { entry: "point", targets: "target", protect: "none", path: "point", tool: "none", check: "none", export: "none" };
/** @type {Record<string, string>} */
const SIDES = { left: "Left nostril", right: "Right nostril", midline: "Midline" };

/**
 * The step that comes next in a plan.
 * @param {PlanSection} plan
 * @returns {StepName}
 */
export function nextStep({ points, targets }) {
  if (!points.length) return "entry";
  return points.length > 1 || targets.length ? "path" : "targets";
}

/** Which step is open. The guide opens the next one by itself until somebody opens one. */
export class Guide {
  constructor() {
    /** @type {StepName | ""} '' where all are closed */
    this.open = "";
    /** @type {string | undefined} the id of the plan */
    this.plan = undefined;
    /** @type {StepName | undefined} the next one when the plan was seen last */
    this.next = undefined;
    this.isDrawn = false; // there is a path: nothing has to come next
    this.chosen = false; // somebody opened or closed a step of this plan
  }

  /**
   * Follow the plan. It goes on where the next step becomes another one by an edit of this window, which selects what it
   * adds: an edit of another window moves nothing here.
   * @param {PlanSection | null | undefined} plan
   * @param {boolean} busy whether somebody works within the open step, or holds a button: then the next one is marked only
   * @returns {StepName | null} the step that was opened
   */
  follow(plan, busy) {
    const known = this.plan;
    this.plan = plan?.id;
    this.isDrawn = (plan?.points.length ?? 0) > 1;
    if (!plan) {
      this.open = "";
      this.next = undefined;
      return null;
    }
    const next = nextStep(plan);
    const other = plan.id !== known;
    const added = next !== this.next && next !== "entry" && isLastSelected(plan);
    const emptied = next === "entry" && this.next !== "entry"; // by an undo: a click is the entry again
    this.next = next;
    if (other) this.chosen = false;
    const moves = other || ((added || emptied) && !this.chosen && !busy && next !== this.open);
    if (moves) this.open = next;
    return moves ? next : null;
  }

  /** The next step where another one is open, '' where none has to come next. */
  get marked() {
    return this.next && this.next !== this.open && !this.isDrawn ? this.next : "";
  }

  /**
   * Somebody opens a step, or closes the one that is open.
   * @param {StepName} name
   * @param {boolean} open
   */
  choose(name, open) {
    this.chosen = true;
    this.open = open ? name : "";
  }
}

/**
 * The result of a step, for when it is closed.
 * @param {StepName} name
 * @param {ViewModel} state
 * @param {Known} known
 * @returns {Line}
 */
export function stepLine(name, state, known) {
  const { plan } = state;
  if (!plan) return { words: "", mark: "" };
  if (name === "entry") return entryLine(plan, state);
  if (name === "targets") return listLine(plan.targets.map(({ label }) => label), "targets");
  if (name === "protect") return listLine((state.regions?.items ?? []).filter(({ purpose }) => purpose === "spare").map((item) => item.name), "structures");
  if (name === "path") return pathLine(plan, known);
  if (name === "tool") return toolLine(plan, state);
  const drawn = plan.points.length > 1;
  if (name === "check") return drawn ? known.verdict : { words: "Needs a path", mark: "" };
  if (drawn && state.corridor?.verdict && ["waits", "drag_waits"].includes(state.corridor.state)) return known.verdict;
  if (drawn && ["blocked", "pierces"].includes(state.corridor?.level ?? "")) return { words: "Blocked plan", mark: "caution" };
  const ready = drawn && state.corridor?.state === "current" && state.corridor.status === "done";
  return { words: ready ? "Ready" : drawn ? "Not simulated" : "Needs a path", mark: ready ? "done" : "" };
}

/**
 * What a part below the steps holds, for when it is closed.
 * @param {string} name
 * @param {ViewModel} state
 * @returns {Line}
 */
export function moreLine(name, { regions, versions, paths }) {
  if (name === "notes") return { words: (paths?.notes ?? "").trim().split("\n")[0], mark: "" };
  const items = name === "versions" ? versions?.items : regions?.items.filter(({ purpose }) => purpose === "remove");
  return items?.length ? listLine(items.map((item) => item.name), name === "versions" ? "versions" : "places") : { words: "", mark: "" };
}

/**
 * @param {PlanSection} plan
 * @param {ViewModel} state
 * @returns {Line}
 */
function entryLine(plan, { paths }) {
  const [first] = plan.points;
  if (!first) return { words: "None", mark: "" };
  const side = SIDES[paths?.items.find(({ id }) => id === paths.chosen)?.entry_side ?? ""];
  if (!side) return { words: "Choose a side", mark: "" };
  return { words: side, mark: paths?.side_caution ? "caution" : "done" };
}

/**
 * @param {string[]} names
 * @param {string} many
 * @returns {Line}
 */
function listLine(names, many) {
  if (!names.length) return { words: "None", mark: "" };
  return { words: names.length > 1 ? `${names.length} ${many}` : names[0], mark: "done" };
}

/**
 * @param {PlanSection} plan
 * @param {Known} known
 * @returns {Line}
 */
function pathLine(plan, { suggestion, searching, short }) {
  if (searching !== null) return { words: `Searching, ${Math.round(100 * searching)} %`, mark: "" };
  const ways = suggestion?.plan_id === plan.id ? suggestion.alternatives : [];
  if (plan.points.length > 1) {
    const way = ways.findIndex((one) => samePath(plan.points, one.points));
    const what = short ? "" : way < 0 ? `, ${plan.points.length} points` : `, way ${way + 1} of ${ways.length}`;
    return { words: `${plan.length_mm.toFixed(0)} mm${what}`, mark: short ? "caution" : "done", pill: short };
  }
  if (suggestion?.plan_id === plan.id && suggestion.none) return { words: "No way found", mark: "caution" };
  return { words: ways.length ? `${ways.length} ${ways.length === 1 ? "way" : "ways"} found` : "None", mark: "" };
}

/**
 * @param {PlanSection} plan
 * @param {ViewModel} state
 * @returns {Line}
 */
function toolLine({ tool, robot }, { plan_use: use }) {
  if (tool.trouble) return { words: "Tool unreadable", mark: "caution" };
  if (robot.trouble) return { words: "Robot unreadable", mark: "caution" };
  if (use?.registration && use.state !== "ready") return { words: "Registration unusable", mark: "caution" };
  return { words: `${tool.title.replace(", ", " ")}${tool.changed ? ", changed" : ""}`, mark: "done" };
}

/**
 * Whether what is selected is the last point or target, as it is after it was added.
 * @param {PlanSection} plan
 */
function isLastSelected({ points, targets, selected }) {
  return selected !== null && [points.at(-1)?.id, targets.at(-1)?.id].includes(selected);
}
