// Rehearse: the robot at the entry, the handle in the hand, and the words of what holds it.
import { h, group, keyed, whenChanged } from "/static/js/dom.js";
import { fixed, mm, sentence } from "/static/js/format.js";
import { holdButton } from "/static/js/hold.js";

/** @import { Parts } from "/static/js/panel.js" */
/** @import { Commands, ItemEntry, OptionView, OptionsSection, RehearsalSection, SettingField, SettingsSection, ViewModel } from "/static/js/types.js" */

/** @import { Row } from "/static/js/dom.js" */

/** @typedef {Commands["rehearsal.mode"]["mode"]} Mode */

/** @type {Record<string, string | undefined>} */
const STATE_WORDS = { absent: "Not in place yet.", ready: "In place at the entry.", running: "Running: the controller follows the hand and keeps off the bone.", paused: "Paused where it is." };
const CHANGED_WORDS = "The plan has changed since the robot was placed. What is drawn here is what is driven; ‘Reset to entry’ takes the plan as it is now.";
const LIVE = ["ready", "running", "paused"];
/** @type {[Mode, string][]} */
const MODES = [["path", "Along the path"], ["free", "Free"], ["inspect", "Inspect"]];

export default class RehearsePanel {
  /** @param {Parts} parts */
  constructor({ connection, keys }) {
    this.connection = connection;
    this.changedState = whenChanged();
    this.changedTargets = whenChanged();
    this.changedFields = whenChanged();
    this.words = h("p", { class: "words" });
    this.startButton = h("button", { type: "button", class: "primary", id: "start", onclick: () => this.startOrPause() });
    this.resetButton = h("button", { type: "button", id: "reset", onclick: () => this.resetOrEnd() }, "Reset to entry");
    this.leaseWords = h("p", { class: "words" });
    this.leaseButton = h("button", { type: "button", class: "wide", id: "lease", onclick: () => this.lease() });
    this.modeButtons = MODES.map(([mode, label]) =>
      h("button", { type: "button", "data-mode": mode, onclick: () => this.setMode(mode) }, label));
    this.modes = h("div", { class: "segmented", role: "group", "aria-label": "Mode" }, this.modeButtons);
    this.modeWords = h("p", { class: "words" });
    this.target = h("select", { "aria-label": "Target to inspect", onchange: () => this.setMode("inspect") });
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
    this.progressWords = h("p", { class: "words" });
    this.changedOptions = whenChanged();
    this.options = h("div", { class: "fields", id: "options" });
    this.optionWords = h("p", { class: "words caution", role: "status", id: "option-words", hidden: true });
    this.fields = h("div", { class: "fields" });
    this.fieldWords = h("p", { class: "words caution", role: "status" });
    /** @type {Map<string, { input: HTMLInputElement, shown: HTMLElement }>} */
    this.sliders = new Map();
    this.marginWarning = h("p", { class: "words caution", hidden: true });
    this.tissueWords = h("p", { class: "words", hidden: true });
    this.element = h("div", {},
      group("Robot", null, this.words, this.tissueWords, h("div", { class: "buttons even" }, this.startButton, this.resetButton)),
      group("Handle", null, this.leaseWords, this.leaseButton),
      group("Motion", null, this.modes, this.target, this.modeWords,
        h("div", { class: "buttons even" }, this.forward, this.back), h("div", { class: "buttons even" }, this.twistLeft, this.twistRight),
        this.progressWords, h("div", { class: "progress" }, this.progressBar)),
      group("What else holds the tool", null, this.options, this.optionWords),
      group("Hand and margin", null, this.fields, this.fieldWords, this.marginWarning));
  }

  /** @param {ViewModel} state */
  update(state) {
    /** @type {Partial<RehearsalSection>} */
    const rehearsal = state.rehearsal ?? {};
    const targets = (state.driven ?? state.plan)?.targets ?? []; // those of the robot that is there
    this.changedTargets([targets], () => this.renderTargets(targets));
    const live = isLive(rehearsal);
    const adjustable = live && Boolean(rehearsal.mine);
    this.changedFields([state.settings, adjustable], () => this.renderFields(state.settings, adjustable));
    this.changedOptions([state.options], () => this.renderOptions(state.options));
    const { state: phase, words, mine, holder, can_take, mode, target_id, path_done, plan_changed } = rehearsal;
    this.changedState([phase, words, mine, holder, can_take, mode, target_id, path_done, plan_changed, targets.length], () => this.renderState(state, rehearsal, targets.length));
    this.renderProgress(rehearsal);
    const { length_mm: passed } = state.corridor?.soft_tissue ?? {};
    this.tissueWords.textContent = `On this path the tool passes ${fixed(passed, 0)} mm of soft tissue; nothing keeps it off that.`;
    this.tissueWords.hidden = !live || (passed ?? 0) < 0.5;
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
    this.words.textContent = sentence(rehearsal.words || (changed && CHANGED_WORDS) || STATE_WORDS[rehearsal.state ?? ""] || "");
    this.words.className = changed || silent || rehearsal.state === "failed" ? "words caution" : "words";
    this.startButton.textContent = rehearsal.state === "running" ? "Pause" : rehearsal.state === "paused" ? "Continue" : "Start";
    const startable = driving || ["absent", "failed"].includes(rehearsal.state ?? "");
    const pausable = rehearsal.state === "running"; // by whoever watches
    this.startButton.disabled = !pausable && (!startable || (state.plan?.points.length ?? 0) < 2);
    this.resetButton.textContent = silent ? "End the process" : "Reset to entry";
    this.resetButton.disabled = !driving && !(silent && (rehearsal.mine || rehearsal.can_take));
    this.leaseWords.textContent = !live ? "The handle appears when the robot is in place." : rehearsal.mine
      ? "This window holds the handle. Drag the sphere on the shaft."
      : rehearsal.can_take ? "Nobody holds the handle." : `${rehearsal.holder ?? "Another window"} holds the handle. You are watching, and may pause the robot.`;
    this.leaseButton.hidden = !live;
    this.leaseButton.textContent = rehearsal.mine ? "Let go of the handle" : "Take over the handle";
    this.leaseButton.disabled = !rehearsal.mine && !rehearsal.can_take;
    for (const button of this.modeButtons) {
      const mode = button.dataset.mode;
      button.setAttribute("aria-pressed", String(mode === rehearsal.mode));
      button.disabled = !driving || (mode === "inspect" && !targets);
    }
    this.target.hidden = rehearsal.mode !== "inspect" && !(rehearsal.path_done && targets);
    if (rehearsal.target_id) this.target.value = rehearsal.target_id;
    this.target.disabled = !driving;
    this.modeWords.textContent = modeWords(rehearsal, targets);
    for (const button of [this.forward, this.back, this.twistLeft, this.twistRight]) button.disabled = !(driving && rehearsal.state === "running");
    this.forward.disabled ||= rehearsal.mode !== "path";
    this.back.disabled ||= rehearsal.mode !== "path";
    for (const button of [this.forward, this.back, this.twistLeft, this.twistRight]) if (button.disabled) button.letGo();
  }

  /** @param {Partial<RehearsalSection>} rehearsal */
  renderProgress({ progress_mm: progress, length_mm: length }) {
    const part = length ? Math.min(1, Math.max(0, (progress ?? 0) / length)) : 0;
    this.progressBar.style.width = `${(part * 100).toFixed(1)}%`;
    this.progressWords.textContent = length ? `${fixed(progress, 1)} of ${mm(length)} along the path` : "";
  }

  /** @param {ItemEntry[]} targets */
  renderTargets(targets) {
    const chosen = this.target.value;
    this.target.replaceChildren(...targets.map((target) => h("option", { value: target.id }, target.label)));
    if (targets.some((target) => target.id === chosen)) this.target.value = chosen;
  }

  /**
   * What is in force, also after a change was refused; a slider under the hand is left alone.
   * @param {SettingsSection | undefined} settings
   * @param {boolean} adjustable
   */
  renderFields(settings, adjustable) {
    const fields = settings?.fields ?? [];
    this.fieldWords.textContent = adjustable ? settings?.words ?? "" : "";
    this.fieldWords.hidden = !this.fieldWords.textContent;
    this.marginWarning.textContent = settings?.warning ? `${sentence(settings.warning)}.` : "";
    this.marginWarning.hidden = !settings?.warning;
    if (this.sliders.size !== fields.length) this.fields.replaceChildren(...fields.map((field) => this.field(field)));
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

  /** @param {OptionsSection | undefined} options */
  renderOptions(options) {
    keyed(this.options, options?.items ?? [], (item) => item.name, (item) => this.option(item), fillOption);
    this.optionWords.textContent = options?.words ?? "";
    this.optionWords.hidden = !options?.words;
  }

  /**
   * @param {OptionView} item
   * @returns {Row<OptionView>}
   */
  option({ name, label }) {
    const box = h("input", { type: "checkbox", "data-option": name, "aria-describedby": `option-${name}`, onchange: () => this.setOptions() });
    const element = h("div", { class: "field" }, h("label", { class: "check" }, box, label), h("p", { class: "words", id: `option-${name}` }));
    return Object.assign(element, { item: /** @type {any} */ (null) }); // `keyed` puts it there
  }

  setOptions() {
    const on = (/** @type {string} */ name) => Boolean(this.options.querySelector(`[data-option="${name}"]:checked`));
    const wanted = { soft_tissue: on("soft_tissue"), remote_centre: on("remote_centre"), speed_limit: on("speed_limit") };
    this.connection.send("rehearsal.options", wanted);
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
    const running = this.connection.state.rehearsal?.state === "running";
    this.connection.send(running ? "rehearsal.pause" : "rehearsal.start");
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
 * @param {HTMLElement} element
 * @param {OptionView} item
 */
function fillOption(element, item) {
  const box = element.querySelector("input");
  const words = element.querySelector("p");
  if (!box || !words) return;
  box.checked = item.on;
  box.disabled = item.refusal !== "";
  words.textContent = item.refusal || item.words;
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
  if (rehearsal.mode === "free") return "No path holds the tip. The bone still does.";
  if (rehearsal.mode === "inspect") return "Drag the handle: the view point is brought onto the target and stays there while the tool swings about it.";
  if (rehearsal.path_done && targets) return "The end of the path is reached. ‘Inspect’ points the tool at a target.";
  if (rehearsal.path_done) return "The end of the path is reached.";
  return "The tip stays on the path; forward and back need no aiming in depth.";
}
