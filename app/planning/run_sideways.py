"""How far sideways air leads around the tissue that a driven tool passes, measured for each step of a recorded run.

It is measured after the drive, since the control process has no CT and a step no time for it; the rows of the run
contain the poses of the tool.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from app.planning.piercing import PiercedReport, pierced_by_steps
from vfix_engine.anatomy.piercing import Ways
from vfix_engine.errors import InputError
from vfix_engine.runtime.run import MANIFEST, SIDEWAYS, TICKS


def measure_sideways(ways: Ways | None) -> Callable[[Path], dict[str, Any] | None] | None:
    """Return :func:`add_sideways` with these ways; None without them, for a head without a CT."""
    return None if ways is None else partial(add_sideways, ways=ways)


def add_sideways(folder: Path, ways: Ways) -> dict[str, Any] | None:
    """Write `sideways.f64` into a run's folder and return what the tool pierced, as the values of `PiercedReport`.

    Returns None and writes no file for a run without rows of a rigid tool. Raises InputError for a run that cannot be
    read.
    """
    try:
        names = [name for name, _ in json.loads((folder / MANIFEST).read_text(encoding="utf-8"))["columns"]]
        data = np.fromfile(folder / TICKS, dtype="<f8")
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"the folder holds no run that can be read: {type(error).__name__}") from None
    parts = sum(name.startswith("s") and name.endswith("_ax") for name in names)
    count = len(data) // max(len(names), 1)
    if not parts or not count or "path_s" not in names:
        return None
    ticks = data[: count * len(names)].reshape(count, len(names))

    def ends(which: str) -> Any:
        columns = [names.index(f"s{part}_{which}{axis}") for part in range(parts) for axis in "xyz"]
        return ticks[:, columns].reshape(count, parts, 3)

    pierced, sideways = pierced_by_steps(ways, ticks[:, names.index("path_s")], ends("a"), ends("b"))
    try:
        sideways.astype("<f8").tofile(folder / SIDEWAYS)
    except OSError:
        (folder / SIDEWAYS).unlink(missing_ok=True)  # a part of it would be stored as the whole
        raise
    return asdict(PiercedReport.of(pierced))
