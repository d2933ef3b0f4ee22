"""The samples of a run of a rigid body's world, as arrays with names."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array, BoolArray, IndexArray
from ...control import ControlSettings
from ...errors import InputError
from ...geometry.path import SplinePath
from ...robots import Tool
from ...runtime.control_mode import FREEHAND
from ...runtime.requests import Reset
from ...runtime.run import Run
from ...runtime.system import SystemSpec
from ...virtual_fixtures.zones import ANATOMY, ordered
from ...worlds.rigid.recorded_settings import driven_s, settings_of
from ...worlds.rigid.row import OUTCOMES, PHASES

_AXES = "xyz"
_ON_PATH = [PHASES.index(name) for name in ("approach", "follow", "done")]
_ON_TARGET = [PHASES.index(name) for name in ("inspect_approach", "inspect_hold")]


@dataclass(frozen=True, eq=False)
class Samples:
    """The samples after the last return to the start that is followed by any; patient frame, mm.

    first: index of the first one in the run; period_s: (n,) control period of each.
    tip, rotation: (n, 3) and (n, 3, 3), pose of the tip. distance: (n, B, S) from each structure to each part of the
        tool, negative where they overlap, cut at the boundary threshold.
    phase, outcome, target: (n,) as in the row; path_s: (n,) arc length nearest to the tip, -1 without a path.
    deflection: (n, 3) of the tip under the hand, which the controller has compensated; 0 without.
    view_distance_mm: (n,) of the point that inspection holds on its target. settings: in force at each.
    force: (n, 3) in N, of the hand, after the cap.
    structures: B ids, the anatomy first; tool, path, targets: of the spec.
    """

    first: int
    period_s: Array
    tip: Array
    rotation: Array
    distance: Array
    phase: IndexArray
    outcome: IndexArray
    target: IndexArray
    path_s: Array
    deflection: Array
    view_distance_mm: Array
    settings: tuple[ControlSettings, ...]
    force: Array
    structures: tuple[str, ...]
    tool: Tool
    path: SplinePath | None
    targets: Array

    @property
    def t(self) -> Array:
        """(n,) driven time at the end of each control period in s."""
        return driven_s(self.period_s)

    @property
    def believed(self) -> Array:
        """(n, 3) tips as the controller believes them: where a compensated deflection has brought them."""
        return self.tip + self.deflection

    @property
    def view_point(self) -> Array:
        """(n, 3) the point that inspection holds on its target, as the controller believes it to be."""
        return self.view_point_of(self.believed, self.rotation)

    def view_point_of(self, tip: Array, rotation: Array) -> Array:
        """The same of a tool with other tips (n, 3) and rotations (n, 3, 3)."""
        direction = np.stack([self.tool.direction(one) for one in rotation])
        points: Array = tip + self.view_distance_mm[:, None] * direction
        return points


def samples_of(run: Run, spec: SystemSpec) -> Samples:
    """Read the samples of a run.

    spec: that it was driven with, such as ``worlds.registry.spec_of(run)``.

    Raises:
        InputError: the run has no samples, is of a world without a rigid tool, or has settings out of their ranges,
            values that are not numbers, or lost steps beside events that they leave without a place.
    """
    scene, control = getattr(spec, "scene", None), getattr(spec, "control", None)
    if scene is None or control is None or "r00" not in [column.name for column in run.columns]:
        raise InputError(f"a run of the world '{run.manifest['world']}' has no rigid tool that could be scored")
    starts = [event.at for event in run.events if isinstance(event.content, Reset) and event.at < len(run.ticks)]
    first = max(starts, default=0)
    rows = run.rows[first:]
    if not len(rows):
        raise InputError("the run has no samples")
    at = {column.name: place for place, column in enumerate(run.columns)}
    tool = scene.tool_itself()
    _check_rows(rows, at, len(scene.targets))
    structures = (ANATOMY, *(zone.name for zone in ordered(scene.zones)))
    distance = [[rows[:, at[f"d{b}_{s}"]] for s in range(len(tool.radius))] for b in range(len(structures))]
    settings = settings_of(run, control)[first:]
    force, phase = rows[:, [at[f"force_{axis}"] for axis in _AXES]], rows[:, at["phase"]].astype(np.int64)
    return Samples(
        first=first,
        period_s=np.array([one.dt_s for one in settings]),
        tip=rows[:, [at[f"tip_{axis}"] for axis in _AXES]],
        rotation=rows[:, [at[f"r{i}{j}"] for i in range(3) for j in range(3)]].reshape(-1, 3, 3),
        distance=np.moveaxis(np.array(distance), -1, 0),
        phase=phase,
        outcome=rows[:, at["outcome"]].astype(np.int64),
        target=rows[:, at["target"]].astype(np.int64),
        path_s=rows[:, at["path_s"]],
        deflection=_deflection(run, settings, force, phase, scene.bent_inspection),
        view_distance_mm=np.array([one.view_distance_mm for one in settings]),
        settings=tuple(settings),
        force=force,
        structures=structures,
        tool=tool,
        path=None if scene.path_points is None else SplinePath(scene.path_points),
        targets=np.asarray(scene.targets, dtype=np.float64),
    )


def _check_rows(rows: Array, at: dict[str, int], targets: int) -> None:
    """Refuse what no comparison would tell: NaN is below no bound. Raises InputError."""
    finite = np.isfinite(rows)
    if not finite.all():
        row, column = (int(value[0]) for value in np.nonzero(~finite))
        name = next(name for name, place in at.items() if place == column)
        raise InputError(f"the run is damaged: '{name}' is {rows[row, column]} in its sample {row + 1}")
    for name, count in (("phase", len(PHASES)), ("outcome", len(OUTCOMES)), ("target", max(targets, 1))):
        numbers = rows[:, at[name]]
        if not ((numbers >= 0) & (numbers < count) & (numbers == np.floor(numbers))).all():
            raise InputError(f"the run is damaged: '{name}' is not a number from 0 to {count - 1} in every sample")


def _deflection(
    run: Run, settings: list[ControlSettings], force: Array, phase: IndexArray, bent_inspection: bool
) -> Array:
    """(n, 3) deflection that the controller compensated, under a hand on the robot.

    bent_inspection: on a target too, see ``Scene``; otherwise on the path's task only.
    """
    first = len(run.ticks) - len(force)
    compliance = np.array([one.compliance_mm_per_n for one in settings])
    under = hand_on_robot(run)[first:] & np.isin(phase, _ON_PATH + _ON_TARGET if bent_inspection else _ON_PATH)
    found: Array = (compliance * under)[:, None] * force
    return found


def hand_on_robot(run: Run) -> BoolArray:
    """(n,) whether the force of each step is that of a hand on the robot: not of a device, nor of a free hand."""
    if run.manifest["world"] == FREEHAND:
        return np.zeros(len(run.ticks), dtype=bool)
    device: Array = run.ticks[:, [name for name, _ in run.manifest["columns"]].index("master")]
    return np.asarray(device == 0.0)
