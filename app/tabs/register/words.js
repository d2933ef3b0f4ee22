// What the panel of the Register tab says of points, errors and orders; nothing here touches the page.

/** @import { CalibrationView, ErrorRow, FitView, OrderView, PairEntry, RegistrationPublic, TouchedView } from "/static/js/types.js" */

const [HELD, WELL_HELD] = [0.02, 0.1]; // of stability: 45 points of 0.3 mm tell the least held motion to 0.55 and 0.25 mm
const LEAST_SCALE_MM = 1; // a full bar: residuals below it do not look large
/** @type {Record<PairEntry["measured_from"], string>} */
const SOURCES = { typed: "typed", file: "table", simulated: "simulated", tracker: "tracked" };

/**
 * What is known of a point, in a few words.
 * @param {PairEntry} pair
 */
export function pairWords(pair) {
  if (!pair.in_image) return "not in the CT yet";
  if (!pair.measured) return "not measured";
  const weight = pair.weight === 1 ? "" : `, weight ${pair.weight}`;
  return pair.enabled ? `${SOURCES[pair.measured_from]}${weight}` : `${SOURCES[pair.measured_from]}, left out`;
}

/**
 * Whether a fit has a transform that can be used.
 * @param {FitView} fit
 */
export function isUsable({ state }) {
  return state === "fitted" || state === "given" || state === "refined";
}

/**
 * The residual that fills a bar, in mm.
 * @param {PairEntry[]} pairs
 */
export function barScale(pairs) {
  return Math.max(LEAST_SCALE_MM, ...pairs.map((pair) => pair.residual_mm ?? 0));
}

/**
 * How much of a bar a residual fills, from 0 to 1.
 * @param {number | null} residual
 * @param {number} scale
 */
export function barShare(residual, scale) {
  return residual === null ? 0 : Math.min(Math.max(residual / scale, 0), 1);
}

/**
 * Whether a point was really measured: typed, read or tracked, not simulated.
 * @param {PairEntry} pair
 */
export function isReal(pair) {
  return Boolean(pair.measured) && pair.measured_from !== "simulated";
}

/**
 * Whether a simulated pointer may touch points: nothing, or nothing but simulated touches, is there.
 * @param {PairEntry[]} pairs
 */
export function canPractise(pairs) {
  return pairs.some((pair) => pair.in_image) && !pairs.some(isReal);
}

/**
 * What the bar of a residual is.
 * @param {number} scale see `barScale`
 */
export function barWords(scale) {
  return `Residual; full bar ${scale.toFixed(scale < 10 ? 1 : 0)} mm`;
}

/**
 * Why points can no longer be touched by the simulated pointer, and what to do; '' where that is not the question.
 * @param {PairEntry[]} pairs
 */
export function practiceWords(pairs) {
  if (canPractise(pairs) || !pairs.some((pair) => pair.measured && pair.measured_from === "simulated")) return "";
  const real = pairs.filter(isReal).map((pair) => `‘${pair.label || "Point"}’`);
  const those = real.length === 1 ? `${real[0]} was` : `${real.length} points were`;
  return `${those} measured. Forget ${real.length === 1 ? "it" : "them"} to simulate: choose the point and press ‘Forget’, or press ‘Clear’ for all.${real.length === 1 ? "" : ` They are ${real.join(", ")}.`}`;
}

/**
 * Where the error of a row is expected.
 * @param {ErrorRow} row
 */
export function rowWords(row) {
  if (row.s_mm === null) return row.label || "Target";
  const at = row.s_mm.toFixed(0);
  return at === "0" ? "Path, at its entry" : `Path, at ${at} mm`;
}

/**
 * How exactly one point was measured, and who says so.
 * @param {FitView} fit
 */
export function fleWords(fit) {
  if (fit.fle_mm === null) return fit.state === "misfit" ? "unknown: points do not fit" : "unknown";
  const figure = `${fit.fle_mm.toFixed(2)} mm`;
  return fit.fle_source === "stated" ? `${figure}, as stated` : `${figure}, estimated`;
}

/**
 * What an order changes, in a sentence.
 * @param {OrderView} order
 */
export function orderWords({ moves }) {
  const moved = moves.filter(({ stays }) => !stays).length;
  if (!moved) return "As they are now";
  const stay = moves.length - moved;
  return `${moved === 1 ? "One point gets" : `${moved} points get`} another place${stay ? `, ${stay} ${stay === 1 ? "stays" : "stay"}` : ""}`;
}

/** @type {Record<TouchedView["measured_from"], string>} */
const TOUCHED_FROM = { file: "table", simulated: "simulated", tracker: "tracked" };

/**
 * What was touched on a surface, and what can be done with it.
 * @param {TouchedView | null} touched
 * @param {string} structure its name
 * @param {boolean} usable whether there is a transform to begin with
 */
export function touchedWords(touched, structure, usable) {
  if (!touched) return usable ? "Nothing touched yet." : "Fit the points first.";
  const what = `${touched.count} points on ${structure}, ${TOUCHED_FROM[touched.measured_from]}.`;
  if (!usable) return `${what} Fit the points first.`;
  return touched.refinement ? what : `${what} Not refined yet.`;
}

/**
 * What a refinement did: terms, figures and their titles; first what judges it.
 * @param {TouchedView} touched
 * @param {FitView} fit
 * @returns {[string, string, string][]}
 */
export function refinementRows({ refinement, count }, fit) {
  if (!refinement) return [];
  const judged = fit.fre_mm === null ? "none" : `${fit.fre_mm.toFixed(2)} mm rms`;
  return [
    ["Measured points", judged, "They judge it"],
    ["Moved by up to", `${refinement.moved_mm.toFixed(2)} mm`, "Of a touched point"],
    ["Hold against sliding", `${refinement.stability.toFixed(2)} of 1, ${holdWords(refinement.stability)}`, "0 to 1; near 0 points slide"],
    ["Residual", `${refinement.residual_mm.toFixed(2)} mm rms, ${refinement.kept} of ${count}`, "Not the accuracy"],
  ];
}

/**
 * What the hold of a surface means: the error of the motion that is held least goes with one over its root.
 * @param {number} stability
 */
function holdWords(stability) {
  if (stability >= WELL_HELD) return "held well";
  return stability >= HELD ? "weak: touch other sides" : "may slide: touch edges";
}

/**
 * A bound at the two digits that are shown: rounded up, so that 'below' stays true.
 * @param {number} value
 */
export function roundedUp(value) {
  return Math.ceil(value * 100 - 1e-9) / 100;
}

/**
 * What a transform that goes out is for.
 * @param {CalibrationView["to"]} to
 */
export function exportWords(to) {
  const there = to === "base" ? "to the robot's base" : "onto the patient";
  return `Moves points ${there}. The files of Plan, ‘Export’, hold them in the image's frame. The folder for 3D Slicer there has plan, head, transforms and points. The whole head as one file: Patient, ‘Save head …’.`;
}

/**
 * What has to be known of a transform that came in.
 * @param {RegistrationPublic} made
 */
export function importedWords({ name, to, fit, said }) {
  const where = to === "base" ? "the robot's base" : "the patient";
  const open = said?.to ? "" : ` If not, choose otherwise in ‘Pointer and robot’.`;
  return `Read as ‘${name}’, to ${where}.${open}${fit.simulated ? " Simulated: no patient." : " Add points to check it."}`;
}
