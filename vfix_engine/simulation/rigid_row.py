"""The row of the rigid tool: what is recorded of every step, as numbers of one array."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..runtime.system import Column
from .scene import Scene

if TYPE_CHECKING:
    from .rigid import RehearsalState

Array = NDArray[np.float64]

OUTCOMES = ("idle", "moved", "shrunk", "held")  # ``outcome`` is the place in here
PHASES = ("free", "approach", "follow", "done", "inspect_approach", "inspect_hold")  # as is ``phase``
_XYZ = ("x", "y", "z")


class RowWriter:
    """Names, units and the writing of a row for one scene.

    q, velocity: joints; tip and rotation (row by row): of the tool's tip; s…: ends of the tool's axis segments;
    d…: distance of every body to every segment; force, torque: of the hand as they counted; share: part of the wanted
    motion that was made; emergency: 1 where an acceleration limit was exceeded.
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
        columns += [Column(f"force_{axis}", "N") for axis in _XYZ] + [Column(f"torque_{axis}", "N·mm") for axis in _XYZ]
        columns += [Column("path_s", "mm"), Column("phase", ""), Column("target", "")]
        columns += [Column("outcome", ""), Column("share", ""), Column("emergency", ""), Column("rows", "")]
        self.layout = tuple(columns)
        sizes = (len(joints), len(joints), 3, 9, 3 * parts, 3 * parts, bodies * parts, 3, 3)
        ends = np.cumsum([1, *sizes]).tolist()
        self._parts = [slice(a, b) for a, b in pairwise(ends)]

    def write(self, state: RehearsalState, out: Array) -> None:
        """The numbers of a state into ``out``."""
        tool, last = state.tool, state.last
        q, velocity, position, rotation, start, end, distance, force, torque = self._parts
        tip, segments = tool.tip, tool.segments
        out[0] = state.steps * state.settings.dt_s
        out[q], out[velocity] = tool.q, tool.velocity
        out[position], out[rotation] = tip.position, tip.rotation.ravel()
        out[start], out[end] = segments.start.ravel(), segments.end.ravel()
        out[distance] = tool.distance.ravel()
        path_s = -1.0 if state.nearest is None else state.nearest.s
        phase = PHASES.index(state.phase)
        if last is None:
            out[force.start :] = 0.0
            out[-7:] = path_s, phase, state.target, 0, 0, 0, 0
            return
        report = last.report
        out[force], out[torque] = last.force, last.torque
        out[-7:] = (
            path_s, phase, state.target, OUTCOMES.index(report.outcome), report.share, report.emergency, report.rows,
        )  # fmt: skip
