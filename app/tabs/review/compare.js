// Runs beside one another: their figures, and the differences from the first.
import { h } from "/static/js/dom.js";
import { fixed, signed } from "/static/js/format.js";
import { drivenOf, viewOf } from "/static/js/run-views.js";
import { UNCERTIFIED, drivenAs, isUncertified, modeWord, runName } from "/static/js/runs.js";
import { draw, html, nothing } from "/static/js/template.js";
import { lumenFigures } from "./lumen-figures.js";
import { paired, pairsOf } from "./pairs.js";

/** @import { AnyScore } from "/static/js/runs.js" */
/** @import { RunTitle, ScorePublic } from "/static/js/types.js" */

/** @typedef {{ run: RunTitle, score: AnyScore }} Scored */
/**
 * @template [Score=any]
 * @typedef {{ name: string, unit: string, digits: number, of: (score: Score) => number | null, more?: boolean, neutral?: boolean, most?: (score: Score) => number }} Figure
 *   more: a larger value is better. neutral: neither is. most: it is at least that where it is that, as farther away nothing was measured */

/** @type {Figure<ScorePublic>[]} */
export const FIGURES = [
  { name: "Time", unit: "s", digits: 1, of: ({ time_s: time }) => time },
  { name: "Tip error, mean", unit: "mm", digits: 3, of: ({ path_error_mm: error }) => error?.robot_frame.mean ?? null },
  { name: "Tip error, largest", unit: "mm", digits: 3, of: ({ path_error_mm: error }) => error?.robot_frame.max ?? null },
  { name: "Target error, mean", unit: "mm", digits: 2, of: ({ target_error_mm: error }) => error?.robot_frame.mean ?? null },
  { name: "Nearest to any structure", unit: "mm", digits: 2, of: ({ least_clearance_mm: least }) => Math.min(...Object.values(least)), more: true, most: ({ reach_mm: reach }) => reach },
  { name: "Contacts", unit: "", digits: 0, of: ({ contacts }) => contacts },
  { name: "Deepest contact", unit: "mm", digits: 2, of: ({ max_depth_mm: depth }) => depth },
  { name: "Held", unit: "s", digits: 1, of: ({ held_s: held, mode }) => (mode === "freehand" ? null : held) },
  { name: "Path length", unit: "mm", digits: 1, of: ({ path_length_mm: length }) => length },
  { name: "Smoothness", unit: "", digits: 2, of: ({ spectral_arc_length: smooth }) => smooth, more: true },
];

/** What is compared, by what was driven. @type {Record<string, (scores: any[]) => Figure[]>} */
const FIGURES_OF = { tool: () => FIGURES, lumen: lumenFigures };

export class CompareTable {
  constructor() {
    this.element = h("div", { class: "review-compare" });
  }

  /**
   * @param {Scored[]} scored the first is the one that the others are compared with
   * @param {RunTitle[]} runs of the head, newest first
   * @param {(id: string | null) => string} planName
   */
  show(scored, runs, planName) {
    draw(this.element, scored.length < 2 ? html`<p class="empty">Add another run with <strong>+</strong> in the list.</p>` : html`
      <table class="compare"><thead><tr><td></td>${scored.map(({ run, score }, index) => html`<th scope="col" colspan=${index ? 2 : 1}>
        <span class="compare-name" data-run=${index === 0 ? "main" : index === 1 ? "ghost" : "other"}>${modeWord(drivenAs(run))}</span>${isUncertified(run) ? html`<span class="pill">${UNCERTIFIED}</span>` : nothing}
        ${viewOf(run).certificate(score) ? html`<span class="compare-sub certified-of">${viewOf(run).certificate(score)}</span>` : nothing}
        <span class="compare-sub">${[runName(run), viewOf(run).robot(run), planName(run.plan_id)].filter(Boolean).join(" · ")}</span></th>`)}</tr></thead>
      <tbody>${FIGURES_OF[drivenOf(scored[0].run)](scored.map(({ score }) => score)).map((figure) => this.row(figure, scored))}</tbody></table>
      ${this.pairs(scored, runs)}`);
  }

  /**
   * @param {Figure} figure
   * @param {Scored[]} scored
   */
  row({ name, unit, digits, of, more = false, neutral = false, most }, scored) {
    const values = scored.map(({ score }) => of(score));
    if (values.every((value) => value === null)) return nothing;
    const [first] = values;
    return html`<tr><th scope="row">${name}${unit ? html` <span class="unit">${unit}</span>` : nothing}</th>${values.map((value, index) => {
      const { score } = scored[index], least = most && value !== null && value >= most(score) - 1e-6;
      const cell = html`<td class="number">${least ? "≥ " : ""}${fixed(value, digits)}</td>`;
      if (!index) return cell;
      const by = value === null || first === null ? null : value - first;
      const worse = !neutral && by !== null && Math.abs(by) >= 0.5 * 10 ** -digits && (more ? by < 0 : by > 0);
      return html`${cell}<td class=${worse ? "number difference worse" : "number difference"}>${by === null ? "–" : signed(by, digits)}</td>`;
    })}</tr>`;
  }

  /**
   * Where two modes were driven on the same plans, or two arms on the same routes, what the second differs by.
   * @param {Scored[]} scored
   * @param {RunTitle[]} runs
   */
  pairs([first, second], runs) {
    const [a, b] = [drivenAs(first.run) ?? "", drivenAs(second.run) ?? ""];
    if (a === b) return nothing;
    const pairs = pairsOf(runs, a, b), documents = `${viewOf(first.run).of}s`;
    const found = [["Time", "s", 1, "time_s"], ["Tip error, mean", "mm", 3, "error_mm"]].flatMap(([name, unit, digits, key]) => {
      const differences = pairs.map((pair) => pair.map(({ score }) => /** @type {number | null | undefined} */ (Reflect.get(score ?? {}, key))))
        .flatMap(([one, two]) => (typeof one === "number" && typeof two === "number" ? [two - one] : []));
      const told = paired(differences);
      return told ? [`${name} ${signed(told.mean, Number(digits))} ± ${fixed(told.half, Number(digits))} ${unit} of ${told.n} ${documents}`] : [];
    });
    const line = found.length ? `${modeWord(b)} against ${modeWord(a).toLowerCase()}: ${found.join("; ")} driven both ways (mean difference, 95 %).`
      : `Statistics need three ${documents} driven both ways; there ${pairs.length === 1 ? "is one" : `are ${pairs.length}`}.`;
    return html`<p class="words">${line}</p>`;
  }
}
