// The websocket to the planner: state comes in by sections, commands go out, and a lost line is said and mended.

const RETRY_MS = [250, 500, 1000, 2000];
const AWAKE_MS = 50;

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
      else if (data.kind === "open") this.opened();
      else this.closed(data.code);
    };
  }

  open() {
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

  opened() {
    const again = this.everConnected;
    this.connected = true;
    this.everConnected = true;
    this.attempt = 0;
    this.dispatchEvent(new CustomEvent("link", { detail: { connected: true, again } }));
  }

  closed(code) {
    this.connected = false;
    for (const { reject } of this.waiting.values()) reject(new Error("The connection was lost."));
    this.waiting.clear();
    if (code === 4409) {
      // the same tab id lives in another window (a duplicated tab): take a new identity
      sessionStorage.removeItem("vfix-tab");
      this.tab = tabId();
      location.reload();
      return;
    }
    this.dispatchEvent(new CustomEvent("link", { detail: { connected: false, again: this.everConnected } }));
    const wait = RETRY_MS[Math.min(this.attempt++, RETRY_MS.length - 1)];
    setTimeout(() => this.open(), wait);
  }

  received(message) {
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
    if (this.connected) this.worker.postMessage({ kind: "send", text: JSON.stringify({ type, ...fields }) });
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
