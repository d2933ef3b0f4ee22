// Whether a path is still the one that something was found for, among what it was found: of a path only its places count.

/** @import { ViewModel } from "/static/js/types.js" */

const SAME_MM = 0.01; // two places nearer than this are one

/**
 * What changes when a path's places do.
 * @param {{ position: number[] }[] | undefined} points
 */
export function pathKey(points) {
  return (points ?? []).map(({ position }) => position.map((value) => Math.round(value / SAME_MM)).join(" ")).join(", ");
}

/**
 * Whether a path passes through the same places as another.
 * @param {{ position: number[] }[]} path
 * @param {{ position: number[] }[]} other
 */
export function samePath(path, other) {
  return path.length > 1 && path.length === other.length
    && path.every(({ position }, at) => Math.hypot(...position.map((value, axis) => value - other[at].position[axis])) < SAME_MM);
}

/**
 * What changes when the tool or its shape does.
 * @param {ViewModel["plan"]} plan
 */
export function toolKey(plan) {
  return JSON.stringify([plan?.tool.name, plan?.tool.bend_deg, plan?.tool.shaft_radius_mm]);
}

/**
 * The one of some items that lies at a place.
 * @template {{ position: number[] }} Item
 * @param {Item[]} items
 * @param {number[]} place
 */
export function itemAt(items, place) {
  return items.find(({ position }) => Math.hypot(...position.map((value, axis) => value - place[axis])) < SAME_MM);
}

/**
 * What changes when that does what a tool is moved by and among: robot and whether its base is kept, margin, registration, protected structures and
 * bone removal.
 * @param {Pick<ViewModel, "plan" | "plan_use" | "regions">} state
 */
export function surroundingsKey({ plan, plan_use: use, regions }) {
  const around = (regions?.items ?? []).map(({ purpose, shape, soft, margin_mm, stiffness_n_per_mm, max_depth_mm }) => [purpose, shape, soft, margin_mm, stiffness_n_per_mm, max_depth_mm]);
  return JSON.stringify([plan?.robot.name, plan?.robot.urdf, plan?.robot.is_placed, plan?.margin_mm, use?.registration, use?.state, around]);
}
