// How tissue looks through a scope: numbers of the shading, by the organ. Chosen by eye, see docs/endoscope.md.

/**
 * reach: mm at which the light is as bright as the picture shows. exposure: of the whole. wrap: light that goes round an
 * edge within tissue, red, green and blue. shine: of the wet surface. fog: mm. relief: of the fine grain. tint: of the light.
 * @typedef {{ reach: number, exposure: number, wrap: [number, number, number], shine: number, fog: number, relief: number, tint: [number, number, number] }} Look
 */

/** @type {Look} */
export const NOSE = { reach: 11, exposure: 3.4, wrap: [0.3, 0.135, 0.105], shine: 1.3, fog: 45, relief: 0.16, tint: [1, 0.96, 0.94] };
