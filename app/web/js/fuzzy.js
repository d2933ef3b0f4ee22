// How well typed words fit a name.

const BEST = 0, WORD = 1, WITHIN = 2, SCATTERED = 3;

/**
 * The rank of a name for what is typed, 0 the best; null where it does not fit. Each word has to be found: at the
 * beginning of the name, of a word of it, anywhere in it, or letter by letter in this order.
 * @param {string} typed
 * @param {string} name
 */
export function rank(typed, name) {
  const words = plain(typed).split(" ").filter(Boolean), text = plain(name);
  let worst = BEST;
  for (const word of words) {
    const found = rankOf(word, text);
    if (found === null) return null;
    worst = Math.max(worst, found);
  }
  return worst;
}

/**
 * @param {string} word
 * @param {string} text
 */
function rankOf(word, text) {
  if (text.startsWith(word)) return BEST;
  if (text.includes(` ${word}`)) return WORD;
  if (text.includes(word)) return WITHIN;
  let at = -1;
  for (const letter of word) {
    at = text.indexOf(letter, at + 1);
    if (at < 0) return null;
  }
  return SCATTERED;
}

/**
 * Lower case without accents, words apart.
 * @param {string} text
 */
function plain(text) {
  return text.normalize("NFD").replace(/\p{M}/gu, "").toLowerCase().replace(/[^\p{L}\p{N}.]+/gu, " ").trim();
}
