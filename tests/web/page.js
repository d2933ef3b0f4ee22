// What the page's modules expect of a browser, as little of it as their pure parts touch.

/** Lay `window` and `document` out as globals, each an EventTarget; returns them. */
export function layOutPage() {
  const document = Object.assign(new EventTarget(), { hidden: false, activeElement: null, hasFocus: () => true, querySelector: () => null, querySelectorAll: () => [], getElementById: () => null });
  const window = Object.assign(new EventTarget(), { performance });
  Object.assign(globalThis, { window, document });
  return { window, document };
}

/** An event as a handler reads it; it notes whether it was prevented and stopped. */
export function keyEvent(code, fields = {}) {
  const event = {
    code, key: code.replace(/^Key/, ""), target: null, view: null, repeat: false, timeStamp: performance.now(), ctrlKey: false, metaKey: false, altKey: false, shiftKey: false,
    prevented: false, stopped: false,
    preventDefault() { event.prevented = true; },
    stopImmediatePropagation() { event.stopped = true; },
    ...fields,
  };
  return event;
}

/** A connection that notes what is sent. */
export function noted(state = {}) {
  const connection = { state, connected: true, sent: [], holds: [], send: (type, fields) => connection.sent.push(fields === undefined ? [type] : [type, fields]), hold: (on) => connection.holds.push(on), say: () => {} };
  return connection;
}
