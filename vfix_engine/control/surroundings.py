"""Surroundings of the tool: the obstacles it must avoid, and those of their triangles that are near."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Array, Float32Array, Int32Array, IntArray
from ..certificate.constants import StepConstants, pack_candidates, pack_constants
from ..geometry.capsules import Segments
from ..geometry.shapes import shape_table
from ..proximity.candidate_kernels import Candidates
from ..proximity.proximity import Proximity
from ..robots import PlacedRobot, Tool
from ..virtual_fixtures import joint_regularisation
from ..virtual_fixtures.zones import ANATOMY, Zone, bodies, ordered
from .settings import ControlSettings

BUFFER_MM = 0.012  # added to the margin in the rows, so that the certificate rarely refuses a step
BEYOND_MARGIN_MM = 1.0  # pairs are searched at least this far beyond every obstacle's margin
SLACK_MM = 1.0  # distance that the tool may move before the candidate triangles are gathered again


Packed = tuple[Array, IntArray, Float32Array, Array, Int32Array, Int32Array, Array]


class Surroundings:
    """The obstacles around one tool: the anatomy, then surfaces, then shapes (``zones.ordered``).

    ``arrays`` holds the packed constants and candidates, see ``constants.py``.
    The candidates are the triangles near the tool's pose at the time they were gathered.
    It is only a cache: the kernels that use it are exact for every pose, independent of previous queries.
    """

    def __init__(
        self, robot: PlacedRobot, tool: Tool, tree: Proximity, settings: ControlSettings, zones: Sequence[Zone] = ()
    ):
        self.zones = ordered(zones)
        self.structure = ANATOMY
        patches, _ = bodies(self.zones)
        self.surfaces = (tree, *patches)
        self.constants = _world_of(robot, tool, settings, self.zones)
        self.packed = pack_constants(self.constants)
        self.arrays = self._gathered(Segments(self.constants.start, self.constants.end, self.constants.radius), -1.0)

    def gather(self, start: Array, end: Array, further: float = 0.0) -> None:
        """Gather the triangles around a pose of the tool's segments (S, 3), (S, 3), with additional slack."""
        self.arrays = self._gathered(Segments(start, end, self.constants.radius), SLACK_MM + further)

    def _gathered(self, segments: Segments, slack: float) -> Packed:
        """Constants and candidates valid for poses within ``slack`` mm of this one; for none if it is negative."""
        reach = self.constants.threshold + slack if slack >= 0.0 else 0.0
        lists = [surface.candidates(segments, reach).arrays for surface in self.surfaces]
        candidates = lists[0] if len(lists) == 1 else _joined(lists)
        poses = pack_candidates(slack, segments.start, segments.end, candidates.frame)
        return (
            *self.packed,
            candidates.boxes,
            candidates.corners,
            candidates.label,
            candidates.offset.reshape(len(lists), -1),
            poses,
        )


def _world_of(robot: PlacedRobot, tool: Tool, settings: ControlSettings, zones: Sequence[Zone] = ()) -> StepConstants:
    """Constants of one tool among an anatomy and ``zones``, which are ordered."""
    margin = np.array([settings.kept_mm, *(zone.margin_mm + settings.deflection_mm for zone in zones)])
    model, chain = robot.robot, robot.chain
    rows = joint_regularisation(model).matrix
    ends = tool.segments(np.eye(3), np.zeros(3))
    farthest = max(np.linalg.norm(ends.start, axis=1).max(), np.linalg.norm(ends.end, axis=1).max())
    return StepConstants(
        chain=chain,
        links=_fixed(np.linalg.norm(chain.offset, axis=1)),
        reach=float(np.linalg.norm(chain.tip_offset) + farthest),
        start=ends.start,
        end=ends.end,
        radius=ends.radius,
        lower=_fixed(model.lower),
        upper=_fixed(model.upper),
        speed=_fixed(model.speed),
        acceleration=_fixed(model.acceleration),
        shapes=shape_table(bodies(zones)[1]),
        margin=_fixed(margin),
        buffered_margin=_fixed(margin + BUFFER_MM),
        threshold=float(max(settings.reach_mm, margin.max() + BEYOND_MARGIN_MM)),
        change=float(settings.approach_deceleration_mm_per_s2 * settings.dt_s**2),
        dt=float(settings.dt_s),
        regularisation=rows.T @ (1.0 * rows),
    )


def _joined(lists: Sequence[Candidates]) -> Candidates:
    """Concatenate the triangles of several surfaces, and their frames (4 M,) and offsets (M (S + 1),)."""
    nodes = np.cumsum([0, *(int(each.offset[-1]) for each in lists)])
    return Candidates(
        np.concatenate([each.boxes for each in lists]),
        np.concatenate([each.corners for each in lists]),
        np.concatenate([each.label for each in lists]),
        np.concatenate([each.frame for each in lists]),
        np.concatenate([each.offset + first for each, first in zip(lists, nodes, strict=False)]).astype(np.int32),
    )


def _fixed(values: Array) -> Array:
    """Return a read-only contiguous copy."""
    copy = np.array(values, dtype=np.float64, order="C")
    copy.setflags(write=False)
    return copy
