// What the plots show of a run's series: numbers only, so that they can be checked without a page.

/** @import { Triple } from "/static/js/slices/grid.js" */
/** @import { LumenSeriesPublic, SeriesPublic } from "/static/js/types.js" */

/** @typedef {{ x: number[], lines: (number | null)[][] }} Curves x ascending; each line as long as x */

const BIN_MM = 0.5; // of the path, for the error along it
const DEGREES = 180 / Math.PI;

/**
 * Largest tip error in every half millimetre of the path, once it is followed; for several runs over one axis.
 * @param {SeriesPublic[]} runs
 * @returns {Curves}
 */
export function errorAlongPath(runs) {
  const tables = runs.map((series) => {
    const following = ["follow", "done"].map((name) => series.phases.indexOf(name));
    /** @type {Map<number, number>} */
    const found = new Map();
    series.error_mm.forEach((error, index) => {
      const s = series.progress_mm[index];
      if (error === null || s === null || !following.includes(series.phase[index])) return;
      const bin = Math.floor(s / BIN_MM);
      found.set(bin, Math.max(error, found.get(bin) ?? 0));
    });
    return found;
  });
  const bins = [...new Set(tables.flatMap((table) => [...table.keys()]))].sort((a, b) => a - b);
  return { x: bins.map((bin) => (bin + 0.5) * BIN_MM), lines: tables.map((table) => bins.map((bin) => table.get(bin) ?? null)) };
}

/**
 * A value of every run over one axis of time: the first run's samples, and what the others had then.
 * @template {{ t_s: number[] }} Series
 * @param {Series[]} runs
 * @param {(series: Series) => (number | null)[]} of
 * @returns {Curves}
 */
export function overTime(runs, of) {
  const x = [...new Set(runs.flatMap(({ t_s: times }) => times))].sort((a, b) => a - b);
  const lines = runs.map((series) => {
    const its = of(series);
    const values = new Map(series.t_s.map((t, index) => [t, its[index]]));
    let last = /** @type {number | null} */ (null);
    const end = series.t_s.at(-1) ?? 0;
    return x.map((t) => {
      if (values.has(t)) last = values.get(t) ?? null;
      return t <= end ? last : null;
    });
  });
  return { x, lines };
}

/** Least clearance to any structure, null where none is within reach. @param {SeriesPublic} series */
export function leastClearance(series) {
  return series.t_s.map((...[, index]) => {
    const near = series.clearance_mm.map((row) => row[index]).filter((value) => value !== null);
    return near.length ? Math.min(...near) : null;
  });
}

/**
 * Speeds of the joints in mm/s and °/s; of a free hand, which has none, that of the tip.
 * @param {SeriesPublic} series
 * @returns {{ name: string, values: number[] }[]}
 */
export function speeds(series) {
  if (!series.joints.length) return [{ name: "Tip", values: tipSpeed(series) }];
  return series.joints.map(({ unit }, joint) => ({ name: String(joint + 1), values: series.speed[joint].map((value) => (unit === "rad" ? DEGREES * value : value)) }));
}

/** @param {SeriesPublic} series mm/s */
export function tipSpeed({ tip, t_s: times }) {
  return tip.map((place, index) => {
    const before = Math.max(index - 1, 0);
    const span = times[index] - times[before];
    return span > 0 ? Math.hypot(...place.map((value, axis) => value - tip[before][axis])) / span : 0;
  });
}

/**
 * When a run came to a place of its path first, s.
 * @param {SeriesPublic} series
 * @param {number} s mm
 */
export function timeAlong({ progress_mm: progress, t_s: times }, s) {
  const index = progress.findIndex((value) => value !== null && value >= s - BIN_MM / 2);
  return times[index < 0 ? times.length - 1 : index];
}

/**
 * Number of the last sample that is not after a time; the first one before all.
 * @param {number[]} times ascending, s
 * @param {number} t
 */
export function sampleAt(times, t) {
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = Math.ceil((low + high) / 2);
    if (times[middle] <= t + 1e-9) low = middle;
    else high = middle - 1;
  }
  return low;
}

/**
 * The axes of the tool's parts at a time, between two samples on the straight line.
 * @param {SeriesPublic} series
 * @param {number} t s
 * @returns {[Triple, Triple][]}
 */
export function segmentsAt({ t_s: times, segments }, t) {
  const { at, next, share } = between(times, t);
  return segments[at].map((part, index) => {
    const values = part.map((value, axis) => value + share * (segments[next][index][axis] - value));
    return [/** @type {Triple} */ (values.slice(0, 3)), /** @type {Triple} */ (values.slice(3))];
  });
}

/**
 * The side of the tool at a time.
 * @param {SeriesPublic} series
 * @param {number} t s
 */
export function sideAt({ t_s: times, side }, t) {
  const { at, next, share } = between(times, t);
  return /** @type {Triple} */ (side[at].map((value, axis) => value + share * (side[next][axis] - value)));
}

/**
 * A robot in a lumen at a time: the axes of its links from the tip on, its camera, and the forces on the hand of the
 * sample before. Links keep their length.
 * @param {LumenSeriesPublic} series
 * @param {number} t s
 */
export function robotAt({ t_s: times, chain_mm: chains, eye, shaft, side, guidance_xy_n: guidance, resistance_xy_n: resistance }, t) {
  const { at, next, share } = between(times, t);
  const mixed = (/** @type {Triple[]} */ of) => /** @type {Triple} */ (of[at].map((value, axis) => value + share * (of[next][axis] - value)));
  const joints = chains[at].map((place, joint) => /** @type {Triple} */ (place.map((value, axis) => value + share * (chains[next][joint][axis] - value))));
  const [first, second] = chains[0], long = Math.hypot(...second.map((value, axis) => value - first[axis]));
  /** @type {[Triple, Triple][]} */
  const segments = [];
  for (let joint = joints.length - 2, far = joints[joints.length - 1]; joint >= 0; joint -= 1) {
    const way = far.map((value, axis) => value - joints[joint][axis]), scale = long / Math.max(Math.hypot(...way), 1e-9);
    const near = /** @type {Triple} */ (far.map((value, axis) => value - scale * way[axis]));
    segments.push([near, far]);
    far = near;
  }
  const [guiding, resisting] = [guidance, resistance].map((force) => /** @type {[number, number]} */ (force[at].map((value) => value ?? 0)));
  return { segments, camera: { tip: mixed(eye), shaft: mixed(shaft), side: mixed(side) }, forces: { guidance: guiding, resistance: resisting } };
}

/**
 * The samples before and after a time, and how far it is from the one to the other.
 * @param {number[]} times s
 * @param {number} t s
 */
function between(times, t) {
  const at = sampleAt(times, t), next = Math.min(at + 1, times.length - 1);
  const span = times[next] - times[at];
  return { at, next, share: span > 0 ? Math.min(Math.max((t - times[at]) / span, 0), 1) : 0 };
}
