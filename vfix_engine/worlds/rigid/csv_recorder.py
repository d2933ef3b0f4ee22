"""Recorder of every step to a CSV file."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from ...anatomy.piercing import SidewaysColumn, Ways
from .snapshot import RigidSnapshot

NOTICE_COLUMN = "not_for_clinical_use"
ABOUT = {
    "notice": "Not for clinical use",
    "frame": "LPS",
    "units": {"t": "s", "q": "mm or rad by joint", "tip": "mm", "segments": "mm", "sideways_mm": "mm"},
}


class CsvRecorder:
    """Columns: t [s], q0 … [mm, rad], tip_x/y/z, and for each tool segment i its axis ends and radius in LPS mm; then
    sideways_mm, how far air leads round the tissue that the tool passes (inf beyond 15 mm, nan where not known); last a
    column of ones whose name is the notice, so that copies of the table contain it.

    ways: finds detours round tissue; None if not available.

    The file gets its name only when the recording is closed, so that an incomplete one is never mistaken for a complete
    one.
    FILE.about.json beside it has frame, units and the notice.
    """

    def __init__(self, path: Path, ways: Ways | None = None):
        self._path = path
        self._part = path.with_name(path.name + ".part")
        self._file = self._part.open("w", newline="", encoding="utf-8")
        self._writer = csv.writer(self._file)
        self._started = False
        self._sideways = None if ways is None else SidewaysColumn(ways)

    def add(self, snapshot: RigidSnapshot) -> None:
        if not self._started:
            self._writer.writerow(self._header(len(snapshot.q), len(snapshot.radius)))
            self._started = True
        segments = np.column_stack([snapshot.segments_start, snapshot.segments_end, snapshot.radius])
        around = np.nan
        if self._sideways is not None:
            around = self._sideways.add(snapshot.segments_start, snapshot.segments_end)
        values = np.concatenate([[snapshot.t], snapshot.q, snapshot.tip, segments.ravel(), [around]])
        self._writer.writerow([*(repr(float(v)) for v in values), 1])

    @staticmethod
    def _header(joints: int, segments: int) -> list[str]:
        columns = ["t", *(f"q{i}" for i in range(joints)), "tip_x", "tip_y", "tip_z"]
        for i in range(segments):
            columns += [f"s{i}_{end}{axis}" for end in "ab" for axis in "xyz"] + [f"s{i}_r"]
        return [*columns, "sideways_mm", NOTICE_COLUMN]

    def close(self) -> None:
        self._file.close()
        self._path.with_name(self._path.name + ".about.json").write_text(json.dumps(ABOUT), encoding="utf-8")
        self._part.replace(self._path)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()
        else:
            self._file.close()
            self._part.unlink()
