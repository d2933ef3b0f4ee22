// Runs in the scene's frame before viser's own script, which the gateway puts it in front of; a plain script, no module.
// viser's client connects anew every second and gives up the attempt before, so that a planner that takes longer to let
// a scene in never would. Here an attempt is awaited: viser's worker tells how it ends, after 5 s at most.
(() => {
  const { postMessage } = Worker.prototype;
  /** @type {WeakMap<Worker, boolean>} of viser's worker, whether it is connected or tries to be */
  const busy = new WeakMap();

  /** @param {Worker} worker */
  const watch = (worker) => {
    busy.set(worker, true);
    // capture: before viser hears of it, which tries again at once
    worker.addEventListener("message", ({ data }) => { if (data.type === "closed") busy.set(worker, false); }, { capture: true });
  };

  /**
   * @this {Worker}
   * @param {any} message
   * @param {any[]} rest
   */
  Worker.prototype.postMessage = function (message, ...rest) {
    if (message?.type === "set_server" && !busy.has(this)) watch(this);
    if (message?.type === "retry" && busy.has(this)) {
      if (busy.get(this)) return;
      busy.set(this, true);
    }
    Reflect.apply(postMessage, this, [message, ...rest]);
  };
})();
