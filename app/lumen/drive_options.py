"""What is chosen for drives of a lumen, beside its route: the arm, a paper's parameters, and values of single links."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from app.lumen.tasks import TaskChoice
from vfix_engine.worlds.snake.settings import Arm

if TYPE_CHECKING:  # slow to load, and a planner that drives no snake needs none of it
    from vfix_engine.worlds.snake import DriveSettings

PresetName = Literal["kwok2013"]
LINKS = 5  # that the camera command moves, L' of Kwok 2013
BoundsMm = tuple[float | None, float | None, float | None, float | None, float | None]
LinkNumbers = tuple[float, float, float, float, float]


@dataclass(frozen=True)
class LumenDriveOptions:
    """Settings of the next drive, recorded with its run.

    arm: who keeps the links in the pathway. preset: a paper's parameters; None: the default ones.
    bounds_mm, thresholds_mm, springs_n_per_mm: b_i, a_i and k_i of the five distal links, the last one's last; None:
    those of the route, and of Table II. b_i may be None for one link alone. task: of the next run, None for none.
    """

    arm: Arm = "certified"
    preset: PresetName | None = None
    bounds_mm: BoundsMm | None = None
    thresholds_mm: LinkNumbers | None = None
    springs_n_per_mm: LinkNumbers | None = None
    task: TaskChoice | None = None

    def settings(self, of_route: DriveSettings) -> DriveSettings:
        """The settings of a drive along a route. Raises InputError for a value out of its range."""
        from vfix_engine.worlds.snake.presets import PRESETS

        values = {} if self.preset is None else dict(PRESETS[self.preset].drive)
        return replace(
            of_route,
            **values,  # type: ignore[arg-type]  # checked by the class
            arm=self.arm,
            link_bounds_mm=self.bounds_mm,
            thresholds_mm=self.thresholds_mm,
            springs_n_per_mm=self.springs_n_per_mm,
        )
