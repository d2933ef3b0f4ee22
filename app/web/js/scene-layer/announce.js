// Runs in the scene's frame before viser's own script, which the gateway puts it in front of; a plain script, no module.
// three.js announces every scene (and its loaders) to window.__THREE_DEVTOOLS__ where there is one.
(() => {
  /** @type {unknown[]} */
  const scenes = [];
  const devtools = new EventTarget();
  devtools.addEventListener("observe", (event) => {
    if (event instanceof CustomEvent && event.detail?.isScene) scenes.push(event.detail);
  });
  Object.assign(window, { vfixScenes: scenes, __THREE_DEVTOOLS__: devtools });
})();
