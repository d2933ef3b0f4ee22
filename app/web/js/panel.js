// What a step's panel is, and how the panels of the steps that the planner has are loaded.

/** @import { Connection } from "./connection.js" */
/** @import { Keys } from "./keys.js" */
/** @import { TabEntry, ViewModel } from "./types.js" */

/**
 * What a panel may use of the page.
 * @typedef {{ connection: Connection, keys: Keys }} Parts
 */

/**
 * What the status bar shows of a tab that drives.
 * @typedef {{ elements: HTMLElement[], update: (state: ViewModel) => void }} TabStatus
 */

/**
 * The default export of a step's `panel.js` is a class of this kind. `element` is shown while its step is, and `overlay`
 * upon the scene; `update` is called with the view model once per frame in which something changed, while its step is shown.
 * @typedef {{ element: HTMLElement, overlay?: HTMLElement, status?: TabStatus, update: (state: ViewModel) => void }} Panel
 */

/**
 * Load a step's panel from the planner. Throws where its module cannot be loaded or fails.
 * @param {TabEntry} step
 * @param {Parts} parts
 * @returns {Promise<Panel>}
 */
export async function loadPanel(step, parts) {
  const module = await import(step.panel);
  return new module.default(parts);
}
