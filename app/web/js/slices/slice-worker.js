// Owns the voxels and the outlines' meshes of one head, and cuts the pictures of its slices, away from the page's thread.
import { cutPlane, OUTSIDE, sampleAt } from "./cut.js";
import { Grid } from "./grid.js";
import { coarser, drawLine, maskOfRuns, tintMask, untint } from "./label-paint.js";
import { cutMesh, meshOf } from "./mesh-cut.js";
import { blend, seenFrom } from "./overlay.js";
import { shade, tableOf } from "./shade.js";
/** @import { CutVolume, Raster } from "./cut.js" */
/** @import { GridWords, Triple } from "./grid.js" */
/** @import { Brush, MaskVolume } from "./label-paint.js" */
/** @import { BlockedMesh } from "./mesh-cut.js" */
/** @import { OverlayLook, Transform } from "./overlay.js" */
/** @import { Greys } from "./shade.js" */

/** @typedef {{ name: string, colour: string, closed: boolean }} OutlineRequest a surface of the case; closed: where its volume ends, by faces that are not drawn */
/** @typedef {{ kind: "open", head: number, caseId: string, volumes: string[] }} OpenOrder volumes: the widest first; finer ones are drawn over it */
/** @typedef {{ kind: "outlines", head: number, caseId: string, outlines: OutlineRequest[] }} OutlinesOrder */
/** @typedef {{ kind: "draw", head: number, id: number, view: string, raster: Raster, greys: Greys, outlines: boolean, overlay: OverlayLook | null }} DrawOrder */
/** @typedef {{ kind: "overlay", head: number, caseId: string | null, volume: string | null, transform: Transform }} OverlayOrder caseId: whose volume is laid over; null: none. volume: its name; null: the widest */
/** @typedef {{ kind: "read", head: number, id: number, places: Triple[] }} ReadOrder */
/** @typedef {{ kind: "label", head: number, caseId: string, labelId: string | null, volume: string, colour: string }} LabelOrder labelId: null: none */
/** @typedef {{ kind: "paint", head: number, brush: Brush, start: Triple, end: Triple }} PaintOrder */
/** @typedef {{ kind: "keep", head: number, runs: Uint32Array | null, step: number }} KeepOrder what of a threshold is kept; null: all */
/** @typedef {OpenOrder | OutlinesOrder | DrawOrder | OverlayOrder | LabelOrder | PaintOrder | KeepOrder | ReadOrder} Order */
/** @typedef {{ canvas: OffscreenCanvas, image: ImageData, rgba: Uint32Array, hu: Int16Array, key: string, over: Int16Array | null, overKey: string }} Sheet what a view was drawn on last; key: its raster; over: HU of the second volume */

const SAY_MS = 100; // between two words on how far the voxels are

let head = 0;
/** @type {CutVolume[]} */
let volumes = [];
/** @type {{ name: string, colour: string, mesh: BlockedMesh }[]} */
let outlines = [];
/** @type {{ caseId: string, name: string | null, volume: CutVolume, transform: Transform } | null} the second volume */
let second = null;
/** @type {MaskVolume & { id: string, colour: string } | null} the painted label */
let label = null;
/** @type {PaintOrder[] | null} what was painted while a label's voxels are brought, which may not hold it yet */
let since = null;
/** @type {MaskVolume | null} what of the threshold is kept */
let kept = null;
let plain = tableOf({ window: 2000, level: -200 }); // without the tint
let plainFor = "";
let labels = 0; // orders for a label; the newest counts
let seconds = 0; // orders for a second volume; the newest counts
/** @type {Map<string, Sheet>} by the name of the view */
const sheets = new Map();
let table = tableOf({ window: 2000, level: -200 });
let tableFor = "";
let secondTable = table;
let secondTableFor = "";

/**
 * @param {object} message
 * @param {Transferable[]} [transfer]
 */
function say(message, transfer = []) {
  /** @type {{ postMessage(message: unknown, transfer: Transferable[]): void }} */ (/** @type {unknown} */ (self)).postMessage(message, transfer);
}

/** @param {string} address */
async function fetched(address) {
  const response = await fetch(address, { credentials: "same-origin" });
  if (response.status === 404) throw new Error("it has no CT, or is not there any more");
  if (!response.ok || !response.body) throw new Error(`the planner answered ${response.status}`);
  return response;
}

/**
 * The voxels of a volume, each byte copied once into the array that keeps them.
 * @param {string} caseId
 * @param {string | null} name null: the widest
 * @param {(bytes: number, all: number) => void} tell
 * @returns {Promise<CutVolume>}
 */
async function load(caseId, name, tell) {
  const query = name === null ? "" : `?volume=${encodeURIComponent(name)}`;
  const base = `/api/v1/cases/${encodeURIComponent(caseId)}/volume`;
  /** @type {GridWords} */
  const words = await (await fetched(`${base}${query}`)).json();
  const grid = new Grid(words);
  const all = grid.shape[0] * grid.shape[1] * grid.shape[2] * 2;
  const bytes = new Uint8Array(all);
  const response = await fetched(`${base}/voxels${query}`);
  const reader = /** @type {ReadableStream<Uint8Array>} */ (response.body).getReader();
  let at = 0;
  for (let piece = await reader.read(); !piece.done; piece = await reader.read()) {
    bytes.set(piece.value, at); // throws where more comes than the grid has
    at += piece.value.length;
    tell(at, all);
  }
  if (at !== all) throw new Error(`${at} of ${all} bytes came`);
  return { grid, voxels: new Int16Array(bytes.buffer) }; // little-endian, as every machine that browsers run on
}

/** @param {OpenOrder} order */
async function open(order) {
  head = order.head;
  volumes = [];
  outlines = [];
  second = null;
  seconds += 1;
  label = since = kept = null;
  labels += 1;
  sheets.clear();
  let said = 0;
  /** @type {CutVolume[]} */
  const loaded = [];
  try {
    for (const [index, name] of order.volumes.entries()) {
      loaded.push(await load(order.caseId, name, (bytes, all) => {
        if (performance.now() - said < SAY_MS || order.head !== head) return;
        said = performance.now();
        say({ kind: "progress", head: order.head, share: (index + bytes / all) / order.volumes.length });
      }));
      if (order.head !== head) return;
    }
  } catch (error) {
    if (order.head === head) say({ kind: "failed", head: order.head, words: String(error instanceof Error ? error.message : error) });
    return;
  }
  volumes = loaded;
  say({ kind: "ready", head: order.head });
}

/** @param {OutlinesOrder} order */
async function loadOutlines({ head: mine, caseId, outlines: wanted }) {
  try {
    const loaded = await Promise.all(wanted.map(async ({ name, colour, closed }) => {
      const known = outlines.find((one) => one.name === name); // one that is shown again, or has another colour
      if (known) return { ...known, colour };
      const address = `/api/v1/cases/${encodeURIComponent(caseId)}/surfaces/${encodeURIComponent(name)}?format=arrays&open_ends=${closed}`;
      return { name, colour, mesh: meshOf(await (await fetched(address)).arrayBuffer()) };
    }));
    if (mine !== head) return;
    outlines = loaded;
    say({ kind: "outlined", head: mine });
  } catch (error) {
    if (mine === head) say({ kind: "unoutlined", head: mine, words: String(error instanceof Error ? error.message : error) });
  }
}

/**
 * @param {string} view
 * @param {Raster} raster
 * @returns {Sheet}
 */
function sheetOf(view, { width, height }) {
  const known = sheets.get(view);
  if (known && known.canvas.width === width && known.canvas.height === height) return known;
  const image = new ImageData(width, height);
  const sheet = { canvas: new OffscreenCanvas(width, height), image, rgba: new Uint32Array(image.data.buffer), hu: new Int16Array(width * height), key: "", over: null, overKey: "" };
  sheets.set(view, sheet);
  return sheet;
}

/** @param {DrawOrder} order */
function draw({ id, view, raster, greys, outlines: outlined, overlay }) {
  const started = performance.now();
  const sheet = sheetOf(view, raster);
  const key = JSON.stringify(raster);
  if (key !== sheet.key) { // else the grey values alone are others
    sheet.hu.fill(OUTSIDE);
    for (const volume of volumes) cutPlane(sheet.hu, volume, raster);
    sheet.key = key;
  }
  const wanted = JSON.stringify(greys);
  if (wanted !== tableFor) [table, tableFor] = [tableOf(greys), wanted];
  shade(sheet.rgba, sheet.hu, table);
  if (kept && greys.threshold) {
    const { window, level } = greys;
    const without = `${window} ${level}`;
    if (without !== plainFor) [plain, plainFor] = [tableOf({ window, level }), without];
    untint(sheet.rgba, sheet.hu, plain, greys.threshold, kept, raster);
  }
  if (overlay && second) lay(sheet, raster, overlay, second);
  if (label) tintMask(sheet.rgba, label, raster, label.colour);
  const context = /** @type {OffscreenCanvasRenderingContext2D} */ (sheet.canvas.getContext("2d"));
  context.putImageData(sheet.image, 0, 0);
  if (outlined) for (const outline of outlines) stroke(context, outline, raster);
  const bitmap = sheet.canvas.transferToImageBitmap();
  say({ kind: "drawn", head, id, bitmap, ms: performance.now() - started }, [bitmap]);
}

/**
 * The second volume over the picture of the first.
 * @param {Sheet} sheet
 * @param {Raster} raster
 * @param {OverlayLook} look
 * @param {{ volume: CutVolume, transform: Transform }} laid
 */
function lay(sheet, raster, { opacity, greys }, { volume, transform }) {
  sheet.over ??= new Int16Array(sheet.hu.length);
  const key = `${seconds} ${sheet.key}`;
  if (key !== sheet.overKey) {
    sheet.over.fill(OUTSIDE);
    cutPlane(sheet.over, volume, seenFrom(raster, transform));
    sheet.overKey = key;
  }
  const wanted = JSON.stringify(greys);
  if (wanted !== secondTableFor) [secondTable, secondTableFor] = [tableOf(greys), wanted];
  blend(sheet.rgba, sheet.over, secondTable, opacity, OUTSIDE);
}

/** @param {OverlayOrder} order */
async function layOver({ head: mine, caseId, volume: name, transform }) {
  seconds += 1;
  const order = seconds;
  if (second?.caseId !== caseId || second.name !== name) second = null; // what was laid before is not shown as this one
  try {
    if (caseId !== null) {
      const volume = second?.caseId === caseId && second.name === name ? second.volume : await load(caseId, name, () => {});
      if (order !== seconds) return;
      second = { caseId, name, volume, transform };
    }
    say({ kind: "laid", head: mine });
  } catch (error) {
    if (order === seconds) say({ kind: "unlaid", head: mine, words: String(error instanceof Error ? error.message : error) });
  }
}

/** @param {LabelOrder} order */
async function showLabel({ head: mine, caseId, labelId, volume, colour }) {
  labels += 1;
  const order = labels;
  since = [];
  if (labelId !== label?.id) label = null;
  try {
    if (labelId !== null) {
      /** @type {GridWords} */
      const words = await (await fetched(`/api/v1/cases/${encodeURIComponent(caseId)}/volume?volume=${encodeURIComponent(volume)}`)).json();
      const runs = new Uint32Array(await (await fetched(`/api/v1/labels/${encodeURIComponent(labelId)}/voxels`)).arrayBuffer());
      if (order !== labels) return;
      const grid = new Grid(words);
      label = { id: labelId, colour, grid, mask: maskOfRuns(grid.shape[0] * grid.shape[1] * grid.shape[2], runs) };
      for (const each of since ?? []) drawLine(label, each.brush, each.start, each.end); // once more does no harm
    }
    since = null;
    say({ kind: "labelled", head: mine });
  } catch (error) {
    if (order === labels) say({ kind: "unlabelled", head: mine, words: String(error instanceof Error ? error.message : error) });
  }
}

/** @param {KeepOrder} order */
function keep({ head: mine, runs, step }) {
  kept = null;
  if (runs && volumes.length) {
    const grid = coarser(volumes[0].grid, step);
    try {
      kept = { grid, mask: maskOfRuns(grid.shape[0] * grid.shape[1] * grid.shape[2], runs) };
    } catch {
      kept = null; // of the head before: the threshold is shown whole
    }
  }
  say({ kind: "labelled", head: mine });
}

/** @param {PaintOrder} order */
function paint(order) {
  since?.push(order);
  if (label) drawLine(label, order.brush, order.start, order.end);
}

/**
 * @param {OffscreenCanvasRenderingContext2D} context
 * @param {{ colour: string, mesh: BlockedMesh }} outline
 * @param {Raster} raster
 */
function stroke(context, { colour, mesh }, raster) {
  const pieces = cutMesh(mesh, raster);
  context.strokeStyle = colour;
  context.lineWidth = 1;
  context.beginPath();
  for (let n = 0; n < pieces.length; n += 4) {
    context.moveTo(pieces[n], pieces[n + 1]);
    context.lineTo(pieces[n + 2], pieces[n + 3]);
  }
  context.stroke();
}

/** @param {ReadOrder} order */
function read({ id, places }) {
  // what is drawn is told: the finest volume that reaches a place lies on top
  const values = places.map((place) => {
    for (let n = volumes.length - 1; n >= 0; n -= 1) {
      const value = sampleAt(volumes[n], place);
      if (value !== null) return value;
    }
    return null;
  });
  say({ kind: "values", head, id, values });
}

onmessage = (/** @type {MessageEvent<Order>} */ { data }) => {
  if (data.kind === "open") open(data);
  if (data.kind === "open" || data.head !== head) return; // of a head that was open before
  if (data.kind === "outlines") loadOutlines(data);
  else if (data.kind === "draw") draw(data);
  else if (data.kind === "overlay") layOver(data);
  else if (data.kind === "label") showLabel(data);
  else if (data.kind === "paint") paint(data);
  else if (data.kind === "keep") keep(data);
  else read(data);
};
