// The verdict on a path in a few words: its word, and the figure that decides it.
import { fixed, mm } from "./format.js";

/** @import { ICONS } from "./dom.js" */
/** @import { EvaluationSection, FigureView, VerdictPart } from "./types.js" */

/** @type {Record<NonNullable<EvaluationSection["level"]>, keyof typeof ICONS>} */
export const LEVEL_ICONS = { fits: "fits", tight: "tight", unknown: "unknown", blocked: "blocked", pierces: "blocked" };

export const UPDATING = "updating"; // beside everything that is of an earlier path, and dimmed

/**
 * Whether the verdict, plot and all figures of them are of an earlier path, or of an earlier place of the hand that drags a point.
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
 * How far before its target a path ends; '' where it ends at it.
 * @param {number} short mm
 */
export function shortWords(short) {
  return short ? `${mm(short, short < 10 ? 1 : 0)} short` : "";
}

/**
 * The verdict in one line, the worst figure behind its word. mark: 'caution' where somebody should look.
 * @param {EvaluationSection | undefined} corridor
 * @returns {{ words: string, mark: "done" | "caution" | "" }}
 */
export function verdictLine(corridor) {
  if (!corridor || corridor.status === "none") return { words: "", mark: "" };
  const { level, word, verdict } = corridor;
  if (isOld(corridor) && verdict) return { words: UPDATING, mark: "" };
  if (!level || isOld(corridor)) return { words: "Simulating …", mark: "" };
  const [worst] = verdict?.figures ?? [];
  const stops = worst?.level === "blocked" && worst.whole_mm === null; // its name is what there is to say
  return { words: [word, ...(worst ? [stops ? worst.name : figureWords(worst)] : [])].join(", "), mark: level === "fits" ? "done" : "caution" };
}

/**
 * Parts of a sentence, each place with what touches it: a bracket stays with the place that it is about.
 * @param {VerdictPart[]} parts
 */
export function unbroken(parts) {
  const held = parts.map((part) => ({ before: "", part, after: "" }));
  for (const [at, one] of held.entries()) {
    if (one.part.s_mm === null) continue;
    const [last, next] = [held[at - 1], held[at + 1]];
    if (last?.part.s_mm === null) {
      one.before = /\S*$/u.exec(last.part.words)?.[0] ?? "";
      last.part = { ...last.part, words: last.part.words.slice(0, last.part.words.length - one.before.length) };
    }
    if (next?.part.s_mm === null) {
      one.after = /^\S*/u.exec(next.part.words)?.[0] ?? "";
      next.part = { ...next.part, words: next.part.words.slice(one.after.length) };
    }
  }
  return held;
}
