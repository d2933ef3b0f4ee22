"""The content of an assignment: which plan is driven, how, how often, and what each run has to reach."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from app.operations.fields import MaybeId
from vfix_engine.errors import InputError
from vfix_engine.runtime.control_mode import ControlMode

Most = Annotated[float, Meta(ge=0.0, le=1e6)]
Count = Annotated[int, Meta(ge=0, le=100_000)]
Signed = Annotated[float, Meta(ge=-1e6, le=1e6)]
Since = Annotated[str, Meta(max_length=40)]
Sha256 = Annotated[str, Meta(pattern="^([0-9a-f]{64})?$")]


class Criteria(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Limits of a run's metrics (docs/metrics.md); None: not asked for. Lengths in mm, times in s.

    completed: the path was followed to its end. The tip's and the target's errors are those in the robot's frame;
    min_clearance_mm: of the whole tool to any structure. max_holds: of holds that are felt, of 0.05 s or more.
    min_smoothness: spectral arc length.
    """

    completed: bool | None = None
    max_time_s: Most | None = None
    max_mean_tip_error_mm: Most | None = None
    max_tip_error_mm: Most | None = None
    max_mean_target_error_mm: Most | None = None
    min_clearance_mm: Signed | None = None
    max_contacts: Count | None = None
    max_contact_depth_mm: Most | None = None
    max_held_s: Most | None = None
    max_holds: Count | None = None
    min_smoothness: Signed | None = None

    def asked(self) -> dict[str, float | bool]:
        """The limits that are asked for, by their names."""
        found = {name: getattr(self, name) for name in self.__struct_fields__}
        return {name: limit for name, limit in found.items() if limit is not None}


class Assignment(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An assignment of a case. preset: 'li2004' or 'li2007', None for any. runs: how many have to be passed.

    countdown: 3, 2, 1 before the tool moves. since: runs before this ISO time do not count, '' for when the assignment
    was opened. plan_sha256: `driven_hash` of the plan when it was opened, '' in what a file says.
    """

    plan_id: MaybeId = ""
    mode: ControlMode = "hands-on"
    criteria: Criteria = Criteria()
    runs: Annotated[int, Meta(ge=1, le=100)] = 1
    preset: Literal["li2004", "li2007"] | None = None
    countdown: bool = False
    since: Since = ""
    plan_sha256: Sha256 = ""


def with_rules(content: Assignment) -> Assignment:
    """What types cannot say. Raises InputError."""
    if content.plan_id and not content.criteria.asked():
        raise InputError("the assignment has no criteria; give it one, such as max_time_s.")
    if content.criteria.completed is False:
        raise InputError("'completed' is true, or left out where it does not matter.")
    if content.preset is not None and content.mode == "freehand":
        raise InputError("a free hand has no preset; leave 'preset' out.")
    return content
