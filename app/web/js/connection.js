// The websocket to the planner: state comes in by sections, commands go out, and a lost line is said and mended.

const RETRY_MS = [250, 500, 1000, 2000];

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
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    this.socket = new WebSocket(`${scheme}://${location.host}/session?tab=${this.tab}`);
    this.socket.addEventListener("open", () => this.opened());
    this.socket.addEventListener("message", (event) => this.received(JSON.parse(event.data)));
    this.socket.addEventListener("close", (event) => this.closed(event));
  }

  opened() {
    const again = this.everConnected;
    this.connected = true;
    this.everConnected = true;
    this.attempt = 0;
    this.dispatchEvent(new CustomEvent("link", { detail: { connected: true, again } }));
  }

  closed(event) {
    this.connected = false;
    for (const { reject } of this.waiting.values()) reject(new Error("The connection was lost."));
    this.waiting.clear();
    if (event.code === 4409) {
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
    if (this.connected && this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ type, ...fields }));
  }

  request(type, fields = {}) {
    return new Promise((resolve, reject) => {
      if (!this.connected) {
        reject(new Error("Not connected."));
        return;
      }
      const id = this.nextRequest++;
      this.waiting.set(id, { resolve, reject });
      this.socket.send(JSON.stringify({ type, id, ...fields }));
    });
  }
}
