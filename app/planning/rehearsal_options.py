"""Options of a rehearsal: fixtures besides its task, in the drive and in the dry run that predicts it."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace

from app.planning.head_tissue import NOT_IN_SCAN, tissue_region, tissue_words
from app.planning.remote_centre import ENTRY, PathPlace, centre_at, path_of, place_mm
from app.plans.model import Plan
from vfix_engine.errors import InputError, PlanError
from vfix_engine.files.volume import Volume
from vfix_engine.proximity.fields.distance_field import DistanceField
from vfix_engine.virtual_fixtures import CartesianLimits, Fixture, PathTube, RemoteCentre

SPEED_MM_PER_S = 5.0  # of the tip; half of what the hand reaches with the default settings
TURN_RAD_PER_S = math.radians(10.0)
NO_CT = "This head has no CT: nobody knows where its soft tissue is."


@dataclass(frozen=True, kw_only=True)
class RehearsalOptions:
    """The options that are on. centre: where the remote centre is. tube_mm: radius of the tube; None without one."""

    soft_tissue: bool = False
    remote_centre: bool = False
    speed_limit: bool = False
    tube_mm: float | None = None
    centre: PathPlace = ENTRY

    @property
    def in_force(self) -> RehearsalOptions:
        """The options without those that have no effect, so that equal drives compare equal."""
        return self if self.remote_centre else replace(self, centre=ENTRY)

    def along(self, plan: Plan) -> RehearsalOptions:
        """Return the options for another path: a remote centre at a point that it does not have moves to its entry."""
        here = self.centre.point is None or self.centre.point in [point.id for point in plan.content.points]
        return self if here else replace(self, centre=ENTRY)


NO_OPTIONS = RehearsalOptions()


@dataclass(frozen=True)
class Standing:
    """The fixtures that act during all of a drive, and their description, such as 'soft tissue and speed limits'."""

    fixtures: tuple[Fixture, ...] = ()
    words: str = ""

    @property
    def centre(self) -> RemoteCentre | None:
        """The remote centre, or None."""
        return next((one for one in self.fixtures if isinstance(one, RemoteCentre)), None)


def standing(
    options: RehearsalOptions, plan: Plan, volume: Volume | None, tissue: Callable[[], DistanceField | None]
) -> Standing:
    """Return the fixtures of the options along a plan's path.

    volume: the CT, or None. tissue: computes the distance field of its skin, mucosa and bone around the plan.
    Raises PlanError with the reason if an option cannot be used.
    """
    if options.in_force == NO_OPTIONS:
        return Standing()
    path = path_of(plan)
    fixtures, words = list[Fixture](), list[str]()
    if options.soft_tissue:
        fixtures.append(tissue_region(_tissue(volume, tissue), path))
        words.append(tissue_words())
    if options.remote_centre:
        at = place_mm(options.centre, plan, path, volume)
        fixtures.append(centre_at(path, at))
        words.append(f"the remote centre at {at:.1f} mm")
    if options.speed_limit:
        fixtures.append(CartesianLimits(speed_mm_per_s=SPEED_MM_PER_S, turn_rad_per_s=TURN_RAD_PER_S))
        words.append("speed limits")
    if options.tube_mm is not None:
        fixtures.append(PathTube(path, options.tube_mm))
        words.append(f"the tube of {options.tube_mm:g} mm")
    listed = " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
    return Standing(tuple(fixtures), listed)


def _tissue(volume: Volume | None, make: Callable[[], DistanceField | None]) -> DistanceField:
    try:
        field = None if volume is None else make()
    except InputError as error:  # no place of the plan is in the scan
        raise PlanError(NOT_IN_SCAN) from error
    if field is None:
        raise PlanError(NO_CT)
    return field


class OptionsByPlan:
    """The options of each plan's rehearsal, kept until the process ends. Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._of: dict[str, RehearsalOptions] = {}

    def of(self, plan_id: str) -> RehearsalOptions:
        """Return the options of a plan; all off until one is set."""
        with self._lock:
            return self._of.get(plan_id, NO_OPTIONS)

    def choose(self, plan_id: str, options: RehearsalOptions) -> None:
        """Set all options of a plan."""
        with self._lock:
            self._of[plan_id] = options
