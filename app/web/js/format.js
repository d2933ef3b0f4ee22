// Numbers as the page shows them: fixed digits, a real minus, a unit beside them.

export function fixed(value, digits) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const text = value.toFixed(digits);
  const clean = Number(text) === 0 ? text.replace("-", "") : text;
  return clean.replace("-", "−");
}

/** Words of the planner as a sentence. */
export function sentence(words) {
  return words.charAt(0).toUpperCase() + words.slice(1);
}

export function mm(value, digits = 1) {
  return `${fixed(value, digits)} mm`;
}

export function when(iso) {
  const date = new Date(iso);
  if (Number.isNaN(date.getTime())) return "";
  return date.toLocaleDateString(undefined, { year: "numeric", month: "short", day: "numeric" });
}

export function count(number, one, many) {
  return `${number.toLocaleString("en-US").replaceAll(",", " ")} ${number === 1 ? one : many}`;
}
