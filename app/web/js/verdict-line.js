// The verdict on a path in a few words: its word, and the figure that decides it.
import { fixed } from "./format.js";

/** @import { ICONS } from "./dom.js" */
/** @import { EvaluationSection, FigureView } from "./types.js" */

/** @type {Record<NonNullable<EvaluationSection["level"]>, keyof typeof ICONS>} */
export const LEVEL_ICONS = { fits: "fits", tight: "tight", unknown: "unknown", blocked: "blocked", pierces: "blocked" };

/**
 * Whether the verdict and plot are of an earlier path, or of an earlier place of the hand that drags a point.
 * @param {EvaluationSection | null | undefined} corridor
 */
export function isOld(corridor) {
  return corridor?.state === "waits" || corridor?.state === "drag_waits";
}

/**
 * A figure of the verdict with its unit; '?' where it is unknown.
 * @param {FigureView} figure
 */
export function figureWords({ name, value, digits, whole_mm: whole, level, at_least: more }) {
  if (value === null) return level === "unknown" ? `${name} ?` : name;
  return `${name} ${more ? "≥ " : ""}${fixed(value, digits)}${whole === null ? "" : ` of ${fixed(whole, digits)}`} mm`;
}

/**
 * The verdict in one line, the worst figure behind its word. mark: 'caution' where somebody should look.
 * @param {EvaluationSection | undefined} corridor
 * @returns {{ words: string, mark: "done" | "caution" | "" }}
 */
export function verdictLine(corridor) {
  if (!corridor || corridor.status === "none") return { words: "", mark: "" };
  const { level, word, verdict } = corridor;
  if (!level || isOld(corridor)) return { words: "Simulating …", mark: "" };
  const [worst] = verdict?.figures ?? [];
  return { words: [word, ...(worst ? [figureWords(worst)] : [])].join(", "), mark: level === "fits" ? "done" : "caution" };
}
