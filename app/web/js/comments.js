// Comments at a time of a run: one line of text, in the driven time of the run.
import { fixed } from "./format.js";
import { change, remove, send } from "./rest.js";
import { html } from "./template.js";

/** @import { CommentPublic } from "./types.js" */

export const MOST_CHARACTERS = 300;

/** @param {string} run @param {string} [comment] */
const address = (run, comment) => `/api/v1/runs/${encodeURIComponent(run)}/comments${comment ? `/${encodeURIComponent(comment)}` : ""}`;

/** @param {string} run @param {number} at s @param {string} text @returns {Promise<CommentPublic>} */
export const addComment = (run, at, text) => send(address(run), { at_s: at, text });

/** @param {string} run @param {string} comment @param {string} text @returns {Promise<CommentPublic>} */
export const changeComment = (run, comment, text) => change(address(run, comment), { text });

/** @param {string} run @param {string} comment */
export const deleteComment = (run, comment) => remove(address(run, comment));

/**
 * A time as comments have it; 'before' for one before the last return to the start.
 * @param {number | null} t s
 */
export function commentTime(t) {
  return t === null ? "before" : `${fixed(t, 1)} s`;
}

/**
 * Send the comment of a field, which is emptied once that is stored, and kept where it is not.
 * @param {HTMLInputElement} field
 * @param {(text: string) => Promise<boolean>} sent whether it was stored
 */
export async function sendLine(field, sent) {
  const text = field.value.trim();
  if (!text || field.readOnly) return; // a second press sends it once
  field.readOnly = true;
  const stored = await sent(text);
  field.readOnly = false;
  if (stored) field.value = "";
}

/**
 * One line to write a comment in.
 * @param {string} id of the field
 * @param {string} words of its button
 * @param {(text: string) => Promise<boolean>} sent as of `sendLine`
 */
export function commentForm(id, words, sent) {
  const submit = (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    const field = /** @type {HTMLFormElement} */ (event.currentTarget).querySelector("input");
    if (field) sendLine(field, sent);
  };
  return html`<form class="comment-form" @submit=${submit}>
    <input type="text" id=${id} maxlength=${MOST_CHARACTERS} placeholder="One line" aria-label="Comment" autocomplete="off"><button type="submit">${words}</button></form>`;
}
