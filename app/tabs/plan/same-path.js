// Whether a path is still the one that something was found for: only its places count, in order.

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
