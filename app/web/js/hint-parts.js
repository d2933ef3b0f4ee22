// A hint in parts: the tabs that it names are ways to them.
/** @import { TabEntry } from "./types.js" */

/** @typedef {{ tab: string, words: string, inline: boolean }} Way to a tab; inline: a word of a sentence */

/**
 * A hint in parts: a sentence that only says ‘Go to Plan.’ is a button, and so is a tab’s name in any other one.
 * @param {string} words
 * @param {Pick<TabEntry, "name" | "label">[]} tabs that can be opened from here
 * @returns {(string | Way)[]}
 */
export function partsOf(words, tabs) {
  if (!tabs.length) return words ? [words] : [];
  const label = tabs.map((tab) => tab.label.replace(/[.*+?^${}()|[\]\\]/gu, "\\$&")).join("|");
  const named = new RegExp(`(?<=^|[.!?] )(?:Go|Then go) to (?<alone>${label})\\.|(?<=\\b(?:in|to) )(?<within>${label})\\b`, "gu");
  /** @type {(string | Way)[]} */
  const parts = [];
  let at = 0;
  for (const found of words.matchAll(named)) {
    const { alone, within } = found.groups ?? {};
    const before = words.slice(at, found.index);
    if (before.trim()) parts.push(alone ? before.trimEnd() : before);
    const { name } = /** @type {TabEntry} */ (tabs.find((tab) => tab.label === (alone ?? within)));
    parts.push({ tab: name, words: alone ? `Go to ${alone}` : within, inline: !alone });
    at = found.index + found[0].length;
  }
  return words.slice(at).trim() ? [...parts, words.slice(at)] : parts;
}
