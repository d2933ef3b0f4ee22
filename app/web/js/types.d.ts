// Made by scripts/declarations.py from the server's types; do not edit.

/** The step that is shown, those that can be gone to, and what to do next. */
export interface StepSection {
  name: string;
  available: string[];
  hint: string;
}

/** Whether the three-dimensional scene shows the head; words: what it waits for. */
export interface SceneSection {
  ready: boolean;
  words: string;
}

/** Height of the view at the centre of the scene. */
export interface CameraSection {
  view_height_mm: number | null;
}

/** The open case; loading: what is being read, None when all of it is there. */
export interface CaseSection {
  id: string;
  name: string;
  frame: FrameView;
  spacing_mm: [number, number, number] | null;
  surfaces: SurfaceView[];
  uncertainty: string;
  has_volume: boolean;
  beads: number;
  notes: string[];
  detail: string | null;
  loading: string | null;
}

/** Frame of the file that the case was made of; assumed: the file did not name it. */
export interface FrameView {
  name: string;
  assumed: boolean;
}

/** A surface of the case and what is said of it. */
export interface SurfaceView {
  name: string;
  triangles: number;
  words: string;
}

/** The three slices through the cross, and the grey values [HU]. */
export interface SlicesSection {
  cross: [number, number, number];
  window_name: string;
  window: number;
  level: number;
  planes: Record<"axial" | "coronal" | "sagittal", SlicePlane>;
}

/** One slice: its place along the plane's normal, the range of places, and the grid of a finer picture within it. */
export interface SlicePlane {
  columns: number;
  rows: number;
  origin: [number, number, number];
  u: [number, number, number];
  v: [number, number, number];
  position: number;
  lo: number;
  hi: number;
  step: number;
  detail: SliceGrid | null;
}

/** Size of a slice's picture in pixels; origin: centre of its first pixel; u and v: from one pixel to the next. */
export interface SliceGrid {
  columns: number;
  rows: number;
  origin: [number, number, number];
  u: [number, number, number];
  v: [number, number, number];
}

/** How the head is shown: opacity 0 to 1, the cut, and the slices in the scene ('none', an axis or 'all'). */
export interface ViewSection {
  opacity: number;
  cut: "whole" | "left" | "right";
  slices: string;
}

/** All cases, the deleted ones included. */
export interface CasesSection {
  items: CaseEntry[];
}

/** A case in the list. */
export interface CaseEntry {
  id: string;
  name: string;
  created: string;
  deleted: boolean;
}

/** All plans of the case, the deleted ones included. */
export interface PlansSection {
  items: PlanEntry[];
}

/** A plan in the list. */
export interface PlanEntry {
  id: string;
  name: string;
  modified: string;
  deleted: boolean;
}

/** What can be chosen; bounds (low, high) of a tool's bend and of its shaft's radius. */
export interface InstrumentsSection {
  robots: RobotChoice[];
  tools: ToolChoice[];
  bend_bounds_deg: number[];
  radius_bounds_mm: number[];
}

/** A robot that comes along; words: what it is. */
export interface RobotChoice {
  name: string;
  title: string;
  words: string;
}

/** A tool that comes along, with its own bend, 0 of a straight one, and radius. */
export interface ToolChoice {
  name: string;
  title: string;
  words: string;
  bend_deg: number;
  shaft_radius_mm: number;
}

/** The open plan; degree and length of its spline are 0 without one. */
export interface PlanSection {
  points: ItemEntry[];
  targets: ItemEntry[];
  id: string;
  name: string;
  frame: string;
  unit: string;
  selected: string | null;
  locked: boolean;
  can_undo: boolean;
  can_redo: boolean;
  add_mode: "point" | "target" | "none";
  degree: number;
  length_mm: number;
  ghost: GhostView | null;
  robot: PlanRobotView;
  tool: PlanToolView;
}

/** A point of the path or a target. */
export interface ItemEntry {
  id: string;
  label: string;
  position: [number, number, number];
}

/** What a click would add. */
export interface GhostView {
  kind: "point" | "target";
  position: [number, number, number];
  words: string;
}

/**
 * The plan's robot; of a URDF of one's own: its hash, the link that holds the tool, and all that could.
 *
 * trouble: why it cannot be read, '' where it can.
 */
export interface PlanRobotView {
  name: string;
  title: string;
  words: string;
  urdf: string | null;
  tool_frame: string | null;
  links: string[];
  notes: string[];
  trouble: string;
}

/** The plan's tool in its shape; bend_deg is None of a straight one. */
export interface PlanToolView {
  name: string;
  title: string;
  words: string;
  bend_deg: number | null;
  shaft_radius_mm: number;
  changed: boolean;
  trouble: string;
}

/** Places along the path. */
export interface CurveSection {
  points: [number, number, number][];
}

/** The dry run of the plan; completed is None until it has ended. */
export interface CorridorSection {
  status: "none" | "computing" | "done" | "failed";
  words: string;
  caution: boolean;
  completed: boolean | null;
  min_clearance_mm: number | null;
  soft_tissue: SoftTissueView | null;
  warning: string;
  scale: ScaleView | null;
}

/** Soft tissue that the tool passes at most, and where its tip is then; complete: the scan holds all of it. */
export interface SoftTissueView {
  length_mm: number | null;
  at_mm: number | null;
  complete: boolean;
}

/** The scale of clearances [mm]: range, margin, and the colours evenly spaced from lo to hi. */
export interface ScaleView {
  lo: number;
  hi: number;
  margin: number;
  colours: string[];
}

/** The rehearsal and who drives it; mine: this window holds the handle, holder: who else does. */
export interface RehearsalSection {
  mode?: string;
  phase?: string;
  held?: boolean;
  reason?: string;
  holding?: string;
  force_n?: number | null;
  tip_error_mm?: number | null;
  clearance_mm?: number | null;
  clearance_capped?: boolean;
  margin_mm?: number | null;
  progress_mm?: number | null;
  length_mm?: number | null;
  target_error_mm?: number | null;
  path_done?: boolean;
  taken_ms?: number | null;
  tip?: [number, number, number];
  grip?: [number, number, number];
  virtual_point?: [number, number, number];
  state: "absent" | "starting" | "ready" | "running" | "paused" | "silent" | "failed";
  words: string;
  mine: boolean;
  holder: string | null;
  can_take: boolean;
  plan_changed: boolean;
  target_id: string | null;
}

/** Points and targets, in order. */
export interface ItemsSection {
  points: ItemEntry[];
  targets: ItemEntry[];
}

/** How the control loop keeps its period; empty while no robot is in place. */
export interface DetailsSection {
  loop_hz?: number | null;
  step_us?: number | null;
  step_us_p99?: number | null;
  lateness_us_p50?: number | null;
  lateness_us_p99?: number | null;
  overruns?: number;
  rows?: number;
  steps?: number;
  priority?: string;
}

/** The settings in force; answered counts the changes that were answered, refused ones included. */
export interface SettingsSection {
  answered: number;
  words: string;
  warning: string;
  fields: SettingField[];
}

/** One setting as a slider. */
export interface SettingField {
  name: string;
  label: string;
  unit: string;
  lo: number;
  hi: number;
  step: number;
  digits: number;
  value: number;
}

/** Switches of the rehearsal as they are wanted; words: when they come into force, '' where they are. */
export interface OptionsSection {
  items: OptionView[];
  words: string;
}

/** A switch of the rehearsal; words: what it does; refusal: why it cannot be used, '' where it can. */
export interface OptionView {
  name: string;
  label: string;
  words: string;
  on: boolean;
  refusal: string;
}

/** Segments (start, end) of robot and tool. */
export interface ToolSection {
  segments: [number, number, number][][];
}

export interface Hello {
  id?: number | null;
  type: "hello";
  version: number;
  role?: "holds" | "instructs" | "watches";
}

/** The first message to a client: the version of all that follow, and the steps in the order of their tabs. */
export interface HelloMessage {
  type: "hello";
  version: number;
  steps: StepEntry[];
}

/** A step of the page: the label of its tab, and the address of the module that draws its panel. */
export interface StepEntry {
  name: string;
  label: string;
  panel: string;
}

/** Words for the user. */
export interface NoteMessage {
  type: "note";
  words: string;
  error: boolean;
}

/** The answer to a command that asked for one by its id. */
export interface ReplyMessage {
  type: "reply";
  id: number;
  ok: boolean;
  result: unknown;
  error: ErrorMessage;
}

/** Why a command was refused. */
export interface ErrorMessage {
  message: string;
}

/**
 * A job; `result` is the id of what it made, `error` is why it failed or was cancelled.
 *
 * case_id: of the case that it works on, null for an import. subject: what it works on, for people.
 */
export interface JobPublic {
  id: string;
  kind: "import" | "dry_run" | "run";
  case_id: string | null;
  subject: string;
  created: string;
  state: "queued" | "running" | "done" | "failed" | "cancelled";
  stage: string;
  fraction: number;
  result: string | null;
  error: ErrorWords | null;
}

/** What went wrong. */
export interface ErrorWords {
  code: string;
  message: string;
  details: unknown;
}

/** The shape of every error. */
export interface ErrorPublic {
  error: ErrorWords;
}

/** Frame and unit of a file that does not name them. */
export interface ImportAnswer {
  frame?: "LPS" | "RAS" | null;
  units?: "mm" | "m" | null;
}

/**
 * A URDF that was stored; name, urdf and tool_frame are what a plan's robot is set to.
 *
 * links: that may hold the tool; ends: those without a child. notes: what was assumed because the file does not say.
 */
export interface OwnRobotPublic {
  name: string;
  urdf: string;
  tool_frame: string;
  links: string[];
  ends: string[];
  notes: string[];
}

/** A plan; positions in LPS mm. */
export interface PlanPublic {
  schema: string;
  id: string;
  name: string;
  case_id: string;
  case_hash: string;
  frame: string;
  unit: string;
  points: PointPublic[];
  targets: PointPublic[];
  tool: string;
  tool_shape: Record<string, number>;
  robot: RobotPublic;
  settings: Record<string, number>;
  created: string;
  modified: string;
  revision: number;
  locked: boolean;
  deleted_at: string | null;
  unreadable: string;
  notice: string;
}

export interface PointPublic {
  id: string;
  label: string;
  position: [number, number, number];
}

/**
 * Base: transform_base_to_patient, 16 numbers row by row, mm.
 *
 * urdf: SHA-256 of a URDF of one's own; tool_frame: its link that holds the tool. Both null of a shipped robot.
 */
export interface RobotPublic {
  name: string;
  base: number[] | null;
  q_start: number[] | null;
  urdf: string | null;
  tool_frame: string | null;
}

/** Places on the canvas in parts of its size, None for a place behind the camera; None without a camera. */
export interface ProjectAnswer {
  places: ([number, number] | null)[] | null;
}

/** What the server has said so far, by section; a section that it has not sent yet is undefined. */
export interface ViewModel {
  camera?: CameraSection;
  case?: CaseSection | null;
  cases?: CasesSection;
  corridor?: CorridorSection;
  curve?: CurveSection;
  details?: DetailsSection;
  driven?: ItemsSection | null;
  instruments?: InstrumentsSection;
  options?: OptionsSection;
  plan?: PlanSection | null;
  plans?: PlansSection;
  rehearsal?: RehearsalSection;
  scene?: SceneSection;
  settings?: SettingsSection;
  slices?: SlicesSection | null;
  step?: StepSection;
  tool?: ToolSection;
  view?: ViewSection;
}

/** Sections that changed, by name. */
export interface StateMessage {
  type: "state";
  sections: ViewModel;
}

export type Message = HelloMessage | StateMessage | ReplyMessage | NoteMessage;

/** Fields of each command besides its type. */
export interface Commands {
  "add.mode": {
    kind: "point" | "target" | "none";
  };
  "case.delete": {
    case_id: string;
  };
  "case.open": {
    case_id: string;
  };
  "case.rename": {
    case_id: string;
    name: string;
  };
  "case.restore": {
    case_id: string;
  };
  "drive": {
    direction: -1 | 0 | 1;
  };
  "ghost.cancel": {};
  "ghost.confirm": {};
  "grip.release": {};
  "heartbeat": {};
  "item.delete": {
    item_id: string;
  };
  "item.drag": {
    item_id: string;
    position: [number, number, number];
  };
  "item.drop": {
    item_id: string;
  };
  "item.rename": {
    item_id: string;
    label: string;
  };
  "item.select": {
    item_id: string;
  };
  "lock": {
    locked: boolean;
  };
  "pick.slice": {
    position: [number, number, number];
  };
  "plan.delete": {
    plan_id: string;
  };
  "plan.duplicate": {
    plan_id: string;
  };
  "plan.new": {
    name: string;
  };
  "plan.open": {
    plan_id: string;
  };
  "plan.rename": {
    plan_id: string;
    name: string;
  };
  "plan.restore": {
    plan_id: string;
  };
  "plan.robot": {
    name: string;
    urdf?: string | null;
    tool_frame?: string | null;
  };
  "plan.tool": {
    name: string;
    bend_deg?: number | null;
    shaft_radius_mm?: number | null;
  };
  "point.insert_after": {
    item_id: string;
  };
  "project": {
    points: [number, number, number][];
  };
  "redo": {};
  "rehearsal.end": {};
  "rehearsal.let_go": {};
  "rehearsal.mode": {
    mode: "path" | "free" | "inspect";
    target_id?: string | null;
  };
  "rehearsal.options": {
    soft_tissue: boolean;
    remote_centre: boolean;
    speed_limit: boolean;
  };
  "rehearsal.pause": {};
  "rehearsal.reset": {};
  "rehearsal.settings": {
    values: Record<string, number>;
  };
  "rehearsal.start": {};
  "rehearsal.take": {};
  "slice.cross": {
    position: [number, number, number];
  };
  "slice.set": {
    axis: "axial" | "coronal" | "sagittal";
    position: number;
  };
  "slice.window": {
    name: string;
    window: number;
    level: number;
  };
  "step.set": {
    name: string;
  };
  "twist": {
    direction: -1 | 0 | 1;
  };
  "undo": {};
  "view.camera": {
    view: "anterior" | "left" | "right" | "superior" | "oblique" | "nose";
  };
  "view.set": {
    opacity?: number | null;
    cut?: "whole" | "left" | "right" | null;
    slices?: "none" | "axial" | "coronal" | "sagittal" | "all" | null;
  };
}

/** Answers to commands; any other command is answered null. */
export interface Answers {
  "project": ProjectAnswer;
}

export type CommandType = keyof Commands;
export type Fields<T extends CommandType> = {} extends Commands[T] ? [fields?: Commands[T]] : [fields: Commands[T]];
export type Answer<T extends CommandType> = T extends keyof Answers ? Answers[T] : null;
