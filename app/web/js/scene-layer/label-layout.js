// Where words beside places of the scene stand: within the view, not on one another, and not below what lies upon it.

export const EDGE_PX = 6;
export const ASIDE_PX = 12; // of a label from its place
const ABOVE = 1.3; // of its own height
const APART_PX = 3; // of a letter from what lies upon the scene
const MOST_ASIDE_PX = 48; // that a letter moves for it

/** @typedef {{ left: number, top: number, right: number, bottom: number }} Box px */
/** @typedef {{ x: number, y: number, width: number, height: number, first: boolean, away: number }} LabelRequest where a place is, px, and the size of its words; first: before all others; away: from the eye */

/**
 * For each request the upper left corner of its words, in px; null where they would hide others, of which the nearer come first.
 * @param {(LabelRequest | null)[]} requests
 * @param {{ width: number, height: number }} view
 * @param {Box[]} taken by what lies upon the scene
 */
export function laidOut(requests, view, taken) {
  /** @type {({ x: number, y: number } | null)[]} */
  const corners = requests.map(() => null);
  const boxes = [...taken];
  const order = [...requests.keys()].filter((index) => requests[index] && isIn(requests[index], view));
  const rank = (/** @type {number} */ index) => (requests[index]?.first ? -Infinity : requests[index]?.away ?? 0);
  order.sort((a, b) => rank(a) - rank(b));
  for (const index of order) {
    const request = /** @type {LabelRequest} */ (requests[index]);
    const x = within(request.x + ASIDE_PX, view.width - request.width - EDGE_PX);
    const y = within(request.y - ABOVE * request.height, view.height - request.height - EDGE_PX);
    const box = { left: x, top: y, right: x + request.width, bottom: y + request.height };
    if (boxes.some((other) => meet(box, other))) continue;
    boxes.push(box);
    corners[index] = { x, y };
  }
  return corners;
}

/**
 * @param {{ x: number, y: number } | null} place
 * @param {{ width: number, height: number }} view
 */
export function isIn(place, { width, height }) {
  return place !== null && place.x > EDGE_PX && place.y > EDGE_PX && place.x < width - EDGE_PX && place.y < height - EDGE_PX;
}

/**
 * The centre of a letter, moved by as little as brings it clear of what lies upon the scene; null where that is too far.
 * @param {{ x: number, y: number }} centre px
 * @param {{ width: number, height: number }} size of the letter
 * @param {{ width: number, height: number }} view
 * @param {Box[]} taken
 */
export function clearOf({ x, y }, { width, height }, view, taken) {
  const [halfWide, halfHigh] = [width / 2 + APART_PX, height / 2 + APART_PX];
  const isFree = (/** @type {{ x: number, y: number }} */ at) => isIn(at, view)
    && !taken.some((box) => meet(box, { left: at.x - halfWide, top: at.y - halfHigh, right: at.x + halfWide, bottom: at.y + halfHigh }));
  const ways = taken.flatMap(({ left, top, right, bottom }) => [{ x, y: bottom + halfHigh }, { x, y: top - halfHigh }, { x: right + halfWide, y }, { x: left - halfWide, y }]);
  const apart = (/** @type {{ x: number, y: number }} */ at) => Math.hypot(at.x - x, at.y - y);
  const near = [{ x, y }, ...ways].filter((at) => apart(at) <= MOST_ASIDE_PX && isFree(at));
  return near.reduce((/** @type {{ x: number, y: number } | null} */ best, at) => (best && apart(best) <= apart(at) ? best : at), null);
}

/**
 * @param {number} value
 * @param {number} most
 */
function within(value, most) {
  return Math.max(EDGE_PX, Math.min(value, most));
}

/**
 * @param {Box} a
 * @param {Box} b
 */
function meet(a, b) {
  return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}
