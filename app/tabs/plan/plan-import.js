// Import of a plan from a file: what the file does not say is asked, never guessed.
import { FRAME_QUESTION, askChoices, clearErrors, confirm, note } from "/static/js/dialogs.js";
import { PlannerError, missing, read, upload } from "/static/js/rest.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { PlanPublic, PlanRegistrationPublic } from "/static/js/types.js" */

const POINTS_QUESTION = {
  name: "points_as",
  label: "The points are",
  options: [["path", "a path, from outside to inside"], ["targets", "targets to inspect"]],
};
const QUESTIONS = [FRAME_QUESTION, POINTS_QUESTION];

/**
 * Import a plan of the open head and open it.
 * @param {Connection} connection
 * @param {File} file
 */
export async function importPlan(connection, file) {
  clearErrors();
  await send(connection, file, {});
}

/**
 * @param {Connection} connection
 * @param {File} file
 * @param {Record<string, string>} answers to what it does not say
 */
async function send(connection, file, answers) {
  const caseId = connection.state.case?.id;
  if (!caseId) return;
  const form = new FormData();
  form.append("file", file);
  for (const [key, value] of Object.entries(answers)) form.append(key, value);
  try {
    /** @type {PlanPublic} */
    const plan = await upload(`/api/v1/cases/${encodeURIComponent(caseId)}/plans/import`, form, () => {});
    connection.send("plan.open", { plan_id: plan.id });
    const doubts = [plan.told, await wanting(plan)].filter(Boolean);
    note([`‘${file.name}’ was imported as a plan.`, ...doubts].join(" "), { stay: doubts.length > 0 });
  } catch (error) {
    await ask(connection, file, answers, /** @type {Error} */ (error));
  }
}

/**
 * Why a plan that came in cannot use the registration that it names; '' where it can, or names none.
 * @param {PlanPublic} plan
 */
async function wanting({ id, registration }) {
  if (!registration) return "";
  /** @type {PlanRegistrationPublic} */
  const used = await read(`/api/v1/plans/${encodeURIComponent(id)}/registration`);
  return used.state === "ready" ? "" : used.words;
}

/**
 * @param {Connection} connection
 * @param {File} file
 * @param {Record<string, string>} answers
 * @param {Error} error
 */
async function ask(connection, file, answers, error) {
  const words = missing(error);
  const questions = QUESTIONS.filter(({ name }) => words.includes(name));
  if (questions.length && questions.length === words.length) {
    const chosen = await askChoices(`What ‘${file.name}’ does not say`, error.message, questions, "Import");
    if (chosen) await send(connection, file, { ...answers, ...chosen });
  } else if (error instanceof PlannerError && error.code === "other_case" && !answers.other_case) {
    if (await confirm(`‘${file.name}’ was made for another head`, error.message, "Import anyway")) await send(connection, file, { ...answers, other_case: "yes" });
  } else {
    note(`‘${file.name}’: ${error.message}`, { error: true });
  }
}
