"""The progress of study II while it is driven: from every row that the control process writes, as of its run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...arrays import Array, BoolArray
from ...robots.snake import SnakeModel
from ...runtime.command import BUTTON_CUT, COMMAND_SIZE, command_from_row
from ...runtime.system import Column
from ..polyps.series import cameras
from .labels import Label
from .task import DiathermySample, DiathermyState, Sight, first_state, stepped

WAY_MM = 1.0  # between two places of the tip that are kept


class CutWay(NamedTuple):
    """The way of the last link's far end so far: (n, 3) LPS mm, and (n,) where the tool was cutting (fig. 10d)."""

    places: Array
    red: BoolArray


class LabelMoment:
    """Study II at one moment, as it is shown: the labels, and their state then."""

    def __init__(
        self, labels: tuple[Label, ...], state: DiathermyState, way: list[tuple[float, float, float, bool]]
    ) -> None:
        """way: of the drive, which may grow: what is there now belongs to this moment."""
        self.labels, self.state = labels, state
        self._way, self._count = way, len(way)

    @property
    def way(self) -> CutWay:
        """Places at least ``WAY_MM`` apart, and where cutting began or ended."""
        kept = np.array(self._way[: self._count], dtype=np.float64).reshape(-1, 4)
        return CutWay(kept[:, :3], kept[:, 3] > 0.0)


class LiveLabels:
    """Steps the task with the rows of a drive; after the same rows its state equals that of ``measured``.

    moment: after the rows so far. The first row is the first one of the task.

    Args:
        columns: of the lines that are read, as ``RowReader.columns``. sight: in the cavity of the drive.
    """

    def __init__(self, labels: Sequence[Label], snake: SnakeModel, columns: Sequence[Column], sight: Sight) -> None:
        self._labels, self._snake, self._sight = tuple(labels), snake, sight
        self._at = {column.name: place for place, column in enumerate(columns[COMMAND_SIZE:])}
        self._way: list[tuple[float, float, float, bool]] = []  # only ever added to, as moments share it
        self.moment = LabelMoment(self._labels, first_state(self._labels), self._way)

    @property
    def state(self) -> DiathermyState:
        """After the rows so far."""
        return self.moment.state

    @property
    def completed(self) -> bool:
        """Whether all labels are traced."""
        return self.state.done

    @property
    def way(self) -> CutWay:
        """As of ``moment``."""
        return self.moment.way

    def read(self, lines: Array) -> DiathermyState:
        """Step with lines (n, w), each a command and a row."""
        rows = np.ascontiguousarray(lines[:, COMMAND_SIZE:])
        at, state = self._at, self.state
        if state.done or not len(rows):
            return state
        times = rows[:, at["t"]].tolist()
        tips = rows[:, [at[f"tip_{axis}"] for axis in "xyz"]]
        for line, camera, t, tip in zip(lines, cameras(self._snake, rows, at), times, tips, strict=True):
            pressed = bool(command_from_row(line[:COMMAND_SIZE]).buttons & BUTTON_CUT)
            state = stepped(self._labels, state, DiathermySample(t, camera, pressed), self._sight)
            self._keep(tip, state.cutting)
            if state.done:
                break
        self.moment = LabelMoment(self._labels, state, self._way)
        return state

    def _keep(self, tip: Array, red: bool) -> None:
        x, y, z = (float(value) for value in tip)
        if self._way:
            *before, was_red = self._way[-1]
            if red == was_red and float(np.linalg.norm(tip - np.array(before))) < WAY_MM:
                return
        self._way.append((x, y, z, red))
