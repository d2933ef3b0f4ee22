// A SpaceMouse over WebHID. Its own report descriptor says which bits are which axis, so that every model is read.
import { REST, shaped } from "./six-axes.js";

/** @import { SixAxes } from "./six-axes.js" */

/** @typedef {{ isRange?: boolean, usages?: number[], usageMinimum?: number, reportSize: number, reportCount: number, logicalMinimum: number, logicalMaximum: number }} ReportItem */
/** @typedef {{ reportId: number, items: ReportItem[] }} Report */
/** @typedef {{ usagePage?: number, usage?: number, inputReports?: Report[], children?: Collection[] }} Collection */
/** @typedef {EventTarget & { vendorId: number, productName: string, opened: boolean, collections: Collection[], open: () => Promise<void>, close: () => Promise<void> }} HidDevice */
/** @typedef {EventTarget & { getDevices: () => Promise<HidDevice[]>, requestDevice: (options: { filters: object[] }) => Promise<HidDevice[]> }} Hid */
/** @typedef {Event & { reportId: number, data: DataView }} InputReport */
/** An axis in a report: its number, where its bytes begin and how many there are, and its whole way. @typedef {{ axis: number, byte: number, bytes: number, full: number }} Field */

const VENDORS = [0x046d, 0x256f]; // Logitech, 3Dconnexion
const [GENERIC_DESKTOP, MULTI_AXIS] = [1, 8];
const BUTTONS = 9; // usage page
const FIRST_AXIS = 0x30; // usages X, Y, Z, Rx, Ry, Rz
const FULL = 350; // whole way of the caps, whatever a descriptor says beyond
const SILENT_MS = 100; // while it is deflected it reports every 8 or 16 ms

const HELD = "Another program holds the SpaceMouse, such as its maker’s driver.";
const NO_HID = "This browser has no WebHID: use Chrome or Edge.";

/** Says `change` when one comes or goes. */
export class SpaceMouseSource extends EventTarget {
  /** @param {{ hid?: Hid }} browser */
  constructor(browser) {
    super();
    this.hid = browser.hid;
    /** @type {HidDevice | null} */
    this.device = null;
    /** @type {Map<number, Field[]>} by report */
    this.fields = new Map();
    /** @type {SixAxes} as the device has them */
    this.raw = [...REST];
    /** @type {Map<number, number[]>} bits of buttons, by report */
    this.buttons = new Map();
    this.pressed = false; // any button is held
    this.at = -Infinity; // of the newest report
    this.refused = "";
    /** @type {Promise<void> | undefined} */
    this.closing = undefined;
    this.wanted = false; // between start and stop
    this.tell = () => this.dispatchEvent(new Event("change"));
    this.heard = (/** @type {Event} */ event) => this.hear(/** @type {InputReport} */ (event));
    this.came = () => this.find();
    this.gone = (/** @type {Event} */ event) => { if (Reflect.get(event, "device") === this.device) this.drop("The SpaceMouse was unplugged."); };
  }

  /** Use what was allowed before, now and when it is plugged in. */
  start() {
    this.wanted = true;
    this.hid?.addEventListener("connect", this.came);
    this.hid?.addEventListener("disconnect", this.gone);
    this.find();
  }

  stop() {
    this.wanted = false;
    this.hid?.removeEventListener("connect", this.came);
    this.hid?.removeEventListener("disconnect", this.gone);
    if (this.device) this.closing = this.device.close().catch(() => {}); // it is closed then, too
    this.drop("");
  }

  get name() {
    return this.device ? this.device.productName || "SpaceMouse" : "";
  }

  get trouble() {
    if (this.device) return "";
    return this.hid ? this.refused || "No SpaceMouse is connected." : NO_HID;
  }

  /** Whether a button may ask for one. */
  get askable() {
    return Boolean(this.hid) && !this.device;
  }

  /** Let the person choose one; a browser asks only after a press. */
  async ask() {
    try {
      const filters = VENDORS.map((vendorId) => ({ vendorId, usagePage: GENERIC_DESKTOP, usage: MULTI_AXIS }));
      const [device] = await this.hid?.requestDevice({ filters }) ?? [];
      if (device) await this.use(device);
    } catch {
      this.drop(HELD);
    }
  }

  async find() {
    try {
      const device = (await this.hid?.getDevices() ?? []).find(isSpaceMouse);
      if (device && !this.device) await this.use(device);
    } catch {
      this.drop(HELD);
    }
  }

  /** @param {HidDevice} device */
  async use(device) {
    await this.closing; // else it looks open, and is closed under our hands
    if (!device.opened) await device.open();
    if (!this.wanted) { // another device was chosen meanwhile
      await device.close();
      return;
    }
    this.drop("");
    this.device = device;
    this.fields = fieldsOf(device.collections);
    this.buttons = buttonsOf(device.collections);
    device.addEventListener("inputreport", this.heard);
    this.tell();
  }

  /** @param {string} why */
  drop(why) {
    this.device?.removeEventListener("inputreport", this.heard);
    this.device = null;
    this.refused = why;
    this.raw = [...REST];
    this.pressed = false;
    this.tell();
  }

  /** @param {InputReport} report */
  hear({ reportId, data, timeStamp }) {
    const bits = this.buttons.get(reportId);
    if (bits) this.pressed = bits.some((bit) => bit >>> 3 < data.byteLength && (data.getUint8(bit >>> 3) >>> (bit & 7)) & 1);
    const fields = this.fields.get(reportId);
    if (!fields) return;
    this.at = timeStamp; // not now: a page that hung hears late
    for (const { axis, byte, bytes, full } of fields) {
      if (byte + bytes <= data.byteLength) this.raw[axis] = shaped((bytes === 1 ? data.getInt8(byte) : data.getInt16(byte, true)) / full);
    }
  }

  /**
   * @param {number} now ms
   * @returns {SixAxes}
   */
  read(now) {
    return now - this.at > SILENT_MS ? [...REST] : inPicture(this.raw);
  }
}

/** @param {HidDevice} device */
function isSpaceMouse({ vendorId, collections }) {
  return VENDORS.includes(vendorId) && collections.some(({ usagePage, usage }) => usagePage === GENERIC_DESKTOP && usage === MULTI_AXIS);
}

/**
 * From the device's axes, x right, y to the hand, z down, to those of the picture.
 * @param {SixAxes} axes
 * @returns {SixAxes}
 */
function inPicture([x, y, z, rx, ry, rz]) {
  return [x, z, 0 - y, rx, rz, 0 - ry];
}

/**
 * Where the six axes are in the reports.
 * @param {Collection[]} collections
 * @returns {Map<number, Field[]>}
 */
export function fieldsOf(collections) {
  /** @type {Map<number, Field[]>} */
  const found = new Map();
  for (const { inputReports = [], children = [] } of collections) {
    for (const { reportId, items } of inputReports) {
      const fields = fieldsIn(items);
      if (fields.length) found.set(reportId, [...found.get(reportId) ?? [], ...fields]);
    }
    for (const [reportId, fields] of fieldsOf(children)) found.set(reportId, [...found.get(reportId) ?? [], ...fields]);
  }
  return found;
}

/**
 * Where the buttons are in the reports: bits, by report.
 * @param {Collection[]} collections
 * @returns {Map<number, number[]>}
 */
export function buttonsOf(collections) {
  /** @type {Map<number, number[]>} */
  const found = new Map();
  for (const { inputReports = [], children = [] } of collections) {
    for (const { reportId, items } of inputReports) {
      let bit = 0;
      for (const item of items) {
        const usage = item.isRange || !item.usages?.length ? item.usageMinimum ?? 0 : item.usages[0];
        const first = bit;
        bit += item.reportSize * item.reportCount;
        if (usage >>> 16 !== BUTTONS || item.reportSize !== 1) continue;
        found.set(reportId, [...found.get(reportId) ?? [], ...[...new Array(item.reportCount).keys()].map((index) => first + index)]);
      }
    }
    for (const [reportId, bits] of buttonsOf(children)) found.set(reportId, [...found.get(reportId) ?? [], ...bits]);
  }
  return found;
}

/**
 * @param {ReportItem[]} items
 * @returns {Field[]}
 */
function fieldsIn(items) {
  let bit = 0;
  return items.flatMap((item) => [...new Array(item.reportCount).keys()].map((index) => {
    const axis = axisOf(item, index);
    const at = { axis, byte: bit / 8, bytes: item.reportSize / 8, full: Math.min(FULL, item.logicalMaximum) };
    bit += item.reportSize;
    return at;
  })).filter(({ axis, byte, bytes, full }) => axis >= 0 && axis < REST.length && Number.isInteger(byte) && (bytes === 1 || bytes === 2) && full > 0);
}

/**
 * The number of the axis that a field of an item is; outside of 0 to 5 where it is none.
 * @param {ReportItem} item
 * @param {number} index
 */
function axisOf({ isRange, usages = [], usageMinimum = 0 }, index) {
  const usage = isRange || !usages.length ? usageMinimum + index : usages[Math.min(index, usages.length - 1)];
  return usage >>> 16 === GENERIC_DESKTOP ? (usage & 0xffff) - FIRST_AXIS : -1;
}
