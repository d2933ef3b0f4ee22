"""The row of the rigid tool: the recorded numbers of every step in one array."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ...arrays import Array
from ...runtime.system import Column
from ...virtual_fixtures.state import Layout
from ...virtual_fixtures.tip_limit import tip_limits
from .scene import Scene
from .state import RehearsalState

OUTCOMES = ("idle", "moved", "shrunk", "held")  # ``outcome`` is the index in this tuple
PHASES = ("free", "approach", "follow", "done", "inspect_approach", "inspect_hold")  # so is ``phase``
CODES = {"phase": PHASES, "outcome": OUTCOMES}  # by column: what its numbers are called
_PHASE = {name: float(place) for place, name in enumerate(PHASES)}
_OUTCOME = {name: float(place) for place, name in enumerate(OUTCOMES)}
_FIELDS = ("q", "velocity", "position", "rotation", "start", "end", "distance")  # of a measured state
_XYZ = ("x", "y", "z")


class RowWriter:
    """Names, units and the writing of a row for one scene.

    q, velocity: joints; tip and rotation (row by row): of the tool's tip; s…: ends of the tool's axis segments;
    d…: distance of every body to every segment; room…: of the tip in every tube and envelope of the scene, less what
    a hand may deflect it by; force,
    torque: effective ones of the hand; share: fraction of the desired motion that was made; emergency: 1 where an
    acceleration limit was exceeded.
    """

    def __init__(self, scene: Scene):
        joints, parts, bodies = scene.robot.joints, len(scene.tool.radius), 1 + len(scene.zones)
        units = [joint.unit for joint in joints]
        columns = [Column("t", "s")]
        columns += [Column(f"q{i}", unit) for i, unit in enumerate(units)]
        columns += [Column(f"v{i}", f"{unit}/s") for i, unit in enumerate(units)]
        columns += [Column(f"tip_{axis}", "mm") for axis in _XYZ]
        columns += [Column(f"r{i}{j}", "") for i in range(3) for j in range(3)]
        columns += [Column(f"s{i}_a{axis}", "mm") for i in range(parts) for axis in _XYZ]
        columns += [Column(f"s{i}_b{axis}", "mm") for i in range(parts) for axis in _XYZ]
        columns += [Column(f"d{body}_{i}", "mm") for body in range(bodies) for i in range(parts)]
        self._limits = tip_limits(scene.fixtures)
        columns += [Column(f"room{i}", "mm") for i in range(len(self._limits))]
        columns += [Column(f"force_{axis}", "N") for axis in _XYZ] + [Column(f"torque_{axis}", "N·mm") for axis in _XYZ]
        columns += [Column("path_s", "mm"), Column("phase", ""), Column("target", "")]
        columns += [Column("outcome", ""), Column("share", ""), Column("emergency", ""), Column("rows", "")]
        self.layout = tuple(columns)
        sizes = (len(joints), len(joints), 3, 9, 3 * parts, 3 * parts, bodies * parts, 3, 3)
        ends = np.cumsum([1, *sizes]).tolist()
        self._parts = [slice(a, b) for a, b in pairwise(ends)]
        self._rooms = ends[7]
        self._copies: tuple[Layout, tuple[tuple[slice, slice], ...]] | None = None

    def write(self, state: RehearsalState, out: Array) -> None:
        """The numbers of a state into ``out``."""
        tool, last = state.tool, state.last
        numbers, layout = tool.numbers, tool.layout
        if self._copies is None or self._copies[0] is not layout:
            self._copies = layout, self._copies_from(layout)
        out[0] = state.t
        for into, where in self._copies[1]:
            out[into] = numbers[where]
        for i, limit in enumerate(self._limits):
            out[self._rooms + i] = limit.room(tool) - state.settings.deflection_mm
        path_s = -1.0 if state.nearest is None else state.nearest.s
        phase, target = _PHASE[state.phase], state.target
        if last is None:
            out[-13:-7] = 0.0
            out[-7:] = path_s, phase, target, 0.0, 0.0, 0.0, 0.0
            return
        report = last.report
        out[-13:-10], out[-10:-7] = last.force, last.torque
        out[-7:] = (
            path_s, phase, target, _OUTCOME[report.outcome], report.share, report.emergency, report.rows,
        )  # fmt: skip

    def _copies_from(self, layout: Layout) -> tuple[tuple[slice, slice], ...]:
        """Mapping of parts of a row to parts of a measured state's numbers; neighbours are copied together."""
        copies: list[tuple[slice, slice]] = []
        for into, name in zip(self._parts, _FIELDS, strict=False):
            first, last, _ = layout.places[name]
            if copies and copies[-1][0].stop == into.start and copies[-1][1].stop == first:
                into, first = slice(copies[-1][0].start, into.stop), copies.pop()[1].start
            copies.append((into, slice(first, last)))
        return tuple(copies)
