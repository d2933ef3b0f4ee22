"""Whether a lumen is wide enough for the robot: its narrowest position, and how far the robot can go.

Measured by the pathway's contours and, where it is available, by the lumen's surface: a narrow section between
contours, such as a membrane or a short stenosis, is not in the contours.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from ...errors import PathwayError
from ...pathway.pathway import Pathway
from ...robots.snake import SnakeModel
from ...validate import point_text


class NarrowPlace(NamedTuple):
    """A position along a pathway at rest: mm from its start, (3,) LPS mm, and the radius there in mm."""

    at_mm: float
    at_lps: tuple[float, float, float]
    radius_mm: float

    @property
    def words(self) -> str:
        """For people."""
        return f"{self.radius_mm:.1f} mm at {self.at_mm:.0f} mm, {point_text(self.at_lps)}"


@dataclass(frozen=True)
class Narrowest:
    """The least radius in mm of a pathway at rest, where along it and where in LPS mm.

    robot_mm: the robot's radius. below_robot_mm, below_bound_mm: along how much of it the radius is less than the
    robot's, or than an explicit bound. first: where it becomes less than the robot's; free: how far the tip may
    move before that, with the round end of the robot ahead of it; None where it is nowhere less, or where there is no
    way in. per_link_mm: the least radius that each link passes, None for links that stay outside.
    """

    radius_mm: float
    at_mm: float
    at_lps: tuple[float, float, float]
    robot_mm: float
    below_robot_mm: float
    below_bound_mm: float
    first: NarrowPlace | None
    free: NarrowPlace | None
    per_link_mm: tuple[float | None, ...]

    def warnings(self, bound_mm: float | None) -> list[str]:
        """In words, where the lumen is too narrow, and what to do; ``bound_mm``: an explicit bound."""
        where = f"the pathway's radius is {NarrowPlace(self.at_mm, self.at_lps, self.radius_mm).words}"
        found = []
        if self.below_robot_mm > 0.0:
            found.append(
                f"the robot is wider than the pathway: {where}, the robot's is {self.robot_mm:g} mm, and it has less "
                f"than that along {self.below_robot_mm:.0f} mm; take a thinner robot, or a farther start or nearer end"
            )
        if bound_mm is not None and self.below_bound_mm > 0.0:
            found.append(
                f"a bound of {bound_mm:g} mm says little where the pathway is narrower: {where}, and it has less than "
                f"the bound along {self.below_bound_mm:.0f} mm; take a smaller bound, or none: it then goes by place"
            )
        return found

    def refuse(self, snake: SnakeModel) -> None:
        """Refuse a pathway that is narrower than the robot.

        Raises:
            PathwayError: the pathway is narrower within the robot's range; the message says how far it can go.
        """
        if self.first is None:
            return
        said = f"the pathway is narrower than the robot: its radius is {self.first.words}, "
        said += f"the robot's {self.robot_mm:g} mm"
        if self.at_mm != self.first.at_mm:
            least = NarrowPlace(self.at_mm, self.at_lps, self.radius_mm)
            said += f", and {least.words}, at the least"
        free, links = self.free, 0 if self.free is None else int(self.free.at_mm // snake.length_mm)
        if free is None or links < 1:
            raise PathwayError(f"{said}; take a thinner robot or another start, or go on anyway")
        x, y, z = free.at_lps
        raise PathwayError(
            f"{said}; the tip could go {free.at_mm:.0f} mm: end at {x:.1f},{y:.1f},{z:.1f}, "
            f"or take {links} links of {snake.length_mm:g} mm at most, or a thinner robot, or go on anyway"
        )


def narrowest(pathway: Pathway, snake: SnakeModel, bound_mm: float | None, to_mm: float) -> Narrowest:
    """For a pathway at rest, from its entrance to the target of the tip; ``bound_mm``: an explicit bound."""
    contours, robot_mm = pathway.moved(None).contours(), snake.sphere_mm
    to_mm = min(max(to_mm, float(contours.s[1])), float(contours.s[-1]))
    s = contours.s
    if pathway.wall_radius is not None:
        s = np.union1d(s, np.linspace(0.0, pathway.length, len(pathway.wall_radius)))
    s = np.append(s[s < to_mm], to_mm)
    radius = np.interp(s, contours.s, contours.radius.min(axis=1))
    radius = np.minimum(radius, pathway.narrowest_between(s, s))
    centre = np.column_stack([np.interp(s, contours.s, contours.centre[:, axis]) for axis in range(3)])
    least, share = int(radius.argmin()), np.gradient(s)
    limits = (robot_mm, 0.0 if bound_mm is None else bound_mm)
    below_robot, below_bound = (float(share[radius < limit].sum()) for limit in limits)

    def place(at: float) -> NarrowPlace:
        x, y, z = (float(np.interp(at, s, centre[:, axis])) for axis in range(3))
        return NarrowPlace(at, (x, y, z), float(np.interp(at, s, radius)))

    first = free = None
    if radius[least] < robot_mm:
        at = int((radius < robot_mm).argmax())
        first = place(float(s[at]))
        meets = float(s[0]) if at == 0 else float(np.interp(robot_mm, radius[[at, at - 1]], s[[at, at - 1]]))
        free = place(meets - robot_mm) if meets - robot_mm > float(s[0]) else None
    through = np.minimum.accumulate(radius)
    reach = to_mm - snake.length_mm * np.arange(snake.links - 1, -1, -1)  # arc lengths of each link's far end
    per_link = tuple(float(np.interp(end, s, through)) if end > 0.0 else None for end in reach.tolist())
    lowest = place(float(s[least]))
    return Narrowest(
        lowest.radius_mm, lowest.at_mm, lowest.at_lps, robot_mm, below_robot, below_bound, first, free, per_link
    )


def narrowest_values(found: Narrowest) -> dict[str, Any]:
    """JSON's types only."""
    places = {
        name: None if at is None else {"radius_mm": at.radius_mm, "at_mm": at.at_mm, "at_lps": list(at.at_lps)}
        for name, at in (("first", found.first), ("free", found.free))
    }
    return asdict(found) | {"at_lps": list(found.at_lps), "per_link_mm": list(found.per_link_mm)} | places
