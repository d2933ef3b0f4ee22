// The websocket to the planner: state comes in by sections, commands go out, and a lost line is said and mended.

/** @import { Answer, CommandType, Fields, HelloMessage, Message, NoteMessage, ViewModel } from "./types.js" */
import { Backoff } from "./backoff.js";
import { keep, recallText } from "./remember.js";

/** @typedef {{ connected: boolean, again?: boolean, words?: string, refused?: boolean }} Link what a `link` event tells */
/** @typedef {{ waitMs: number, words: string }} Refusal */
/** @typedef {{ link: Link, hello: HelloMessage, state: { state: ViewModel, changed: string[] }, note: Pick<NoteMessage, "words" | "error">, refused: null, anew: null }} Events */

export const VERSION = 1; // of the messages; app/messages/version.py has the planner's
const AWAKE_MS = 50;
const TAKEN = 4409; // app/session/router.py names the codes
const OUTDATED = 4426;

/**
 * Why the planner does not let this window in, what to do, and after how long it is asked again by itself.
 * @type {Record<number, Refusal | undefined>}
 */
const REFUSALS = {
  4429: { waitMs: 10_000, words: "Too many messages from this window. Trying again in 10 seconds." },
  [OUTDATED]: { waitMs: Infinity, words: "The planner was updated. Reload the page; every change is saved." },
  4503: { waitMs: 15_000, words: "Too many windows are open. Close one, then try again." },
};
const LOCKED = {
  waitMs: 15_000,
  words: "This window is signed out. Open the new address. The planner was started again with another token; "
    + "paste the address that it printed into the address bar. Every change is saved.",
};
const GONE = "Connection lost, reconnecting … Every change is saved. If the planner was ended, start it again and open the address that it prints.";

// What streams by itself or follows a hand is dropped on a dead line without a word.
const STREAMS = /^(heartbeat|grip\.release|drive|twist|tilt|camera\.drag|axes|rate|slice\..*|view\..*|item\.drag|review\.moment)$/;

/**
 * What this tab had open, the plan of a head or the route of a lumen among it, for a planner that was started anew; a new tab has what this browser had open last.
 * @returns {Record<string, string>}
 */
function remembered() {
  try {
    return JSON.parse(sessionStorage.getItem("vfix-open") ?? recallText("open") ?? "{}");
  } catch {
    return {}; // what is stored is damaged
  }
}

/**
 * @param {ViewModel} state
 * @param {Partial<ViewModel>} news the sections that have just come; figures come fifty times a second
 */
function remember(state, news) {
  if (!(news.case || news.plan || news.route || news.step) || !state.case || !state.step) return;
  const open = { case: state.case.id, plan: state.plan?.id ?? state.route?.id };
  sessionStorage.setItem("vfix-open", JSON.stringify({ ...open, step: state.step.name }));
  keep("open", JSON.stringify(open));
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

/** Says `hello`, `state`, `link`, `note` and `refused`; `anew` where controls may show what the data never had; see {@link Events}. */
export class Connection extends EventTarget {
  constructor() {
    super();
    this.tab = tabId();
    /** @type {ViewModel} */
    this.state = {};
    this.connected = false;
    this.everConnected = false;
    this.outdated = false;
    this.openedAt = 0;
    this.line = 0;
    this.backoff = new Backoff();
    this.nextRequest = 1;
    /** @type {Map<number, { resolve: (answer: any) => void, reject: (error: Error) => void }>} */
    this.waiting = new Map();
    /** @type {number | undefined} */
    this.timer = undefined;
    /** @type {number | undefined} */
    this.awake = undefined;
    this.worker = new Worker("/static/js/link-worker.js");
    this.worker.onmessage = ({ data }) => {
      if (data.kind === "message") this.received(JSON.parse(data.text));
      else this.closed(data.code);
    };
  }

  /**
   * Listen to one of the {@link Events}.
   * @template {keyof Events} E
   * @param {E} name
   * @param {(detail: Events[E]) => void} listener
   */
  on(name, listener) {
    this.addEventListener(name, (event) => listener(/** @type {CustomEvent<Events[E]>} */ (event).detail));
  }

  /**
   * @template {keyof Events} E
   * @param {E} name
   * @param {Events[E]} detail
   */
  say(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  open() {
    if (this.outdated) {
      location.reload();
      return;
    }
    clearTimeout(this.timer);
    this.giveUp(); // the worker does not tell the end of a line that is replaced
    this.line += 1;
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const query = new URLSearchParams({ tab: this.tab, ...remembered() });
    this.worker.postMessage({ kind: "open", url: `${scheme}://${location.host}/session?${query}` });
  }

  /**
   * Something is held, or nothing any more: the heartbeat starts or ends. The page says by itself that it is awake.
   * @param {boolean} on
   */
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
    this.say("link", { connected: true, again });
  }

  /** Requests sent over the connection that ends are not answered any more. */
  giveUp() {
    const asked = [...this.waiting.values()];
    this.waiting.clear();
    for (const { reject } of asked) reject(new Error("The connection was lost."));
  }

  /** @param {number} code of the websocket */
  async closed(code) {
    if (this.connected) this.backoff.lost(performance.now() - this.openedAt);
    this.connected = false;
    this.giveUp();
    if (code === TAKEN) {
      // the same tab id lives in another window (a duplicated tab): take a new identity
      sessionStorage.removeItem("vfix-tab");
      this.tab = tabId();
      location.reload();
      return;
    }
    this.outdated ||= code === OUTDATED;
    const { line } = this;
    if (!REFUSALS[code]) this.lost(GONE, false);
    const refusal = REFUSALS[code] ?? (await lockedOut() ? LOCKED : null);
    if (line !== this.line) return; // tried again meanwhile
    if (refusal) this.lost(refusal.words, true);
    const wait = refusal?.waitMs ?? this.backoff.next();
    if (Number.isFinite(wait)) this.timer = setTimeout(() => this.open(), wait);
  }

  /**
   * @param {string} words
   * @param {boolean} refused
   */
  lost(words, refused) {
    this.say("link", { connected: false, words, refused });
  }

  /**
   * The planner says its version first, and hears the page's; with another one neither understands what follows.
   * @param {HelloMessage} message
   */
  greet(message) {
    this.worker.postMessage({ kind: "send", text: JSON.stringify({ type: "hello", version: VERSION, role: "holds" }) });
    if (message.version !== VERSION) {
      this.closed(OUTDATED);
      return;
    }
    this.opened();
    this.say("hello", message);
  }

  /** @param {Message} message */
  received(message) {
    if (this.outdated) return;
    if (message.type === "hello") {
      this.greet(message);
      return;
    }
    if (!this.connected) this.opened();
    if (message.type === "state") {
      Object.assign(this.state, message.sections);
      remember(this.state, message.sections);
      this.say("state", { state: this.state, changed: Object.keys(message.sections) });
      return;
    }
    if (message.type === "reply") {
      const entry = this.waiting.get(message.id);
      if (!entry) return;
      this.waiting.delete(message.id);
      if (message.ok) entry.resolve(message.result);
      else {
        entry.reject(new Error(message.error?.message ?? "The planner refused that."));
        this.say("refused", null);
      }
      return;
    }
    if (message.type === "note") {
      this.say("note", message);
      if (message.error) this.say("refused", null);
    }
  }

  /**
   * Send and forget; a command on a dead line is dropped, never queued, so that nothing stale arrives later.
   * @template {CommandType} T
   * @param {T} type
   * @param {Fields<T>} fields
   */
  send(type, ...fields) {
    this.post(type, { ...fields[0] });
  }

  /**
   * @param {CommandType} type
   * @param {object} fields
   */
  post(type, fields) {
    if (this.connected) {
      this.worker.postMessage({ kind: "send", text: JSON.stringify({ type, ...fields }) });
    } else if (!STREAMS.test(type)) {
      this.say("note", { words: "There is no connection to the planner; that was not done.", error: true });
      this.say("refused", null);
    }
  }

  /**
   * Send and wait for the answer; rejects with the planner's words where it refuses.
   * @template {CommandType} T
   * @param {T} type
   * @param {Fields<T>} fields
   * @returns {Promise<Answer<T>>}
   */
  request(type, ...fields) {
    return new Promise((resolve, reject) => {
      if (!this.connected) {
        reject(new Error("Not connected."));
        return;
      }
      const id = this.nextRequest++;
      this.waiting.set(id, { resolve, reject });
      this.post(type, { id, ...fields[0] });
    });
  }
}
