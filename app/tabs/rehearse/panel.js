// Rehearse: the robot at the entry, the handle in the hand, and the words of what holds it.
import { brief } from "/static/js/brief.js";
import { note } from "/static/js/dialogs.js";
import { fillOptions, h, group, whenChanged } from "/static/js/dom.js";
import { EndCard } from "/static/js/end-card.js";
import { isOld } from "/static/js/verdict-line.js";
import { fixed, mm } from "/static/js/format.js";
import { holdButton } from "/static/js/hold.js";
import { isTrial, trialWords } from "/static/js/led-study.js";
import { NearnessGauge } from "/static/js/nearness.js";
import { say } from "/static/js/said.js";
import { UsedRegistration } from "/static/js/used-registration.js";
import { ApproachRow } from "./approach.js";
import { AssignmentGroup } from "./assignment.js";
import { CommentsGroup } from "./comments.js";
import { Countdown } from "./countdown.js";
import { DeviceMenu } from "./device-menu.js";
import { ModesGroup, WITHOUT, isFree } from "./modes.js";
import { preselected } from "./preselected.js";
import { RehearsalStatus } from "./status.js";
import { OptionsGroup } from "./options.js";
import { TruthGroup } from "./truth.js";

/** @import { Parts } from "/static/js/panel.js" */
/** @import { Commands, ItemEntry, RehearsalSection, SettingField, SettingsSection, ViewModel } from "/static/js/types.js" */

/** @typedef {Commands["rehearsal.mode"]["mode"]} Mode */

/** @type {Record<string, string | undefined>} */
const FREEHAND_WORDS = { absent: "Not in your hand yet.", ready: "At the entry, in your hand.", running: `Running. ${WITHOUT}`, paused: "Paused where it is." };
/** @type {Record<string, string | undefined>} */
const STATE_WORDS = { absent: "Not in place yet.", ready: "In place at the entry.", running: "Running: follows the hand and keeps off bone.", paused: "Paused where it is." };
/** @type {Record<string, string>} */
const FREEHAND_TASKS = {
  path: "Nothing leads the tip; its distance from the path is measured.",
  free: "Nothing leads the tip. Contacts are counted.",
  inspect: "Nothing holds the view; its distance from the target is measured.",
};
const CHANGED_WORDS = "The plan has changed. ‘Reset to entry’ takes it as it is now. What is drawn here is what is driven.";
const BLOCKED_WORDS = "The robot goes on as placed before. ‘Reset to entry’ works once the plan has a registration that can be used, or none.";
const NO_TARGETS = "No target to inspect. Add one in Plan.";
const LIVE = ["ready", "running", "paused"];
/** @type {[Mode, string][]} */
const TASKS = [["path", "Along the path"], ["free", "Free"], ["inspect", "Inspect"]];

export default class RehearsePanel {
  /** @param {Parts} parts */
  constructor({ connection, keys }) {
    this.connection = connection;
    this.devices = new DeviceMenu({ connection, keys });
    this.status = new RehearsalStatus();
    this.nearness = new NearnessGauge();
    this.changedState = whenChanged();
    this.changedTargets = whenChanged();
    this.changedFields = whenChanged();
    this.words = h("p", { class: "words" });
    this.startButton = h("button", { type: "button", class: "primary", id: "start", onclick: () => this.startOrPause() });
    this.resetButton = h("button", { type: "button", id: "reset", onclick: () => this.resetOrEnd() }, "Reset to entry");
    this.startRow = h("div", { class: "buttons even" }, this.startButton, this.resetButton);
    this.leaseWords = h("p", { class: "words" });
    this.leaseButton = h("button", { type: "button", class: "wide", id: "lease", onclick: () => this.lease() });
    this.handle = group("Handle", null, this.leaseWords, this.leaseButton);
    this.modeButtons = TASKS.map(([mode, label]) =>
      h("button", { type: "button", "data-mode": mode, onclick: () => this.setMode(mode) }, label));
    this.modes = h("div", { class: "segmented", role: "group", "aria-label": "Task" }, this.modeButtons);
    this.modeWords = h("p", { class: "words" });
    this.target = h("select", { "aria-label": "Target to inspect", onchange: () => { this.chosen = this.target.value; this.setMode("inspect"); } });
    this.chosen = ""; // the target that somebody has chosen here
    /**
     * @param {string} label
     * @param {string} hint
     * @param {"drive" | "twist"} type
     * @param {-1 | 1} direction
     */
    const held = (label, hint, type, direction) => holdButton(label, hint, (down) => {
      connection.send(type, { direction: down ? direction : 0 });
      keys.hold(label, down);
    });
    this.forward = held("Forward", "↑ or W", "drive", 1);
    this.back = held("Back", "↓ or S", "drive", -1);
    this.twistLeft = held("Twist ↺", "A", "twist", -1);
    this.twistRight = held("Twist ↻", "D", "twist", 1);
    this.progressBar = h("div");
    this.progress = h("div", { class: "progress" }, this.progressBar);
    this.progressWords = h("p", { class: "words" });
    this.soFar = h("p", { class: "words", id: "so-far", hidden: true });
    this.approach = new ApproachRow(connection);
    this.controls = new ModesGroup(connection);
    this.rehearsalOptions = new OptionsGroup(connection);
    this.truth = new TruthGroup(connection);
    this.fields = h("div", { class: "fields" });
    this.fieldWords = h("p", { class: "words caution", role: "status" });
    /** @type {Map<string, { input: HTMLInputElement, shown: HTMLElement }>} */
    this.sliders = new Map();
    this.marginWarning = h("p", { class: "words caution", hidden: true });
    this.registration = new UsedRegistration("driven-registration", true);
    this.tissueWords = h("p", { class: "words", hidden: true });
    this.unrecorded = h("p", { class: "words caution", id: "unrecorded", role: "status", hidden: true });
    this.countdown = new Countdown(() => this.update(connection.state));
    this.overlay = h("div", { class: "rehearse-overlay" }, h("div", { class: "overlay nearness-over-scene" }, this.nearness.element), this.countdown.number);
    keys.shortcuts.push((event) => this.countdown.key(event));
    connection.on("state", ({ state }) => { if (state.step?.name !== "rehearse") this.countdown.cancel(); });
    this.endCard = new EndCard(connection, () => this.start());
    this.assignment = new AssignmentGroup(connection);
    this.trialHead = h("h2", { id: "trial-head" });
    this.trial = h("div", { class: "group", id: "trial", hidden: true }, h("div", { class: "group-head" }, this.trialHead), h("p", { class: "words" }, "Drive to the end, then press Finish run."));
    this.comments = new CommentsGroup(connection);
    this.element = h("div", {}, this.trial, this.endCard.element, this.assignment.element,
      group("Drive", null, this.words, this.unrecorded, this.registration.element, this.tissueWords, this.startRow, this.countdown.element),
      this.comments.element,
      this.controls.element,
      group("Task", null, this.modes, this.target, this.modeWords,
        h("div", { class: "buttons even" }, this.forward, this.back), h("div", { class: "buttons even" }, this.twistLeft, this.twistRight),
        this.progressWords, this.progress, this.approach.element, this.soFar),
      this.handle,
      this.devices.element,
      this.truth.element,
      this.rehearsalOptions.element,
      group("Hand and margin", null, this.fields, this.fieldWords, this.marginWarning));
  }

  /** @param {ViewModel} state */
  update(state) {
    /** @type {Partial<RehearsalSection>} */
    const rehearsal = state.rehearsal ?? {};
    const targets = (state.driven ?? state.plan)?.targets ?? []; // those of the robot that is there
    this.changedTargets([targets], () => this.renderTargets(targets));
    this.preselect(state, targets);
    this.endCard.update(state);
    this.assignment.update(state);
    this.comments.update(state);
    this.registration.update(state);
    this.countdown.follow(rehearsal.state);
    const live = isLive(rehearsal);
    const trial = isTrial(state);
    this.trial.hidden = !trial;
    this.assignment.element.hidden = trial; // one task at a time
    if (trial) say(this.trialHead, trialWords(state));
    const adjustable = live && !trial && Boolean(rehearsal.mine);
    this.changedFields([state.settings, adjustable], () => this.renderFields(state.settings, adjustable));
    const freehand = isFree(rehearsal);
    this.controls.update(state, !trial && (live ? Boolean(rehearsal.mine) : Boolean(rehearsal.mine || rehearsal.can_take)));
    this.truth.update(state);
    this.rehearsalOptions.update(state);
    this.rehearsalOptions.element.hidden = freehand; // nothing holds that tool
    this.devices.update(state);
    this.nearness.update(state.nearness);
    const { state: drive, phase, words, mine, holder, can_take, mode, target_id, path_done, plan_changed } = rehearsal;
    this.changedState([this.countdown.counting, drive, phase, words, mine, holder, can_take, mode, target_id, path_done, plan_changed, state.plan_use, targets.length, rehearsal.control], () => this.renderState(state, rehearsal, targets.length));
    this.renderProgress(rehearsal);
    this.approach.update(state);
    say(this.unrecorded, rehearsal.unrecorded ? `Not recorded: ${rehearsal.unrecorded}` : "");
    this.unrecorded.hidden = !rehearsal.unrecorded;
    this.soFar.textContent = rehearsal.so_far ?? "";
    this.soFar.hidden = !rehearsal.so_far;
    const passed = Math.max(0, ...(isOld(state.corridor) ? null : state.corridor?.verdict?.profile.tissue_mm) ?? []); // the length that the verdict of the plan names
    say(this.tissueWords, `The path presses soft tissue along ${fixed(passed, 0)} mm.`);
    const held = state.options?.items.some(({ name, on }) => name === "soft_tissue" && on);
    this.tissueWords.hidden = !live || freehand || held || passed < 0.5;
  }

  /**
   * @param {ViewModel} state
   * @param {Partial<RehearsalSection>} rehearsal
   * @param {number} targets
   */
  renderState(state, rehearsal, targets) {
    const live = isLive(rehearsal);
    const driving = live && Boolean(rehearsal.mine);
    const changed = live && rehearsal.plan_changed;
    const silent = rehearsal.state === "silent";
    const freehand = isFree(rehearsal);
    say(this.words, rehearsal.words || (changed && (isBlocked(state) ? BLOCKED_WORDS : CHANGED_WORDS)) || (freehand ? FREEHAND_WORDS : STATE_WORDS)[rehearsal.state ?? ""] || "");
    this.words.className = freehand && live && !rehearsal.words ? "words uncertified" : changed || silent || rehearsal.state === "failed" ? "words caution" : "words";
    if (!driving && live) this.countdown.cancel(); // the handle has gone elsewhere
    this.startButton.textContent = rehearsal.state === "running" || this.countdown.counting ? "Pause" : rehearsal.state === "paused" ? "Continue" : "Start";
    const startable = driving || ["absent", "failed"].includes(rehearsal.state ?? "");
    const pausable = rehearsal.state === "running"; // by whoever watches
    this.startButton.disabled = !pausable && (!startable || (state.plan?.points.length ?? 0) < 2);
    this.resetButton.textContent = silent ? "End process" : "Reset to entry";
    this.resetButton.title = changed && isBlocked(state) ? brief(state.plan_use?.words ?? "") : "";
    this.resetButton.disabled = !driving && !(silent && (rehearsal.mine || rehearsal.can_take));
    say(this.leaseWords, !live ? "The handle appears when the robot is in place." : rehearsal.mine
      ? "This window holds the handle. Drag the sphere on the shaft."
      : rehearsal.can_take ? "Nobody holds the handle." : `${rehearsal.holder ?? "Nobody"} holds the handle. You watch, and may pause.`);
    this.leaseButton.hidden = !live;
    this.leaseButton.textContent = rehearsal.mine ? "Release handle" : "Take handle";
    this.leaseButton.disabled = !rehearsal.mine && !rehearsal.can_take;
    this.placeLease(live && !rehearsal.mine && Boolean(rehearsal.can_take));
    for (const button of this.modeButtons) {
      const mode = button.dataset.mode;
      button.setAttribute("aria-pressed", String(mode === rehearsal.mode));
      button.disabled = !driving || (mode === "inspect" && !targets);
      button.title = mode === "inspect" && live && !targets ? NO_TARGETS : "";
    }
    this.target.hidden = rehearsal.mode !== "inspect" && !(rehearsal.path_done && targets);
    if (rehearsal.target_id) this.target.value = rehearsal.target_id;
    this.target.disabled = !driving;
    say(this.modeWords, modeWords(rehearsal, targets));
    for (const button of [this.forward, this.back, this.twistLeft, this.twistRight]) button.disabled = !(driving && rehearsal.state === "running");
    const { mode, phase } = rehearsal; // a button that the controller would not heed is off
    this.forward.disabled ||= !freehand && mode !== "path" && phase !== "inspect_approach";
    this.back.disabled ||= !freehand && mode !== "path";
    for (const button of [this.twistLeft, this.twistRight]) button.disabled ||= !freehand && mode !== "free" && phase !== "inspect_hold";
    for (const button of [this.forward, this.back, this.twistLeft, this.twistRight]) if (button.disabled) button.letGo();
  }

  /**
   * 'Take handle' is beside Start, in the place of a reset that nobody may do, where only it lets the user go on.
   * @param {boolean} first
   */
  placeLease(first) {
    const row = first ? this.startRow : this.handle, focused = document.activeElement === this.leaseButton;
    this.resetButton.hidden = first;
    if (this.leaseButton.parentElement === row) return;
    row.append(this.leaseButton);
    if (focused) (first || this.startButton.disabled ? this.leaseButton : this.startButton).focus();
  }

  /** @param {Partial<RehearsalSection>} rehearsal */
  renderProgress(rehearsal) {
    const { mode, phase, progress_mm: progress, length_mm: length } = rehearsal;
    this.progress.hidden = this.progressWords.hidden = mode !== "path"; // elsewhere the place on the path is not followed
    const part = length ? Math.min(1, Math.max(0, (progress ?? 0) / length)) : 0;
    this.progressBar.style.width = `${(part * 100).toFixed(1)}%`;
    const along = phase === "approach" && !isFree(rehearsal) ? "Approaches" : "";
    this.progressWords.textContent = length ? `${along} ${fixed(progress, 1)} of ${mm(length)} along the path`.trim() : "";
  }

  /**
   * Show a target that can be inspected, until somebody chooses one; while one is inspected it is that.
   * @param {ViewModel} state
   * @param {ItemEntry[]} targets
   */
  preselect({ rehearsal, cones, plan }, targets) {
    if (rehearsal?.mode === "inspect" || targets.some(({ id }) => id === this.chosen)) return;
    const place = rehearsal?.phase === "done" ? rehearsal.virtual_point : plan?.points.at(-1)?.position;
    const id = preselected(targets, cones, place ?? null);
    if (id !== null && this.target.value !== id) this.target.value = id;
  }

  /** @param {ItemEntry[]} targets */
  renderTargets(targets) {
    const chosen = this.target.value;
    fillOptions(this.target, targets.map(({ id, label }) => [id, label]));
    if (targets.some((target) => target.id === chosen)) this.target.value = chosen;
  }

  /**
   * What is in force, also after a change was refused; a slider under the hand is left alone.
   * @param {SettingsSection | undefined} settings
   * @param {boolean} adjustable
   */
  renderFields(settings, adjustable) {
    const fields = settings?.fields ?? [];
    const refused = adjustable ? settings?.words ?? "" : "";
    say(this.fieldWords, refused);
    this.fieldWords.hidden = !refused;
    say(this.marginWarning, settings?.warning ? `${settings.warning}.` : "");
    this.marginWarning.hidden = !settings?.warning;
    if (String([...this.sliders.keys()]) !== String(fields.map(({ name }) => name))) {
      this.sliders.clear();
      this.fields.replaceChildren(...fields.map((field) => this.field(field)));
    }
    for (const field of fields) {
      const slider = this.sliders.get(field.name);
      if (!slider) continue;
      const { input, shown } = slider;
      input.disabled = !adjustable;
      if (input.matches(":active")) continue;
      input.value = String(field.value);
      shown.textContent = `${fixed(field.value, field.digits)} ${field.unit}`;
    }
  }

  /** @param {SettingField} field */
  field(field) {
    const shown = h("span", { class: "number" }, `${fixed(field.value, field.digits)} ${field.unit}`);
    /** @type {HTMLInputElement} */
    const input = h("input", {
      type: "range", min: field.lo, max: field.hi, step: field.step, value: field.value, "aria-label": `${field.label} in ${field.unit}`,
      oninput: () => { shown.textContent = `${fixed(Number(input.value), field.digits)} ${field.unit}`; },
      onchange: () => this.connection.send("rehearsal.settings", { values: { [field.name]: Number(input.value) } }),
    });
    this.sliders.set(field.name, { input, shown });
    return h("label", { class: "field" }, h("span", { class: "field-label" }, h("span", {}, field.label), shown), input);
  }

  startOrPause() {
    if (this.countdown.cancel()) return;
    if (this.connection.state.rehearsal?.state === "running") this.connection.send("rehearsal.pause");
    else this.start();
  }

  /** After the countdown, where one is wanted: the tool is placed before, so that it moves at its end. */
  async start() {
    const { connection, countdown } = this, run = () => connection.send("rehearsal.start");
    if (!countdown.wanted || isLive(connection.state.rehearsal ?? {})) {
      countdown.before(run);
      return;
    }
    try {
      await connection.request("rehearsal.take");
      await connection.request("rehearsal.reset"); // it is answered once the state says that the tool comes
    } catch (error) {
      note(error instanceof Error ? error.message : String(error), { error: true });
      return;
    }
    countdown.whenPlaced(run);
    countdown.follow(connection.state.rehearsal?.state);
  }

  resetOrEnd() {
    this.connection.send(this.connection.state.rehearsal?.state === "silent" ? "rehearsal.end" : "rehearsal.reset");
  }

  lease() {
    this.connection.send(this.connection.state.rehearsal?.mine ? "rehearsal.let_go" : "rehearsal.take");
  }

  /** @param {Mode} mode */
  setMode(mode) {
    this.connection.send("rehearsal.mode", { mode, target_id: mode === "inspect" ? this.target.value || null : null });
  }
}

/**
 * Whether the plan refers to a registration that it cannot use.
 * @param {ViewModel} state
 */
function isBlocked({ plan_use: use }) {
  return Boolean(use) && use?.state !== "none" && use?.state !== "ready";
}

/** @param {Partial<RehearsalSection>} rehearsal */
function isLive(rehearsal) {
  return LIVE.includes(rehearsal.state ?? "");
}

/**
 * @param {Partial<RehearsalSection>} rehearsal
 * @param {number} targets
 */
function modeWords(rehearsal, targets) {
  if (isFree(rehearsal)) return FREEHAND_TASKS[rehearsal.mode ?? ""] ?? FREEHAND_TASKS.path;
  if (rehearsal.mode === "free") return "No path holds the tip. The margin to bone is kept. What is switched on below holds too.";
  if (rehearsal.mode === "inspect") return "Drag the handle: the tool swings about the target. The view point is brought onto it and stays there.";
  const lead = rehearsal.control?.mode === "teleoperated" ? "The device only sets how fast. " : "";
  if (rehearsal.phase === "approach") return "Push: the tip goes straight to the path, then along it.";
  if (rehearsal.path_done && targets) return "At the end of the path. ‘Inspect’ looks at a target.";
  if (rehearsal.path_done) return "At the end of the path.";
  return `The tip is led along the path. ${lead}Forward and back need no aiming in depth. The tool is twisted in Free and Inspect.`;
}
