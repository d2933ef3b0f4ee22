// The websocket to the planner: state comes in by sections, commands go out, and a lost line is said and mended.

const RETRY_MS = [250, 500, 1000, 2000];
const STEADY_MS = 10_000; // a line that held for so long lets the next loss begin with the shortest wait again
const AWAKE_MS = 50;
const TAKEN = 4409; // app/session/router.py names the codes

/** Why the planner does not let this window in, what to do, and after how long it is asked again by itself. */
const REFUSALS = {
  4429: { waitMs: 10_000, words: "The planner closed the connection: this window sent more messages than it takes. It is tried again in 10 seconds." },
  4503: { waitMs: 15_000, words: "Too many windows of this planner are open. Close one that is not needed, then try again." },
};
const LOCKED = {
  waitMs: 15_000,
  words: "The planner was started again with another token, and this window may no longer come in. "
    + "Open the address that the planner printed when it started. Plans are saved with every change.",
};
const GONE = "Connection lost – reconnecting … Plans are saved with every change. If the planner was ended, start it again.";

// What streams by itself or follows a hand is dropped on a dead line without a word.
const STREAMS = /^(heartbeat|grip\.release|drive|twist|slice\..*|view\..*|item\.drag)$/;

/** What this tab had open, for a planner that was started anew. */
function remembered() {
  return JSON.parse(sessionStorage.getItem("vfix-open") ?? "{}");
}

function remember(state) {
  if (!state.case || !state.plan || !state.step) return;
  sessionStorage.setItem("vfix-open", JSON.stringify({ case: state.case.id, plan: state.plan.id, step: state.step.name }));
}

function tabId() {
  let id = sessionStorage.getItem("vfix-tab");
  if (!id) {
    const bytes = crypto.getRandomValues(new Uint8Array(12));
    id = Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
    sessionStorage.setItem("vfix-tab", id);
  }
  return id;
}

/** Whether the planner is there but no longer knows this window's token: a browser does not say why a websocket was refused. */
async function lockedOut() {
  try {
    return (await fetch("/static/icon.svg", { method: "HEAD", cache: "no-store" })).status === 401;
  } catch {
    return false; // nobody answers
  }
}

export class Connection extends EventTarget {
  constructor() {
    super();
    this.tab = tabId();
    this.state = {};
    this.connected = false;
    this.everConnected = false;
    this.attempt = 0;
    this.nextRequest = 1;
    this.waiting = new Map();
    this.worker = new Worker("/static/js/link-worker.js");
    this.worker.onmessage = ({ data }) => {
      if (data.kind === "message") this.received(JSON.parse(data.text));
      else this.closed(data.code);
    };
  }

  open() {
    clearTimeout(this.timer);
    this.line = (this.line ?? 0) + 1;
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const query = new URLSearchParams({ tab: this.tab, ...remembered() });
    this.worker.postMessage({ kind: "open", url: `${scheme}://${location.host}/session?${query}` });
  }

  /** Something is held, or nothing any more: the heartbeat starts or ends. The page says by itself that it is awake. */
  hold(on) {
    this.worker.postMessage({ kind: "hold", on });
    clearInterval(this.awake);
    if (on) this.awake = setInterval(() => this.worker.postMessage({ kind: "awake" }), AWAKE_MS);
  }

  /** The planner has spoken: it accepts a websocket before it refuses the window, so that alone says nothing. */
  opened() {
    const again = this.everConnected;
    this.connected = true;
    this.everConnected = true;
    this.openedAt = performance.now();
    this.dispatchEvent(new CustomEvent("link", { detail: { connected: true, again } }));
  }

  async closed(code) {
    if (this.connected && performance.now() - this.openedAt > STEADY_MS) this.attempt = 0;
    this.connected = false;
    for (const { reject } of this.waiting.values()) reject(new Error("The connection was lost."));
    this.waiting.clear();
    if (code === TAKEN) {
      // the same tab id lives in another window (a duplicated tab): take a new identity
      sessionStorage.removeItem("vfix-tab");
      this.tab = tabId();
      location.reload();
      return;
    }
    const { line } = this;
    if (!REFUSALS[code]) this.lost(GONE, false);
    const refusal = REFUSALS[code] ?? (await lockedOut() ? LOCKED : null);
    if (line !== this.line) return; // tried again meanwhile
    if (refusal) this.lost(refusal.words, true);
    const wait = refusal?.waitMs ?? RETRY_MS[Math.min(this.attempt++, RETRY_MS.length - 1)];
    this.timer = setTimeout(() => this.open(), wait);
  }

  lost(words, refused) {
    this.dispatchEvent(new CustomEvent("link", { detail: { connected: false, words, refused } }));
  }

  received(message) {
    if (!this.connected) this.opened();
    if (message.type === "state") {
      Object.assign(this.state, message.sections);
      remember(this.state);
      this.dispatchEvent(new CustomEvent("state", { detail: { state: this.state, changed: Object.keys(message.sections) } }));
      return;
    }
    if (message.type === "reply") {
      const entry = this.waiting.get(message.id);
      if (!entry) return;
      this.waiting.delete(message.id);
      if (message.ok) entry.resolve(message.result);
      else entry.reject(new Error(message.error.message));
      return;
    }
    if (message.type === "note") this.dispatchEvent(new CustomEvent("note", { detail: message }));
  }

  /** Send and forget; a command on a dead line is dropped, never queued, so that nothing stale arrives later. */
  send(type, fields = {}) {
    if (this.connected) {
      this.worker.postMessage({ kind: "send", text: JSON.stringify({ type, ...fields }) });
    } else if (!STREAMS.test(type)) {
      this.dispatchEvent(new CustomEvent("note", { detail: { words: "There is no connection to the planner; that was not done.", error: true } }));
    }
  }

  request(type, fields = {}) {
    return new Promise((resolve, reject) => {
      if (!this.connected) {
        reject(new Error("Not connected."));
        return;
      }
      const id = this.nextRequest++;
      this.waiting.set(id, { resolve, reject });
      this.send(type, { id, ...fields });
    });
  }
}
