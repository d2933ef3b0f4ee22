// The one dialog of the page, and the short notes at its foot.
import { byId, h } from "./dom.js";
import { sentence } from "./format.js";
import { letGoOfEverything } from "./keys.js";
import { say } from "./said.js";

export const FRAME_QUESTION = {
  name: "frame",
  label: "Frame",
  options: [
    ["LPS", "LPS – x left, y back, z up (DICOM)"],
    ["RAS", "RAS – x right, y front, z up (NIfTI, Slicer scene)"],
  ],
};

/** @import { Connection } from "./connection.js" */
/** @typedef {{ name: string, label: string, options: string[][] }} Question options: [value, words] */

const LINGER_MS = 1000; // that a note stays where it is pointed at or focused, before it is looked at again

const dialog = () => /** @type {HTMLDialogElement} */ (byId("dialog"));

/** @type {Promise<string>} */
let turn = Promise.resolve("");

/**
 * One question at a time: the next one waits until this one is answered, so that no answer is taken for two.
 * @param {HTMLFormElement} form
 * @param {() => void} [shown]
 */
export function show(form, shown = () => {}) {
  turn = turn.then(() => new Promise((resolve) => {
    const element = dialog();
    element.replaceChildren(form);
    element.addEventListener("close", () => resolve(element.returnValue), { once: true });
    element.returnValue = "cancel";
    letGoOfEverything(); // keys do not drive behind a dialog, and one that is held goes on there unseen
    element.showModal();
    shown();
  }));
  return turn;
}

/** @param {string} confirmWord */
function footer(confirmWord) {
  return h("div", { class: "buttons" },
    h("button", { type: "submit", value: "cancel", formNoValidate: true }, "Cancel"),
    h("button", { type: "submit", value: "ok", class: "primary" }, confirmWord));
}

/**
 * Ask for a name, or for another line of text; resolves to the trimmed text or null.
 * @param {string} title
 * @param {string} value
 * @param {string} [confirmWord]
 * @param {{ label?: string, most?: number }} [line] what it is; most: characters
 */
export async function askName(title, value, confirmWord = "Save", { label = "Name", most = 120 } = {}) {
  const input = h("input", { type: "text", value, maxLength: most, required: true, "aria-label": label, autocomplete: "off" });
  const form = h("form", { method: "dialog" }, h("h2", {}, title), input, footer(confirmWord));
  // Enter confirms: the first submit button of a form is the default one, so it is answered here
  input.addEventListener("keydown", (event) => {
    if (event.key !== "Enter") return;
    event.preventDefault();
    if (input.value.trim()) dialog().close("ok");
  });
  return (await show(form, () => input.select())) === "ok" && input.value.trim() ? input.value.trim() : null;
}

/**
 * @param {string} title
 * @param {string} words
 * @param {string} confirmWord
 */
export async function confirm(title, words, confirmWord) {
  const form = h("form", { method: "dialog" }, h("h2", {}, title), h("p", { class: "words" }, sentence(words)), footer(confirmWord));
  return (await show(form)) === "ok";
}

/**
 * Whether a file with the images of a head may be saved: they can identify the patient.
 * @param {string} name of the head
 */
export function askForImages(name) {
  return confirm("Save the patient's images?",
    `The file holds the images of ‘${name}’. A face can be drawn from them, so they can identify the patient.`, "Save with images");
}

/**
 * Ask for one choice per question; resolves to the chosen values by the questions' names, or null.
 * @param {string} title
 * @param {string} words
 * @param {Question[]} questions
 * @param {string} confirmWord
 */
export async function askChoices(title, words, questions, confirmWord) {
  const selects = questions.map((question) => h("select", { id: `ask-${question.name}`, required: true },
    h("option", { value: "" }, "Choose …"),
    question.options.map(([value, label]) => h("option", { value }, label))));
  const fields = questions.map((question, index) => h("label", { class: "field" },
    h("span", { class: "field-label" }, question.label), selects[index]));
  const form = h("form", { method: "dialog" }, h("h2", {}, title), h("p", { class: "words" }, sentence(words)), fields, footer(confirmWord));
  if ((await show(form)) !== "ok") return null;
  return Object.fromEntries(questions.map((question, index) => [question.name, selects[index].value]));
}

/** @typedef {{ label: string, run: () => void }} Action a button in a note */

/**
 * Ask for what can be taken back: say that it was done, with a button that undoes it, or why it was not.
 * @param {Promise<unknown>} request
 * @param {string} words
 * @param {Action} action
 */
export function noteDone(request, words, action) {
  request.then(() => note(words, { action })).catch((error) => note(error.message, { error: true }));
}

/** @type {{ plan: "undo", registration: "registration.undo" }} what takes back the newest edit of what is open */
const UNDOES = { plan: "undo", registration: "registration.undo" };

/**
 * Ask for an edit of the open plan or registration, and say that it was done, with a button that undoes it. The button
 * undoes this very edit: it leaves with the next one, and the planner refuses it where that came from elsewhere.
 * @param {Connection} connection
 * @param {keyof typeof UNDOES} what
 * @param {Promise<unknown>} request
 * @param {string} words
 */
export function noteEdit(connection, what, request, words) {
  request.then(() => {
    const { id, revision } = connection.state[what] ?? {}; // the planner tells what it did before it answers
    const leave = note(words, { action: { label: "Undo", run: () => connection.send(UNDOES[what], { revision }) } });
    const look = () => {
      const now = connection.state[what];
      if (now?.id === id && now?.revision === revision) return;
      connection.removeEventListener("state", look);
      leave();
    };
    connection.addEventListener("state", look);
  }).catch((error) => note(error.message, { error: true }));
}

/** What went wrong before is no news any more: another head, plan or tab is shown, or another file was chosen. */
export function clearErrors() {
  byId("alerts").replaceChildren();
}

/**
 * Wait until somebody is ready to answer; nothing is laid over what they do meanwhile.
 * @param {string} words
 * @param {string} label
 * @returns {Promise<void>}
 */
export function whenReady(words, label) {
  return new Promise((resolve) => { note(words, { action: { label, run: resolve }, stay: true }); });
}

/**
 * A short note, the same one once. Errors are spoken at once and stay until dismissed; others leave by themselves, but not
 * from under the pointer or the focus of somebody who is about to press their button. Returns what takes it away.
 * @param {string} words
 * @param {{ error?: boolean, action?: Action | null, stay?: boolean }} [options]
 */
export function note(words, { error = false, action = null, stay = false } = {}) {
  const box = byId(error ? "alerts" : "notes");
  const shown = h("span");
  say(shown, words);
  const element = h("div", { class: error ? "toast error" : "toast" }, shown);
  if (stay) element.dataset.stays = "yes";
  const leave = () => element.remove();
  const leaveUnlessUsed = () => {
    if (element.matches(":hover, :focus-within")) setTimeout(leaveUnlessUsed, LINGER_MS);
    else leave();
  };
  if (action) element.append(h("button", { type: "button", onclick: () => { action.run(); leave(); } }, action.label));
  if (error) element.append(h("button", { type: "button", class: "plain", onclick: leave }, "Dismiss"));
  else if (!stay) setTimeout(leaveUnlessUsed, action ? 9000 : 4500);
  if (!action) [...box.children].find((other) => other.firstElementChild?.textContent === shown.textContent)?.remove();
  box.append(element);
  const passing = () => [...box.children].filter((other) => other instanceof HTMLElement && !other.dataset.stays);
  while (!error && passing().length > 3) passing()[0].remove();
  return leave;
}
