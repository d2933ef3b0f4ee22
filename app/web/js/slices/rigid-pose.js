// A rigid transform as six numbers: a shift in mm, and turns about the x, the y and then the z axis of LPS in degrees.
/** @import { Transform } from "./overlay.js" */

const DEGREES = 180 / Math.PI;

/**
 * The transform that turns about the frame's origin, x first and z last, and then shifts.
 * @param {number[]} pose x, y, z in mm, and the turns about them in degrees
 * @returns {Transform}
 */
export function transformOfPose([x, y, z, aboutX, aboutY, aboutZ]) {
  const [[ca, sa], [cb, sb], [cg, sg]] = [aboutX, aboutY, aboutZ].map((angle) => [Math.cos(angle / DEGREES), Math.sin(angle / DEGREES)]);
  return [
    cg * cb, cg * sb * sa - sg * ca, cg * sb * ca + sg * sa, x,
    sg * cb, sg * sb * sa + cg * ca, sg * sb * ca - cg * sa, y,
    -sb, cb * sa, cb * ca, z,
    0, 0, 0, 1,
  ].map((value) => value + 0); // no −0
}

/**
 * The inverse of `transformOfPose`; where the turn about y is a right angle, that about z is 0.
 * @param {Transform} transform rigid
 * @returns {number[]}
 */
export function poseOf(transform) {
  const [xx, , , x, yx, yy, yz, y, zx, zy, zz, z] = transform;
  const aboutY = Math.asin(Math.max(-1, Math.min(1, -zx)));
  const level = Math.hypot(xx, yx) > 1e-6;
  const aboutX = level ? Math.atan2(zy, zz) : Math.atan2(-yz, yy);
  const aboutZ = level ? Math.atan2(yx, xx) : 0;
  return [x, y, z, aboutX * DEGREES, aboutY * DEGREES, aboutZ * DEGREES];
}
