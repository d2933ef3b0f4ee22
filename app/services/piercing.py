"""Whether a planned tool pierces skin or a wall between two airs, in words; the engine measures it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from vfix_engine.geometry.path import SplinePath
from vfix_engine.imaging.piercing import Piercing, Run, Ways, piercing_of
from vfix_engine.progress import ProgressCallback
from vfix_engine.simulation.dry_run import STATION_MM, DryRun

Floats = npt.NDArray[np.float64]
PiercedState = Literal["none", "room", "wall", "unknown"]

_MIDDLE_MM = 3.0  # from the entry's side: nearer to the scan's middle than that is told as the middle
_LEVEL_MM = 0.5  # a smaller height is told as level with the nostril


@dataclass(frozen=True, eq=False)
class Pierced:
    """What of the body a tool pierces; lengths in mm, places (3,) in LPS.

    state: 'room' that it pierces tissue with the room's air at one end, 'wall' one between two airs of the body;
    'unknown' that the scan does not tell. sideways_mm: how far round the worst tissue the nearest air leads, inf beyond
    15 mm, and gives_mm what tissue gives there; None where the tool passes none, or nothing is known. begin, end: of
    that tissue on the tool's axis, from outside to inside; s_mm: of the tip there. s, along_mm (m,): the same along the
    path, NaN where it is not known.
    """

    state: PiercedState
    sideways_mm: float | None = None
    gives_mm: float | None = None
    begin: tuple[float, float, float] | None = None
    end: tuple[float, float, float] | None = None
    s_mm: float | None = None
    where: str = ""
    s: Floats | None = None
    along_mm: Floats | None = None

    @property
    def words(self) -> str:
        """A sentence, '' where nothing is pierced."""
        if self.state == "unknown":
            return "Whether the tool pierces tissue is not known: no scan shows it from the room's air on."
        if self.state == "none" or self.sideways_mm is None:
            return ""
        what = "skin" if self.state == "room" else "a wall between two airs of the body"
        return f"Pierces {what} {self.where}: {way_words(self.sideways_mm)}, where tissue gives {self.gives_mm:.0f} mm."


NOT_KNOWN = Pierced("unknown")


def way_words(sideways_mm: float) -> str:
    """How far air leads round tissue, within a sentence."""
    if not np.isfinite(sideways_mm):
        return "no air leads round it within 15 mm"
    return f"air leads round it {sideways_mm:.1f} mm beside the tool"


def pierced_along(ways: Ways | None, run: DryRun, path: SplinePath, go_on: ProgressCallback) -> Pierced:
    """What a dry run pierces. ways: of its head, None without a CT or where none of it shows the path."""
    if ways is None:
        return NOT_KNOWN
    rows = np.union1d(np.unique(np.rint(run.s / STATION_MM), return_index=True)[1], [len(run.s) - 1])
    found = piercing_of(
        ways, run.segments_start, run.segments_end, rows.tolist(), lambda: go_on("Looking for ways round tissue", 0.97)
    )
    return _pierced(found, run, path.position(0.0))


def _pierced(found: Piercing, run: DryRun, entry: Floats) -> Pierced:
    along = run.s[found.rows], found.sideways_mm
    if found.pierced is None and not found.known:
        return Pierced("unknown", s=along[0], along_mm=along[1])
    worst = found.worst
    if worst is None or found.row is None:
        return Pierced("none", 0.0, s=along[0], along_mm=along[1])
    state: PiercedState = "none" if not worst.pierced else "room" if worst.from_room else "wall"
    return Pierced(
        state, worst.sideways_mm, worst.gives_mm, worst.begin, worst.end, float(run.s[found.row]),
        place_words(worst, entry), *along,
    )  # fmt: skip


def place_words(run: Run, entry: Floats) -> str:
    """Where tissue begins that a tool passes: its side of the patient, its height above the nostril, and its place."""
    x, y, z = run.begin if run.outside == "room" or run.inside != "room" else run.end
    side = "in the middle" if abs(x) < _MIDDLE_MM else "on the left" if x > 0.0 else "on the right"
    above = z - float(entry[2])
    height = "level with" if abs(above) < _LEVEL_MM else f"{abs(above):.0f} mm {'above' if above > 0.0 else 'below'}"
    return f"{side}, {height} the nostril (L {x:.0f}, P {y:.0f}, S {z:.0f})"
