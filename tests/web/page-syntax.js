// The syntax tree of a module of the page, by the parser that ESLint uses.
// @ts-expect-error it has no types
import * as espree from "espree";

/** @type {Record<string, string[]>} the children of each type of node */
export const KEYS = espree.VisitorKeys;

/**
 * @param {string} source
 * @returns {any}
 */
export function parse(source) {
  return espree.parse(source, { ecmaVersion: "latest", sourceType: "module", loc: true });
}
