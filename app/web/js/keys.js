// Keys, and what is held: a key, a button, the grip.

import { hasTextUndo, isUndoKey } from "./fields.js";
import { pacing } from "./frame-pacing.js";
import { isFresh, takeHold } from "./fresh-press.js";
import { letterOf } from "./letters.js";
import { foldExplanation } from "./said.js";

/** @import { Connection } from "./connection.js" */
/** @import { ViewModel } from "./types.js" */

/** What keys do, each by the codes of its two directions. @typedef {Partial<Record<"drive" | "twist" | "tilt", Record<string, -1 | 1>>>} DriveKeys */
/** Of a tool: along its path, and about its shaft. @type {DriveKeys} */
const TOOL = { drive: { ArrowUp: 1, KeyW: 1, ArrowDown: -1, KeyS: -1 }, twist: { KeyA: -1, KeyD: 1 } };
/** Of a robot whose camera is turned: along the lumen, and the camera to a side, up and down. @type {DriveKeys} */
const CAMERA = { drive: { KeyW: 1, KeyS: -1 }, twist: { ArrowLeft: -1, KeyA: -1, ArrowRight: 1, KeyD: 1 }, tilt: { ArrowUp: 1, ArrowDown: -1 } };

/** Sent to the window when held controls are not reliable any more: keys, buttons and the grip are released. */
export const LET_GO = "vfix:let-go";

export function letGoOfEverything() {
  window.dispatchEvent(new Event(LET_GO));
}

/** The release of a key or button while another window has the focus is not reported. */
function watchForLoss() {
  window.addEventListener("blur", () => queueMicrotask(() => {
    // the page also loses the focus when the scene inside it takes it: that is no reason to let go
    if (document.activeElement?.id !== "scene" || !document.hasFocus()) letGoOfEverything();
  }));
  window.addEventListener("pagehide", letGoOfEverything);
  document.addEventListener("visibilitychange", () => { if (document.hidden) letGoOfEverything(); });
}

export class Keys {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    /** @type {Set<string>} codes of the keys that drive */
    this.held = new Set();
    /** @type {Set<string>} */
    this.holds = new Set();
    /** @type {((event: KeyboardEvent) => boolean)[]} what else a key may mean; the first that knows it has it */
    this.shortcuts = [];
    // capture: while the robot runs no part of the page has the drive keys before
    window.addEventListener("keydown", (event) => this.drives(event), { capture: true });
    window.addEventListener("keydown", (event) => this.down(event));
    window.addEventListener("keyup", (event) => this.up(event));
    window.addEventListener(LET_GO, () => this.letGo());
    watchForLoss();
    watchFocus();
  }

  /**
   * Whether the key drives the robot that this window runs; it does then.
   * @param {KeyboardEvent} event
   */
  drives(event) {
    if (!isRunning(this.connection.state) || !this.isDriveKey(event) || hasOwnUse(event) || isDialogOpen()) return false;
    event.preventDefault();
    event.stopImmediatePropagation();
    this.press(event);
    return true;
  }

  /** @param {KeyboardEvent} event */
  down(event) {
    if (this.drives(event)) return;
    const target = /** @type {Partial<HTMLInputElement> | null} */ (event.target);
    const driving = this.connection.state.step?.input === "drive" && this.isDriveKey(event) && !movesSlider(event);
    // a slider that keeps the focus is moved by ← and →: where keys drive, ↑ and ↓ do so, and change no margin
    const undoing = isUndoKey(event) && !(isText(target) && hasTextUndo(target)) && !isDialogOpen();
    if (typing(event) && !(driving && target?.type === "range") && !undoing && !isFindKey(event)) return;
    const inScene = event.view && event.view !== window;
    if ((!isDialogOpen() && foldExplanation(event)) || this.command(event) || this.shortcut(event)) {
      if (undoing) this.connection.say("anew", null); // a field may show what was never drawn: edit and undo lie in one frame
      event.preventDefault();
      event.stopImmediatePropagation();
      return;
    }
    if (driving && !isDialogOpen()) {
      event.preventDefault();
      this.press(event);
    }
    // the viewer has hot keys of its own, which the page does not mention
    if (inScene) event.stopImmediatePropagation();
  }

  /**
   * A drive key goes down, or repeats: a hand that a busy machine has lost takes hold again by a repeat.
   * @param {KeyboardEvent} event
   */
  press(event) {
    if (event.repeat && !isFresh(event)) return;
    const { code } = event;
    this.held.add(code);
    this.hold("keys", true);
    takeHold(event, () => this.held.has(code), () => this.sendHeld());
  }

  /** @param {KeyboardEvent} event */
  up(event) {
    if (!this.held.delete(event.code)) return;
    event.stopImmediatePropagation();
    this.sendHeld();
  }

  /**
   * Whether the key is a command of the tab, which is sent then.
   * @param {KeyboardEvent} event
   */
  command(event) {
    const send = (/** @type {"undo" | "redo" | "ghost.confirm" | "ghost.cancel"} */ type) => {
      this.connection.send(type);
      return true;
    };
    const { tagName } = /** @type {Partial<Element>} */ (event.target ?? {});
    if (this.connection.state.step?.input !== "edit" || event.repeat) return false;
    const control = event.ctrlKey || event.metaKey;
    if (control && letterOf(event) === "Z") return send(event.shiftKey ? "redo" : "undo");
    if (control && letterOf(event) === "Y") return send("redo");
    const { plan, regions } = this.connection.state;
    const ghost = plan?.ghost;
    if (regions?.drawing?.places.length && event.key === "Enter" && tagName !== "BUTTON") {
      this.connection.send("region.done");
      return true;
    }
    if (ghost && event.key === "Enter" && tagName !== "BUTTON") return send("ghost.confirm");
    if (event.key === "Escape" && !isDialogOpen()) return send("ghost.cancel");
    if (event.key === "Delete" && isOfAnother(event)) return false;
    if (event.key === "Delete" && ghost) return send("ghost.cancel");
    if (event.key === "F2" && tagName !== "TR" && !isDialogOpen()) {
      document.getElementById("rename-item")?.click();
      return true;
    }
    if (event.key === "Delete" && tagName !== "TR" && plan?.selected) {
      this.connection.send("item.delete", { item_id: plan.selected });
      return true;
    }
    return false;
  }

  /**
   * Whether the key is a shortcut of the page, which is done then; none is while a question is open.
   * @param {KeyboardEvent} event
   */
  shortcut(event) {
    return !isDialogOpen() && this.shortcuts.some((known) => known(event));
  }

  /** What the keys of the tab do that is shown. */
  get table() {
    return this.connection.state.scope?.hand ? CAMERA : TOOL;
  }

  /** @param {KeyboardEvent} event */
  isDriveKey({ code, ctrlKey, metaKey, altKey }) {
    return Object.values(this.table).some((codes) => code in codes) && !(ctrlKey || metaKey || altKey);
  }

  /** Where the held keys lead. */
  get directions() {
    const { drive = {}, twist = {}, tilt = {} } = this.table;
    return { drive: directionOf(this.held, drive), twist: directionOf(this.held, twist), tilt: directionOf(this.held, tilt) };
  }

  sendHeld() {
    const { drive, twist, tilt } = this.directions;
    this.connection.send("drive", { direction: drive });
    this.connection.send("twist", { direction: twist });
    if (this.table.tilt) this.connection.send("tilt", { direction: tilt });
    this.hold("keys", this.held.size > 0);
  }

  letGo() {
    if (!this.held.size) return;
    this.held.clear();
    this.sendHeld();
  }

  /**
   * While anything is held a heartbeat is sent; without it the planner lets the force decay.
   * @param {string} what
   * @param {boolean} on
   */
  hold(what, on) {
    const before = this.holds.size;
    if (on) this.holds.add(what);
    else this.holds.delete(what);
    if (Boolean(before) === Boolean(this.holds.size)) return;
    this.connection.hold(this.holds.size > 0);
    pacing.hold(this.holds.size > 0 && this.connection.state.step?.input === "drive");
  }
}

/**
 * Whether the key opens the command palette, wherever the focus is.
 * @param {KeyboardEvent} event
 */
export function isFindKey(event) {
  return (event.ctrlKey || event.metaKey) && !event.shiftKey && !event.altKey && letterOf(event) === "K";
}

/** Whether the control that has the focus was given it by a pointer. */
let focusByPointer = false;

function watchFocus() {
  let pointing = false;
  const options = { capture: true };
  window.addEventListener("pointerdown", () => { pointing = true; }, options);
  window.addEventListener("keydown", ({ code }) => { if (code === "Tab") pointing = false; }, options);
  window.addEventListener("focusin", () => { focusByPointer = pointing; }, options);
}

/**
 * Whether Space writes in the control that has the focus, presses it or ticks it. A slider does nothing with it, and a control
 * that was clicked leaves it to the page: who has just ticked a box and presses Space wants the robot to stop.
 * @param {Pick<KeyboardEvent, "target">} event
 */
export function ownsSpace({ target }) {
  const within = (/** @type {string} */ controls) => Boolean(/** @type {Partial<Element> | null} */ (target)?.closest?.(controls));
  return within("select, input:not([type=range]):not([type=checkbox]), [contenteditable]") || (!focusByPointer && within("button, summary, input[type=checkbox]"));
}

/**
 * Where the held keys lead together; two that are opposite lead nowhere.
 * @param {Set<string>} held
 * @param {Record<string, number>} table
 */
function directionOf(held, table) {
  const sum = [...held].reduce((total, code) => total + (table[code] ?? 0), 0);
  return /** @type {-1 | 0 | 1} */ (Math.sign(sum));
}

/** @param {ViewModel} state */
function isRunning({ step, rehearsal }) {
  return step?.input === "drive" && rehearsal?.state === "running" && Boolean(rehearsal.mine);
}

/**
 * Whether Delete means something else than what is selected in the plan: a question or list is open, or a row has the focus.
 * @param {KeyboardEvent} event
 */
function isOfAnother({ target }) {
  return isDialogOpen() || Boolean(/** @type {Partial<Element> | null} */ (target)?.closest?.("li.row"));
}

function isDialogOpen() {
  return Boolean(document.querySelector('dialog[open], [popover="auto"]:popover-open'));
}

/**
 * Whether the key moves the slider that has the focus, which no other key does where keys drive.
 * @param {KeyboardEvent} event
 */
function movesSlider({ code, target }) {
  return /** @type {Partial<HTMLInputElement> | null} */ (target)?.type === "range" && ["ArrowLeft", "ArrowRight"].includes(code);
}

/**
 * Whether what has the focus needs the key itself: text needs all, a list its arrows, a slider two of them.
 * @param {KeyboardEvent} event
 */
function hasOwnUse(event) {
  const { code, target } = event;
  const { tagName, type = "", isContentEditable } = /** @type {Partial<HTMLInputElement>} */ (target ?? {});
  if (movesSlider(event)) return true;
  if (tagName === "SELECT" || (tagName === "INPUT" && type === "radio")) return code.startsWith("Arrow");
  if (tagName === "INPUT") return !["range", "checkbox", "button", "color", "file"].includes(type);
  return tagName === "TEXTAREA" || Boolean(isContentEditable);
}

/**
 * Whether text is typed into it: a list and a slider have no undo of their own.
 * @param {Partial<HTMLInputElement> | null} target
 */
function isText(target) {
  return target?.tagName === "TEXTAREA" || (target?.tagName === "INPUT" && !["range", "radio", "color", "file"].includes(target.type ?? ""));
}

/**
 * Whether the key belongs to a field: all of them to one that takes text, to a slider those that move it.
 * @param {Pick<KeyboardEvent, "code" | "target">} event
 */
function typing({ code, target }) {
  const { tagName, type = "" } = /** @type {Partial<HTMLInputElement>} */ (target ?? {});
  if (type === "range") return /^(Arrow|Page|Home|End)/.test(code);
  return tagName === "SELECT" || tagName === "TEXTAREA" || (tagName === "INPUT" && !["checkbox", "button"].includes(type));
}
