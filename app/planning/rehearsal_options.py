"""Switches of a rehearsal: fixtures that stand beside its task, for the drive and for the dry run that foretells it."""

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
from vfix_engine.virtual_fixtures import CartesianLimits, Fixture, RemoteCentre

SPEED_MM_PER_S = 5.0  # of the tip; half of what the hand reaches with the settings as they come
TURN_RAD_PER_S = math.radians(10.0)
NO_CT = "This head has no CT: nobody knows where its soft tissue is."


@dataclass(frozen=True)
class Switches:
    """Which switches are on. centre: where the remote centre is."""

    soft_tissue: bool = False
    remote_centre: bool = False
    speed_limit: bool = False
    centre: PathPlace = ENTRY

    @property
    def in_force(self) -> Switches:
        """The same without what has no effect: two that are driven alike are equal."""
        return self if self.remote_centre else Switches(self.soft_tissue, False, self.speed_limit)

    def along(self, plan: Plan) -> Switches:
        """The same for another path of a plan: a remote centre at a point that this one has not is at its entry."""
        here = self.centre.point is None or self.centre.point in [point.id for point in plan.points]
        return self if here else replace(self, centre=ENTRY)


NO_SWITCHES = Switches()


@dataclass(frozen=True)
class Standing:
    """The standing fixtures of a drive, and in words what they are, such as 'soft tissue and speed limits'."""

    fixtures: tuple[Fixture, ...] = ()
    words: str = ""

    @property
    def centre(self) -> RemoteCentre | None:
        """The remote centre; None where there is none."""
        return next((one for one in self.fixtures if isinstance(one, RemoteCentre)), None)


def standing(
    switches: Switches, plan: Plan, volume: Volume | None, tissue: Callable[[], DistanceField | None]
) -> Standing:
    """What the switches stand for along a plan's path.

    volume: the CT, None where there is none; tissue: makes the field of its skin, mucosa and bone around the plan.
    Raises PlanError where a switch cannot be used, with the reason.
    """
    if switches.in_force == NO_SWITCHES:
        return Standing()
    path = path_of(plan)
    fixtures, words = list[Fixture](), list[str]()
    if switches.soft_tissue:
        fixtures.append(tissue_region(_tissue(volume, tissue), path))
        words.append(tissue_words())
    if switches.remote_centre:
        at = place_mm(switches.centre, plan, path, volume)
        fixtures.append(centre_at(path, at))
        words.append(f"the remote centre at {at:.1f} mm")
    if switches.speed_limit:
        fixtures.append(CartesianLimits(speed_mm_per_s=SPEED_MM_PER_S, turn_rad_per_s=TURN_RAD_PER_S))
        words.append("speed limits")
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


class SwitchBoard:
    """The switches of each plan's rehearsal, until the planner ends. Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._of: dict[str, Switches] = {}

    def of(self, plan_id: str) -> Switches:
        """As they are wanted: all off, until somebody turns one."""
        with self._lock:
            return self._of.get(plan_id, NO_SWITCHES)

    def turn(self, plan_id: str, switches: Switches) -> None:
        """Set them all."""
        with self._lock:
            self._of[plan_id] = switches
