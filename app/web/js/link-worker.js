// The websocket lives here, away from drawing: a slow picture must not make a hand on the grip look gone.
// While something is held a heartbeat leaves every 40 ms, but only as long as the page itself still answers.

const HEARTBEAT_MS = 40;
const PAGE_SILENT_MS = 250; // a page that has not said a word for so long may have missed the release

/** @type {WebSocket | null} */
let socket = null;
/** @type {number | null} */
let timer = null;
let pageSeenAt = 0;

function beat() {
  if (performance.now() - pageSeenAt > PAGE_SILENT_MS) return;
  if (socket?.readyState === WebSocket.OPEN) socket.send('{"type":"heartbeat"}');
}

/** @param {boolean} on */
function hold(on) {
  if (on && timer === null) {
    beat();
    timer = setInterval(beat, HEARTBEAT_MS);
  } else if (!on && timer !== null) {
    clearInterval(timer);
    timer = null;
  }
}

/** @param {string} url */
function open(url) {
  const mine = new WebSocket(url);
  const before = socket;
  socket = mine;
  before?.close();
  mine.onmessage = (event) => { if (socket === mine) postMessage({ kind: "message", text: event.data }); };
  mine.onclose = (event) => {
    if (socket !== mine) return; // another one was opened meanwhile
    hold(false);
    postMessage({ kind: "close", code: event.code });
  };
}

/** @typedef {{ kind: "open", url: string } | { kind: "send", text: string } | { kind: "hold", on: boolean } | { kind: "awake" }} Order */

onmessage = (/** @type {MessageEvent<Order>} */ { data }) => {
  pageSeenAt = performance.now();
  if (data.kind === "open") open(data.url);
  else if (data.kind === "send" && socket?.readyState === WebSocket.OPEN) socket.send(data.text);
  else if (data.kind === "hold") hold(data.on);
};
