// When a press takes hold of the robot: a page that hung hears of its keys late, and of their release after them.

const FRESH_MS = 100; // as long as a force lasts at the planner without a sign of the hand

/**
 * Whether an event is young enough to say what a hand does now. Each frame's clock starts when the frame is made.
 * @param {UIEvent} event
 */
export function isFresh(event) {
  const { performance: clock } = event.view ?? window;
  return clock.now() - event.timeStamp < FRESH_MS;
}

/**
 * Act on a press or on the repeat of a held key. A press acts at once; one that comes late acts after the events that
 * wait already, if it is held still: browsers handle those of the hand before timers, so that a release among them wins.
 * A repeat acts after them too, and only while it is young.
 * @param {PointerEvent | KeyboardEvent} event
 * @param {() => boolean} held whether nothing let go of it since
 * @param {() => void} act
 */
export function takeHold(event, held, act) {
  const repeat = "repeat" in event && event.repeat;
  const fresh = isFresh(event);
  if (fresh && !repeat) act();
  else if (fresh || !repeat) setTimeout(() => { if (held() && (!repeat || isFresh(event))) act(); });
}
