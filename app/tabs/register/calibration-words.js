// What the group of pointer and robot says of calibrations; nothing here touches the page.

/** @import { CalibrationView, PointerTipView, RobotView } from "/static/js/types.js" */

/** @type {Record<PointerTipView["measured_from"], string>} */
const SOURCES = { file: "table", simulated: "simulated", tracker: "tracked" };

/**
 * The group in one line, for when it is folded.
 * @param {CalibrationView} calibration
 */
export function briefWords({ to, pointer, robot }) {
  const parts = [to === "base" ? "to the robot's base" : "to the patient"];
  if (pointer) parts.push(`tip ± ${mm(pointer.tip_error_mm)}${pointer.measured_from === "simulated" ? ", simulated" : ""}`);
  if (robot) parts.push(robot.measured_from === "simulated" ? "robot simulated" : "robot calibrated");
  return parts.join(" · ");
}

/**
 * Rows of the pointer's calibration: what, how much, and what that means.
 * @param {PointerTipView} pointer
 * @returns {[string, string, string][]}
 */
export function pointerRows(pointer) {
  return [
    ["Error of the tip", `${mm(pointer.tip_error_mm)} rms`, "Expected, in the pointer"],
    ["Residual", `${mm(pointer.residual_mm)} rms`, "Distance of the tip from its place"],
    ["Swung by", `${pointer.swing_deg.toFixed(0)}°`, "Least direction; 30° is good"],
    ["Poses", sourceWords(pointer), "Used, and their source"],
  ];
}

/**
 * Rows of the robot's calibration: what, how much, and what that means.
 * @param {RobotView} robot
 * @returns {[string, string, string][]}
 */
export function robotRows(robot) {
  return [
    ["Residual, distance", `${mm(robot.translation_residual_mm)} rms`, "Marker, carried against seen"],
    ["Residual, rotation", `${robot.rotation_residual_deg.toFixed(2)}° rms`, "Their angle"],
    ["Poses", sourceWords(robot), "Used pairs, and their source"],
  ];
}

/** @param {PointerTipView | RobotView} tool */
function sourceWords(tool) {
  return `${tool.poses} ${tool.poses === 1 ? "pose" : "poses"}, ${SOURCES[tool.measured_from]}`;
}

/**
 * Which of two tables of poses is the robot's; null where that is not one of them.
 * @param {string[]} texts
 * @returns {number | null}
 */
export function robotsTable(texts) {
  const robots = texts.map((text) => /^#\s*pose\s*=\s*flange_to_base\s*$/im.test(text));
  return texts.length === 2 && robots[0] !== robots[1] ? robots.indexOf(true) : null;
}

/** @param {number} value */
export function mm(value) {
  return `${value.toFixed(2)} mm`;
}

/**
 * A sentence of the server, which has no capital.
 * @param {string} text
 */
export function sentence(text) {
  return text.charAt(0).toUpperCase() + text.slice(1);
}
