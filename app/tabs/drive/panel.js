// Drive: start and reset, the handle, the camera, and the figures of the robot in the lumen.
import { h } from "/static/js/dom.js";
import { DEVICES, HandDevices } from "/static/js/devices/hand-devices.js";
import { EndCard } from "/static/js/end-card.js";
import { fixed } from "/static/js/format.js";
import { ownsSpace } from "/static/js/keys.js";
import { fixedLayout, isTrial, trialWords } from "/static/js/led-study.js";
import { ENLARGE, LAID_OUT } from "/static/js/layout.js";
import { draw, hintLine, html, live, more, nothing, said, titled } from "/static/js/template.js";
import { forceSound } from "/static/js/endoscope/force-sound.js";
import { LEAST_N, RED_N } from "/static/js/endoscope/guidance-arc.js";
import { snakeAxes } from "./axes.js";
import { controlGroup } from "./control.js";
import { LIMIT_WORDS, cautions } from "./limits.js";
import { ToolButton } from "./tool-button.js";
import { SnakeStatus } from "./status.js";
import { taskGroup } from "./task.js";
import { tissueGroup } from "./tissue.js";

/** @import { Parts } from "/static/js/panel.js" */
/** @import { DeviceKind } from "/static/js/devices/hand-devices.js" */
/** @import { RoutePathSection, RouteSection, SnakeView, ViewModel } from "/static/js/types.js" */

const LIVE = ["ready", "running", "paused"];
/** @type {Record<string, string | undefined>} */
const STATE_WORDS = { absent: "Start puts the robot at the entry.", ready: "At the entry.", running: "Running.", paused: "Paused where it is." };
const RINGS = "Pink rings are polyps and labels that were put on the route by hand or by seed; behind a fold they are faint.";
const ARCS = "Arcs on the picture’s rim are forces on your hand. The thick one guides you off the wall at that side; "
  + "the thin one inside it is the resistance to a fast hand, at the side to which it goes.";
/** With the colours of the arcs. */
const ARCS_HELP = html`${ARCS} <span class="arc-key amber">Amber: from ${fixed(LEAST_N, 1)} N</span> <span class="arc-key red">Red: from ${fixed(RED_N, 0)} N</span>`;
const LIMITED = ["Deviation", "Behind wall"]; // figures with a limit
/** @type {Record<DeviceKind, string>} */
const NAMES = { mouse: "Mouse", keys: "Keys", gamepad: "Gamepad", "space-mouse": "SpaceMouse" };

export default class DrivePanel {
  /** @param {Parts} parts */
  constructor({ connection, keys }) {
    this.connection = connection;
    this.status = new SnakeStatus();
    this.tool = new ToolButton(connection, keys);
    this.devices = new HandDevices(keys, (axes) => connection.send("axes", snakeAxes(axes, this.devices.kind, this.devices.spaceMouse.pressed)));
    this.layout = "";
    this.endCard = new EndCard(connection, undefined, ({ route }) => route, "robot", true);
    this.taskDone = false;
    this.element = h("div", {});
    window.addEventListener(LAID_OUT, (event) => {
      this.layout = /** @type {CustomEvent<string>} */ (event).detail;
      if (connection.state.step?.name === "drive") this.update(connection.state);
    });
    keys.shortcuts.push((event) => this.key(event));
    connection.on("state", ({ state }) => this.follow(state)); // also while another tab is shown
    connection.on("link", () => this.follow(connection.state));
    this.devices.addEventListener("change", () => this.update(connection.state));
  }

  /** @param {ViewModel} state */
  follow({ step, rehearsal, drive_task: task }) {
    const held = this.connection.connected && step?.name === "drive" && Boolean(rehearsal?.mine);
    this.tool.follow(held && rehearsal?.state === "running" && task?.task === "labels");
    this.devices.follow(held, held && rehearsal?.state === "running");
  }

  /** @param {ViewModel} state */
  update(state) {
    const { rehearsal, snake, route, step, drive_options: options, drive_task: task } = state, trial = isTrial(state);
    if (step?.name !== "drive") return;
    const runs = Boolean(rehearsal?.mine) && rehearsal?.state === "running";
    this.endCard.update(this.connection.state);
    this.finishTask(runs && Boolean(task?.now?.completed || task?.labels?.completed));
    draw(this.element, html`<div class="panel-bar drive-bar" role="group" aria-label="Drive">${this.drive(rehearsal, route, trial)}</div>
      ${this.endCard.element}
      ${trial ? html`<div class="group"><h2 id="trial-head">${trialWords(state)}</h2></div>` : nothing}
      <div class="group" id="arms">${controlGroup(this.connection, options, snake, runs)}</div>
      <div class="group" id="task">${taskGroup(this.connection, task)}</div>
      <div class="group">${titled("Robot", null, snake ? figures(snake) : html`<p class="words">Appears at the entry.</p>`)}${this.camera(rehearsal, snake)}</div>
      <div class="group">${titled("Handle", null, this.handle(rehearsal))}</div>
      <div class="group" id="devices">${titled("Device", null, this.device(snake))}</div>
      <div class="group">${titled("View", null, this.views(snake, Boolean(fixedLayout(state))))}</div>
      <div class="group">${snake?.fixed || trial ? nothing : tissueGroup(this.connection, route, Boolean(snake))}</div>`);
  }

  /**
   * A task that is done ends its run, by the window that drives.
   * @param {boolean} done
   */
  finishTask(done) {
    const before = this.taskDone;
    this.taskDone = done;
    if (done && !before) this.endCard.finish();
  }

  /**
   * Space pauses, unless a control has it; J changes the joint of a manual hand, by the window that drives.
   * @param {KeyboardEvent} event
   */
  key(event) {
    const { step, rehearsal, snake } = this.connection.state;
    if (step?.name !== "drive" || rehearsal?.state !== "running" || event.repeat || event.ctrlKey || event.metaKey || event.altKey) return false;
    if (event.code === "Space" && !ownsSpace(event)) this.connection.send("rehearsal.pause");
    else if (event.code === "KeyJ" && rehearsal.mine && snake?.arm === "manual") this.connection.send("drive.joint", { joint: snake.joint === 1 ? 2 : 1 });
    else return false;
    return true;
  }

  /**
   * What starts, pauses and ends the robot, always in sight.
   * @param {ViewModel["rehearsal"]} rehearsal
   * @param {RouteSection | null | undefined} route
   * @param {boolean} trial of a study, which has no second beginning
   */
  drive(rehearsal, route, trial) {
    const { state = "absent", words, mine, can_take, unrecorded } = rehearsal ?? {};
    const running = state === "running", silent = state === "silent";
    const narrow = route && tooNarrow(this.connection.state.route_path, route);
    const startable = Boolean(route?.entry && route.end) && !narrow && (mine || can_take) && !["starting", "silent"].includes(state);
    const caution = silent || state === "failed" || Boolean(words && LIVE.includes(state));
    return html`<div class="buttons even">
        <button type="button" class="primary" id="start" ?disabled=${!running && !startable}
          @click=${() => this.connection.send(running ? "rehearsal.pause" : "rehearsal.start")}>${running ? "Pause" : state === "paused" ? "Continue" : "Start"}</button>
        ${this.endCard.finishButton(rehearsal ?? {})}
        <button type="button" id="reset" ?disabled=${!(mine && !trial && LIVE.includes(state)) && !silent}
          @click=${() => this.connection.send(silent ? "rehearsal.end" : "rehearsal.reset")}>${silent ? "End process" : "Reset"}</button>
      </div>
      <p class=${caution ? "words caution" : "words"} id="drive-words" role="status">${said(startWords(rehearsal) || STATE_WORDS[state] || "")}</p>
      ${typeof rehearsal?.fraction !== "number" ? nothing : html`<div class="progress" id="start-progress"><div style=${`width: ${(100 * rehearsal.fraction).toFixed(1)}%`}></div></div>`}
      ${narrow ? this.narrow(narrow) : nothing}
      <p class="words caution" id="unrecorded" ?hidden=${!unrecorded}>${unrecorded ? said(`Not recorded: ${unrecorded}`) : nothing}</p>`;
  }

  /**
   * Why this robot cannot start, and one that can.
   * @param {RoutePathSection} path
   */
  narrow({ reach_mm: depth, least_mm: least, by_hand_mm: contour, offers: [offer] }) {
    const take = () => {
      const { links, length_mm, radius_mm } = offer;
      this.connection.send("route.robot", { links, length_mm, radius_mm });
    };
    const cause = contour === null ? nothing : html` The contour by hand at ${fixed(contour, 0)} mm does that.`;
    return html`<p class="words caution" id="too-narrow">Too narrow for this robot ${fixed(depth ?? 0, 0)} mm in: radius ${fixed(least ?? 0, 1)} mm.${cause}</p>
      ${offer ? html`<button type="button" class="wide" id="take-offer" @click=${take}>Thinner robot</button>` : nothing}`;
  }

  /**
   * @param {ViewModel["rehearsal"]} rehearsal
   * @param {SnakeView | null | undefined} snake
   */
  camera(rehearsal, snake) {
    const off = !(rehearsal?.mine && rehearsal.state === "running");
    return html`<div class="buttons even">
      <button type="button" id="straighten" ?disabled=${off || snake?.straight} @click=${() => this.connection.send("camera.straighten")}>Straighten</button>
      <button type="button" id="look-round" aria-pressed=${String(snake?.doing === "look")} ?disabled=${off || !snake?.can_look} title=${whyNoLook(off, snake)} @click=${() => this.connection.send("camera.look_round")}>Look round</button>
    </div>`;
  }

  /** @param {ViewModel["rehearsal"]} rehearsal */
  handle(rehearsal) {
    const { mine, holder, can_take, state = "absent" } = rehearsal ?? {};
    const words = mine ? "This window holds the handle." : can_take ? "Nobody holds the handle." : `${holder ?? "Another window"} holds the handle.`;
    return html`<p class="words" id="lease-words">${words}</p>
      <button type="button" class="wide" id="lease" ?hidden=${!LIVE.includes(state)} ?disabled=${!mine && !can_take}
        @click=${() => this.connection.send(mine ? "rehearsal.let_go" : "rehearsal.take")}>${mine ? "Release handle" : "Take handle"}</button>`;
  }

  /** @param {SnakeView | null | undefined} snake */
  device(snake) {
    const { devices } = this, stands = onBase(this.connection.state), help = html`${helpOf(stands, snake)} ${ARCS_HELP}`;
    const ask = devices.kind === "space-mouse" && devices.spaceMouse.askable;
    return html`<div class="segmented devices" role="group" aria-label="Device">${DEVICES.map((kind) => html`<button type="button" data-device=${kind}
      aria-pressed=${String(kind === devices.kind)} @click=${() => devices.choose(kind)}>${NAMES[kind]}</button>`)}</div>
      ${hintLine("drive-help", stands ? "Drag or arrow keys turn the camera." : "Wheel or W S insert; drag or arrows turn.", help)}
      <p class="words" ?hidden=${!devices.source?.trouble}>${said(devices.source?.trouble ?? "")}</p>
      ${ask ? html`<button type="button" class="wide" id="connect-device" @click=${() => devices.spaceMouse.ask()}>Connect SpaceMouse</button>` : nothing}`;
  }

  /**
   * @param {SnakeView | null | undefined} snake
   * @param {boolean} laid the layout is fixed
   */
  views(snake, laid) {
    const outside = this.layout !== "endoscope-alone";
    const on = (/** @type {Event} */ { currentTarget }) => /** @type {HTMLInputElement} */ (currentTarget).checked;
    const lay = (/** @type {Event} */ event) => window.dispatchEvent(new CustomEvent(ENLARGE, { detail: on(event) ? null : "endoscope-alone" }));
    const bends = snake?.steered ? html`<label class="check"><input type="checkbox" id="control-bends" .checked=${live(snake.shown)}
      @change=${(/** @type {Event} */ event) => this.connection.send("drive.bends", { on: on(event) })}>Control bends</label>` : nothing;
    return html`<label class="check"><input type="checkbox" id="outside-view" .checked=${live(outside)} ?disabled=${laid} @change=${lay}>Outside view</label>
      ${bends}
      <label class="check"><input type="checkbox" id="force-sound" .checked=${live(forceSound.on)} @change=${(/** @type {Event} */ event) => forceSound.turn(on(event))}>Sound of force</label>`;
  }
}

/**
 * What is being done for a start and how much of it, or why there is none.
 * @param {ViewModel["rehearsal"]} rehearsal
 */
function startWords({ words = "", fraction = null } = /** @type {NonNullable<ViewModel["rehearsal"]>} */ ({})) {
  return fraction === null ? words : `${words}, ${fixed(100 * fraction, 0)}\u00a0%`;
}

/**
 * Whether the robot of this case stands on a fixed base and is not inserted, also while there is none.
 * @param {Pick<ViewModel, "drive_task">} state
 */
function onBase({ drive_task: task }) {
  return Boolean(task?.offered.includes("labels")); // the task of such a robot
}

/**
 * How the robot is driven.
 * @param {boolean} stands on a fixed base
 * @param {Pick<SnakeView, "camera_mm_per_s"> | null | undefined} snake
 */
export function helpOf(stands, snake) {
  const speed = snake ? `, ${fixed(snake.camera_mm_per_s, 0)} mm/s at most` : "";
  return [
    stands ? "The base is fixed: nothing is inserted." : "The wheel in the picture inserts and retracts 5 mm a notch, with the bend that the tip has.",
    `A drag moves what is seen along with the pointer, so the camera goes the other way. It follows as fast as the robot can${speed}: hold until it has come. Releasing is the clutch, and nothing moves any more.`,
    `Keys: ${stands ? "" : "W S insert and retract, "}↑ ↓ ← → turn the camera, A D too, about 20° in a second; Space pauses and Continue goes on, J changes the joint of a manual hand.`,
    stands ? "Gamepad: the right stick turns. SpaceMouse: slides turn." : "Gamepad: triggers insert, the right stick turns. SpaceMouse: slides turn; with a button held, a push inserts.",
    RINGS,
  ].join(" ");
}

/**
 * The path of a route that is narrower than its robot; null for another.
 * @param {RoutePathSection | null | undefined} path
 * @param {RouteSection} route
 */
export function tooNarrow(path, { radius_mm: radius }) {
  return path?.state === "ready" && (path.limit === "narrow" || (path.least_mm !== null && path.least_mm < radius)) ? path : null;
}

/**
 * Why the camera cannot look round now; '' where it can.
 * @param {boolean} off nobody drives here
 * @param {SnakeView | null | undefined} snake
 */
export function whyNoLook(off, snake) {
  if (off) return "While this window's robot runs";
  return snake?.can_look ? "" : "Insert until all links that bend are inside";
}

/** The link that is deepest behind the wall. @param {SnakeView} snake */
function deepestWords({ deepest }) {
  return deepest?.link ? `${fixed(deepest.depth_mm, 1)} mm, link ${deepest.link}` : "None";
}

/** @param {SnakeView} snake */
function figures(snake) {
  const { nearest } = snake, near = cautions(snake);
  const fact = (/** @type {string} */ term, /** @type {string} */ value, caution = false) => ({ term, value, caution });
  const facts = [
    ...(snake.fixed ? [fact("Base", `Fixed, ${snake.links} links`)] : [
      fact("Depth", `${fixed(snake.depth_mm, 0)} of ${fixed(snake.length_mm, 0)} mm`),
      ...(snake.passed ? [fact("Past", snake.passed)] : []),
      fact("Links inside", `${snake.links_inside} of ${snake.links}`),
    ]),
    fact("Deviation", nearest ? `${fixed(nearest.deviation_mm, 1)} of ${fixed(nearest.bound_mm, 1)} mm, link ${nearest.link}` : "–", near.deviation),
    ...(snake.deepest ? [fact("Behind wall", deepestWords(snake), near.behind)] : []),
    ...(snake.lens_mm === null ? [] : [fact("Lens to wall", snake.lens_mm < 0 ? `${fixed(-snake.lens_mm, 1)} mm behind` : `${fixed(snake.lens_mm, 1)} mm`)]),
    fact("Bend", snake.straight ? "Straight" : `${fixed(100 * snake.bend, 0)} % of the most`),
  ];
  const part = snake.length_mm ? Math.min(1, snake.depth_mm / snake.length_mm) : 0;
  return html`<dl class="facts" id="snake-facts">${facts.map(({ term, value, caution }) => html`<dt>${term}${LIMITED.includes(term) ? more(LIMIT_WORDS) : nothing}</dt><dd class=${caution ? "caution" : ""}>${value}</dd>`)}</dl>
    ${snake.fixed ? nothing : html`<div class="progress"><div style=${`width: ${(100 * part).toFixed(1)}%`}></div></div>`}`;
}
