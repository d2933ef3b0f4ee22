// How much of a text stands on the page: at most a dozen words; the rest of it is behind ‘?’ (said.js).

const MOST_WORDS = 12;

/**
 * How many words a text has: what has neither letter nor digit, such as ‘·’ or ‘…’, is none.
 * @param {string} text
 */
export function countWords(text) {
  return text.split(/\s+/u).filter((word) => /[\p{L}\p{N}□]/u.test(word)).length;
}

/**
 * The beginning of a text: as many of its sentences as have a dozen words together, else its first one, else that up to
 * a semicolon, a colon or a parenthesis.
 * @param {string} text
 */
export function brief(text) {
  for (const end of [/[.!?…][’)]?(?= )|$/gu, /[;:](?= )|(?= \()/gu]) {
    const ends = [...text.matchAll(end)].map((match) => match.index + match[0].length).filter((at) => isWhole(text.slice(0, at)));
    if (ends.length) return text.slice(0, ends.at(-1));
  }
  return text.split(/(?<=[.!?]) /u)[0];
}

/**
 * Whether it has a dozen words at most, and ends in no parenthesis.
 * @param {string} text
 */
function isWhole(text) {
  return countWords(text) <= MOST_WORDS && text.split("(").length === text.split(")").length;
}

/**
 * A text in two: what stands on the page, and what is behind ‘?’, '' where nothing is.
 * @param {string} text
 * @returns {[string, string]}
 */
export function inTwo(text) {
  const first = brief(text);
  const rest = text.slice(first.length).trim();
  return [first.replace(/(?:[;:]|(?<![.!?…)’]))$/u, rest ? "." : ""), rest.charAt(0).toUpperCase() + rest.slice(1)];
}
