// The part of a line near a plane, which alone is drawn as in the slice.

/** @typedef {{ x: number, y: number }} Place in the plane, mm */
/** @typedef {Place & { away: number }} PlaceNear with its signed distance from the plane, mm */

/**
 * Cut a line of places {x, y, away} into runs that lie within `limit` of the plane and runs that do not.
 * away: signed distance from the plane, linear along each segment. Returns [{near, places: [{x, y}, …]}, …] in order.
 * @param {PlaceNear[]} line
 * @param {number} limit
 */
export function cutNear(line, limit) {
  /** @type {{ near: boolean, places: PlaceNear[] }[]} */
  const runs = [];
  for (let index = 1; index < line.length; index += 1) {
    const [a, b] = [line[index - 1], line[index]];
    const cuts = [-limit, limit]
      .map((level) => (level - a.away) / (b.away - a.away))
      .filter((part) => part > 0 && part < 1)
      .sort((one, other) => one - other);
    const parts = [0, ...cuts, 1];
    for (let cut = 1; cut < parts.length; cut += 1) {
      const middle = along(a, b, (parts[cut - 1] + parts[cut]) / 2);
      const near = Math.abs(middle.away) <= limit;
      if (runs.at(-1)?.near !== near) runs.push({ near, places: [along(a, b, parts[cut - 1])] });
      runs[runs.length - 1].places.push(along(a, b, parts[cut]));
    }
  }
  return runs;
}

/**
 * @param {PlaceNear} a
 * @param {PlaceNear} b
 * @param {number} part
 * @returns {PlaceNear}
 */
function along(a, b, part) {
  const mix = (/** @type {keyof PlaceNear} */ key) => a[key] + (b[key] - a[key]) * part;
  return { x: mix("x"), y: mix("y"), away: mix("away") };
}
