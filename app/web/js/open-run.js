// Which run Review is asked to open from elsewhere: at a moment, or beside others.

/** @import { Connection } from "./connection.js" */

/** @typedef {{ run: string, at?: number, compare?: string[] }} RunRequest at: s of driven time; compare: ids of the runs beside it */

/** @type {RunRequest | null} */
let asked = null;

/**
 * Go to Review and open a run there.
 * @param {Connection} connection
 * @param {RunRequest} request
 */
export function openRun(connection, request) {
  asked = request;
  connection.send("step.set", { name: "review" });
}

/** What was asked for last, once. */
export function takeRunRequest() {
  const request = asked;
  asked = null;
  return request;
}
