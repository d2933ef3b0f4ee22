// The steps of a registration: which one is open, and the result of each in one line. Pure: it reads the view model, no document.
import { briefWords, mm } from "./calibration-words.js";
import { isReal, isUsable, roundedUp } from "./words.js";

/** @import { Line } from "/static/js/step-list.js" */
/** @import { PlanUseSection, RegistrationSection, ViewModel } from "/static/js/types.js" */

/** @typedef {"beads" | "points" | "fit" | "error" | "use"} StepName */
/** @typedef {"refine" | "trace" | "calibration" | "registrations"} PartName */

/** @type {{ name: StepName, title: string }[]} */
export const STEPS = [
  { name: "beads", title: "Beads" },
  { name: "points", title: "Points" },
  { name: "fit", title: "Fit" },
  { name: "error", title: "Error" },
  { name: "use", title: "Use" },
];

/** @type {{ name: PartName, title: string }[]} */
export const PARTS = [
  { name: "refine", title: "Refine" },
  { name: "trace", title: "Trace" },
  { name: "calibration", title: "Pointer and robot" },
  { name: "registrations", title: "Registrations" },
];

const LEAST = 3; // points that make a transform

/** @type {Partial<Record<RegistrationSection["fit"]["state"], string>>} of points that have no transform */
const NO_FIT = { waiting: "Needs 3 points", degenerate: "Points in a line", misfit: "Points do not fit", inconsistent: "Contradicts points" };

/**
 * The step that comes next. With an error to be read it is that: using the registration is a person's decision.
 * @param {RegistrationSection} registration
 * @returns {StepName}
 */
export function nextStep({ beads, pairs, fit, has_volume: hasVolume }) {
  if (fit.state === "given" || fit.state === "refined") return "error";
  const measured = pairs.some((pair) => pair.measured);
  if (beads.some(({ state }) => state === "found") && !measured) return "beads";
  if (!pairs.length) return hasVolume && !beads.length ? "beads" : "points";
  if (fit.state === "waiting" || pairs.some((pair) => pair.enabled && !(pair.in_image && pair.measured))) return "points";
  return isUsable(fit) && fit.wrong?.certainty !== "outlier" ? "error" : "fit";
}

/** Which step is open. The guide opens the next one by itself until somebody opens one. */
export class Guide {
  constructor() {
    /** @type {StepName | ""} '' where all are closed */
    this.open = "";
    /** @type {string | undefined} the id of the registration */
    this.registration = undefined;
    /** @type {StepName | undefined} the next one when the registration was seen last */
    this.next = undefined;
    this.isDone = false; // used by the open plan, or deleted: nothing has to come next
    this.chosen = false; // somebody opened or closed a step of this registration
    this.acted = false; // somebody did something in a step of it, in this window: an edit of another one moves nothing here
  }

  /**
   * @param {RegistrationSection | null | undefined} registration
   * @param {PlanUseSection | null | undefined} use
   * @param {boolean} busy whether somebody works within the open step, or holds a button: then the next one is marked only
   * @returns {StepName | null} the step that was opened
   */
  follow(registration, use, busy) {
    const other = registration?.id !== this.registration;
    const before = this.next;
    this.registration = registration?.id;
    this.isDone = Boolean(registration?.deleted || (use?.here && use.state === "ready"));
    this.next = registration ? nextStep(registration) : undefined;
    if (other) this.chosen = this.acted = false;
    if (!this.next) {
      this.open = "";
      return null;
    }
    const moves = other || (this.acted && !this.chosen && !busy && this.next !== before && this.next !== this.open);
    if (moves) this.open = this.next;
    return moves ? this.next : null;
  }

  /** The next step where another one is open, '' where none has to come next. */
  get marked() {
    const next = this.next === "error" && (this.open === "error" || this.open === "use") ? "use" : this.next;
    return next && next !== this.open && !this.isDone ? next : "";
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
 * @param {RegistrationSection} registration
 * @param {PlanUseSection | null | undefined} use
 * @returns {Line}
 */
export function stepLine(name, registration, use) {
  if (name === "beads") return beadsLine(registration);
  if (name === "points") return pointsLine(registration);
  if (name === "fit") return fitLine(registration);
  return name === "error" ? errorLine(registration) : useLine(use, registration);
}

/**
 * What a part below the steps holds, for when it is closed.
 * @param {PartName} name
 * @param {ViewModel} state
 * @returns {Line}
 */
export function partLine(name, { registration, registrations }) {
  if (name === "registrations") {
    const kept = (registrations?.items ?? []).filter(({ deleted }) => !deleted).length;
    return { words: kept ? `${kept} saved` : "None", mark: "" };
  }
  if (!registration) return { words: "", mark: "" };
  if (name === "calibration") return { words: briefWords(registration.calibration), mark: "" };
  const { touched } = registration;
  if (name === "trace" || !touched) return { words: "", mark: "" };
  return { words: touched.refinement ? `Moved by ${mm(touched.refinement.moved_mm)}` : `${touched.count} points touched`, mark: "" };
}

/**
 * @param {RegistrationSection} registration
 * @returns {Line}
 */
function beadsLine({ beads, search, has_volume: hasVolume }) {
  if (!beads.length) return { words: !hasVolume ? "No CT" : search ? "None found" : "None", mark: hasVolume && search ? "caution" : "" };
  const confirmed = beads.filter(({ state }) => state === "confirmed").length;
  const open = beads.some(({ state }) => state === "found");
  return { words: `${confirmed} of ${beads.length} confirmed`, mark: confirmed && !open ? "done" : "" };
}

/**
 * @param {RegistrationSection} registration
 * @returns {Line}
 */
function pointsLine({ pairs, fit }) {
  if (!pairs.length) return { words: "None", mark: "" };
  const used = pairs.filter(({ enabled }) => enabled);
  const whole = used.filter((pair) => pair.in_image && pair.measured).length;
  const left = pairs.length - used.length;
  const words = `${whole} of ${used.length} ${fit.simulated ? "simulated" : "measured"}${left ? `, ${left} left out` : ""}`;
  const enough = whole >= LEAST && fit.state !== "waiting";
  return { words, mark: enough && whole === used.length ? "done" : "" };
}

/**
 * That all points were simulated is in the line of Points, and no doubt of the fit.
 * @param {RegistrationSection} registration
 * @returns {Line}
 */
function fitLine({ fit, pairs }) {
  const none = NO_FIT[fit.state];
  if (none) return { words: none, mark: fit.state === "waiting" ? "" : "caution" };
  if (fit.wrong) return { words: `${fit.wrong.certainty === "outlier" ? "Wrong" : "Check"}: ‘${fit.wrong.label}’`, mark: "caution" };
  const by = { given: "Imported", refined: "Refined" }[/** @type {"given"} */ (fit.state)];
  const fre = fit.fre_mm === null ? "" : `FRE ${mm(fit.fre_mm)}`;
  return { words: [by, fre].filter(Boolean).join(", "), mark: fit.cautions.length > Number(fit.simulated && !pairs.some(isReal)) ? "caution" : "done" };
}

/**
 * @param {RegistrationSection} registration
 * @returns {Line}
 */
function errorLine({ fit, errors }) {
  if (!isUsable(fit)) return { words: "Needs a fit", mark: "" };
  if (isUnknown(fit)) return { words: "Unknown", mark: "caution" };
  if (!errors.rows.length) return { words: "No target yet", mark: "" };
  return { words: `95 % within ${mm(roundedUp(Math.max(...errors.rows.map(({ within_95_mm: within }) => within))))}`, mark: fit.wrong?.certainty === "outlier" ? "caution" : "done" };
}

/**
 * Whether a transform can be used whose error nobody knows: the verdict of a plan that uses it is unknown too.
 * @param {RegistrationSection["fit"]} fit
 */
function isUnknown(fit) {
  return fit.state === "given" || fit.state === "refined" || (isUsable(fit) && fit.fle_source === "none");
}

/**
 * @param {PlanUseSection | null | undefined} use
 * @param {RegistrationSection} registration
 * @returns {Line}
 */
function useLine(use, { fit }) {
  if (!use) return { words: "No plan open", mark: "" };
  if (isBlocked(use)) return { words: "Cannot be used", mark: "caution" };
  if (use.state === "none") return { words: "Not used", mark: "" };
  if (use.here && isUnknown(fit)) return { words: "In use, error unknown", mark: "caution" };
  return use.here ? { words: "In use", mark: "done" } : { words: `‘${use.name}’ in use`, mark: "" };
}

/**
 * Whether a plan refers to a registration that it cannot use.
 * @param {PlanUseSection | null | undefined} use
 */
export function isBlocked(use) {
  return Boolean(use) && use?.state !== "none" && use?.state !== "ready";
}
