// The REST face, where a websocket is the wrong tool: files in, files out.

async function failure(response) {
  try {
    const body = await response.json();
    const error = new Error(body.error.message);
    error.code = body.error.code;
    error.details = body.error.details;
    return error;
  } catch {
    return new Error(`The planner answered ${response.status}.`);
  }
}

async function call(path, options = {}) {
  let response;
  try {
    response = await fetch(path, { credentials: "same-origin", ...options });
  } catch {
    throw new Error("The planner does not answer.");
  }
  if (!response.ok) throw await failure(response);
  return response.status === 204 ? null : response.json();
}

export function post(path, body) {
  return call(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
}

export function remove(path) {
  return call(path, { method: "DELETE" });
}

/** Watch a job until it is done; throws what it failed with. */
export async function finished(job, onProgress) {
  let now = job;
  while (now.state === "queued" || now.state === "running") {
    onProgress(now);
    await new Promise((resolve) => { setTimeout(resolve, 300); });
    now = await call(`/api/jobs/${encodeURIComponent(now.id)}`);
  }
  if (now.state === "done") return now;
  throw Object.assign(new Error(now.error.message), { code: now.error.code, details: now.error.details });
}

/** Upload with progress in [0, 1]; resolves to the answer's JSON. */
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
      const error = new Error(request.response?.error?.message ?? `The planner answered ${request.status}.`);
      error.code = request.response?.error?.code;
      error.details = request.response?.error?.details;
      reject(error);
    });
    request.addEventListener("error", () => reject(new Error("The upload was interrupted.")));
    request.send(form);
  });
}

/** Let the browser save what an address answers. */
export function download(path) {
  const anchor = document.createElement("a");
  anchor.href = path;
  anchor.download = "";
  document.body.append(anchor);
  anchor.click();
  anchor.remove();
}
