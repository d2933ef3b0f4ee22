"""Clearance of a tool's poses to bone and to soft tissue, from distance fields."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..errors import InputError
from ..proximity.fields.distance_field import DistanceField, FieldGrid
from ..robots import Tool
from .room_kernels import BONE, DEEPEST, DEPTH, TOUCHED, UNKNOWN, pose_figures

SAMPLE_MM = 0.5  # sample spacing along the tool


class Passage(NamedTuple):
    """Contact of a tool with soft tissue over a series of poses.

    tissue_mm: largest length of the tool whose surface is in soft tissue, over the poses; tissue_depth_mm: largest
        depth;
    mean_depth: mean over the poses of the integral of the depth along the tool, in mm². None for a head without a CT.
    """

    tissue_mm: float | None
    tissue_depth_mm: float | None
    mean_depth: float


@dataclass(frozen=True, eq=False)
class Figures:
    """Measures of n poses, each (n,): see ``room_kernels.pose_figures``."""

    bone: Array
    touched: Array
    deepest: Array
    depth: Array
    unknown: Array


class Room:
    """Bone and soft tissue as distance fields.

    Args:
        bone, tissue: signed distances in mm, positive outside; tissue is skin, mucosa and bone. None without a CT:
            then only bone is considered.

    Raises:
        InputError: the two fields are not on the same grids.
    """

    def __init__(self, bone: DistanceField, tissue: DistanceField | None) -> None:
        self.bone, self.tissue = bone, tissue
        second = bone if tissue is None else tissue
        if [_place(g) for g in bone.grids] != [_place(g) for g in second.grids]:
            raise InputError("the fields of bone and of soft tissue must be on the same grids")
        pairs = list(zip(bone.grids, second.grids, strict=True))
        self._fine, self._whole = (_arrays(*pairs[i]) for i in (0, -1))

    def figures(self, tool: Tool, rotations: Array, positions: Array, step: float = SAMPLE_MM) -> Figures:
        """Measure poses: rotations (n, 3, 3) and positions (n, 3) of the tip. Tissue is 0 without a CT."""
        segments = tool.segments(np.eye(3), np.zeros(3))
        ends = np.ascontiguousarray(np.stack([segments.end, segments.start], axis=1))
        turns, places = (np.ascontiguousarray(a, dtype=np.float64) for a in (rotations, positions))
        found = pose_figures(self._fine, self._whole, turns, places, ends, np.array(tool.radius), step)
        tissue = np.zeros_like(found) if self.tissue is None else found
        return Figures(
            found[:, BONE], tissue[:, TOUCHED], tissue[:, DEEPEST], tissue[:, DEPTH], tissue[:, UNKNOWN]
        )  # fmt: skip

    def passed(self, tool: Tool, rotations: Array, positions: Array) -> Passage:
        """Measure the tool's contact with soft tissue over a series of poses."""
        if self.tissue is None:
            return Passage(None, None, 0.0)
        found = self.figures(tool, rotations, positions)
        return Passage(float(found.touched.max()), float(found.deepest.max()), float(found.depth.mean()))


def _place(grid: FieldGrid) -> tuple[tuple[int, ...], list[float], float]:
    return grid.values.shape, grid.origin.tolist(), grid.step_mm


def _arrays(bone: FieldGrid, tissue: FieldGrid) -> tuple[NDArray[np.float32], NDArray[np.float32], Array, float]:
    return bone.values, tissue.values, bone.origin, float(bone.step_mm)
