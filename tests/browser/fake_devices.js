// A gamepad and a SpaceMouse that a test plays: headless, a browser has none and never answers who asks for one.
(() => {
  const axis = (first) => ({ reportSize: 16, reportCount: 3, logicalMinimum: -350, logicalMaximum: 350, usages: [0, 1, 2].map((index) => 0x10000 + first + index) });
  const inputReports = [{ reportId: 1, items: [axis(0x30)] }, { reportId: 2, items: [axis(0x33)] }];
  class Mouse extends EventTarget {
    vendorId = 0x256f;
    productName = "SpaceMouse Compact";
    opened = false;
    collections = [{ usagePage: 1, usage: 8, inputReports, children: [] }];
    async open() { this.opened = true; }
    async close() { this.opened = false; }
    report(reportId, values) {
      const data = new DataView(new ArrayBuffer(6));
      values.forEach((value, index) => data.setInt16(2 * index, value, true));
      const event = new Event("inputreport");
      Object.defineProperties(event, { reportId: { value: reportId }, data: { value: data } });
      if (this.opened) this.dispatchEvent(event);
    }
    // reports as a deflected one does, until it falls silent
    hold(translation, rotation = [0, 0, 0]) {
      this.silence();
      this.timer = setInterval(() => { this.report(1, translation); this.report(2, rotation); }, 16);
    }
    silence() { clearInterval(this.timer); }
  }
  const mouse = new Mouse();
  const hid = new EventTarget();
  let granted = false;
  hid.requestDevice = async () => { granted = true; return [mouse]; };
  hid.getDevices = async () => (granted ? [mouse] : []);
  Object.defineProperty(Navigator.prototype, "hid", { configurable: true, get: () => hid });
  const pad = { id: "Test pad (STANDARD GAMEPAD)", mapping: "standard", connected: false, timestamp: 0, axes: [0, 0, 0, 0], buttons: [...new Array(17).keys()].map(() => ({ pressed: false, touched: false, value: 0 })) };
  Navigator.prototype.getGamepads = () => [null, pad.connected ? { ...pad, axes: [...pad.axes] } : null, null, null];
  const tell = (name) => window.dispatchEvent(new Event(name));
  window.fakes = {
    mouse,
    unplugMouse() {
      mouse.silence();
      granted = false;
      hid.dispatchEvent(Object.assign(new Event("disconnect"), { device: mouse }));
    },
    plugPad() { pad.connected = true; tell("gamepadconnected"); },
    unplugPad() { pad.connected = false; tell("gamepaddisconnected"); },
    sticks(...axes) { Object.assign(pad, { axes, timestamp: performance.now() }); },
  };
})();
