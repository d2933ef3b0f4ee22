// The scene's attempts to connect, with a worker that stands for viser's.
import assert from "node:assert/strict";
import { test } from "node:test";

/** Notes what it is told. */
class FakeWorker extends EventTarget {
  /** @type {string[]} */
  told = [];

  /** @param {{ type: string }} message */
  postMessage(message) {
    this.told.push(message.type);
  }

  /** @param {string} type */
  says(type) {
    this.dispatchEvent(Object.assign(new Event("message"), { data: { type } }));
  }
}

Object.assign(globalThis, { Worker: FakeWorker });
await import("../../app/web/js/scene-layer/patience.js");

test("an attempt to connect is awaited before the next one", () => {
  const worker = new FakeWorker();
  worker.postMessage({ type: "set_server" });
  for (let second = 0; second < 3; second++) worker.postMessage({ type: "retry" });
  assert.deepEqual(worker.told, ["set_server"]);
  worker.says("closed");
  for (let second = 0; second < 3; second++) worker.postMessage({ type: "retry" });
  assert.deepEqual(worker.told, ["set_server", "retry"]);
  worker.says("connected");
  worker.postMessage({ type: "send" });
  worker.says("closed");
  worker.postMessage({ type: "retry" });
  assert.deepEqual(worker.told, ["set_server", "retry", "send", "retry"]);
});

test("other workers are told everything", () => {
  const worker = new FakeWorker();
  for (const type of ["retry", "retry", "send"]) worker.postMessage({ type });
  assert.deepEqual(worker.told, ["retry", "retry", "send"]);
});
