"""What the tests run in the page: how it draws, and what it shows at one moment."""

# Antialiasing costs two thirds of the time of a frame in software.
NO_ANTIALIASING = """
const original = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, options) {
  return original.call(this, kind, kind.startsWith("webgl") ? { ...options, antialias: false } : options);
};
"""

# The scene's frame stays empty until OPEN_SCENE, over a reload too: software takes one of two cores to draw it. Then it
# has half the resolution that the page asks of software, a quarter of the pixels.
HOLD_SCENE = """
if (window === top) {
  const source = Object.getOwnPropertyDescriptor(HTMLIFrameElement.prototype, "src");
  const isHeld = () => !sessionStorage.getItem("vfix-scene-opened");
  const hold = { ...source, set(address) {
    this.heldAddress = address.replace("fixedDpr=0.6", "fixedDpr=0.3");
    if (!isHeld()) source.set.call(this, this.heldAddress);
  } };
  Object.defineProperty(HTMLIFrameElement.prototype, "src", hold);
}
"""
OPEN_SCENE = """() => {
  sessionStorage.setItem("vfix-scene-opened", "yes");
  const frame = document.getElementById("scene");
  if (frame?.heldAddress) frame.src = frame.heldAddress;
}"""

# Every note that was ever shown: most of them leave by themselves.
SAID = """
if (window === top) {
  window.said = [];
  new MutationObserver((changes) => {
    for (const { addedNodes } of changes) {
      for (const node of addedNodes) if (node.classList?.contains("toast")) window.said.push(node.textContent);
    }
  }).observe(document, { childList: true, subtree: true });
}
"""

# Two frames: the page draws its newest state with the next one, and the slices what that asks for with the one after.
DRAWN = "() => new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(() => go())))"

# After four frames: where the planner believes two places to be on the canvas, and whether the canvas draws them there.
# Turned about a place beside its middle, the two differ by some pixels.
LOOK = """async () => {
  for (let n = 0; n < 4; n += 1) await new Promise((go) => requestAnimationFrame(go));
  const points = [[0, 0, 0], [0, 60, 40]];
  const { places } = await vfix.request('project', { points });
  if (!places || !vfix.layer) return { places, same: Boolean(places) };
  const { width, height } = vfix.layer.hooks.size;
  const same = points.every((point, n) => {
    const drawn = vfix.layer.hooks.project(point);
    if (!drawn || !places[n]) return !drawn && !places[n];
    const [x, y] = [places[n][0] * width, places[n][1] * height];
    return Math.hypot(x - drawn.x, y - drawn.y) < 6 + 0.005 * Math.hypot(x - width / 2, y - height / 2);
  });
  return { places, same };
}"""

# Whether the camera looks from a direction, of the patient; null where the canvas cannot be reached.
LOOKS_FROM = """(direction) => {
  if (!vfix.layer) return null;
  const { hooks } = vfix.layer;
  const wanted = hooks.world(direction).sub(hooks.world([0, 0, 0])).normalize();
  return hooks.camera.getWorldDirection(wanted.clone()).dot(wanted) < -0.99999;
}"""

# Whether something small is drawn at a place of the scene, such as a point of the path.
IN_SCENE = """(position) => {
  if (!vfix.layer) return true;
  const { hooks } = vfix.layer;
  const place = hooks.world(position);
  let found = false;
  hooks.each((object) => {
    if (!object.isMesh || object.userData.vfixPass) return;
    found ||= object.getWorldPosition(place.clone()).distanceTo(place) < 0.05;
  });
  return found;
}"""

# Where the slices in sight stand and what they show; null until each shows what it is to show.
SLICES = """async () => {
  await new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(() => go())));
  const { link, panes } = vfix.slices;
  const shown = panes.filter((pane) => !pane.element.hidden && pane.stage.clientWidth);
  const ports = shown.map((pane) => [pane.port, pane.wanted()].map((port) => JSON.stringify(port)));
  const done = link.ready && ports.every(([drawn, wanted]) => drawn === wanted) && !shown.some((pane) => pane.drawing);
  if (!done) return null;
  return shown.map(({ stage }, n) => [ports[n][0], JSON.stringify(stage.getBoundingClientRect())]);
}"""

# What is shown and past its limit: three words of a button, twelve of anything else and of what an attribute says. Free
# are what stands behind '?' and in a dialog's body, what is only spoken, and buttons named by what they stand for.
LONG_TEXTS = """async () => {
  const { countWords } = await import('/static/js/brief.js');
  const free = 'script, style, select, textarea, svg, .help, .visually-hidden, .verdict-words, #dialog .words, .keys';
  const named = '.row-main, .row-sub, .chip, .place, .way, .step > summary, [role=option], .where, .number, '
    + '.order-card, .slice-window, .slice-where, [role=menuitemradio]';
  const texts = new Map();
  const nodes = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (nodes.nextNode()) {
    const { data, parentElement: parent } = nodes.currentNode;
    if (!data.trim() || !parent.checkVisibility({ visibilityProperty: true }) || parent.closest(free)) continue;
    let block = parent;
    while (/^(inline|contents)$/.test(getComputedStyle(block).display)) block = block.parentElement;
    texts.set(block, (texts.get(block) ?? '') + data);
  }
  const long = [];
  for (const [block, text] of texts) {
    const most = block.closest('button, summary') && !block.closest(named) ? 3 : 12;
    if (countWords(text) > most) long.push(`${block.id || block.className || block.tagName}: ${text}`);
  }
  for (const element of document.querySelectorAll('[title], [aria-label], [placeholder]')) {
    if (!element.checkVisibility() || element.matches('tr')) continue; // a row is named as the user named it
    for (const name of ['title', 'aria-label', 'placeholder']) {
      if (countWords(element.getAttribute(name) ?? '') > 12) long.push(`${name}: ${element.getAttribute(name)}`);
    }
  }
  return long;
}"""
