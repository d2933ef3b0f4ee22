// Preferences that the browser stores. Everything works in a browser that stores nothing.

/**
 * @param {string} name
 * @param {readonly string[]} allowed
 * @param {string} otherwise
 */
export function recall(name, allowed, otherwise) {
  const kept = recallText(name);
  return kept !== null && allowed.includes(kept) ? kept : otherwise;
}

/**
 * @param {string} name
 * @returns {string | null}
 */
export function recallText(name) {
  try {
    return localStorage.getItem(`vfix-${name}`);
  } catch {
    return null; // storage is switched off
  }
}

/**
 * @param {string} name
 * @param {string} value
 */
export function keep(name, value) {
  try {
    localStorage.setItem(`vfix-${name}`, value);
  } catch {
    // storage is switched off or full: it holds until the page is loaded again
  }
}
