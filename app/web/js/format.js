// Numbers as the page shows them: fixed digits, a real minus, a unit beside them; places as a surgeon reads them.

/**
 * @param {number | null | undefined} value
 * @param {number} digits
 */
export function fixed(value, digits) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const text = value.toFixed(digits);
  const clean = Number(text) === 0 ? text.replace("-", "") : text;
  return clean.replace("-", "−");
}

/**
 * A difference with its sign.
 * @param {number} value
 * @param {number} digits
 */
export function signed(value, digits) {
  const text = fixed(value, digits);
  return Number(value.toFixed(digits)) > 0 ? `+${text}` : text;
}

/**
 * Words of the planner as a sentence.
 * @param {string} words
 */
export function sentence(words) {
  return words.charAt(0).toUpperCase() + words.slice(1);
}

/**
 * @param {number | null | undefined} value
 * @param {number} [digits]
 */
export function mm(value, digits = 1) {
  return `${fixed(value, digits)} mm`;
}

/**
 * A date as the reader's language writes it; nothing for what is no date.
 * @param {string} iso
 */
export function when(iso) {
  const date = new Date(iso);
  if (Number.isNaN(date.getTime())) return "";
  return date.toLocaleDateString(undefined, { year: "numeric", month: "short", day: "numeric" });
}

/**
 * A date with the time of day, hours and minutes, as the reader's language writes it; nothing for what is no date.
 * @param {string} iso
 */
export function whenExactly(iso) {
  const date = new Date(iso);
  if (Number.isNaN(date.getTime())) return "";
  return date.toLocaleString(undefined, { year: "numeric", month: "short", day: "numeric", hour: "2-digit", minute: "2-digit" });
}

/**
 * A time of this year without the year, as the reader's language writes it; nothing for what is no date.
 * @param {string} iso
 */
export function whenShort(iso) {
  const date = new Date(iso);
  if (Number.isNaN(date.getTime())) return "";
  const year = date.getFullYear() === new Date().getFullYear() ? undefined : "numeric";
  return date.toLocaleString(undefined, { year, month: "short", day: "numeric", hour: "2-digit", minute: "2-digit" });
}

/**
 * A whole number with its thousands set apart by commas, as the planner writes them.
 * @param {number} number
 */
export function thousands(number) {
  return fixed(Math.round(number), 0).replace(/\B(?=(\d{3})+$)/g, ",");
}

/**
 * @param {number} number
 * @param {string} one
 * @param {string} many
 */
export function count(number, one, many) {
  return `${thousands(number)} ${number === 1 ? one : many}`;
}
