// Poses of a drive as they come: the binary channel of the planner, of which the newest row counts.
/** @import { Triple } from "../slices/grid.js" */
/** @import { ScopePose } from "./lens.js" */

const AGAIN_MS = 1000;
const TOO_MANY = 4503;

export class PoseChannel {
  /**
   * @param {(pose: ScopePose, row: (name: string) => number) => void} came row: any number of it by its name
   * @param {(words: string) => void} say why there are no poses; '' where there are
   */
  constructor(came, say) {
    this.came = came;
    this.say = say;
    /** @type {string | null} address of the drive that is followed */
    this.address = null;
    /** @type {WebSocket | null} */
    this.socket = null;
    /** @type {number | undefined} */
    this.timer = undefined;
  }

  /**
   * Follow a drive; null follows none.
   * @param {string | null} address
   */
  follow(address) {
    if (address === this.address) return;
    this.address = address;
    this.say("");
    clearTimeout(this.timer);
    this.socket?.close();
    this.socket = null;
    if (address !== null) this.open(address);
  }

  /** @param {string} address */
  open(address) {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}${address}`);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    /** @type {((row: Float64Array) => ScopePose) | null} */
    let read = null;
    /** @type {string[]} */
    let fields = [];
    socket.addEventListener("message", ({ data }) => {
      if (socket !== this.socket) return;
      if (typeof data === "string") {
        fields = JSON.parse(data).fields;
        read = readerOf(fields);
      } else if (read) {
        const row = new Float64Array(data);
        this.take(read(row), (name) => row[fields.indexOf(name)]);
      }
    });
    socket.addEventListener("close", ({ code }) => {
      if (socket !== this.socket) return;
      this.say(code === TOO_MANY ? "Too many programs read the tool’s poses." : "Poses do not arrive.");
      this.timer = setTimeout(() => { if (socket === this.socket) this.open(address); }, AGAIN_MS);
    });
  }

  /**
   * @param {ScopePose} pose
   * @param {(name: string) => number} row
   */
  take(pose, row) {
    this.say("");
    this.came(pose, row);
  }
}

/**
 * Reads a row by the names of its numbers.
 * @param {string[]} fields
 */
export function readerOf(fields) {
  const eye = fields.includes("eye_x") ? "eye" : "tip"; // a camera may lie ahead of the tip
  const first = [eye, "shaft", "side"].map((name) => fields.indexOf(`${name}_x`));
  if (first.includes(-1)) throw new Error("The planner's poses have no shaft.");
  return (/** @type {Float64Array} */ row) => {
    const [tip, shaft, side] = first.map((at) => /** @type {Triple} */ ([row[at], row[at + 1], row[at + 2]]));
    return { tip, shaft, side };
  };
}
