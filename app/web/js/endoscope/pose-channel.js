// Poses of a drive as they come: the binary channel of the planner, of which the newest row counts.
/** @import { Triple } from "../slices/grid.js" */
/** @import { ScopePose } from "./lens.js" */

const AGAIN_MS = 1000;
const TOO_MANY = 4503;

export class PoseChannel {
  /**
   * @param {(pose: ScopePose) => void} came
   * @param {(words: string) => void} say why there are no poses; '' where there are
   */
  constructor(came, say) {
    this.came = came;
    this.say = say;
    /** @type {string | null} id of the plan whose drive is followed */
    this.plan = null;
    /** @type {WebSocket | null} */
    this.socket = null;
    /** @type {number | undefined} */
    this.timer = undefined;
  }

  /**
   * Follow the drive of a plan; null follows none.
   * @param {string | null} plan
   */
  follow(plan) {
    if (plan === this.plan) return;
    this.plan = plan;
    this.say("");
    clearTimeout(this.timer);
    this.socket?.close();
    this.socket = null;
    if (plan !== null) this.open(plan);
  }

  /** @param {string} plan */
  open(plan) {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/api/v1/steps/rehearse/poses?plan=${encodeURIComponent(plan)}`);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    /** @type {((row: Float64Array) => ScopePose) | null} */
    let read = null;
    socket.addEventListener("message", ({ data }) => {
      if (socket !== this.socket) return;
      if (typeof data === "string") read = readerOf(JSON.parse(data).fields);
      else if (read) this.take(read(new Float64Array(data)));
    });
    socket.addEventListener("close", ({ code }) => {
      if (socket !== this.socket) return;
      this.say(code === TOO_MANY ? "Too many programs read the tool’s poses." : "Poses do not arrive.");
      this.timer = setTimeout(() => { if (socket === this.socket) this.open(plan); }, AGAIN_MS);
    });
  }

  /** @param {ScopePose} pose */
  take(pose) {
    this.say("");
    this.came(pose);
  }
}

/**
 * Reads a row by the names of its numbers.
 * @param {string[]} fields
 */
export function readerOf(fields) {
  const first = /** @type {const} */ (["tip", "shaft", "side"]).map((name) => fields.indexOf(`${name}_x`));
  if (first.includes(-1)) throw new Error("The planner's poses have no shaft.");
  return (/** @type {Float64Array} */ row) => {
    const [tip, shaft, side] = first.map((at) => /** @type {Triple} */ ([row[at], row[at + 1], row[at + 2]]));
    return { tip, shaft, side };
  };
}
