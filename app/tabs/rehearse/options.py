"""The options of a rehearsal as the page shows them, and where its remote centre can be."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from app.planning.head_tissue import MAX_DEPTH_MM, NOSTRIL_DEPTH_MM, STIFFNESS_N_PER_MM
from app.planning.rehearsal_options import (
    NO_CT,
    SPEED_MM_PER_S,
    TURN_RAD_PER_S,
    RehearsalOptions,
)
from app.planning.remote_centre import TOLERANCE_MM, PathPlace, centre_at, entry_mm, path_of, point_places
from app.planning.verdict import NOSTRIL_MM
from app.plans.service import Plan
from app.services import Services
from app.tabs.rehearse.sections import CentreChoice, CentreSection, LengthSection, OptionsSection, OptionView
from app.workspace.latest import BackgroundTask, Latest
from vfix_engine.errors import VfixError
from vfix_engine.geometry.path import SplinePath
from vfix_engine.virtual_fixtures import RemoteCentre

ENTRY, MM = "entry", "mm"  # of a position that is not a path point
# Lowest and highest length of an option on the page, and the step: a tool beside bone strays from its path, too.
RANGES_MM: dict[str, tuple[float, float, float]] = {"tube_mm": (0.5, 10.0, 0.1), "stop_mm": (0.5, 20.0, 0.5)}
NO_PATH_YET = "The plan has no path yet."
OF_ANOTHER = "Another window holds the handle."
TAKE_FIRST = "Take the handle first."
OF_TRIAL = "The trial fixes it."


@dataclass(frozen=True)
class _Known:
    """A plan's path: arc lengths of its points and of its entry in mm, or why there is none; '' while unknown."""

    path: SplinePath
    points: tuple[tuple[str, str, float], ...]  # id, label, arc length [mm]
    has_ct: bool
    entry: float | None = None
    trouble: str = ""


class CentrePlaces:
    """Possible positions of a plan's remote centre. The CT is read in the background. Owned by one thread."""

    def __init__(self, services: Services, executor: Executor, post: Callable[[Callable[[], None]], Any]) -> None:
        """post: queues a call onto the owner's thread."""
        self._services, self._latest = services, Latest(executor, post)
        self._key: object = None
        self.known: _Known | None = None  # of the last plan
        self._last: tuple[object, RemoteCentre | str] = (None, "")  # the last path

    def ask(self, plan: Plan | None) -> None:
        """Read a plan's path, if it has changed."""
        points = () if plan is None else tuple((point.id, point.label, point.position) for point in plan.content.points)
        key = (None if plan is None else plan.id, points)
        if key == self._key:
            return
        self._key, self.known = key, None
        self._latest.drop()
        if plan is None or len(points) < 2:
            return
        path = path_of(plan)
        at = zip(plan.content.points, point_places(plan, path), strict=True)
        has_ct = bool(self._services.cases.get(plan.case_id).volumes)
        known = self.known = _Known(path, tuple((point.id, point.label, s) for point, s in at), has_ct)
        self._find(plan, known)

    def _find(self, plan: Plan, known: _Known) -> None:
        def find(run: BackgroundTask) -> float | None:
            return entry_mm(plan, known.path, self._services.cases.volume(self._services.cases.get(plan.case_id)))

        def show(entry: float | None, trouble: str = "") -> None:
            self.known = replace(known, entry=entry, trouble=trouble)

        self._latest.ask("The entry was not found", find, show, lambda words: show(None, words), lane=plan.id)

    def at_mm(self, place: PathPlace) -> float | None:
        """The arc length of a position; None where it is not known, or there is none."""
        if self.known is None:
            return None
        if place.point is not None:
            return next((s for point, _, s in self.known.points if point == place.point), None)
        return self.known.entry if place.at_mm is None else min(place.at_mm, self.known.path.length)

    def centre(self, place: PathPlace) -> RemoteCentre | None:
        """The fixture at a position; None where it cannot be there."""
        found = self._looked_at(self.at_mm(place))
        return found if isinstance(found, RemoteCentre) else None

    def _looked_at(self, at: float | None) -> RemoteCentre | str:
        """The fixture at an arc length, or why it cannot be there; '' where the arc length is not known."""
        if at is None or self.known is None:
            return ""
        key = (self.known.path, at)
        if self._last[0] != key:
            try:
                self._last = key, centre_at(*key)
            except VfixError as error:
                self._last = key, str(error)
        return self._last[1]

    def section(self, place: PathPlace) -> CentreSection | None:
        """For the page; None without a path."""
        known = self.known
        if known is None:
            return None
        at = self.at_mm(place)
        points: list[CentreChoice] = [
            {"value": point, "label": f"{number}: {label}, {s:.1f} mm"}
            for number, (point, label, s) in enumerate(known.points, 1)
        ]
        return {
            "choices": [{"value": ENTRY, "label": self._entry_words(known)}, *points],
            "chosen": place.point or (ENTRY if place.at_mm is None else MM),
            "at_mm": None if at is None else round(at, 1),
            "length_mm": round(known.path.length, 1),
            "trouble": self._trouble(known, place, at),
        }

    def _entry_words(self, known: _Known) -> str:
        at = "" if known.entry is None else f", {known.entry:.1f} mm"
        return f"Entry into the head{at}" if known.has_ct else f"First path point{at}"

    def _trouble(self, known: _Known, place: PathPlace, at: float | None) -> str:
        if at is None:
            gone = "That path point is gone; choose another place."
            return gone if place.point is not None else known.trouble
        found = self._looked_at(at)
        return found if isinstance(found, str) else ""


def place_of(choice: str | None, at_mm: float | None) -> PathPlace:
    """The position chosen on the page: a path point, an arc length in mm, or the entry."""
    return PathPlace(choice, at_mm if choice is None else None)


def options_section(
    wanted: RehearsalOptions,
    in_force: RehearsalOptions | None,
    centre: CentreSection | None,
    has_ct: bool,
    may_change: bool,
    free: bool = False,
    fixed: bool = False,
) -> OptionsSection:
    """Options, the effect of each, and why one cannot be used.

    in_force: of the present robot; None where there is none. centre: None without a path. free: nobody
    holds the handle. fixed: a trial of a study goes on.
    """
    refusals = {
        "soft_tissue": "" if has_ct else NO_CT,
        "remote_centre": "" if centre is not None else NO_PATH_YET,
        "speed_limit": "",
        "tube_mm": "" if centre is not None else NO_PATH_YET,
        "stop_mm": "" if centre is not None else NO_PATH_YET,
    }
    items: list[OptionView] = [
        {
            "name": name,
            "label": label,
            "words": _option_words(words, _is_on(wanted, name), _is_on(in_force or wanted, name)),
            "on": _is_on(wanted, name),
            "refusal": refusals[name] or (OF_TRIAL if fixed else "" if may_change else not_held(free)),
        }
        for name, (label, words) in _LABELS.items()
    ]
    changed = in_force is not None and in_force != wanted.in_force
    return {
        "items": items,
        "centre": centre if wanted.remote_centre else None,
        "lengths": {name: _length(name, mm) for name in RANGES_MM if (mm := getattr(wanted, name)) is not None},
        "words": "In force from ‘Start’ or ‘Reset to entry’." if changed else "",
    }


def not_held(free: bool) -> str:
    """Why a client without the handle is refused. free: nobody holds it."""
    return TAKE_FIRST if free else OF_ANOTHER


def _is_on(options: RehearsalOptions, name: str) -> bool:
    return getattr(options, name) not in (False, None)


def _length(name: str, mm: float) -> LengthSection:
    low, high, step = RANGES_MM[name]
    return {"mm": mm, "lo": low, "hi": high, "step": step}


class _OptionWords(NamedTuple):
    """acts: the effect of the option; would: the same after 'Turn on to'."""

    acts: str
    would: str


def _option_words(words: _OptionWords, on: bool, acts: bool) -> str:
    """The effect of an option, or what it would be. on: as selected; acts: in the present robot."""
    if on != acts:
        return f"Not in force yet: {words.acts}" if on else f"Still in force: {words.acts}"
    return f"{words.acts[:1].upper()}{words.acts[1:]}" if on else f"Off. Turn on to {words.would}"


_LABELS: dict[str, tuple[str, _OptionWords]] = {
    "soft_tissue": (
        "Soft tissue",
        _OptionWords(
            f"skin and mucosa push back as the CT shows them. They yield with {STIFFNESS_N_PER_MM} N/mm and are "
            f"hard from {MAX_DEPTH_MM:g} mm on, from {NOSTRIL_DEPTH_MM:g} mm within {NOSTRIL_MM:g} mm of the entry.",
            "let skin and mucosa push back as the CT shows them.",
        ),
    ),
    "remote_centre": (
        "Remote centre",
        _OptionWords(
            f"the tool passes one place of the path within {TOLERANCE_MM:g} mm. It does so once the "
            "tip is inside, as in a nostril.",
            f"keep the tool within {TOLERANCE_MM:g} mm of one place.",
        ),
    ),
    "speed_limit": (
        "Speed limits",
        _OptionWords(
            f"the tip is limited to {SPEED_MM_PER_S:g} mm/s and {math.degrees(TURN_RAD_PER_S):.0f}°/s.",
            f"limit the tip to {SPEED_MM_PER_S:g} mm/s and {math.degrees(TURN_RAD_PER_S):.0f}°/s.",
        ),
    ),
    "tube_mm": (
        "Tube",
        _OptionWords("the tip stays in a tube about the path.", "keep the tip in a tube about the path."),
    ),
    "stop_mm": (
        "Depth stop",
        _OptionWords(
            "the tip stays behind a plane past the end of the path.", "keep the tip behind a plane past the path's end."
        ),
    ),
}
