// Made by scripts/declarations.py from the server's types; do not edit.

/**
 * The active tab, what keys and clicks do in it, the tabs that can be opened, and the hint.
 *
 * endoscope: whether the tab has the picture of one.
 * offered: the tabs that are for cases of the open kind; a page shows no other.
 */
export interface TabSection {
  name: string;
  input: "none" | "edit" | "drive";
  endoscope?: "none" | "offered" | "first";
  available: string[];
  hint: string;
  offered: string[];
}

/** Whether the three-dimensional scene shows the head; words: the reason for waiting. */
export interface SceneSection {
  ready: boolean;
  words: string;
}

/** Height of the view at the centre of the scene; pivot: the centre of rotation since the last click, if any. */
export interface CameraSection {
  view_height_mm: number | null;
  pivot: [number, number, number] | null;
}

/** A label at a position of the scene. */
export interface LabelView {
  kind: string;
  words: string;
  position: [number, number, number];
}

/**
 * All waiting and running jobs, oldest first; one that is missing has ended.
 *
 * version: number of changes so far; it also counts a job that began and ended between two messages.
 */
export interface JobsSection {
  version: number;
  items: JobEntry[];
}

/** A waiting or running job, as in REST; REST alone has `result` and `error`, at its end. */
export interface JobEntry {
  id: string;
  kind: "import" | "structures" | "dry_run" | "run" | "suggestion" | "tools" | "segmentation" | "islands" | "overlay" | "beads" | "refinement" | "skin" | "openings" | "pictures" | "endoscope" | "swept" | "route" | "viewable";
  case_id: string | null;
  subject: string;
  document_id: string | null;
  created: string;
  state: "queued" | "running" | "done" | "failed" | "cancelled";
  stage: string;
  fraction: number;
}

/**
 * The open case; noun, surface: how its kind and its anatomy are called.
 *
 * parts: of the Patient tab that are for it. sliced: it may have slices. size_mm: of its first surface along the axes.
 * loading: the part that is being read, None when all of it is there.
 * window: width and centre of grey values that the scanner's files suggest, None where they do not.
 * volumes: names of the CT volumes in the slices, the widest first, finer ones over it. outlines: structures that can
 * be drawn in the slices. images: it has images that can identify its patient.
 */
export interface CaseSection {
  id: string;
  name: string;
  kind: "head" | "lumen";
  noun: string;
  surface: string;
  parts: ("structures" | "threshold" | "paint" | "overlays" | "lumen")[];
  sliced: boolean;
  size_mm: number[];
  landmarks: LandmarkView[];
  frame: FrameView;
  spacing_mm: [number, number, number] | null;
  surfaces: SurfaceView[];
  uncertainty: string;
  has_volume: boolean;
  images: boolean;
  beads: number;
  notes: string[];
  detail: string | null;
  loading: string | null;
  window: [number, number] | null;
  volumes: string[];
  overlays: OverlayView[];
  outlines: OutlineView[];
}

/** A named place of the anatomy, LPS mm. */
export interface LandmarkView {
  name: string;
  position: [number, number, number];
}

/** Frame of the file from which the case was made; assumed: the file did not name it. */
export interface FrameView {
  name: string;
  assumed: boolean;
}

/** A surface of the case and its report. */
export interface SurfaceView {
  name: string;
  triangles: number;
  words: string;
}

/** A volume that can be overlaid on the open case; words: its grid. */
export interface OverlayView {
  id: string;
  name: string;
  words: string;
  notes: string[];
}

/** A surface whose cut is drawn in the slices, and the colour. closed: by flat faces where its volume ends. */
export interface OutlineView {
  surface: string;
  colour: string;
  closed: boolean;
}

/** The three slices through the crosshair, and the grey values [HU]. */
export interface SlicesSection {
  cross: [number, number, number];
  window_name: string;
  window: number;
  level: number;
  planes: Record<"axial" | "coronal" | "sagittal", SlicePlane>;
}

/** One slice: position and range along the plane's normal, and the grid of a finer picture within it. */
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

/** How the head is shown: opacity 0 to 1, the cut, the slices in the scene ('none', an axis or 'all'), the skin. */
export interface ViewSection {
  opacity: number;
  cut: "whole" | "left" | "right";
  slices: string;
  skin: SkinSection;
}

/**
 * The skin in the scene. possible: the case has a CT of a head. shown: switched on, and there or being made.
 *
 * opacity: 0 to 1. colour: as in the scene. words: why it could not be made, or the warning that it is a patient's
 * face; else ''.
 */
export interface SkinSection {
  possible: boolean;
  shown: boolean;
  opacity: number;
  colour: string;
  words: string;
}

/** All cases, the deleted ones included. */
export interface CasesSection {
  items: CaseEntry[];
}

/**
 * A case in the list. unreadable: why its content cannot be read, '' where it can.
 *
 * images: it has images that can identify its patient.
 */
export interface CaseEntry {
  id: string;
  name: string;
  created: string;
  deleted: boolean;
  unreadable: string;
  images: boolean;
}

/** The imported structures of the open case. */
export interface StructuresSection {
  items: StructureEntry[];
}

/**
 * A structure beside the anatomy of the open case.
 *
 * colour: '#rrggbb'. notes: doubts about it, in sentences. origin: 'ct' for a threshold, 'painted' for a
 * label, 'segmentation' for a file.
 */
export interface StructureEntry {
  id: string;
  name: string;
  colour: string;
  shown: boolean;
  triangles: number;
  notes: string[];
  origin: "ct" | "surface" | "shipped" | "segmentation" | "painted";
}

/** The painted labels of the open case. */
export interface LabelsSection {
  items: LabelEntry[];
}

/**
 * A painted label of the open case.
 *
 * volume: the one whose grid it has. surface: whether a structure was made from it, and still has the surface of what
 * is painted. unreadable: why its content cannot be read, '' where it can.
 */
export interface LabelEntry {
  id: string;
  name: string;
  colour: string;
  volume: string;
  revision: number;
  locked: boolean;
  can_undo: boolean;
  can_redo: boolean;
  surface: "none" | "made" | "changed";
  unreadable: string;
}

/**
 * The paths of the open plan, which one is chosen, and the notes.
 *
 * side_caution: a sentence where the entry of the chosen path lies on the other side than it says; else ''.
 */
export interface PathsSection {
  items: PathView[];
  chosen: string;
  side_caution: string;
  notes: string;
  locked: boolean;
}

/** A path of the plan; tool: its title. */
export interface PathView {
  id: string;
  name: string;
  points: number;
  tool: string;
  entry_side: string;
}

/**
 * The openings of the head while the chosen path has no point.
 *
 * state: 'waiting' while they are looked for, 'current' once they are known, 'none' where they are not asked for.
 * marked: a click on one is its choice. words: what to do where none was found, else ''.
 */
export interface OpeningsSection {
  state: "none" | "waiting" | "current";
  items: OpeningView[];
  marked: boolean;
  words: string;
}

/** An opening; side: '', 'left' or 'right' of the patient; radius_mm: of the largest ball in it. */
export interface OpeningView {
  id: string;
  name: string;
  side: string;
  position: [number, number, number];
  radius_mm: number;
}

/** Regions of the open plan. */
export interface RegionsSection {
  items: RegionView[];
  selected: string | null;
  drawing: DrawingView | null;
  structures: StructureChoice[];
  locked: boolean;
}

/**
 * A protected structure, or a region of bone to be removed.
 *
 * kind: of its shape. sub: its shape and how it is kept, in words. sizes: a radius, or a box's half sizes along its
 * axes; place: where it is taken by when it is moved, None of a structure of the case. What a purpose or a kind does
 * not have is None.
 */
export interface RegionView {
  id: string;
  purpose: "spare" | "remove";
  name: string;
  kind: string;
  sub: string;
  sizes_mm: number[];
  place: [number, number, number] | null;
  shape: Record<string, unknown>;
  colour: string;
  visible: boolean;
  soft: boolean;
  margin_mm: number | null;
  stiffness_n_per_mm: number | null;
  max_depth_mm: number | null;
}

/** What is being drawn by clicks; places: those of a chain so far, of this radius and in this colour. */
export interface DrawingView {
  purpose: "spare" | "remove";
  kind: "sphere" | "capsules" | "capsule" | "box" | "half_space" | "patch";
  places: [number, number, number][];
  radius_mm: number;
  colour: string;
  words: string;
}

/** A structure of the case that can be protected as it is. */
export interface StructureChoice {
  id: string;
  name: string;
}

/** The bone that the open plan removes; words: in all, '' where nothing is to be removed, or why it is not known. */
export interface RemovedBoneSection {
  items: RemovedRegionView[];
  words: string;
}

/** The bone in a region that is to be removed, in words. */
export interface RemovedRegionView {
  id: string;
  words: string;
}

/**
 * Versions of the open plan, newest first.
 *
 * compared: the one whose changes since then are told, None for none. differs: whether going back to it would change
 * the plan; it leaves the settings of the rehearsal as they are.
 */
export interface VersionsSection {
  items: VersionView[];
  compared: string | null;
  changes: string[];
  differs: boolean;
  locked: boolean;
}

/** A version in the list. */
export interface VersionView {
  id: string;
  name: string;
  created: string;
}

/** What the open plan lays over its head, None for nothing; known: whether that volume is among the choices. */
export interface SecondVolumeSection {
  laid: LaidView | null;
  known: boolean;
  choices: VolumeChoice[];
  locked: boolean;
}

/**
 * What is laid over the head. transform: 16 numbers row by row; opacity: 0 to 1.
 *
 * to_confirm: the volume is of another head, and nobody has confirmed that it shows the same patient; it is not drawn.
 */
export interface LaidView {
  case: string;
  volume: string | null;
  transform: number[];
  opacity: number;
  window: number;
  level: number;
  to_confirm: boolean;
}

/**
 * A volume that can be laid over the head. window, level: that it is shown with at first; None of a CT.
 *
 * other_head: it is the CT of another case, imported then; None of a volume of this case.
 */
export interface VolumeChoice {
  case: string;
  volume: string | null;
  name: string;
  other_head: string | null;
  window: number | null;
  level: number | null;
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

/** What can be chosen; bounds (low, high) of a tool's bend, of its shaft's radius, and of the margin. */
export interface InstrumentsSection {
  robots: RobotOption[];
  tools: ToolOption[];
  bend_bounds_deg: number[];
  radius_bounds_mm: number[];
  margin_bounds_mm: number[];
}

/** A robot that comes along; words: what it is. */
export interface RobotOption {
  name: string;
  title: string;
  words: string;
}

/** A tool that comes along, with its own bend, 0 of a straight one, and radius. */
export interface ToolOption {
  name: string;
  title: string;
  words: string;
  bend_deg: number;
  shaft_radius_mm: number;
}

/**
 * The open plan; degree and length of its spline are 0 without one. margin_mm: to bone, as it is set.
 *
 * nearest_target: id of the target nearest to the path's end, None without a path or a target. short_mm: how far
 * before it the path ends, 0 where it ends at it.
 */
export interface PlanSection {
  points: ItemEntry[];
  targets: ItemEntry[];
  id: string;
  revision: number;
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
  nearest_target: string | null;
  short_mm: number;
  ghost: GhostView | null;
  robot: PlanRobotView;
  tool: PlanToolView;
  margin_mm: number;
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
 * is_placed: the plan keeps where its base stands. trouble: why it cannot be read, '' where it can.
 */
export interface PlanRobotView {
  name: string;
  title: string;
  words: string;
  urdf: string | null;
  tool_frame: string | null;
  links: string[];
  is_placed: boolean;
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

/**
 * The dry run of the plan; completed is None until it has ended.
 *
 * level, short: of the verdict, also where the tool does not fit at the entry or the run has failed; None and '' while
 * the path is judged. word: of the level, of the verdict that is shown where there is none, '' without either.
 * job: id of the one that computes it, None where none does. cancelled: somebody ended it.
 * verdict: of a run that has ended, or of an earlier one while another is computed; shown_mm: arc length at which the
 * tool is shown, None where it is not.
 * state: what the verdict is of: 'current' of the stored path; 'waits' an earlier answer, while this one is computed;
 * 'drag' of the path as it would be under a hand, with the robot's base kept, 'drag_waits' of an earlier place of the
 * hand. state_words says so.
 */
export interface EvaluationSection {
  status: "none" | "computing" | "done" | "failed";
  words: string;
  level: "fits" | "tight" | "pierces" | "blocked" | "unknown" | null;
  word: string;
  short: string;
  completed: boolean | null;
  warning: string;
  scale: ScaleView | null;
  job: string | null;
  cancelled: boolean;
  verdict: VerdictView | null;
  shown_mm: number | null;
  state: "none" | "current" | "waits" | "drag" | "drag_waits";
  state_words: string;
}

/**
 * The scale of clearances [mm]: range, margin, and the colours evenly spaced from lo to hi.
 *
 * unknown: colour of the part of the path that the tool does not reach; None where there is none. blocked: colour of
 * what is pierced, and of a verdict that is blocked or pierces.
 */
export interface ScaleView {
  lo: number;
  hi: number;
  margin: number;
  colours: string[];
  unknown: string | null;
  blocked: string;
}

/**
 * The verdict on the path: level from bone and reach; short: in a few words.
 *
 * figures: the one that decides first.
 * pierced: what is drawn in red; None where the tool pierces nothing.
 * show_mm: arc length of the place to look at first, of the first figure that has one.
 * nearest: name of what leaves least above its margin, bone or a protected structure, nearest_curve: its curve, and
 * nearest_mm: arc length of that place. base_mm: distance of the robot's base from the entry.
 */
export interface VerdictView {
  level: "fits" | "tight" | "pierces" | "blocked" | "unknown";
  short: string;
  parts: VerdictPart[];
  figures: FigureView[];
  pierced: PiercedView | null;
  show_mm: number;
  nearest: string;
  nearest_curve: number;
  nearest_mm: number;
  length_mm: number;
  base_mm: number;
  profile: ClearanceProfile;
}

/** A piece of the verdict's sentence; s_mm: arc length of the tip that it is about, None where it is about none. */
export interface VerdictPart {
  words: string;
  s_mm: number | null;
}

/** A figure of the verdict, see `VerdictFigure`. */
export interface FigureView {
  name: string;
  value: number | null;
  level: "fits" | "tight" | "pierces" | "blocked" | "unknown";
  s_mm: number | null;
  whole_mm: number | null;
  digits: number;
  at_least: boolean;
}

/** The tissue that the tool pierces, on its axis where the tip is at s_mm: from outside to inside, in LPS. */
export interface PiercedView {
  begin: [number, number, number];
  end: [number, number, number];
}

/**
 * Along the path, at one pose of the dry run for every 0.5 mm: all lists are of one length, in mm.
 *
 * curves: bone first, then each hard protected structure.
 * exact_to_mm: bone that is farther away is at this distance or beyond.
 * tissue_mm and tissue_depth_mm: along which length and how deep the tool is in soft tissue; None without a CT.
 * registration_mm: what the registration may be off by at the tip (95 %); None without one.
 * sideways_mm: how far sideways air leads round the tissue that the tool passes; None where not known anywhere.
 */
export interface ClearanceProfile {
  s_mm: number[];
  curves: ObstacleCurve[];
  exact_to_mm: number;
  tissue_mm: number[] | null;
  tissue_depth_mm: number[] | null;
  registration_mm: number[] | null;
  sideways_mm: number[] | null;
}

/** Clearance of the whole tool to bone or to a hard protected structure along the path, and its margin, in mm. */
export interface ObstacleCurve {
  name: string;
  margin_mm: number;
  clearance_mm: number[];
}

/**
 * The shaft at the selected path point.
 *
 * point: its id, None where no path point is selected; aiming: the next click aims the shaft of that point.
 * words: where the shaft leaves to, '' where the direction is left open. roll_deg: None where it is left open.
 * bent: the tool has a bend, so that its roll matters. shown: the suggestion and alternative that the scene shows.
 */
export interface ShaftSection {
  point: string | null;
  aiming: boolean;
  words: string;
  roll_deg: number | null;
  bent: boolean;
  shown: string | null;
}

/**
 * The cones of the targets of the open plan.
 *
 * state: 'current', of the stored path and targets; 'waits' while others than these are computed, the items being of
 * before; 'none' where there is nothing to tell.
 */
export interface ConeSection {
  state: "none" | "waits" | "current";
  items: ConeView[];
}

/** A target, and the full opening angle of the round cone of all directions from which it can be inspected. */
export interface ConeView {
  target: string;
  cone_deg: number;
  words: string;
}

/** The routes of the open case. */
export interface RouteList {
  items: RouteEntry[];
}

/** A route in the list. */
export interface RouteEntry {
  id: string;
  name: string;
  modified: string;
}

/**
 * The open route; lengths in mm. links: None for as many as the way needs. bound_mm: None by the lumen's radius.
 *
 * mark_kinds: that there are. picking: what the next click on the wall is, '' for nothing. moving: the polyp or label
 * that it moves, or ''.
 */
export interface RouteSection {
  id: string;
  name: string;
  revision: number;
  locked: boolean;
  can_undo: boolean;
  can_redo: boolean;
  entry: [number, number, number] | null;
  end: [number, number, number] | null;
  links: number | null;
  length_mm: number;
  radius_mm: number;
  bound_mm: number | null;
  breathing_mm: number;
  breathing_period_s: number;
  peristalsis: number;
  peristalsis_period_s: number;
  marks: MarkView[];
  mark_kinds: MarkKindView[];
  picking: "entry" | "end" | "polyp" | "label" | "move" | "";
  moving: string;
}

/** A polyp or a label on the wall, LPS mm. */
export interface MarkView {
  id: string;
  kind: "polyp" | "label";
  name: string;
  at: [number, number, number];
}

/** A kind of marks; many: of them, in words. */
export interface MarkKindView {
  kind: "polyp" | "label";
  many: string;
}

/**
 * What was computed of the open route; lengths in mm, all along the way of the robot's tip.
 *
 * words: why it failed. length_mm: to the end. reach_mm: how deep the tip comes; limit, reach_words: what
 * ends its way. offers: what would come deeper. behind_share, behind_mm: how much of the
 * pathway's surface is behind the wall, and how deep at most; bound_mm: the largest bound of a link.
 * by_hand_mm: where the contour by hand is that makes it narrower than the robot; None: the lumen is, or it is not.
 * s_mm, radius_mm, wall_mm: along the way, the pathway's radius and the distance from the centreline to the wall.
 */
export interface RoutePathSection {
  state: "none" | "computing" | "ready" | "failed";
  words: string;
  length_mm: number | null;
  links: number | null;
  reach_mm: number | null;
  reach_words: string;
  limit: "" | "end" | "links" | "narrow" | "bound" | "shape" | "base";
  offers: ReachOfferView[];
  behind_share: number | null;
  behind_mm: number | null;
  bound_mm: number | null;
  least_mm: number | null;
  least_at_mm: number | null;
  by_hand_mm: number | null;
  s_mm: number[];
  radius_mm: number[];
  wall_mm: number[];
}

/** A robot, or a bound, with which the tip comes deeper; lengths in mm. bound_mm: None by the lumen's radius. */
export interface ReachOfferView {
  words: string;
  links: number;
  length_mm: number;
  radius_mm: number;
  bound_mm: number | null;
}

/**
 * Control contours of the open route. chosen: number of the one that is edited. by_hand: edits that are stored.
 *
 * left_out: of them, those that are too far from the way. words: what is to be known of those by hand.
 */
export interface ContourList {
  items: ContourView[];
  chosen: number | null;
  by_hand: number;
  left_out: number;
  words: string;
}

/**
 * A control contour of the pathway; lengths in mm. radii_mm: one of a circle, else those around it.
 *
 * cut_mm: by how much it was reduced, so that it does not cross a neighbour. behind_mm: by how much its rim lies
 * behind the wall; None: not known yet.
 */
export interface ContourView {
  at_mm: number;
  centre: [number, number, number];
  radii_mm: number[];
  by_hand: boolean;
  cut_mm: number;
  behind_mm: number | null;
}

/** The viewable share of the wall up to depth_mm, None until it is computed. shown: tinted in the scene. */
export interface WallViewsSection {
  state: "none" | "computing" | "ready" | "failed";
  words: string;
  share: number | null;
  depth_mm: number | null;
  shown: boolean;
}

/** The registrations of the open case. */
export interface RegistrationsSection {
  items: RegistrationEntry[];
}

/** A registration in the list. */
export interface RegistrationEntry {
  id: string;
  name: string;
  modified: string;
  deleted: boolean;
}

/**
 * The open registration; fle_stated_mm: the localisation error that was stated, None where it is estimated.
 *
 * anatomy: name of the structure that the case is driven in. touched: None where no surface was touched.
 */
export interface RegistrationSection {
  id: string;
  revision: number;
  name: string;
  locked: boolean;
  deleted: boolean;
  can_undo: boolean;
  can_redo: boolean;
  made_from: "none" | "pairs" | "given" | "surface";
  has_volume: boolean;
  selected: string | null;
  beads: BeadEntry[];
  search: BeadSearchView | null;
  pairs: PairEntry[];
  fit: FitView;
  fle_stated_mm: number | null;
  errors: ErrorsView;
  orders: OrdersView | null;
  anatomy: string;
  touched: TouchedView | null;
  calibration: CalibrationView;
}

/** A bead that was found in the CT; name: of its point, once it is one, else what that would be called. */
export interface BeadEntry {
  id: string;
  name: string;
  position: [number, number, number];
  diameter_mm: number;
  state: "found" | "confirmed" | "rejected";
}

/** How beads were looked for. diameter_mm: None for every size; left_out: dense places that are no beads. */
export interface BeadSearchView {
  diameter_mm: number | null;
  threshold_hu: number;
  cautions: string[];
  left_out: number;
}

/** A point seen twice; a place that is missing is None. residual_mm: how far it is off under the transform. */
export interface PairEntry {
  id: string;
  label: string;
  in_image: [number, number, number] | null;
  measured: [number, number, number] | null;
  enabled: boolean;
  weight: number;
  measured_from: "typed" | "file" | "simulated" | "tracker";
  bead: string;
  residual_mm: number | null;
}

/** How the registration stands. fre_mm, mean_residual_mm: how well the pairs fit, not how exact the tool is. */
export interface FitView {
  state: "waiting" | "degenerate" | "misfit" | "inconsistent" | "fitted" | "given" | "refined";
  words: string;
  used: number;
  fre_mm: number | null;
  mean_residual_mm: number | null;
  wrong: WrongPairView | null;
  fle_mm: number | null;
  fle_source: "stated" | "estimated" | "none";
  simulated: boolean;
  cautions: string[];
}

/** The pair that does not fit the others. */
export interface WrongPairView {
  pair: string;
  label: string;
  certainty: "outlier" | "suspect";
  words: string;
}

/** The error to be expected in the open plan, and what it means. */
export interface ErrorsView {
  rows: ErrorRow[];
  words: string;
}

/** The error to be expected at a target, or at the worst place of the path (s_mm along it). */
export interface ErrorRow {
  label: string;
  rms_mm: number;
  within_95_mm: number;
  position: [number, number, number];
  s_mm: number | null;
}

/** What was found of the order of the measured points, the order that fits best first. */
export interface OrdersView {
  candidates: OrderView[];
  ambiguous: boolean;
  unchanged: boolean;
  words: string;
}

/** An order that fits: what each pair of the image gets, and how well the points fit then. */
export interface OrderView {
  moves: OrderMove[];
  fre_mm: number;
}

/** A pair and the measured point that an order gives it. measured_at: label of the pair that it stands at now. */
export interface OrderMove {
  label: string;
  measured_at: string;
  measured: [number, number, number];
  stays: boolean;
}

/** What was touched on a structure, by its id; refinement: None while the registration was not refined on it. */
export interface TouchedView {
  structure: string;
  count: number;
  measured_from: "file" | "simulated" | "tracker";
  refinement: RefinementView | null;
}

/** What a refinement did, mm. residual_mm: of the `kept` points; it is never the accuracy. stability: 0 to 1. */
export interface RefinementView {
  residual_mm: number;
  kept: number;
  moved_mm: number;
  stability: number;
}

/** Of the open registration. stays: why `to` cannot be changed; no_base: why none to the base can be made; or ''. */
export interface CalibrationView {
  to: "patient" | "base";
  stays: string;
  pointer: PointerTipView | null;
  robot: RobotView | null;
  no_base: string;
}

/** The calibrated tip of the pointer; mm and degrees. */
export interface PointerTipView {
  residual_mm: number;
  tip_error_mm: number;
  swing_deg: number;
  poses: number;
  measured_from: "file" | "simulated" | "tracker";
  cautions: string[];
}

/** The tracker beside the robot, as it was calibrated. */
export interface RobotView {
  translation_residual_mm: number;
  rotation_residual_deg: number;
  poses: number;
  measured_from: "file" | "simulated" | "tracker";
  cautions: string[];
}

/**
 * The registration that the open plan uses. here: it is the one that is open in this tab. to: what it leads to.
 *
 * words: that it can be used, or why not. Of one that can: doubts to know before, and what error is to be expected.
 * has_balls: the error at the plan's targets is known, and drawn as balls about them.
 */
export interface PlanUseSection {
  plan: string;
  registration: string | null;
  name: string | null;
  state: "none" | "ready" | "unfinished" | "misfit" | "inconsistent" | "deleted" | "missing" | "other_case" | "unreadable";
  to: "patient" | "base" | null;
  words: string;
  doubts: string[];
  error_words: string;
  has_balls: boolean;
  here: boolean;
  locked: boolean;
}

/** The marks of beads and points while the tab is open. */
export interface FiducialsSection {
  items: FiducialMark[];
}

/**
 * A mark in the slices and the scene. measured: where it was measured, in the image; None without a fit.
 *
 * state: of a bead, or 'left_out' of a point that the fit leaves out.
 */
export interface FiducialMark {
  id: string;
  label: string;
  position: [number, number, number];
  measured: [number, number, number] | null;
  state: "found" | "confirmed" | "rejected" | "left_out";
  selected: boolean;
}

/** The tracked pointer that the planner listens to: whether it is seen, and words that say so. */
export interface TrackerView {
  state: "connecting" | "waiting" | "fresh" | "stale";
  words: string;
}

/** The rehearsal of a plan: the drive, and the fields of the tool. contacts: in a free hand, the deepest first. */
export interface RehearsalSection {
  holding?: string;
  force_n?: number | null;
  progress_mm?: number | null;
  length_mm?: number | null;
  taken_ms?: number | null;
  tip?: [number, number, number];
  mode?: string;
  phase?: string;
  held?: boolean;
  reason?: string;
  so_far?: string;
  tip_error_mm?: number | null;
  clearance_mm?: number | null;
  clearance_capped?: boolean;
  margin_mm?: number | null;
  target_error_mm?: number | null;
  path_done?: boolean;
  grip?: [number, number, number];
  virtual_point?: [number, number, number];
  state: "absent" | "starting" | "ready" | "running" | "paused" | "silent" | "failed";
  words: string;
  fraction: number | null;
  mine: boolean;
  holder: string | null;
  can_take: boolean;
  unrecorded: string | null;
  comments: CommentView[];
  control?: ControlView;
  contacts?: ContactView[];
  plan_changed?: boolean;
  target_id?: string | null;
}

/** A comment on a drive, at a driven time. */
export interface CommentView {
  id: string;
  t_s: number | null;
  text: string;
}

/**
 * How the tool is driven, or will be: control mode, device of a teleoperated drive, and preset, None for none.
 *
 * certified: every motion is certified before it is made; never in a free hand.
 */
export interface ControlView {
  mode: "freehand" | "hands-on" | "teleoperated";
  device: "position" | "rate";
  preset: string | null;
  certified: boolean;
}

/** Contacts of a part of a tool in a free hand so far, the deepest, and its depth now; lengths in mm. */
export interface ContactView {
  structure: string;
  part: string;
  count: number;
  max_depth_mm: number | null;
  depth_mm: number | null;
}

/** Points and targets, in order. */
export interface ItemsSection {
  points: ItemEntry[];
  targets: ItemEntry[];
}

/** Timing of the control loop; empty while there is no robot. rows: of the solved program. */
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

/** The present settings; answered counts the changes that were answered, refused ones included. */
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

/**
 * Selected options of the rehearsal; words: when they take effect, '' where they have.
 *
 * centre: None while the remote centre is off. lengths: of the options that are on and have one.
 */
export interface OptionsSection {
  items: OptionView[];
  centre: CentreSection | null;
  lengths: Record<string, LengthSection>;
  words: string;
}

/** An option of the rehearsal; words: its effect, or what it would be; refusal: why it cannot be used, or ''. */
export interface OptionView {
  name: string;
  label: string;
  words: string;
  on: boolean;
  refusal: string;
}

/**
 * Position of the remote centre; chosen: a choice's value, or 'mm' for a position in between.
 *
 * at_mm: along the path, None where it is not known. trouble: why it cannot be there, '' where it can.
 */
export interface CentreSection {
  choices: CentreChoice[];
  chosen: string;
  at_mm: number | null;
  length_mm: number;
  trouble: string;
}

/** A position for the remote centre; value: 'entry', or the id of a path point. */
export interface CentreChoice {
  value: string;
  label: string;
}

/** The length of an option that has one, such as the tube's radius, and the range that is offered; mm. */
export interface LengthSection {
  mm: number;
  lo: number;
  hi: number;
  step: number;
}

/**
 * Places of the driven path that the tip can go to; length_mm: of the path.
 *
 * refusal: why none can be approached now, '' where one can.
 */
export interface ApproachSection {
  points: ApproachPlace[];
  length_mm: number;
  refusal: string;
}

/** A path point that can be approached, and its arc length. */
export interface ApproachPlace {
  id: string;
  label: string;
  at_mm: number;
}

/** Axes (start, end) of the tool's parts from the tip on, and their radii; both empty without a robot. */
export interface ToolSection {
  segments: [number, number, number][][];
  radii_mm: number[];
}

/**
 * The tool's clearance to bone or to a protected structure; lengths in mm.
 *
 * at_least: it is farther away than clearances are measured, which is the value. soft: the tool may enter its layer,
 * whose thickness is the margin. level: as in a verdict; 'blocked' where the tool is nearer than the margin.
 */
export interface NearnessView {
  name: string;
  clearance_mm: number;
  margin_mm: number;
  at_least: boolean;
  soft: boolean;
  level: "fits" | "tight" | "blocked";
}

/**
 * What really happens to the tool that is driven; LPS mm. Tips and numbers are None where no stage is on.
 *
 * followed: the head, by a reference. compensated_mm_per_n: what the robot compensates, 0: nothing. below_margin: the
 * true tool is nearer to bone than the margin of the certificate.
 */
export interface TruthSection {
  stages: StageView[];
  followed: boolean;
  compensated_mm_per_n: number;
  may_compensate: boolean;
  believed: [number, number, number] | null;
  true: [number, number, number] | null;
  difference_mm: number | null;
  clearance_mm: number | null;
  clearance_capped: boolean;
  below_margin: boolean;
}

/**
 * A stage of the error chain with its one number; known: it is that of the plan's own registration.
 *
 * refusal: why it cannot be switched on, '' where it can.
 */
export interface StageView {
  name: string;
  label: string;
  unit: string;
  most: number;
  step: number;
  value: number;
  on: boolean;
  known: boolean;
  hint: string;
  refusal: string;
}

/**
 * Figures of the snake robot. depth_mm: of the tip along its way; passed: the last landmark behind it, '' for
 * none.
 *
 * nearest: the link nearest to its bound, None while none is inside. bend: r of the bending links, 1 where they bend
 * no further; straight: they have the pathway's shape. can_look: the camera can be moved. doing: a request under way.
 * insertion_mm_per_s, camera_mm_per_s: speeds of an axis that is fully deflected. breathing_mm: 0 where there is none.
 * arm: of this drive; certified: in the arm of that name only. joint: that a manual hand turns, 1: the last.
 * yield_mm_per_s_per_n: admittance by which a guided pull yields to the force, 0 in other arms.
 * behind: of the pathway; deepest: of the links, None where the tissue moves. steered: the control has control
 * bends; shown: whether this window shows them.
 * lens_mm: from the lens to the wall, negative behind it; None where the tissue moves.
 * fixed: the robot stands on a fixed base and bends; nothing is inserted.
 */
export interface SnakeView {
  depth_mm: number;
  length_mm: number;
  passed: string;
  links: number;
  links_inside: number;
  nearest: LinkView | null;
  bend: number;
  straight: boolean;
  can_look: boolean;
  doing: string;
  insertion_mm_per_s: number;
  camera_mm_per_s: number;
  breathing_mm: number;
  arm: "manual" | "guided" | "certified";
  certified: boolean;
  joint: number;
  yield_mm_per_s_per_n: number;
  behind: BehindWallView | null;
  deepest: DeepestLinkView | null;
  steered: boolean;
  shown: boolean;
  lens_mm: number | null;
  fixed: boolean;
}

/** The link that is nearest to its bound: its number from the base, deviation and bound in mm. */
export interface LinkView {
  link: number;
  deviation_mm: number;
  bound_mm: number;
}

/**
 * How much of the pathway's surface is behind the wall, and how deep at most: so deep can a certified link be.
 *
 * bound_mm: by how much deeper, the largest bound of any link; between_mm: by how much between the
 *     vertices at which it is measured.
 */
export interface BehindWallView {
  share: number;
  depth_mm: number;
  bound_mm: number;
  between_mm: number;
}

/**
 * The link that is deepest behind the wall, by its number from the base, and its bound; 0 mm, 0 and None where none
 * is.
 */
export interface DeepestLinkView {
  depth_mm: number;
  link: number;
  bound_mm: number | null;
}

/**
 * What is chosen for the drive that is there, or comes next. links: the distal ones, the last one last.
 *
 * open: this client may choose.
 */
export interface DriveOptionsView {
  arm: "manual" | "guided" | "certified";
  preset: "kwok2013" | null;
  links: LinkValuesView[];
  open: boolean;
}

/** Of one distal link: b_i, None by the route, a_i and k_i. */
export interface LinkValuesView {
  bound_mm: number | null;
  threshold_mm: number;
  spring_n_per_mm: number;
}

/**
 * The task that is chosen for the drive that is there, or comes next; None for none.
 *
 * offered: what can be done in this case. marks: polyps of the route, which may be the task's. open: this client may
 * choose.
 */
export interface DriveTaskView {
  now: TaskNowView | null;
  labels: LabelsNowView | null;
  offered: ("polyps" | "labels")[];
  task: "polyps" | "labels" | null;
  places: "seed" | "route";
  seed: number;
  marks: number;
  open: boolean;
}

/**
 * Study I. polyps: all of them, so many, in the order of their numbers; cleared: how many are.
 *
 * held_s: for how long what is aimed at is viewed, of hold_s. frame_deg: half the opening of the aiming frame. end_mm:
 * of the tip, where the task ends; end_name: of the landmark there. viewable_share: of the wall there, None if nobody
 * asked. words: why this may differ from the run's score. seen: how far in mm and how many degrees off the axis the
 * nearest polyp is that is left and in the picture, while none is viewed; None for none.
 */
export interface TaskNowView {
  of: number;
  cleared: number;
  viewed: boolean;
  seen: PolypSeenView | null;
  held_s: number;
  hold_s: number;
  polyps: TaskPolypView[];
  radius_mm: number;
  frame_deg: number;
  end_mm: number;
  end_name: string;
  viewable_share: number | null;
  completed: boolean;
  words: string;
}

/** A polyp in the picture: its distance from the lens, and its angle off the optical axis. */
export interface PolypSeenView {
  distance_mm: number;
  angle_deg: number;
}

/** A polyp. at: its middle now, LPS mm; colour: 0, blue, to 1, yellow; cleared: it was viewed for long enough. */
export interface TaskPolypView {
  at: [number, number, number];
  colour: number;
  cleared: boolean;
}

/**
 * Study II. traced: how many labels are done; aimed: number of the one under the marker, from 1.
 *
 * cutting: its object is being shortened. near_mm: as near the marker has to be. words: why this may differ from the
 * run's score.
 */
export interface LabelsNowView {
  labels: TaskLabelView[];
  traced: number;
  aimed: number | null;
  cutting: boolean;
  near_mm: number;
  completed: boolean;
  words: string;
}

/**
 * A label of study II, LPS: its middle in mm, unit vectors of its face and of its arrow, and what is to be cut.
 *
 * end_mm: of the object's aimed end along the arrow, from −10 to 10, where it is done.
 */
export interface TaskLabelView {
  centre: [number, number, number];
  normal: [number, number, number];
  along: [number, number, number];
  end_mm: number;
}

/**
 * What the page's endoscope shows: where its surface and its poses come from; '' for none yet.
 *
 * key: another one for another surface. look: of the tissue. hand: a drag in the picture and the arrow keys move the
 * camera. own: the picture is turned as the robot's own camera is, which has no lens that could be tilted. pose: what
 * is shown before there is a robot. words: why there is no picture.
 */
export interface ScopeSection {
  surface: string;
  key: string;
  poses: string;
  look: "nose" | "colon" | "cavity";
  hand: boolean;
  own: boolean;
  pose: ScopePoseView | null;
  words: string;
}

/** A place in the lumen, the way ahead, and up in the picture. */
export interface ScopePoseView {
  tip: [number, number, number];
  shaft: [number, number, number];
  side: [number, number, number];
}

/**
 * The task of the run that is replayed, at the moment that is shown; before it began it has neither of both.
 *
 * waits: it is being computed. words: why it is not known, '' where it is.
 */
export interface ReplayedTaskView {
  now: TaskNowView | null;
  labels: LabelsNowView | null;
  run: string;
  waits: boolean;
  words: string;
}

/**
 * The open study. consent: its text; next: what the subject does next; each, total: trials of a condition, of all.
 *
 * trial: the next one; the last before a questionnaire; None when all is done. break_min: due before it, 0 for none.
 * missing, attached: of the subject; those with a run by their position. following: the first subject with something
 * left to do, '' where everybody has done all.
 */
export interface LedStudyView {
  id: string;
  name: string;
  revision: number;
  can_undo: boolean;
  can_redo: boolean;
  subjects: SubjectView[];
  subject: string;
  next: "consent" | "trial" | "questionnaire" | "done";
  consent: string;
  trial: TrialView | null;
  each: number;
  total: number;
  break_min: number;
  missing: MissingView[];
  attached: number[];
  following: string;
}

/** A subject, by its code, and how far it is. */
export interface SubjectView {
  code: string;
  done: number;
  skipped: number;
}

/**
 * The next trial. position: in the subject's order; number: of the condition; running: it has begun.
 *
 * tab: that drives it. document_id: of the plan or route, document: its name. plan, lumen: how it is driven, one of
 * them. view: that is shown, None for any.
 */
export interface TrialView {
  position: number;
  number: number;
  label: string;
  tab: "rehearse" | "drive";
  case_id: string;
  document_id: string;
  document: string;
  plan: PlanTrialView | null;
  lumen: LumenTrialView | null;
  view: "outside" | "endoscope" | null;
  running: boolean;
}

/** device: of a teleoperated trial, else without effect. preset: a paper's parameters, None for the plan's own. */
export interface PlanTrialView {
  mode: "freehand" | "hands-on" | "teleoperated";
  device: "position" | "rate";
  preset: "li2004" | "li2007" | null;
}

/** preset: a paper's parameters, None for those of the route. */
export interface LumenTrialView {
  arm: "manual" | "guided" | "certified";
  task: "polyps" | "labels";
  preset: "kwok2013" | null;
}

/** A trial that was skipped, and why. */
export interface MissingView {
  position: number;
  label: string;
  reason: string;
}

export interface Hello {
  id?: number | null;
  type: "hello";
  version: number;
  role?: "holds" | "instructs" | "watches";
}

/** The first message to a client: the version of all that follow, the tabs in their order, and the operations. */
export interface HelloMessage {
  type: "hello";
  version: number;
  steps: TabEntry[];
  operations: OperationEntry[];
}

/** A tab of the page: the label of its tab, and the address of the module that draws its panel. */
export interface TabEntry {
  name: string;
  label: string;
  panel: string;
}

/** An operation on a document: the type of its message, and its name for people. */
export interface OperationEntry {
  type: string;
  name: string;
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
  result?: unknown;
  error?: ErrorMessage;
}

/** Why a command was refused. */
export interface ErrorMessage {
  message: string;
}

/**
 * A job; `result` is the id of its result, `error` the reason of a failure or cancellation.
 *
 * case_id: null for an import of a head. subject: name of what it works on, for display. document_id: the plan,
 * registration or label that it works on, null without one.
 */
export interface JobPublic {
  id: string;
  kind: "import" | "structures" | "dry_run" | "run" | "suggestion" | "tools" | "segmentation" | "islands" | "overlay" | "beads" | "refinement" | "skin" | "openings" | "pictures" | "endoscope" | "swept" | "route" | "viewable";
  case_id: string | null;
  subject: string;
  document_id: string | null;
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

/** The format of all errors. */
export interface ErrorPublic {
  error: ErrorWords;
}

/** What a file leaves open: frame, unit, one of several series, the case of a segmentation. */
export interface ImportAnswer {
  frame?: "LPS" | "RAS" | null;
  units?: "mm" | "m" | "um" | null;
  series?: number | null;
  into?: string | null;
}

/**
 * A stored URDF; name, urdf and tool_frame are the values for a plan's robot.
 *
 * links: possible tool frames; ends: leaf links. notes: assumptions for values that the file lacks.
 */
export interface OwnRobotPublic {
  name: string;
  urdf: string;
  tool_frame: string;
  links: string[];
  ends: string[];
  notes: string[];
}

/**
 * A plan; positions in LPS mm. points, tool and tool_shape are those of the chosen path, `path_id`.
 *
 * tool_shape: bend_deg, shaft_radius_mm where not the shipped ones. told: of undo and redo: what it took back or did
 * again; of a file: its doubts; else ''. entry_side: of the chosen path. registration: id of the one that it uses.
 */
export interface PlanPublic {
  id: string;
  name: string;
  case_id: string;
  created: string;
  modified: string;
  revision: number;
  locked: boolean;
  deleted_at: string | null;
  can_undo: boolean;
  can_redo: boolean;
  unreadable: string;
  schema: string;
  case_hash: string;
  frame: string;
  unit: string;
  told: string;
  notice: string;
  points: PlanPoint[];
  tool: string;
  tool_shape: Record<string, number>;
  entry_side: string;
  targets: PlanPoint[];
  robot: RobotPublic;
  settings: Record<string, number>;
  path_id: string;
  paths: PlanPath[];
  zones: PlanZone[];
  removed_bone: RemovedBone[];
  notes: string;
  second_volume: SecondVolume | null;
  registration: string | null;
}

/**
 * A path point or a target; position in LPS mm.
 *
 * direction: of a path point, from the tool's tip towards the tail of its shaft, LPS, of length 1; None where the
 * plan leaves it open. roll_deg: turn of a bent tool about that direction; None where the plan leaves it open.
 */
export interface PlanPoint {
  id: string;
  label: string;
  position: [number, number, number];
  direction: [number, number, number] | null;
  roll_deg: number | null;
}

/**
 * Base: transform_base_to_patient, 16 numbers row by row, mm.
 *
 * urdf: SHA-256 of a custom URDF; tool_frame: its link that holds the tool. Both null for a shipped robot.
 */
export interface RobotPublic {
  name: string;
  base: number[] | null;
  q_start: number[] | null;
  urdf: string | null;
  tool_frame: string | null;
}

/** One way into the head. Its points lead from outside to inside; tool and tool_shape are as those of a plan. */
export interface PlanPath {
  id: string;
  name: string;
  points: PlanPoint[];
  tool: string;
  tool_shape: Record<string, number>;
  entry_side: "" | "left" | "right" | "midline";
}

/**
 * A protected structure.
 *
 * shape: as in a file of zones, or {'kind': 'capsules', 'points': …, 'radius': …} or {'kind': 'structure',
 * 'structure': id}. margin_mm: how far the tool stays away from a hard one; of a soft one the thickness of the layer
 * around it. A hard one is not entered; a soft one pushes back with stiffness_n_per_mm, and max_depth_mm is how deep
 * it may be entered, None where the plan does not say. visible: whether the views draw it, which no drive asks.
 */
export interface PlanZone {
  id: string;
  name: string;
  shape: Record<string, unknown>;
  margin_mm: number;
  kind: "hard" | "soft";
  stiffness_n_per_mm: number | null;
  max_depth_mm: number | null;
  colour: string;
  visible: boolean;
}

/** A region in which bone will be removed before the tool goes in: a sphere, a capsule or a box. */
export interface RemovedBone {
  id: string;
  name: string;
  shape: Record<string, unknown>;
}

/**
 * A volume that is drawn over the slices of the head.
 *
 * case: id of the case that it belongs to, the plan's own or another one. volume: its name there; None: the widest CT.
 * transform: 16 numbers row by row, from the second volume's LPS to the head's, mm; rigid.
 * opacity: from 0 to 1. window, level: its values from black to white, and the value in their middle.
 * other_head: somebody confirmed that this volume, of another case, shows the same patient (HAZ-38).
 */
export interface SecondVolume {
  case: string;
  volume: string | null;
  transform: number[];
  opacity: number;
  window: number;
  level: number;
  other_head: boolean;
}

/**
 * Alternatives, the best one first, or why there are none.
 *
 * kept_mm: from bone: the margin, and what thinning may have moved the case's surface by. revision: the plan's that
 * was searched in.
 */
export interface SuggestionPublic {
  id: string;
  plan_id: string;
  revision: number;
  entry: [number, number, number];
  target: [number, number, number];
  tool: string;
  kept_mm: number;
  alternatives: AlternativePublic[];
  none: NonePublic | null;
}

/**
 * A path with directions of the shaft, and how the tool was driven along it; lengths in mm.
 *
 * verdict: the level that the plan has when it is led along it, word: of it, short: in a few words, words: the whole,
 * figures: those of the verdict, the one that decides first.
 * nearest: bone or the protected structure that leaves least above its margin, margin_mm; nearest_clearance_mm: to it.
 * least_clearance_mm: to bone. short_of_target_mm: from the path's end to the target. tight: the verdict is;
 * turns: the shaft's direction changes along the path.
 * sideways_mm: how far sideways air leads round the tissue that the tool passes; ways that pierce tissue are never
 * among the alternatives.
 */
export interface AlternativePublic {
  verdict: "fits" | "tight" | "pierces" | "blocked" | "unknown";
  word: string;
  short: string;
  words: string;
  figures: VerdictFigure[];
  nearest: string;
  nearest_clearance_mm: number | null;
  margin_mm: number | null;
  short_of_target_mm: number;
  length_mm: number;
  least_clearance_mm: number;
  tightest_mm: number;
  tight: boolean;
  tissue_mm: number | null;
  tissue_depth_mm: number | null;
  sideways_mm: number | null;
  turns: boolean;
  points: SuggestedPoint[];
}

/**
 * A figure of a verdict, with its level.
 *
 * name: what it is of, such as 'bone'. value: in mm, None if it is not known or has none. whole_mm: of which it is a
 * part, such as the length of the path. digits: of the value. s_mm: arc length of the tip at its place, None without;
 * of an obstacle that stops the tool, where it does.
 * margin_mm: of an obstacle. at_least: it is farther away than clearances are measured, which is the value.
 */
export interface VerdictFigure {
  name: string;
  value: number | null;
  level: "fits" | "tight" | "pierces" | "blocked" | "unknown";
  s_mm: number | null;
  whole_mm: number | null;
  digits: number;
  margin_mm: number | null;
  at_least: boolean;
}

export interface SuggestedPoint {
  position: [number, number, number];
  direction: [number, number, number];
  roll_deg: number | null;
}

/**
 * Why there is no path: where the widest way ends, how far that is from the target, and what was searched.
 *
 * short: the reason in at most nine words.
 */
export interface NonePublic {
  ends_at: [number, number, number];
  gap_mm: number;
  reason: string;
  short: string;
  searched: string;
}

/** Every shipped tool along the path of a plan at a revision. */
export interface ToolTablePublic {
  id: string;
  plan_id: string;
  revision: number;
  tools: ToolPublic[];
}

/**
 * How a tool does along the plan's path; lengths in mm, null where it does not fit at the entry or is not known.
 *
 * verdict: the level of the plan with this tool, word: of it. stop: what stops it and where, in figures, '' if nothing
 * does. parts: its shape, from the tip on; view: where an
 * endoscope looks, a direction in the same plane.
 */
export interface ToolPublic {
  tool: string;
  title: string;
  chosen: boolean;
  as_planned: boolean;
  reaches: boolean;
  reached_mm: number | null;
  length_mm: number;
  least_clearance_mm: number | null;
  tissue_mm: number | null;
  tissue_depth_mm: number | null;
  reason: string;
  stop: string;
  pierces: boolean;
  verdict: "fits" | "tight" | "pierces" | "blocked" | "unknown";
  word: string;
  parts: ToolPartPublic[];
  view: [number, number] | null;
}

/** A part of a tool in the plane of its bend, mm: ends of its axis, along the shaft and across it; the tip is 0. */
export interface ToolPartPublic {
  start: [number, number];
  end: [number, number];
  radius: number;
}

/**
 * A registration. transform: from the image (LPS) to the frame `to`, 16 numbers row by row, mm.
 *
 * made_from: 'none' while there is no transform (what stands there means nothing then), 'pairs', 'given' of one that
 * was read from a file, or 'surface' of one that was refined on touched points. fle_mm: as stated; null where it is
 * estimated, see `fit`. told: of undo and redo what it took back or did again; of a file its doubts; else ''.
 */
export interface RegistrationPublic {
  id: string;
  name: string;
  case_id: string;
  created: string;
  modified: string;
  revision: number;
  locked: boolean;
  deleted_at: string | null;
  can_undo: boolean;
  can_redo: boolean;
  unreadable: string;
  to: "patient" | "base";
  transform: number[];
  pairs: PairPublic[];
  made_from: "none" | "pairs" | "given" | "surface";
  fle_mm: number | null;
  beads: FoundBeadPublic[];
  search: BeadSearchRecord | null;
  surface: TouchedSurface | null;
  pointer: PointerTipPublic | null;
  robot: RobotToTrackerPublic | null;
  said: FileMetadata | null;
  case_hash: string;
  schema: string;
  told: string;
  fit: FitPublic;
  notice: string;
}

/**
 * A point seen twice, mm: in the image (LPS) and as measured; null where that is missing yet.
 *
 * residual_mm: its distance under the transform, not an error of the tool. bead: id of the bead it is the centre of.
 */
export interface PairPublic {
  id: string;
  label: string;
  in_image: [number, number, number] | null;
  measured: [number, number, number] | null;
  enabled: boolean;
  weight: number;
  measured_from: "typed" | "file" | "simulated" | "tracker";
  bead: string;
  residual_mm: number | null;
}

/** A bead that was found; confirmed: a pair was made of it. Position in LPS mm; name: as the case has it. */
export interface FoundBeadPublic {
  id: string;
  name: string;
  position: [number, number, number];
  diameter_mm: number;
  peak_hu: number;
  voxels: number;
  state: "found" | "confirmed" | "rejected";
}

/**
 * What was looked for, and what the search says of its doubts, in sentences.
 *
 * diameter_mm: None for beads of every size. left_out: dense places of a bead's size that are none.
 */
export interface BeadSearchRecord {
  diameter_mm: number | null;
  threshold_hu: number;
  cautions: string[];
  left_out: number;
}

/**
 * Points touched on a structure of the case; in the frame that the registration is to, mm.
 *
 * structure: its id. refinement: None while the registration was not refined on them.
 */
export interface TouchedSurface {
  structure: string;
  points: [number, number, number][];
  measured_from: "file" | "simulated" | "tracker";
  refinement: Refinement | null;
}

/**
 * What a refinement on the touched points did, see `vfix_engine.registration.SurfaceRefinement`; mm.
 *
 * residual_mm: of the points that were kept; it is never the accuracy. kept: how many they were. moved_mm: largest
 * displacement of a point by it. stability: 0 to 1, how much the surface resists the motion it resists least.
 */
export interface Refinement {
  residual_mm: number;
  kept: number;
  moved_mm: number;
  stability: number;
}

/**
 * The tip of a tracked pointer, mm in the frame whose pose the tracker tells, and how it was found.
 *
 * residual_mm: rms distance of the tip from where it stood; tip_error_mm: expected rms error of it; swing_deg: half
 * angle of the cone that the pointer was swung in. cautions: sentences.
 */
export interface PointerTipPublic {
  tip: [number, number, number];
  residual_mm: number;
  tip_error_mm: number;
  swing_deg: number;
  poses: number;
  measured_from: "file" | "simulated" | "tracker";
  cautions: string[];
}

/**
 * Where the tracker stands beside the robot. transform: from the tracker to the base, 16 numbers row by row, mm.
 *
 * covariance: 36 numbers, row by row, of its error (t, ω) in mm and rad. cautions: sentences.
 */
export interface RobotToTrackerPublic {
  transform: number[];
  rotation_residual_deg: number;
  translation_residual_mm: number;
  covariance: number[];
  poses: number;
  measured_from: "file" | "simulated" | "tracker";
  cautions: string[];
}

/**
 * to: what the transform leads to, None where the file leaves that open. simulated: no patient was measured.
 *
 * fre_mm, points, fle_mm: FRE, number of points and error of one, as a `FitReport` has them; None where it says none.
 */
export interface FileMetadata {
  to: "patient" | "base" | null;
  simulated: boolean;
  fre_mm: number | null;
  points: number | null;
  fle_mm: number | null;
}

/**
 * How the registration stands; lengths in mm.
 *
 * fre_mm: root mean square of the residuals of the used pairs, mean_residual_mm: their mean; both tell how well the
 * pairs fit, and neither is the error at a target. fle_mm: rms length of one fiducial's localisation error.
 */
export interface FitPublic {
  state: "waiting" | "degenerate" | "misfit" | "inconsistent" | "fitted" | "given" | "refined";
  words: string;
  used: number;
  fre_mm: number | null;
  mean_residual_mm: number | null;
  wrong: WrongPair | null;
  fle_mm: number | null;
  fle_source: "stated" | "estimated" | "none";
  simulated: boolean;
  cautions: string[];
}

/** The pair that does not fit the others. certainty: 'outlier' where that is clear, else 'suspect'. */
export interface WrongPair {
  pair: string;
  label: string;
  certainty: "outlier" | "suspect";
  words: string;
}

/**
 * The registration that a plan refers to: 'ready', or why it cannot be used, with words; null without any.
 *
 * doubts: of one that is ready, what to know before it is gone by, such as a point that does not fit the others.
 */
export interface PlanRegistrationPublic {
  plan_id: string;
  registration: string | null;
  name: string | null;
  state: "none" | "ready" | "unfinished" | "misfit" | "inconsistent" | "deleted" | "missing" | "other_case" | "unreadable";
  words: string;
  doubts: string[];
  errors: ErrorTablePublic | null;
}

/** The error to be expected at a plan's targets and along its chosen path, and what that means or why it is open. */
export interface ErrorTablePublic {
  fle_mm: number | null;
  fle_source: "stated" | "estimated" | "none";
  targets: ErrorAtTarget[];
  path: ErrorAlongPath | null;
  words: string;
}

/** The expected error at a target of the plan. */
export interface ErrorAtTarget {
  id: string;
  label: string;
  error: ExpectedError;
}

/** At one place, LPS: the rms error, and the radius within which it is in 95 of 100 cases; both in mm. */
export interface ExpectedError {
  position: [number, number, number];
  rms_mm: number;
  within_95_mm: number;
}

/** Along the chosen path, one place for every millimetre and its end. worst_mm: arc length of the worst place. */
export interface ErrorAlongPath {
  s_mm: number[];
  within_95_mm: number[];
  worst_mm: number;
  worst: ExpectedError;
}

/**
 * A traced path that was added to a plan and chosen; lengths in mm.
 *
 * residual_mm, largest_mm: rms and largest distance of the samples from it; the registration's error comes on top.
 * used: places of the samples that were fitted.
 */
export interface TracedPublic {
  path: string;
  name: string;
  points: number;
  length_mm: number;
  residual_mm: number;
  largest_mm: number;
  samples: number;
  used: number;
  traced_from: "file" | "simulated" | "tracker";
  registration: string;
  words: string;
  plan: PlanPublic;
}

/**
 * A run; ticks: number of recorded steps, lost: number of steps that were not recorded.
 *
 * mode: 'freehand', 'hands-on' or 'teleoperated', 'mixed' where it was changed on the way, null for a snake.
 * arm: 'manual', 'guided' or 'certified' of a snake, links: how many it has; both null for a rigid tool.
 * certified: every motion was certified, by the run's world, its rows and the arm.
 * whole is false, and ticks and lost are null, for an interrupted run.
 * pierced: what the tool pierced while it was driven; null where that was not measured.
 * score: null where nobody has asked for it yet, see `/runs/{run_id}/score`, and where there is none.
 * teacher: whether it is marked as the teacher's, of which a plan has one at most. comments: in the order of time.
 */
export interface RunTitle {
  id: string;
  case_id: string | null;
  plan_id: string | null;
  origin: "page" | "command line" | "replay" | "study";
  world: string;
  mode: string | null;
  arm: string | null;
  links: number | null;
  certified: boolean;
  recorded: string;
  size_bytes: number;
  whole: boolean;
  ticks: number | null;
  lost: number | null;
  pierced: PiercedPublic | null;
  score: ShortScore | ShortLumenScore | null;
  files: Record<string, RunFilePublic>;
  teacher: boolean;
  comments: CommentPublic[];
}

/**
 * Whether the tool goes through skin ('room') or a wall between two air spaces of the body ('wall'); lengths in mm.
 *
 * sideways_mm: how far sideways the nearest air leads round the worst tissue that the tool's axis passes, null where
 * that is not known or beyond 15 mm; gives_mm: what tissue gives there. begin, end: of that tissue, in LPS.
 */
export interface PiercedPublic {
  state: "none" | "room" | "wall" | "unknown";
  sideways_mm: number | null;
  gives_mm: number | null;
  begin: [number, number, number] | null;
  end: [number, number, number] | null;
  s_mm: number | null;
  words: string;
}

/**
 * Figures of a run's score; lengths in mm. clearance_mm: least one to any structure, negative in contact.
 *
 * completed: the path was followed to its end. error_mm, error_max_mm: mean and largest tip error in the robot's
 * frame, null where no sample follows a path.
 */
export interface ShortScore {
  certified: boolean;
  completed: boolean;
  time_s: number;
  error_mm: number | null;
  error_max_mm: number | null;
  clearance_mm: number;
  contacts: number;
  held_s: number;
}

/**
 * Figures of the score of a run in a lumen; lengths in mm.
 *
 * completed: as in `LumenScorePublic`. depth_mm: the tip's deepest place, null on a fixed base. deviation_mm: the
 * largest of the link nearest to its bound, null in a run whose rows do not have it. beyond_bound_mm: 0 where no link
 * was beyond it. bound_mm, behind_wall: what stands beside a certificate, as in `LumenScorePublic`. task: its
 * title, null where the run was of none.
 */
export interface ShortLumenScore {
  certified: boolean;
  completed: boolean;
  time_s: number;
  depth_mm: number | null;
  deviation_mm: number | null;
  beyond_bound_mm: number;
  bound_mm: number;
  behind_wall: BehindWallPublic | null;
  held_s: number;
  task: string | null;
}

/**
 * What a certificate of the pathway does not speak of; see docs/metrics.md.
 *
 * share: of the pathway's surface behind the wall, depth_mm: its largest depth there. links_mm: the most that a link
 * was behind the wall, null where the tissue moves.
 */
export interface BehindWallPublic {
  share: number;
  depth_mm: number;
  links_mm: number | null;
}

export interface RunFilePublic {
  sha256: string;
  size_bytes: number;
}

/**
 * A comment. t_s: driven time since the last return to the start; null where the tool was returned after it.
 *
 * step: number of recorded steps before it.
 */
export interface CommentPublic {
  id: string;
  t_s: number | null;
  step: number;
  text: string;
  written: string;
}

/**
 * The score of a run, see docs/metrics.md; lengths in mm, angles in degrees, times in s.
 *
 * completed: the path was followed to its end. reach_mm: least distance at which a clearance is cut.
 * whole: it was recorded to its end; lost: number of steps that were not recorded. led_by: shares of the samples by
 * hand, position of a master, and rate of a device. holds: in the order of time.
 */
export interface ScorePublic {
  world: string;
  mode: string | null;
  certified: boolean;
  whole: boolean;
  lost: number;
  led_by: Record<string, number>;
  completed: boolean;
  samples: number;
  time_s: number;
  approach: ApproachPublic;
  path_error_mm: ErrorsPublic | null;
  path_length_mm: number;
  spectral_arc_length: number | null;
  log_dimensionless_jerk: number | null;
  jerk_filter: string;
  contacts: number;
  max_depth_mm: number;
  contacts_by: ContactsPublic[];
  least_clearance_mm: Record<string, number>;
  reach_mm: number;
  held_s: number;
  held_by: HeldPublic[] | null;
  target_error_mm: ErrorsPublic | null;
  angle_deg: number | null;
  holds: HoldPublic[];
}

/** The samples before the path was followed. */
export interface ApproachPublic {
  time_s: number;
  path_length_mm: number;
}

/** An error in mm, where the robot has the tool and where it truly was. */
export interface ErrorsPublic {
  robot_frame: MeanMaxPublic;
  true_frame: MeanMaxPublic;
}

/** Over the samples. */
export interface MeanMaxPublic {
  mean: number;
  max: number;
}

/** Contacts of one part of the tool with one structure. */
export interface ContactsPublic {
  structure: string;
  part: string;
  count: number;
  max_depth_mm: number;
  time_s: number;
}

/** How long a constraint held the tool. */
export interface HeldPublic {
  kind: string;
  structure: string;
  part: string;
  time_s: number;
}

/**
 * A time in which something held the tool, or touched it in a free hand (kind 'contact'); place in LPS mm.
 *
 * held_s: of duration_s without interruptions, which are up to 0.3 s each.
 */
export interface HoldPublic {
  t_s: number;
  duration_s: number;
  held_s: number;
  kind: string;
  structure: string;
  part: string;
  reason: string;
  place: [number, number, number];
  depth_mm: number;
}

/**
 * The series of a run at 30 Hz at most, n samples of S tool parts, J joints and B structures; LPS mm.
 *
 * t_s (n): driven time. tip (n, 3). segments (n, S, 6): start and end of the axis of each part of the tool, from the
 * tip on; radii_mm (S). side (n, 3): unit vector across the first part, to which a bend or lens points.
 * speed (J, n): of the joints. clearance_mm (B, n): least of each interval, null beyond
 * reach_mm (n). nearest (n): number of the nearest structure, -1 for none within reach. force_n (n): of the hand.
 * error_mm (n): largest of each interval, of the path or of the target, null where there is none.
 * progress_mm (n): along the path. flat_mm (n, 2): the tip in the plane of the path; path_mm (m, 2): the path there,
 * from its entry on; across_mm (2, n): error of the path within that plane and off it; all null without a path.
 * phase (n): numbers of phases. held (n): 1 where the tool was held.
 */
export interface SeriesPublic {
  run: string;
  world: string;
  mode: string | null;
  certified: boolean;
  structures: string[];
  joints: JointPublic[];
  radii_mm: number[];
  phases: string[];
  t_s: number[];
  tip: [number, number, number][];
  segments: number[][][];
  side: [number, number, number][];
  speed: number[][];
  clearance_mm: ((number | null)[])[];
  reach_mm: number[];
  nearest: number[];
  force_n: number[];
  error_mm: (number | null)[];
  progress_mm: (number | null)[];
  flat_mm: [number, number][] | null;
  across_mm: ((number | null)[])[] | null;
  path_mm: [number, number][] | null;
  phase: number[];
  held: number[];
}

/** A joint, and the unit of its speed less the 1/s. */
export interface JointPublic {
  name: string;
  unit: string;
}

/**
 * The score of a run in a lumen, see docs/metrics.md; lengths in mm, times in s, forces in N.
 *
 * completed: its task was done, or without one the tip came to the end of its way. depth_mm: its deepest place;
 * length_mm, reach_mm: of the robot's way, and how far along it this robot can come; share: of length_mm. insertion_s:
 * until the deepest place; withdrawal_s: from then until the tip was out, null where it was not. All from depth_mm on
 * are null on a fixed base, from which nothing is inserted. deviation: of the last links, nearest_mm: of the link
 * nearest to its bound; both null in a run whose rows do not have them. bound_mm: the largest bound of any link.
 * behind_wall: null without the lumen's surface. held_by: the longest first; holds: in the
 * order of time. task: what the run's task adds, null without one.
 */
export interface LumenScorePublic {
  world: string;
  arm: string | null;
  certified: boolean;
  whole: boolean;
  lost: number;
  completed: boolean;
  samples: number;
  time_s: number;
  depth_mm: number | null;
  length_mm: number | null;
  reach_mm: number | null;
  share: number | null;
  insertion_s: number | null;
  withdrawal_s: number | null;
  path_length_mm: number;
  deviation: DeviationPublic | null;
  nearest_mm: MeanMaxPublic | null;
  bound_mm: number;
  beyond_bound_mm: number;
  beyond_bound_s: number;
  behind_wall: BehindWallPublic | null;
  force_n: MeanMaxPublic;
  held_s: number;
  held_by: HeldPublic[];
  task: TaskScorePublic | null;
  holds: HoldPublic[];
}

/**
 * Times in which any of the last links was outside the pathway, in one piece each; longest_s: of the longest.
 *
 * length_mm: the tip's way while the last link is outside; depth_mm: of the deepest link, its mean over time_s.
 */
export interface DeviationPublic {
  episodes: number;
  time_s: number;
  longest_s: number;
  length_mm: number;
  depth_mm: MeanMaxPublic | null;
}

/**
 * What a run of a task is worth.
 *
 * result: the outcome in words, '' where there are none; lacking: what of it is not known and why, '' for nothing.
 * items: by their numbers, none where that is not known.
 */
export interface TaskScorePublic {
  title: string;
  completed: boolean;
  rows: ScoreRowPublic[];
  lacking: string;
  result: string;
  items: TaskItemPublic[];
}

/** A figure of a task as it is shown; value null where it is not defined, worse where it is to stand out. */
export interface ScoreRowPublic {
  name: string;
  value: number | null;
  unit: string;
  digits: number;
  worse: boolean;
}

/**
 * A polyp or label of a task. name: with its number, as in the pictures; done_s: when, null where it was not.
 *
 * share: of a label's arrow that was cut; of a polyp 1 or 0.
 */
export interface TaskItemPublic {
  name: string;
  done_s: number | null;
  share: number;
}

/**
 * The series of a run in a lumen at 20 Hz at most, n samples of a robot of L links; LPS mm.
 *
 * t_s (n): driven time. chain_mm (n, L + 1): the joints from the base on, last the tip; radius_mm: of a link. eye,
 * shaft, side (n): the camera's place, the way it looks, and up in its picture. depth_mm (n): of the tip along the
 * pathway; speed_mm_per_s (n): of the insertion. deviation_mm, bound_mm, link (n): of the link nearest to its bound
 * in the interval, null and 0 while none is inside; beyond_mm (n): beyond it, negative within it. distal_mm (n):
 * largest depth of the last links outside the pathway. bend (n): r. force_n (n): on the hand, guidance_n: the part
 * of it that leads away from the wall; guidance_xy_n, resistance_xy_n (n): that part and the rest at t_s, to the
 * right in the picture and down, null in runs of before they were recorded. held (n): 1 where a command was held;
 * limit, limit_link (n): what held it, a number of limits, and the link whose bound that is, 0 for none.
 */
export interface LumenSeriesPublic {
  run: string;
  world: string;
  arm: string | null;
  certified: boolean;
  limits: string[];
  radius_mm: number;
  t_s: number[];
  chain_mm: [number, number, number][][];
  eye: [number, number, number][];
  shaft: [number, number, number][];
  side: [number, number, number][];
  depth_mm: number[];
  speed_mm_per_s: number[];
  deviation_mm: (number | null)[];
  bound_mm: (number | null)[];
  link: number[];
  beyond_mm: (number | null)[];
  distal_mm: number[];
  bend: number[];
  force_n: number[];
  guidance_n: (number | null)[];
  guidance_xy_n: ([number | null, number | null])[];
  resistance_xy_n: ([number | null, number | null])[];
  held: number[];
  limit: number[];
  limit_link: number[];
}

/** What a file says to set up. case_id, plan_id: of the plan to drive; preset: null for any. */
export interface AssignmentOpened {
  id: string;
  case_id: string;
  plan_id: string;
  mode: "freehand" | "hands-on" | "teleoperated";
  preset: "li2004" | "li2007" | null;
}

/**
 * Results of an assignment, its runs the oldest first. passed: number of runs that passed every criterion.
 *
 * since: runs before it do not count. wanted: how many have to pass; complete: as many have.
 */
export interface ResultsPublic {
  name: string;
  plan_id: string;
  mode: string;
  since: string;
  wanted: number;
  criteria: AskedPublic[];
  runs: RunResultPublic[];
  passed: number;
  complete: boolean;
}

/** A criterion: 'max_' and 'min_' of its name say which limit it is, without either the value is the limit. */
export interface AskedPublic {
  name: string;
  label: string;
  unit: string;
  limit: boolean | number;
}

/** A run of an assignment; trouble: why it cannot be scored, '' where it can. */
export interface RunResultPublic {
  run: string;
  recorded: string;
  criteria: CriterionPublic[];
  passed: boolean;
  trouble: string;
}

/** A criterion of one run; value: null where the run has none. */
export interface CriterionPublic {
  name: string;
  label: string;
  unit: string;
  limit: boolean | number;
  value: boolean | number | null;
  passed: boolean;
}

/** Positions on the canvas as fractions of its size, None for one behind the camera; None without a camera. */
export interface ProjectAnswer {
  places: ([number, number] | null)[] | null;
}

/** What the server has said so far, by section; a section that it has not sent yet is undefined. */
export interface ViewModel {
  approach?: ApproachSection | null;
  camera?: CameraSection;
  case?: CaseSection | null;
  cases?: CasesSection;
  cones?: ConeSection;
  corridor?: EvaluationSection;
  curve?: CurveSection;
  details?: DetailsSection;
  drive_options?: DriveOptionsView;
  drive_task?: DriveTaskView;
  driven?: ItemsSection | null;
  fiducials?: FiducialsSection;
  instruments?: InstrumentsSection;
  jobs?: JobsSection;
  labels?: LabelView[];
  nearness?: NearnessView[];
  openings?: OpeningsSection;
  options?: OptionsSection;
  painted?: LabelsSection;
  paths?: PathsSection | null;
  plan?: PlanSection | null;
  plan_use?: PlanUseSection | null;
  plans?: PlansSection;
  pointer?: TrackerView | null;
  regions?: RegionsSection | null;
  registration?: RegistrationSection | null;
  registrations?: RegistrationsSection;
  rehearsal?: RehearsalSection;
  removed_bone?: RemovedBoneSection | null;
  replayed_task?: ReplayedTaskView | null;
  route?: RouteSection | null;
  route_contours?: ContourList;
  route_path?: RoutePathSection;
  route_views?: WallViewsSection;
  routes?: RouteList;
  scene?: SceneSection;
  scope?: ScopeSection | null;
  second_volume?: SecondVolumeSection | null;
  settings?: SettingsSection;
  shaft?: ShaftSection;
  slices?: SlicesSection | null;
  snake?: SnakeView | null;
  step?: TabSection;
  structures?: StructuresSection;
  study?: LedStudyView | null;
  tool?: ToolSection;
  truth?: TruthSection;
  versions?: VersionsSection | null;
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
  "axes": {
    camera_x?: number;
    camera_y?: number;
    insert?: number;
  };
  "base.free": {
    revision?: number | null;
  };
  "base.keep": {
    revision?: number | null;
  };
  "bead.confirm_all": {
    revision?: number | null;
  };
  "bead.judge": {
    bead_id: string;
    confirmed: boolean | null;
    revision?: number | null;
  };
  "bead.show": {
    bead_id: string;
  };
  "camera.drag": {
    right_mm: number;
    down_mm: number;
    held: boolean;
  };
  "camera.look_round": {};
  "camera.straighten": {};
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
  "clearance.hide": {};
  "clearance.show": {
    s_mm: number;
  };
  "drive": {
    direction: -1 | 0 | 1;
  };
  "drive.arm": {
    arm: "manual" | "guided" | "certified";
  };
  "drive.bends": {
    on: boolean;
  };
  "drive.cut": {
    on: boolean;
  };
  "drive.joint": {
    joint: 1 | 2;
  };
  "drive.links": {
    bounds_mm: [number | null, number | null, number | null, number | null, number | null] | null;
    thresholds_mm: [number, number, number, number, number] | null;
    springs_n_per_mm: [number, number, number, number, number] | null;
  };
  "drive.preset": {
    preset: "kwok2013" | null;
  };
  "drive.task": {
    task: "polyps" | "labels" | null;
    places?: "seed" | "route";
    seed?: number;
    count?: number;
    hold_s?: number;
  };
  "dry_run.again": {};
  "ghost.cancel": {};
  "ghost.confirm": {};
  "grip.release": {};
  "heartbeat": {};
  "insert.to": {
    depth_mm: number;
    held: boolean;
  };
  "item.delete": {
    item_id: string;
    revision?: number | null;
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
    revision?: number | null;
  };
  "item.select": {
    item_id: string;
  };
  "label.change": {
    label_id: string;
    name?: string | null;
    colour?: string | null;
    locked?: boolean | null;
    revision?: number | null;
  };
  "label.delete": {
    label_id: string;
    revision?: number | null;
  };
  "label.new": {
    name: string;
    colour?: string;
    volume?: string | null;
    structure_id?: string | null;
    revision?: number | null;
  };
  "label.redo": {
    label_id: string;
    revision?: number | null;
  };
  "label.restore": {
    label_id: string;
    revision?: number | null;
  };
  "label.stroke": {
    label_id: string;
    radius_mm: number;
    points: [number, number, number][];
    mode?: "paint" | "erase";
    brush?: "disc" | "ball";
    normal?: [number, number, number] | null;
    revision?: number | null;
  };
  "label.undo": {
    label_id: string;
    revision?: number | null;
  };
  "lock": {
    locked: boolean;
    revision?: number | null;
  };
  "master": {
    position: [number, number, number];
    clutch: boolean;
  };
  "opening.use": {
    opening_id: string;
  };
  "order.find": {};
  "order.forget": {};
  "order.take": {
    candidate: number;
  };
  "pair.add": {
    label?: string | null;
    in_image?: [number, number, number] | null;
    measured?: [number, number, number] | null;
    revision?: number | null;
  };
  "pair.change": {
    pair_id: string;
    label?: string | null;
    in_image?: [number, number, number] | null;
    measured?: [number, number, number] | null;
    enabled?: boolean | null;
    weight?: number | null;
    revision?: number | null;
  };
  "pair.clear_measured": {
    revision?: number | null;
  };
  "pair.delete": {
    pair_id: string;
    revision?: number | null;
  };
  "pair.select": {
    pair_id: string;
  };
  "pair.touch": {
    pair_id?: string | null;
    noise_mm?: number;
    seed?: number | null;
    revision?: number | null;
  };
  "path.choose": {
    path_id: string;
    revision?: number | null;
  };
  "path.delete": {
    path_id: string;
    revision?: number | null;
  };
  "path.duplicate": {
    path_id: string;
    revision?: number | null;
  };
  "path.new": {
    revision?: number | null;
  };
  "path.rename": {
    path_id: string;
    name: string;
    revision?: number | null;
  };
  "path.side": {
    path_id: string;
    side: "" | "left" | "right" | "midline";
    revision?: number | null;
  };
  "pick.slice": {
    position: [number, number, number];
  };
  "plan.delete": {
    plan_id: string;
    revision?: number | null;
  };
  "plan.duplicate": {
    plan_id: string;
    revision?: number | null;
  };
  "plan.new": {
    name: string;
    revision?: number | null;
  };
  "plan.notes": {
    notes: string;
    revision?: number | null;
  };
  "plan.open": {
    plan_id: string;
  };
  "plan.rename": {
    plan_id: string;
    name: string;
    revision?: number | null;
  };
  "plan.restore": {
    plan_id: string;
    revision?: number | null;
  };
  "plan.robot": {
    name: string;
    urdf?: string | null;
    tool_frame?: string | null;
    revision?: number | null;
  };
  "plan.settings": {
    settings: Record<string, number>;
    revision?: number | null;
  };
  "plan.tool": {
    name: string;
    bend_deg?: number | null;
    shaft_radius_mm?: number | null;
    revision?: number | null;
  };
  "point.insert_after": {
    item_id: string;
  };
  "project": {
    points: [number, number, number][];
  };
  "rate": {
    axes: [number, number, number, number, number, number];
  };
  "redo": {
    revision?: number | null;
  };
  "region.cancel": {};
  "region.change": {
    region_id: string;
    name?: string | null;
    colour?: string | null;
    visible?: boolean | null;
    soft?: boolean | null;
    margin_mm?: number | null;
    stiffness_n_per_mm?: number | null;
    max_depth_mm?: number | null;
    no_depth?: boolean;
    sizes_mm?: number[] | null;
    place?: [number, number, number] | null;
    turn?: boolean;
    revision?: number | null;
  };
  "region.delete": {
    region_id: string;
    revision?: number | null;
  };
  "region.done": {};
  "region.draw": {
    purpose: "spare" | "remove";
    kind: "sphere" | "capsules" | "capsule" | "box" | "half_space" | "patch";
    sizes_mm?: number[];
    free_side?: "R" | "L" | "A" | "P" | "S" | "I";
  };
  "region.select": {
    region_id: string;
  };
  "region.structure": {
    structure: string;
    revision?: number | null;
  };
  "registration.delete": {
    registration_id: string;
    revision?: number | null;
  };
  "registration.duplicate": {
    registration_id: string;
    revision?: number | null;
  };
  "registration.fit_pairs": {
    made_from?: "pairs";
    revision?: number | null;
  };
  "registration.fle": {
    fle_mm: number | null;
    revision?: number | null;
  };
  "registration.lock": {
    locked: boolean;
    revision?: number | null;
  };
  "registration.new": {
    name?: string | null;
    to?: "patient" | "base" | null;
    copy_of?: string | null;
    revision?: number | null;
  };
  "registration.open": {
    registration_id: string;
  };
  "registration.redo": {
    revision?: number | null;
  };
  "registration.rename": {
    registration_id: string;
    name: string;
    revision?: number | null;
  };
  "registration.restore": {
    registration_id: string;
    revision?: number | null;
  };
  "registration.undo": {
    revision?: number | null;
  };
  "registration.use": {
    used: boolean;
  };
  "rehearsal.approach": {
    point?: string | null;
    at_mm?: number | null;
  };
  "rehearsal.comment": {
    text: string;
  };
  "rehearsal.control": {
    mode: "freehand" | "hands-on" | "teleoperated";
    device?: "position" | "rate";
    preset?: "li2004" | "li2007" | null;
  };
  "rehearsal.end": {};
  "rehearsal.errors": {
    registration?: number | null;
    encoders?: number | null;
    servo?: number | null;
    compliance?: number | null;
    head?: number | null;
    followed?: boolean;
  };
  "rehearsal.let_go": {};
  "rehearsal.mode": {
    mode: "path" | "free" | "inspect";
    target_id?: string | null;
  };
  "rehearsal.options": {
    soft_tissue: boolean;
    remote_centre: boolean;
    speed_limit: boolean;
    centre_point?: string | null;
    centre_mm?: number | null;
    tube_mm?: number | null;
    stop_mm?: number | null;
  };
  "rehearsal.pause": {};
  "rehearsal.reset": {};
  "rehearsal.settings": {
    values: Record<string, number>;
  };
  "rehearsal.start": {};
  "rehearsal.take": {};
  "review.moment": {
    run: string | null;
    t_s?: number;
  };
  "route.bound": {
    bound_mm?: number | null;
    revision?: number | null;
  };
  "route.breathing": {
    breathing_mm: number;
    period_s?: number | null;
    revision?: number | null;
  };
  "route.contour.add": {
    at_mm: number;
    radius_mm?: number | null;
    revision?: number | null;
  };
  "route.contour.choose": {
    at_mm: number | null;
  };
  "route.contour.clear": {
    revision?: number | null;
  };
  "route.contour.move": {
    at_mm: number;
    to: [number, number, number];
    revision?: number | null;
  };
  "route.contour.remove": {
    at_mm: number;
    revision?: number | null;
  };
  "route.contour.resize": {
    at_mm: number;
    radii_mm: number[];
    revision?: number | null;
  };
  "route.delete": {
    route_id: string;
    revision?: number | null;
  };
  "route.end": {
    at: [number, number, number];
    revision?: number | null;
  };
  "route.entry": {
    at: [number, number, number];
    revision?: number | null;
  };
  "route.lock": {
    route_id: string;
    locked: boolean;
    revision?: number | null;
  };
  "route.mark.add": {
    kind: "polyp" | "label";
    at: [number, number, number];
    name?: string | null;
    revision?: number | null;
  };
  "route.mark.move": {
    mark_id: string;
    to: [number, number, number];
    revision?: number | null;
  };
  "route.mark.remove": {
    mark_id: string;
    revision?: number | null;
  };
  "route.mark.rename": {
    mark_id: string;
    name: string;
    revision?: number | null;
  };
  "route.mark.seed": {
    seed: number;
    count?: number;
    revision?: number | null;
  };
  "route.new": {
    name?: string | null;
    revision?: number | null;
  };
  "route.open": {
    route_id: string;
  };
  "route.peristalsis": {
    share: number;
    period_s?: number | null;
    revision?: number | null;
  };
  "route.pick": {
    what: "entry" | "end" | "polyp" | "label" | "move" | "";
    mark_id?: string | null;
  };
  "route.redo": {
    revision?: number | null;
  };
  "route.rename": {
    route_id: string;
    name: string;
    revision?: number | null;
  };
  "route.restore": {
    route_id: string;
    revision?: number | null;
  };
  "route.robot": {
    length_mm: number;
    radius_mm: number;
    links?: number | null;
    revision?: number | null;
  };
  "route.swap": {
    revision?: number | null;
  };
  "route.undo": {
    revision?: number | null;
  };
  "route.viewable": {
    shown?: boolean | null;
  };
  "second_volume.lay": {
    case_id: string;
    transform: number[];
    opacity: number;
    window: number;
    level: number;
    volume?: string | null;
    other_head?: boolean;
    revision?: number | null;
  };
  "second_volume.none": {
    revision?: number | null;
  };
  "shaft.aim": {
    item_id: string;
  };
  "shaft.aim_off": {};
  "shaft.clear": {
    item_id: string;
    revision?: number | null;
  };
  "shaft.roll": {
    item_id: string;
    roll_deg?: number | null;
    revision?: number | null;
  };
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
  "structure.change": {
    structure_id: string;
    name?: string | null;
    colour?: string | null;
  };
  "structure.delete": {
    structure_id: string;
  };
  "structure.show": {
    structure_id?: string | null;
    shown: boolean;
  };
  "study.answer": {
    subject: string;
    ratings: [number, number, number, number, number, number];
    revision?: number | null;
  };
  "study.attach": {
    subject: string;
    run_id?: string;
    revision?: number | null;
  };
  "study.begin": {
    subject: string;
    revision?: number | null;
  };
  "study.consent": {
    subject: string;
    revision?: number | null;
  };
  "study.new": {
    text: string;
    revision?: number | null;
  };
  "study.redo": {
    revision?: number | null;
  };
  "study.repeat": {
    subject: string;
    position: number;
    revision?: number | null;
  };
  "study.show": {
    study_id: string | null;
  };
  "study.skip": {
    subject: string;
    reason: string;
    revision?: number | null;
  };
  "study.subject": {
    subject: string;
    revision?: number | null;
  };
  "study.undo": {
    revision?: number | null;
  };
  "suggestion.hide": {};
  "suggestion.show": {
    suggestion_id: string;
    alternative: number;
  };
  "suggestion.use": {
    suggestion_id: string;
    alternative: number;
  };
  "targets.take": {
    plan_id: string;
    revision?: number | null;
  };
  "tilt": {
    direction: -1 | 0 | 1;
  };
  "twist": {
    direction: -1 | 0 | 1;
  };
  "undo": {
    revision?: number | null;
  };
  "version.compare": {
    version_id: string;
  };
  "version.delete": {
    version_id: string;
    revision?: number | null;
  };
  "version.go_back": {
    version_id: string;
    revision?: number | null;
  };
  "version.rename": {
    version_id: string;
    name: string;
    revision?: number | null;
  };
  "version.restore": {
    version_id: string;
    revision?: number | null;
  };
  "version.save": {
    name: string;
    revision?: number | null;
  };
  "view.camera": {
    view: "anterior" | "left" | "right" | "superior" | "oblique" | "nose";
  };
  "view.labels": {
    by_page: boolean;
  };
  "view.set": {
    opacity?: number | null;
    cut?: "whole" | "left" | "right" | null;
    slices?: "none" | "axial" | "coronal" | "sagittal" | "all" | null;
    skin?: boolean | null;
    skin_opacity?: number | null;
  };
}

/** Answers to commands; any other command is answered null. */
export interface Answers {
  "project": ProjectAnswer;
}

export type CommandType = keyof Commands;
export type Fields<T extends CommandType> = {} extends Commands[T] ? [fields?: Commands[T]] : [fields: Commands[T]];
export type Answer<T extends CommandType> = T extends keyof Answers ? Answers[T] : null;
