// How tissue looks through a scope: numbers of the shading, by the organ. Chosen by eye, see docs/endoscope.md.

/**
 * reach: mm at which the light is as bright as the picture shows. exposure: of the whole. wrap: light that goes round an
 * edge within tissue, red, green and blue. shine: of the wet surface. fog: mm. relief: of the fine grain. tint: of the light.
 * near: how far the fall-off of the light is softened close to the lens, where it would dazzle, as a share of reach².
 * lights: mm of each of the two lights beside the lens. far: mm beyond which nothing is drawn.
 * @typedef {{ lights: number, far: number, reach: number, near: number, exposure: number, wrap: [number, number, number], shine: number, fog: number, relief: number, tint: [number, number, number] }} Look
 */

/** @type {Look} */
export const NOSE = { lights: 1.2, far: 120, reach: 11, near: 0.06, exposure: 3.4, wrap: [0.3, 0.135, 0.105], shine: 1.3, fog: 45, relief: 0.16, tint: [1, 0.96, 0.94] };

/** A colon is wider: its light reaches farther, and its folds are seen far ahead. @type {Look} */
export const COLON = { lights: 3, far: 200, reach: 16, near: 1, exposure: 4.2, wrap: [0.25, 0.16, 0.13], shine: 0.8, fog: 90, relief: 0.14, tint: [1, 0.96, 0.92] };

/** A cavity is wider still, and less wet. @type {Look} */
export const CAVITY = { ...COLON, lights: 4, far: 400, reach: 45, near: 0.6, shine: 0.5, fog: 260 };

/** @type {Record<"nose" | "colon" | "cavity", Look>} */
export const LOOKS = { nose: NOSE, colon: COLON, cavity: CAVITY };
