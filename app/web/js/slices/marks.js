// What is drawn over a slice as SVG, in CSS pixels of the view: crosshair, path, points, targets, measures.
import { svg } from "../dom.js";
import { cutNear } from "../near-plane.js";
import { isOld } from "../verdict-line.js";
import { measureWords } from "./measures.js";
import { reachedMm, splitAt } from "./reached.js";
/** @import { PlaceNear } from "../near-plane.js" */
/** @import { FiducialMark, OpeningView, ViewModel } from "../types.js" */
/** @import { Triple } from "./grid.js" */
/** @import { Measure } from "./measures.js" */
/** @import { Port } from "./port.js" */

export const NEAR_MM = 2; // what lies this near to the plane is drawn in full, the rest faint
const MARK_PX = 3.6;
const STOP_PX = 7; // radius of the mark where the tool stops
const LEAST_OPENING_PX = 7; // radius of its ring
const NAME_PX = 6.5; // of a letter of its name
const STRIP_PX = 42; // at the left, where tools and letters lie
const FIDUCIAL_PX = 8;
const CROSS_PX = 4.5; // half the length of the lines where a point was measured
const FIDUCIAL_MM = 3; // a bead this near is cut by the plane

/**
 * @param {Port} port
 * @param {ViewModel} state
 * @param {Triple} cross
 * @param {Measure[]} measures
 * @returns {SVGElement[]}
 */
export function marksOf(port, state, cross, measures) {
  const project = (/** @type {Triple} */ place) => port.project(place);
  const at = project(cross);
  /** @type {SVGElement[]} */
  const marks = [
    svg("line", { class: "cross-hair", x1: 0, x2: port.width, y1: at.y, y2: at.y }),
    svg("line", { class: "cross-hair", y1: 0, y2: port.height, x1: at.x, x2: at.x }),
  ];
  const line = (/** @type {Triple[]} */ places, /** @type {string} */ kind) => marks.push(...drawnLine(places.map(project), kind));
  const [reached, beyond] = splitAt(state.curve?.points ?? [], reachedMm(state) ?? Infinity);
  line(reached, "slice-path");
  line(beyond, "slice-path beyond");
  const { driven, plan } = state; // a rehearsal of the plan as it was shows what it drives
  const selected = driven ? null : plan?.selected;
  const { points, targets } = driven ?? plan ?? { points: [], targets: [] };
  for (const item of points) marks.push(drawnMark(project(item.position), "slice-point", item.id === selected));
  for (const item of targets) marks.push(drawnMark(project(item.position), "slice-target", item.id === selected));
  if (beyond.length) marks.push(drawnStop(project(beyond[0])));
  for (const opening of openingsOf(state)) marks.push(...drawnOpening(project(opening.position), opening, port));
  for (const mark of state.fiducials?.items ?? []) marks.push(...drawnFiducial(project, mark));
  if (!driven) for (const place of state.regions?.drawing?.places ?? []) marks.push(drawnMark(project(place), "slice-point drawing", false, 0.9));
  if (!driven && plan?.ghost) marks.push(drawnMark(project(plan.ghost.position), "slice-point ghost", false, 1.3));
  const pierced = driven || isOld(state.corridor) ? null : state.corridor?.verdict?.pierced;
  if (pierced) line([pierced.begin, pierced.end], "slice-pierced");
  if (state.step?.input === "drive") for (const segment of state.tool?.segments ?? []) line(segment, "slice-tool");
  for (const measure of measures) marks.push(...drawnMeasure(measure, project));
  return marks;
}

/**
 * A line in the head: in full where it is near the plane, dotted and faint where it is not.
 * @param {PlaceNear[]} places
 * @param {string} kind
 */
function drawnLine(places, kind) {
  return cutNear(places, NEAR_MM).map((run) => svg("polyline", {
    class: run.near ? kind : `${kind} far`, points: run.places.map(({ x, y }) => `${x.toFixed(2)},${y.toFixed(2)}`).join(" "),
  }));
}

/**
 * @param {PlaceNear} place
 * @param {string} kind
 * @param {boolean} selected
 * @param {number} [size]
 */
function drawnMark({ x, y, away }, kind, selected, size = 1) {
  const near = Math.abs(away) <= NEAR_MM;
  const radius = MARK_PX * size * (near ? 1 : 0.6);
  return svg("circle", { class: selected ? `${kind} selected` : kind, cx: x, cy: y, r: radius, opacity: near ? 1 : 0.45 });
}

/**
 * Where the tool stops before the end of its path.
 * @param {PlaceNear} place
 */
function drawnStop({ x, y, away }) {
  const near = Math.abs(away) <= NEAR_MM;
  const [r, arm] = near ? [STOP_PX, 0.42 * STOP_PX] : [0.6 * STOP_PX, 0.25 * STOP_PX];
  const cross = `M${x - arm} ${y - arm}L${x + arm} ${y + arm}M${x - arm} ${y + arm}L${x + arm} ${y - arm}`;
  return svg("g", { class: "slice-stop", opacity: near ? 1 : 0.55 }, svg("circle", { cx: x, cy: y, r }), svg("path", { d: cross }));
}

/**
 * The openings of the head that are to be clicked, while one of them can be the entry.
 * @param {ViewModel} state
 */
export function openingsOf({ openings, step }) {
  return step?.input === "edit" && openings?.marked ? openings.items : [];
}

/**
 * A ring around an opening, with its name where the plane cuts it.
 * @param {PlaceNear} place
 * @param {OpeningView} opening
 * @param {Port} port
 * @returns {SVGElement[]}
 */
function drawnOpening({ x, y, away }, { name, side, radius_mm: radius }, { perPixel, axes }) {
  const near = Math.abs(away) <= radius;
  const r = Math.max(radius / perPixel, LEAST_OPENING_PX);
  const ring = svg("circle", { class: near ? "slice-opening" : "slice-opening far", cx: x, cy: y, r });
  if (!near) return [ring];
  const before = side === "right" && axes.u[0] > 0.5; // the patient's right is on the left, but in a sagittal slice
  const above = before && x - r - 6 - NAME_PX * name.length < STRIP_PX; // beside it the tools would lie upon it
  const at = above ? { x, y: y - r - 6, "text-anchor": "middle" } : { x: before ? x - r - 6 : x + r + 6, y: y + 4, "text-anchor": before ? "end" : "start" };
  const words = svg("text", { class: "slice-opening-name", ...at });
  words.append(name);
  return [ring, words];
}

/**
 * A bead or point of a registration: a ring around it, whose middle stays to be seen, and a cross where it was measured,
 * joined to it: the line is the residual.
 * @param {(place: Triple) => PlaceNear} project
 * @param {FiducialMark} mark
 */
function drawnFiducial(project, { position, measured, state, selected }) {
  const { x, y, away } = project(position);
  const near = Math.abs(away) <= FIDUCIAL_MM;
  /** @type {SVGElement[]} */
  const marks = [svg("circle", {
    class: selected ? "slice-fiducial selected" : "slice-fiducial", "data-state": state, cx: x, cy: y, r: near ? FIDUCIAL_PX : 0.6 * FIDUCIAL_PX, opacity: near ? 1 : 0.3,
  })];
  if (!measured) return marks;
  const at = project(measured);
  const arm = near ? CROSS_PX : 0.6 * CROSS_PX;
  const path = `M${at.x - arm} ${at.y}h${2 * arm}M${at.x} ${at.y - arm}v${2 * arm}M${x} ${y}L${at.x} ${at.y}`;
  return [...marks, svg("path", { class: "slice-measured", d: path, opacity: near ? 1 : 0.3 })];
}

/**
 * @param {Measure} measure
 * @param {(place: Triple) => PlaceNear} project
 */
function drawnMeasure(measure, project) {
  const places = measure.places.map(project);
  /** @type {SVGElement[]} */
  const marks = drawnLine(places, "slice-measure");
  const ends = places.filter(({ away }) => Math.abs(away) <= NEAR_MM);
  marks.push(...ends.map(({ x, y }) => svg("circle", { class: "slice-measure-end", cx: x, cy: y, r: 2.5 })));
  const words = measureWords(measure);
  if (!words || !ends.length) return marks;
  const [a, b] = measure.kind === "angle" ? [places[1], places[1]] : [places[0], places[1]];
  const label = svg("text", { class: "slice-measure-words", x: (a.x + b.x) / 2 + 6, y: (a.y + b.y) / 2 - 6 });
  label.append(words);
  return [...marks, label];
}
