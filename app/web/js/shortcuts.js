// Keys and gestures of the page: the sheet of ‘?’ lists them, and the palette shows the keys of what it offers.

/** @typedef {{ keys: string, words: string, does?: string }} Shortcut does: message or action that the palette offers */

/** @type {[string, Shortcut[]][]} groups of keys and what they do */
export const SHORTCUTS = [
  ["Everywhere", [
    { keys: "Ctrl K", words: "Find an action, head, plan or place" },
    { keys: "?", words: "This sheet", does: "help" },
  ]],
  ["Views", [
    { keys: "1", words: "Axial slice alone; again: back", does: "layout.axial" },
    { keys: "2", words: "Coronal slice alone; again: back", does: "layout.coronal" },
    { keys: "3", words: "Sagittal slice alone; again: back", does: "layout.sagittal" },
    { keys: "4", words: "3D alone; again: back", does: "layout.scene" },
    { keys: "5", words: "View across the path alone; again: back", does: "layout.path" },
    { keys: "P", words: "Fold the panel away, and back", does: "panel" },
    { keys: "C", words: "Bring the clicked place to the middle of 3D" },
    { keys: "Drag, wheel", words: "Turn the head about the clicked place; zoom to the pointer" },
    { keys: "Right drag", words: "Move the head sideways" },
  ]],
  ["Slices", [
    { keys: "Wheel, Page ↑ ↓", words: "Move through the head" },
    { keys: "Ctrl + wheel", words: "Zoom to the pointer" },
    { keys: "Right drag", words: "Window (sideways) and level (up and down)" },
    { keys: "Ctrl + drag", words: "Move the picture" },
    { keys: "↑ ↓ ← →", words: "Move the crosshair by 1 mm; Shift 5, Alt 0.1" },
    { keys: "Enter", words: "Add at the crosshair" },
    { keys: "Space", words: "While drawing: a place at the crosshair" },
    { keys: "M", words: "Lift the chosen point: arrows carry, Enter drops, Esc returns it" },
    { keys: "Double-click", words: "This slice alone, and back" },
  ]],
  ["Plan", [
    { keys: "Click", words: "Add what ‘Click’ says" },
    { keys: "Enter, Esc", words: "Add at the ring, or take it back" },
    { keys: "Ctrl Z", words: "Undo", does: "undo" },
    { keys: "Ctrl Shift Z", words: "Redo", does: "redo" },
    { keys: "F2", words: "Rename what is selected", does: "item.rename" },
    { keys: "Del", words: "Delete what is selected", does: "item.delete" },
  ]],
  ["Register", [
    { keys: "Click", words: "In 3D: bring the slices to the clicked place" },
    { keys: "Ctrl Z", words: "Undo of the registration", does: "registration.undo" },
    { keys: "Ctrl Shift Z", words: "Redo of the registration", does: "registration.redo" },
  ]],
  ["Rehearse", [
    { keys: "↑ ↓ or W S", words: "Hold: drive forward or back; in a list W S" },
    { keys: "A D", words: "Hold: twist the tool, in Free and Inspect" },
    { keys: "E", words: "Endoscope large; again: beside 3D", does: "layout.endoscope" },
    { keys: "Drag the sphere", words: "Pull the tool by hand" },
  ]],
  ["Drive", [
    { keys: "W S", words: "Hold: insert, retract" },
    { keys: "↑ ↓ ← →", words: "Hold: turn the camera; to the sides A D too" },
    { keys: "Wheel", words: "In the picture: insert and retract by 5 mm" },
    { keys: "Drag", words: "In the picture: pull what you see; the camera turns" },
    { keys: "Space", words: "Pause the robot where it is" },
    { keys: "E", words: "Endoscope large; again: beside 3D", does: "layout.endoscope" },
    { keys: "X", words: "Hold: the tool of a task cuts" },
    { keys: "J", words: "The other joint of a manual hand" },
  ]],
];

const KEYS = new Map(SHORTCUTS.flatMap(([, rows]) => rows.flatMap(({ keys, does }) => (does ? [[does, keys]] : []))));

/**
 * All of them, those of a tab first.
 * @param {string | undefined} tab its label
 */
export function shortcutsIn(tab) {
  const of = SHORTCUTS.filter(([title]) => title === tab);
  return [...of, ...SHORTCUTS.filter((group) => !of.includes(group))];
}

/**
 * The keys of what the palette offers; '' where it has none.
 * @param {string} does
 */
export function keysOf(does) {
  return KEYS.get(does) ?? "";
}
