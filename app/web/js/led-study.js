// The study that this browser leads: opened from its file, and again after a reload; what it fixes during a trial.
import { note } from "./dialogs.js";
import { keep, recallText } from "./remember.js";

/** @import { Connection } from "./connection.js" */
/** @import { ViewModel } from "./types.js" */
/** @import { Layout } from "./layout.js" */

const KEPT = "study";
const DRIVING = ["rehearse", "drive"]; // the tabs in which trials are driven

/** Ask for the file of a study and open it. @param {Connection} connection */
export function chooseStudy(connection) {
  const input = document.createElement("input");
  Object.assign(input, { type: "file", accept: ".toml" });
  input.addEventListener("change", () => { if (input.files?.[0]) openStudy(connection, input.files[0]); });
  input.click();
}

/** @param {Connection} connection @param {File} file */
export async function openStudy(connection, file) {
  try {
    await connection.request("study.new", { text: await file.text() });
    await connection.request("step.set", { name: "study" });
  } catch (error) {
    note(error instanceof Error ? error.message : String(error), { error: true });
  }
}

/**
 * Keep which study is open, and open it again on a page or in a planner that begins anew; go back to it when a trial
 * has its run.
 * @param {Connection} connection
 */
export function followStudy(connection) {
  let asked = false, running = false;
  connection.on("state", ({ state }) => {
    const kept = recallText(KEPT);
    if (state.study) {
      asked = false;
      if (state.study.id !== kept) keep(KEPT, state.study.id);
    } else if (kept && state.step && !asked) {
      asked = true;
      reopen(connection, kept);
    }
    const before = running;
    running = isTrial(state);
    if (before && state.study && !running && DRIVING.includes(state.step?.name ?? "")) connection.send("step.set", { name: "study" });
  });
}

/** Study is shown at once unless its trial goes on, which is driven elsewhere. @param {Connection} connection @param {string} study_id */
async function reopen(connection, study_id) {
  try {
    await connection.request("study.show", { study_id });
  } catch {
    keep(KEPT, ""); // it is not here any more
    return;
  }
  if (!isTrial(connection.state)) connection.send("step.set", { name: "study" });
}

/** @param {Connection} connection */
export async function closeStudy(connection) {
  keep(KEPT, "");
  await connection.request("step.set", { name: "patient" });
  await connection.request("study.show", { study_id: null });
}

/** Whether a trial goes on, which fixes how its plan or route is driven. @param {ViewModel} state */
export function isTrial({ study, plan, route, case: opened }) {
  const trial = study?.next === "trial" ? study.trial : null, open = trial?.plan ? plan : route;
  return Boolean(trial?.running && opened?.id === trial.case_id && (!open || open.id === trial.document_id));
}

/** Which trial it is, in words. @param {ViewModel} state */
export function trialWords({ study }) {
  return `${study?.subject}: trial ${study?.trial?.position} of ${study?.total}`;
}

/** The layout that a trial has, null for any. @param {ViewModel} state @returns {Layout | null} */
export function fixedLayout(state) {
  const trial = isTrial(state) ? state.study?.trial : null, view = state.step?.name === trial?.tab ? trial?.view : null;
  return view === "endoscope" ? "endoscope-alone" : view === "outside" ? "scene" : null;
}
