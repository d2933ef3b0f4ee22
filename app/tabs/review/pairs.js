// Paired differences of two modes: the same plans, driven both ways.
import { drivenAs } from "/static/js/runs.js";

/** @import { RunTitle } from "/static/js/types.js" */

// Two-sided 95 % of Student's t by degrees of freedom from 1 on; the last holds for more.
const T95 = [12.71, 4.3, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23, 2.2, 2.18, 2.16, 2.14, 2.13, 2.12, 2.11, 2.1, 2.09, 2.09];

/**
 * Mean of paired differences with the half width of its 95 % interval; null for fewer than three pairs.
 * @param {number[]} differences
 */
export function paired(differences) {
  const n = differences.length;
  if (n < 3) return null;
  const mean = differences.reduce((sum, one) => sum + one, 0) / n;
  const spread = Math.sqrt(differences.reduce((sum, one) => sum + (one - mean) ** 2, 0) / (n - 1));
  return { n, mean, half: (T95[Math.min(n - 2, T95.length - 1)] * spread) / Math.sqrt(n) };
}

/**
 * Pairs of completed runs of two modes: one for each plan driven in both, of the newest run of each.
 * @param {RunTitle[]} runs newest first
 * @param {string} first
 * @param {string} second
 * @returns {[RunTitle, RunTitle][]}
 */
export function pairsOf(runs, first, second) {
  const newest = (/** @type {string} */ mode, /** @type {string | null} */ plan) => runs.find((run) => drivenAs(run) === mode && run.plan_id === plan && run.score?.completed);
  const plans = [...new Set(runs.map(({ plan_id: plan }) => plan))];
  return plans.flatMap((plan) => {
    const [a, b] = [newest(first, plan), newest(second, plan)];
    return plan !== null && a && b ? [/** @type {[RunTitle, RunTitle]} */ ([a, b])] : [];
  });
}
