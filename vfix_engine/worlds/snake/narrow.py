"""Whether a lumen is wide enough for the robot: its narrowest position, and how far the robot can go.

Measured by the pathway's contours and, where it is available, by the lumen's surface: a narrow section between
contours, such as a membrane or a short stenosis, is not in the contours.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from ...anatomy.lumen.centreline import Centreline
from ...arrays import Array
from ...errors import PathwayError
from ...geometry.curve import Curve
from ...pathway.pathway import Pathway
from ...robots.snake import SnakeModel
from ...validate import point_text
from .by_hand import ContourByHand, HandEdits


class NarrowPlace(NamedTuple):
    """A position along a pathway at rest: mm along the robot's way, (3,) LPS mm, and the radius there in mm.

    off_mm, lumen_mm: how far it is from the lumen's middle, and the lumen's radius about that; None: not known.
    """

    at_mm: float
    at_lps: tuple[float, float, float]
    radius_mm: float
    off_mm: float | None = None
    lumen_mm: float | None = None

    @property
    def words(self) -> str:
        """For people."""
        said = f"{self.radius_mm:.1f} mm at {self.at_mm:.0f} mm, {point_text(self.at_lps)}"
        if self.off_mm is None or self.lumen_mm is None or self.lumen_mm <= self.radius_mm:
            return said
        return f"{said}, {self.off_mm:.1f} mm off the middle of the lumen, whose radius is {self.lumen_mm:.1f} mm"


@dataclass(frozen=True)
class Narrowest:
    """The least radius in mm of a pathway at rest, where along the robot's way and where in LPS mm.

    robot_mm: the robot's radius. below_robot_mm, below_bound_mm: along how much of it the radius is less than the
    robot's, or than an explicit bound. first: where it becomes less than the robot's; free: how far the tip may
    move before that, with the round end of the robot ahead of it; None where it is nowhere less, or where there is no
    way in. per_link_mm: the least radius that each link passes, None for links that stay outside.
    by_hand: the contour placed by hand that makes it less than the robot's at ``first``; None: the lumen is so narrow.
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
    by_hand: ContourByHand | None = None

    @property
    def subject(self) -> str:
        """What of it is narrower than the robot, before 'narrower', for people."""
        return "the pathway is" if self.by_hand is None else f"{self.by_hand.words}, makes the pathway"

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
        said = f"{self.subject} narrower than the robot: its radius is {self.first.words}, "
        said += f"the robot's {self.robot_mm:g} mm"
        if self.at_mm != self.first.at_mm:
            least = NarrowPlace(self.at_mm, self.at_lps, self.radius_mm)
            said += f", and {least.words}, at the least"
        free, links = self.free, 0 if self.free is None else int(self.free.at_mm // snake.length_mm)
        if self.by_hand is not None:
            raise PathwayError(f"{said}; enlarge that contour, move it or remove it, or take a thinner robot")
        if free is None or links < 1:
            raise PathwayError(f"{said}; take a thinner robot or another start, or go on anyway")
        x, y, z = free.at_lps
        raise PathwayError(
            f"{said}; the tip could go {free.at_mm:.0f} mm: end at {x:.1f},{y:.1f},{z:.1f}, "
            f"or take {links} links of {snake.length_mm:g} mm at most, or a thinner robot, or go on anyway"
        )


def narrowest(
    pathway: Pathway,
    snake: SnakeModel,
    bound_mm: float | None,
    to_mm: float,
    curve: Curve | None = None,
    hand: HandEdits | None = None,
    middle: Centreline | None = None,
) -> Narrowest:
    """For a pathway at rest, from its entrance to the target of the tip.

    Args:
        bound_mm: an explicit bound. to_mm: mm along the robot's way.
        curve: that the robot follows; all lengths are along it, see ``Pathway.along``.
        hand: contours placed by hand, of which one may be what makes it narrow.
        middle: of the lumen, from which a narrow place may be far; None: not known.
    """
    contours, robot_mm = pathway.moved(None).contours(), snake.sphere_mm
    along = contours.s
    if pathway.wall_radius is not None:
        along = np.union1d(along, np.linspace(0.0, pathway.length, len(pathway.wall_radius)))
    way = pathway.along(curve, along)
    to_mm = min(max(to_mm, float(pathway.along(curve, contours.s[1:2])[0])), float(way[-1]))
    s = np.append(way[way < to_mm], to_mm)
    along = np.interp(s, way, along)
    radius = np.interp(along, contours.s, contours.radius.min(axis=1))
    radius = np.minimum(radius, pathway.narrowest_between(along, along))
    centre = np.column_stack([np.interp(along, contours.s, contours.centre[:, axis]) for axis in range(3)])
    least, share = int(radius.argmin()), np.gradient(s)
    limits = (robot_mm, 0.0 if bound_mm is None else bound_mm)
    below_robot, below_bound = (float(share[radius < limit].sum()) for limit in limits)

    def place(at: float) -> NarrowPlace:
        x, y, z = (float(np.interp(at, s, centre[:, axis])) for axis in range(3))
        return NarrowPlace(at, (x, y, z), float(np.interp(at, s, radius)), *_off(middle, np.array([x, y, z])))

    first = free = by_hand = None
    if radius[least] < robot_mm:
        at = int((radius < robot_mm).argmax())
        first = place(float(s[at]))
        cause = None if hand is None else hand.narrowing(float(along[at]), robot_mm)
        if hand is not None and cause is not None:
            by_hand = hand.named(cause)
        meets = float(s[0]) if at == 0 else float(np.interp(robot_mm, radius[[at, at - 1]], s[[at, at - 1]]))
        free = place(meets - robot_mm) if meets - robot_mm > float(s[0]) else None
    through = np.minimum.accumulate(radius)
    reach = to_mm - snake.length_mm * np.arange(snake.links - 1, -1, -1)  # arc lengths of each link's far end
    per_link = tuple(float(np.interp(end, s, through)) if end > 0.0 else None for end in reach.tolist())
    lowest = place(float(s[least]))
    return Narrowest(
        lowest.radius_mm, lowest.at_mm, lowest.at_lps, robot_mm, below_robot, below_bound, first, free, per_link,
        by_hand,
    )  # fmt: skip


def _off(middle: Centreline | None, place: Array) -> tuple[float, float] | tuple[()]:
    """How far a place (3,) is from the middle of the lumen, and the lumen's radius about that, mm."""
    if middle is None:
        return ()
    line = middle.curve
    at = line.closest(place)
    radius = np.interp(at, np.arange(len(line.points)) * line.step_mm, middle.radius)
    return float(np.linalg.norm(line.position(at) - place)), float(radius)


def narrowest_values(found: Narrowest) -> dict[str, Any]:
    """JSON's types only."""
    places = {
        name: None if at is None else at._asdict() | {"at_lps": list(at.at_lps)}
        for name, at in (("first", found.first), ("free", found.free))
    } | {"by_hand": None if found.by_hand is None else found.by_hand._asdict()}
    return asdict(found) | {"at_lps": list(found.at_lps), "per_link_mm": list(found.per_link_mm)} | places
