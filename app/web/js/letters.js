// Which letter a key means, on keyboards of any language.

/**
 * The capital letter of a shortcut: what the key says where that is a Latin letter, else what the key at this place says
 * on an English keyboard, so that shortcuts work on Greek and Cyrillic ones; '' where it is no letter.
 * @param {Pick<KeyboardEvent, "key" | "code">} event
 */
export function letterOf({ key, code }) {
  if (/^[a-z]$/i.test(key)) return key.toUpperCase();
  return /^Key([A-Z])$/.exec(code)?.[1] ?? "";
}
