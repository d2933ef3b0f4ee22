// The REST face, where a websocket is the wrong tool: files in, files out.

/** @import { ErrorPublic, ErrorWords, JobPublic } from "./types.js" */

/**
 * @typedef {{ number: number, modality: string, description: string, slices: number, columns: number, rows: number, spacing_mm: number[] }} SeriesFacts
 *   of a DICOM series, to choose it by
 */

/** What the planner says went wrong; details: what it needs besides the words, such as what a file does not say. */
export class PlannerError extends Error {
  /** @param {ErrorWords} words */
  constructor({ code, message, details }) {
    super(message);
    this.code = code;
    this.details = /** @type {{ missing?: string[], series?: SeriesFacts[] } | null | undefined} */ (details);
  }
}

/**
 * The series to choose one of, where that is what is missing.
 * @param {unknown} error
 */
export function seriesOf(error) {
  return (error instanceof PlannerError && error.details?.series) || [];
}

/**
 * What the planner needs besides: 'frame', 'unit', 'series', 'into' or 'points_as'.
 * @param {unknown} error
 */
export function missing(error) {
  return (error instanceof PlannerError && error.details?.missing) || [];
}

/**
 * @param {number} status
 * @param {Partial<ErrorPublic> | null} body the answer's JSON; null where it is none
 */
function failure(status, body) {
  return body?.error ? new PlannerError(body.error) : new Error(`The planner answered ${status}.`);
}

/**
 * @param {string} path
 * @param {RequestInit} [options]
 */
async function ask(path, options = {}) {
  let response;
  try {
    response = await fetch(path, { credentials: "same-origin", ...options });
  } catch {
    throw new Error("The planner does not answer.");
  }
  if (!response.ok && response.status !== 304) throw failure(response.status, await response.json().catch(() => null));
  return response;
}

/**
 * @param {string} path
 * @param {RequestInit} [options]
 */
async function call(path, options = {}) {
  const response = await ask(path, options);
  return response.status === 204 ? null : response.json();
}

/**
 * Ask for something that is made of a wish.
 * @param {string} path
 * @param {object} wish
 */
export function send(path, wish) {
  return call(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(wish) });
}

/**
 * @param {string} path
 * @param {object} wish
 */
export function change(path, wish) {
  return call(path, { method: "PATCH", headers: { "Content-Type": "application/json" }, body: JSON.stringify(wish) });
}

/** @param {string} path */
export function read(path) {
  return call(path);
}

/**
 * A picture that the planner has drawn as SVG, as an element of the page, so that the page's colours apply to it.
 * @param {string} path
 */
export async function readPicture(path) {
  const text = await (await ask(path)).text();
  return document.importNode(new DOMParser().parseFromString(text, "image/svg+xml").documentElement, true);
}

/**
 * A binary file of the planner with its ETag; data is null where it is still the one that is known.
 * @param {string} path
 * @param {string} known its ETag; '' for none
 */
export async function readBytes(path, known) {
  const response = await ask(path, known ? { headers: { "If-None-Match": known } } : {});
  return { etag: response.headers.get("ETag") ?? "", data: response.status === 304 ? null : await response.arrayBuffer() };
}

/** @param {string} path */
export function remove(path) {
  return call(path, { method: "DELETE" });
}

/**
 * How far a job is.
 * @param {string} id
 * @returns {Promise<JobPublic>}
 */
export function jobNow(id) {
  return call(`/api/v1/jobs/${encodeURIComponent(id)}`);
}

/**
 * Whether somebody cancelled the job that failed so.
 * @param {unknown} error
 */
export function wasCancelled(error) {
  return error instanceof PlannerError && error.code === "job_cancelled";
}

/**
 * Upload with progress in [0, 1]; resolves to the answer's JSON.
 * @template Answer
 * @param {string} path
 * @param {FormData} form
 * @param {(part: number) => void} onProgress
 * @returns {Promise<Answer>}
 */
export function upload(path, form, onProgress) {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open("POST", path);
    request.responseType = "json";
    request.upload.addEventListener("progress", (event) => {
      if (event.lengthComputable) onProgress(event.loaded / event.total);
    });
    request.addEventListener("load", () => {
      if (request.status < 300) {
        resolve(request.response);
        return;
      }
      reject(failure(request.status, request.response));
    });
    for (const end of ["error", "abort", "timeout"]) request.addEventListener(end, () => reject(new Error("The upload was interrupted.")));
    request.send(form);
  });
}

/**
 * Let the browser save what an address answers.
 * @param {string} path
 */
export function download(path) {
  const anchor = document.createElement("a");
  anchor.href = path;
  anchor.download = "";
  document.body.append(anchor);
  anchor.click();
  anchor.remove();
}

/**
 * Save what an address answers once it has come, so that a refusal is told; returns the file's name.
 * @param {string} path
 */
export async function saveFrom(path) {
  const response = await ask(path);
  const name = response.headers.get("Content-Disposition")?.match(/filename="([^"]+)"/u)?.[1] ?? "vfix";
  saveBlob(await response.blob(), name);
  return name;
}

/**
 * Save what the page itself has made.
 * @param {Blob} blob
 * @param {string} name of the file
 */
export function saveBlob(blob, name) {
  const anchor = document.createElement("a");
  anchor.href = URL.createObjectURL(blob);
  anchor.download = name;
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(anchor.href), 60_000); // once the browser has begun to save it
}
