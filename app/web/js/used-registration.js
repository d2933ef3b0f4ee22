// The registration that the open plan goes by: its name, the error to be expected of it, and what is doubtful of it.
import { rowAt } from "./clearance-words.js";
import { h, whenChanged } from "./dom.js";
import { mm } from "./format.js";
import { line } from "./said.js";
import { isOld } from "./verdict-line.js";

/** @import { PlanUseSection, VerdictView, ViewModel } from "./types.js" */

const DRIVEN = "It tells the robot where the patient lies. Bone, path and targets lie before the robot as it says, and to each other as planned.";

export class UsedRegistration {
  /**
   * @param {string} id of the element
   * @param {boolean} driven whether it says what the registration changes for the robot
   */
  constructor(id, driven) {
    this.driven = driven;
    this.changed = whenChanged();
    this.element = h("div", { class: "fields", id, hidden: true });
  }

  /** @param {ViewModel} state */
  update({ plan_use: use, corridor }) {
    const verdict = isOld(corridor) ? null : corridor?.verdict ?? null;
    this.changed([use, verdict, corridor?.words], () => {
      const lines = !use ? [] : usedWords(use, verdict, this.driven);
      const told = corridor?.status === "failed" && corridor.words === use?.words; // the dry run says it
      this.element.hidden = !lines.length || told;
      this.element.replaceChildren(...lines.map(({ words, caution }) => line(words, { class: caution ? "words caution" : "words" })));
    });
  }
}

/**
 * @param {PlanUseSection} use
 * @param {VerdictView | null} verdict of the dry run
 * @param {boolean} driven
 * @returns {{ words: string, caution: boolean }[]}
 */
export function usedWords(use, verdict, driven) {
  if (use.state === "none") return [];
  if (use.state !== "ready") return [{ words: use.words, caution: true }];
  const words = [`Uses ‘${use.name ?? ""}’. ${use.error_words}`, ...narrowestWords(verdict), ...(driven ? [DRIVEN] : [])].join(" ");
  return [{ words, caution: false }, ...use.doubts.map((doubt) => ({ words: doubt, caution: true }))];
}

/**
 * What the registration may be off by where least is left of a margin, to bone or to a protected structure.
 * @param {VerdictView | null} verdict
 * @returns {string[]}
 */
function narrowestWords(verdict) {
  const off = verdict?.profile.registration_mm;
  if (!verdict || !off?.length) return [];
  const at = rowAt(verdict.profile, verdict.nearest_mm);
  return [`Where the path is narrowest, at ${verdict.nearest_mm.toFixed(0)} mm, it is below ${mm(off[at], 2)}.`];
}
