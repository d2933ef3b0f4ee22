// Shader texts. Variants are made by #define: a branch on a uniform costs both of its sides without a graphics card.

export const TISSUE_VERTEX = `#version 300 es
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 colour;
uniform mat4 toClip;
out vec3 place; out vec3 facing; out vec4 tissue;
void main() { place = position; facing = normal; tissue = colour; gl_Position = toClip * vec4(position, 1.0); }`;

/** 'full': two lights, shine and fine relief. 'lean': one light, for drawing without a graphics card. @typedef {"full" | "lean"} Quality */

/** Of back faces, and of nothing, where the lens is in tissue: a red-out and no hole. @type {[number, number, number]} */
export const IN_TISSUE = [0.42, 0.09, 0.07];

const COMMON = `precision highp float;
in vec3 place; in vec3 facing; in vec4 tissue;
uniform vec3 eye; uniform vec3 ahead; uniform vec3 lights[2];
uniform float reach; uniform float near; uniform float exposure; uniform vec3 wrap; uniform float shine; uniform float fog; uniform float relief; uniform vec3 tint;
out vec4 drawn;
const vec3 IN_TISSUE = vec3(${IN_TISSUE});
vec3 shown(vec3 light) { return pow(1.0 - exp(-exposure * light * tint), vec3(1.0 / 2.2)); }
`;

const LEAN = `void main() {
  if (!gl_FrontFacing) { drawn = vec4(IN_TISSUE, 1.0); return; }
  vec3 n = normalize(facing), v = eye - place;
  float far2 = dot(v, v), reach2 = reach * reach; v *= inversesqrt(far2);
  float open = tissue.a * tissue.a, fall = reach2 / (far2 + near * reach2);
  float soft = clamp((dot(n, v) + 0.2) / 1.2, 0.0, 1.0), s2 = soft * soft, s4 = s2 * s2;
  vec3 light = tissue.rgb * tissue.rgb * fall * (0.85 * s2 * mix(0.55, 1.0, open) + 0.08 * open) + 0.02 * shine * fall * open * s4 * s4;
  drawn = vec4(shown(light), 1.0);
}`;

const FULL = `float hash(vec3 q) { q = fract(q * 0.3183099 + 0.1); q *= 17.0; return fract(q.x * q.y * q.z * (q.x + q.y + q.z)); }
float noise(vec3 q) {
  vec3 i = floor(q), f = fract(q); f = f * f * (3.0 - 2.0 * f);
  vec4 low = vec4(hash(i), hash(i + vec3(1, 0, 0)), hash(i + vec3(0, 1, 0)), hash(i + vec3(1, 1, 0)));
  vec4 high = vec4(hash(i + vec3(0, 0, 1)), hash(i + vec3(1, 0, 1)), hash(i + vec3(0, 1, 1)), hash(i + vec3(1, 1, 1)));
  vec4 level = mix(low, high, f.z);
  return mix(mix(level.x, level.y, f.x), mix(level.z, level.w, f.x), f.y);
}
vec3 roughened(vec3 n, float away) {  // by the slope of a noise, less with distance
  const float STEP = 0.12;
  vec3 q = place * 2.6; float here = noise(q);
  vec3 slope = vec3(noise(q + vec3(STEP, 0, 0)), noise(q + vec3(0, STEP, 0)), noise(q + vec3(0, 0, STEP))) - here;
  return normalize(n - relief * exp(-away / 18.0) * (slope - n * dot(slope, n)) / STEP);
}
void main() {
  if (!gl_FrontFacing) { drawn = vec4(IN_TISSUE, 1.0); return; }
  vec3 v = eye - place; float far2 = dot(v, v), away = sqrt(far2), reach2 = reach * reach; v /= away;
  vec3 n = roughened(normalize(facing), away);
  vec3 albedo = pow(tissue.rgb, vec3(2.2)) * (1.0 + 0.25 * relief * (noise(place * 1.1) - 0.5));
  float open = tissue.a * tissue.a;
  vec3 lit = vec3(0.0), wet = vec3(0.0);
  for (int i = 0; i < 2; i++) {
    vec3 l = lights[i] - place; float d2 = dot(l, l); l *= inversesqrt(d2);
    float cone = smoothstep(0.62, 0.97, dot(-l, ahead)) * 0.75 + 0.25;
    float fall = 0.5 * cone * reach2 / (d2 + near * reach2);
    vec3 soft = clamp((vec3(dot(n, l)) + wrap) / (1.0 + wrap), 0.0, 1.0);
    vec3 h = normalize(l + v); float nh = max(dot(n, h), 0.0), edge = pow(1.0 - max(dot(v, h), 0.0), 5.0);
    lit += fall * soft * soft;
    wet += fall * (0.04 + 0.96 * edge) * (6.0 * pow(nh, 90.0) + 0.7 * pow(nh, 14.0));
  }
  vec3 bounced = 0.10 * reach2 / (far2 + 0.5 * reach2) * vec3(1.0, 0.62, 0.55);
  vec3 light = albedo * (lit * mix(0.55, 1.0, open) + bounced * open) + shine * wet * open;
  drawn = vec4(shown(mix(vec3(0.010, 0.003, 0.003), light, exp(-away / fog))), 1.0);
}`;

/** @type {Record<Quality, string>} */
export const TISSUE_FRAGMENT = { full: `#version 300 es\n${COMMON}${FULL}`, lean: `#version 300 es\n${COMMON}${LEAN}` };

/** A line as ribbons of one width in the picture; what lies behind the lens is cut off before it is widened. */
export const LINE_VERTEX = `#version 300 es
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 other;
layout(location = 2) in float side;
uniform mat4 toClip; uniform float width; uniform float near;
vec4 before(vec4 a, vec4 b) { return a.w < near && b.w > near ? mix(a, b, (near - a.w) / (b.w - a.w)) : a; }
void main() {
  vec4 a = toClip * vec4(position, 1.0), b = toClip * vec4(other, 1.0), from = before(a, b), to = before(b, a);
  vec2 way = to.xy / to.w - from.xy / from.w;
  vec2 along = dot(way, way) > 1e-12 ? normalize(way) : vec2(1.0, 0.0);
  gl_Position = from + vec4(vec2(-along.y, along.x) * side * width * from.w, 0.0, 0.0);
}`;

/** A ring about a place, of one size in the picture. */
export const RING_VERTEX = `#version 300 es
layout(location = 0) in vec3 position;
uniform mat4 toClip; uniform float size;
void main() { gl_Position = toClip * vec4(position, 1.0); gl_PointSize = size; }`;

export const INK_FRAGMENT = `#version 300 es
precision mediump float;
uniform vec4 ink; out vec4 drawn;
float away(vec2 q, vec2 a, vec2 b) { vec2 way = b - a; return length(q - a - way * clamp(dot(q - a, way) / dot(way, way), 0.0, 1.0)); }
void main() {
#ifdef RING
  float r = length(gl_PointCoord - 0.5) * 2.0;
  if (r > 1.0 || (r < 0.68 && r > 0.2)) discard;
#endif
#ifdef TICK
  vec2 q = gl_PointCoord * 2.0 - 1.0;  // to the right and down
  float arm = min(away(q, vec2(-0.42, 0.02), vec2(-0.12, 0.34)), away(q, vec2(-0.12, 0.34), vec2(0.44, -0.32)));
  if (length(q) > 1.0) discard;
  if (arm < 0.11) { drawn = vec4(1.0, 1.0, 1.0, ink.a); return; }
#endif
  drawn = ink;
}`;

export const RING_FRAGMENT = INK_FRAGMENT.replace("#version 300 es", "#version 300 es\n#define RING");

export const TICK_FRAGMENT = INK_FRAGMENT.replace("#version 300 es", "#version 300 es\n#define TICK");

/** A ball about a place, lit from the lens. */
export const BALL_VERTEX = `#version 300 es
layout(location = 0) in vec3 normal;
uniform mat4 toClip; uniform vec4 ball;
out vec3 facing; out vec3 place;
void main() { facing = normal; place = ball.xyz + ball.w * normal; gl_Position = toClip * vec4(place, 1.0); }`;

export const BALL_FRAGMENT = `#version 300 es
precision highp float;
in vec3 facing; in vec3 place;
uniform vec3 eye; uniform vec3 colour;
out vec4 drawn;
void main() {
  float lit = max(dot(normalize(facing), normalize(eye - place)), 0.0);
  drawn = vec4(colour * (0.45 + 0.55 * lit) + 0.35 * pow(lit, 40.0), 1.0);
}`;

export const FLAT_VERTEX = `#version 300 es
layout(location = 0) in vec3 corner; layout(location = 1) in vec3 normal; layout(location = 2) in vec3 ink;
uniform mat4 toClip;
out vec3 facing; out vec3 place; out vec3 colour;
void main() { facing = normal; place = corner; colour = ink; gl_Position = toClip * vec4(corner, 1.0); }`;

/** A label has one face; its back is dark. */
export const FLAT_FRAGMENT = `#version 300 es
precision highp float;
in vec3 facing; in vec3 place; in vec3 colour;
uniform vec3 eye;
out vec4 drawn;
void main() {
  float lit = dot(facing, normalize(eye - place));
  drawn = vec4(colour * (lit > 0.0 ? 0.5 + 0.5 * lit : 0.25), 1.0);
}`;
