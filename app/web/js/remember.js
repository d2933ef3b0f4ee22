// What a browser remembers of how somebody likes the page. A browser that keeps nothing still shows all of it.

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
