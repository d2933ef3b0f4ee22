// What six axes of a device are to a robot in a lumen.

/** @import { DeviceKind } from "/static/js/devices/hand-devices.js" */
/** @import { SixAxes } from "/static/js/devices/six-axes.js" */

/**
 * Six axes of a device as the three of the robot: a slide or a turn to a side moves the camera. What inserts are a push of
 * a SpaceMouse while one of its buttons is held, which moves the camera no more, and the triggers of a gamepad, the right
 * one forwards.
 * @param {Readonly<SixAxes>} axes
 * @param {DeviceKind} kind
 * @param {boolean} [pressed] a button of the SpaceMouse
 */
export function snakeAxes([x, y, z, up, right], kind, pressed = false) {
  const pad = kind === "gamepad";
  const clipped = (/** @type {number} */ value) => Math.max(-1, Math.min(1, value));
  if (pressed && !pad) return { camera_x: 0, camera_y: 0, insert: clipped(z) };
  return { camera_x: clipped(x + right), camera_y: clipped((pad ? 0 : y) - up), insert: clipped(pad ? z - y : 0) };
}
