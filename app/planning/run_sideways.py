"""How far air leads round the tissue that a driven tool passes: measured for each step of a run once it is written.

A drive's process has no CT, and a step no time for it; the rows of the run say where the tool was.
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
    """:func:`add_sideways` with these ways; None where there are none, of a head without a CT."""
    return None if ways is None else partial(add_sideways, ways=ways)


def add_sideways(folder: Path, ways: Ways) -> dict[str, Any] | None:
    """Write `sideways.f64` into a run's folder; returns what the tool pierced, as `PiercedReport` has it.

    None, and no file, of a run whose rows hold no rigid tool, or that has none. Raises InputError for one that cannot
    be read.
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
    sideways.astype("<f8").tofile(folder / SIDEWAYS)
    return asdict(PiercedReport.of(pierced))
