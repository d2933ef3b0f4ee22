"""Whether a planned tool pierces skin or a wall between two air spaces; measured by the engine, described here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Self

import numpy as np

from app.kit.values import Position
from vfix_engine.anatomy.piercing import Piercing, SidewaysColumn, TissueRun, Ways, piercing_of
from vfix_engine.anatomy.way_round_kernel import REACH_MM
from vfix_engine.arrays import Array
from vfix_engine.progress import ProgressCallback
from vfix_engine.worlds.rigid.dry_run import STATION_MM, DryRun

PiercedState = Literal["none", "room", "wall", "unknown"]

_MIDDLE_MM = 3.0  # places nearer to the middle of the head are described as in the middle
_LEVEL_MM = 0.5  # a smaller height difference is described as level with the entry


@dataclass(frozen=True, eq=False)
class Pierced:
    """The tissue that a tool pierces; lengths in mm, positions (3,) in LPS.

    state: 'room' if it pierces tissue with the room's air at one end, 'wall' for a wall between two air spaces of the
    body, 'unknown' if the scan does not show it. sideways_mm: sideways distance of the nearest air around the worst
    tissue, inf beyond 15 mm; gives_mm: how far tissue yields there. Both None if the tool passes no tissue or nothing
    is known. begin, end: ends of that tissue on the tool's axis, from outside to inside. s_mm: arc length of the tip
    there. s, along_mm (m,): the sideways distance along the path, NaN where it is not known.
    """

    state: PiercedState
    sideways_mm: float | None = None
    gives_mm: float | None = None
    begin: Position | None = None
    end: Position | None = None
    s_mm: float | None = None
    where: str = ""
    s: Array | None = None
    along_mm: Array | None = None

    def at(self, s: Array) -> list[float] | None:
        """Return `along_mm` at arc lengths (n,), of the last measured pose before each; 15 mm if farther or unknown."""
        if self.s is None or self.along_mm is None or not len(self.s) or np.isnan(self.along_mm).all():
            return None
        rows = np.maximum(np.searchsorted(self.s, s + 1e-9, side="right") - 1, 0)
        far: list[float] = np.round(np.nan_to_num(np.fmin(self.along_mm[rows], REACH_MM), nan=REACH_MM), 1).tolist()
        return far

    @property
    def ends(self) -> tuple[Position, Position] | None:
        """Both ends of the pierced tissue; None if none is pierced."""
        if self.state not in ("room", "wall") or self.begin is None or self.end is None:
            return None
        return self.begin, self.end

    @property
    def words(self) -> str:
        """A sentence, '' if nothing is pierced."""
        if self.state == "unknown":
            return "Whether the tool pierces tissue is not known: no scan shows it from the room's air on."
        if self.state == "none" or self.sideways_mm is None:
            return ""
        what = "skin" if self.state == "room" else "a wall between two air spaces of the body"
        return f"Pierces {what} {self.where}: {way_words(self.sideways_mm)}, where tissue gives {self.gives_mm:.0f} mm."


NOT_KNOWN = Pierced("unknown")


def way_words(sideways_mm: float) -> str:
    """Return how far sideways air leads around tissue, as part of a sentence."""
    if not np.isfinite(sideways_mm):
        return "no air leads round it within 15 mm"
    return f"air leads round it {sideways_mm:.1f} mm beside the tool"


def short_way(sideways_mm: float | None) -> str:
    """Return how far sideways air leads around tissue in a few words. sideways_mm: None if it is not known."""
    if sideways_mm is None:
        return "air round tissue not known"
    return (
        "no air round tissue within 15 mm" if not np.isfinite(sideways_mm) else f"air {sideways_mm:.1f} mm round tissue"
    )


def pierced_along(ways: Ways | None, run: DryRun, progress: ProgressCallback) -> Pierced:
    """Return what a dry run pierces. ways: search in its head, None if no CT shows the path."""
    if ways is None:
        return NOT_KNOWN
    rows = np.union1d(np.unique(np.rint(run.s / STATION_MM), return_index=True)[1], [len(run.s) - 1])
    found = piercing_of(
        ways,
        run.segments_start,
        run.segments_end,
        rows.tolist(),
        lambda: progress("Looking for ways round tissue", 0.97),
    )
    return _pierced(found, run.s, ways)


def pierced_by_poses(ways: Ways | None, poses: Sequence[tuple[float, Array, Array]]) -> Pierced:
    """Return what a drive pierces. poses: arc length of the tip, starts and ends (S, 3) of the tool's segments."""
    if ways is None or not poses:
        return NOT_KNOWN
    s, start, end = (np.array(values) for values in zip(*poses, strict=True))
    return _pierced(piercing_of(ways, start, end, range(len(s))), s, ways)


def pierced_by_steps(ways: Ways, s: Array, start: Array, end: Array) -> tuple[Pierced, Array]:
    """Return what a drive pierces, measured at every step.

    s (n,): arc length of the tip. start, end (n, S, 3): ends of the tool's segments.
    Also returns, for each step (n,), how far sideways air leads around the passed tissue, as
    `PiercingWatch.sideways_mm`.
    """
    column = SidewaysColumn(ways)
    sideways = np.array([column.add(*ends) for ends in zip(start, end, strict=True)])
    return _pierced(column.found, s, ways), sideways


def _pierced(found: Piercing, s: Array, ways: Ways) -> Pierced:
    along = s[found.rows], found.sideways_mm
    if found.pierced is None and not found.known:
        return Pierced("unknown", s=along[0], along_mm=along[1])
    worst = found.worst
    if worst is None or found.row is None:
        return Pierced("none", 0.0, s=along[0], along_mm=along[1])
    state: PiercedState = "none" if not worst.pierced else "room" if worst.from_room else "wall"
    return Pierced(
        state, worst.sideways_mm, worst.gives_mm, worst.begin, worst.end, float(s[found.row]),
        place_words(worst, ways), *along,
    )  # fmt: skip


def sideways_of(found: Piercing | None) -> float | None:
    """Return how far sideways air leads around the worst tissue of a drive; None if not known or beyond 15 mm."""
    if found is None or not found.known:
        return None
    sideways = 0.0 if found.worst is None else found.worst.sideways_mm
    return sideways if sideways is not None and np.isfinite(sideways) else None


@dataclass(frozen=True)
class PiercedReport:
    """The values of `Pierced` in a report; sideways_mm is None if no air leads around within 15 mm."""

    state: PiercedState
    sideways_mm: float | None
    gives_mm: float | None
    begin: Position | None
    end: Position | None
    s_mm: float | None
    words: str

    @classmethod
    def of(cls, found: Pierced) -> Self:
        far = found.sideways_mm if found.sideways_mm is not None and np.isfinite(found.sideways_mm) else None
        return cls(found.state, far, found.gives_mm, found.begin, found.end, found.s_mm, found.words)


def place_words(run: TissueRun, ways: Ways) -> str:
    """Describe where passed tissue begins: side of the patient, height above the path's entry, and position."""
    x, y, z = run.begin if run.outside == "room" or run.inside != "room" else run.end
    beside = x - ways.middle_mm
    side = "in the middle" if abs(beside) < _MIDDLE_MM else "on the left" if beside > 0.0 else "on the right"
    above = z - float(ways.entry[2])
    height = "level with" if abs(above) < _LEVEL_MM else f"{abs(above):.0f} mm {'above' if above > 0.0 else 'below'}"
    place = " ".join(
        f"{ends[value < 0.0]} {abs(value):.0f}" for ends, value in zip(("LR", "PA", "SI"), (x, y, z), strict=True)
    )
    return f"{side}, {height} the entry ({place})"
