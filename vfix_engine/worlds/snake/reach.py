"""Before any motion: how deep a snake can come into its lumen, what would hold it there, and what would come deeper.

The robot is inserted without a clock, by the steps and the certificate of every drive; only the joints' speed, which
costs time and no depth, is not limited.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np

from ...anatomy.lumen.centreline import Centreline
from ...arrays import Array
from ...geometry.curve import Curve
from ...geometry.mesh import TriangleMesh
from ...pathway.fit import Containment, containment
from ...pathway.pathway import Pathway
from ...robots.snake import SnakeModel
from ...snake.conform.conforming import driven_curve
from ...validate import point_text
from .by_hand import HandEdits
from .narrow import Narrowest, narrowest
from .offline.operators import inserted
from .offline.snake_drive import SnakeDrive
from .settings import DriveSettings

ReachLimit = Literal["end", "links", "narrow", "bound", "shape", "base"]

_UNLIMITED = 20.0  # [rad/s] of the joints: no step of a shape is cut by it
_ATTEMPTS = 1  # to come again with other shapes, after the first hold
_DEEPER_MM = 5.0  # an offer brings the robot at least so much deeper
_SAME_MM = 1e-6
_SHORTER = (0.5, 0.25)  # lengths of the links that are offered, of the robot's
_THINNER = 2.0 / 3.0  # their radius, of the robot's
_LEAST_MM, _MOST = 1.0, 120  # length of a link that is offered, and number of links


@dataclass(frozen=True)
class ReachOffer:
    """A robot, or a bound, with which the tip comes to ``depth_mm``; bound_mm: of all links, None: by place."""

    words: str
    snake: SnakeModel
    bound_mm: float | None
    depth_mm: float


@dataclass(frozen=True)
class Reach:
    """How deep a robot comes.

    depth_mm: of its tip along the curve that it follows (``driven_curve``), of ``path_mm``. limit: what ends it there:
    the path's 'end', too few 'links', a 'narrow' place, the 'bound' of a link, or no 'shape' that conforms; 'base': it
    stands on a fixed base, and comes so far from there. words: the same for people. at_lps: (3,) LPS mm, the place it
    is held at: the narrow place, the vertex beyond its bound, or the tip.
    narrowest: of the pathway, up to the target. offers: what would come deeper, the deepest first.
    behind_wall: how much of the pathway's surface is outside the lumen; None: no surface was given. A link within its
    bound there can be so deep behind the wall.
    """

    depth_mm: float
    path_mm: float
    limit: ReachLimit
    words: str
    at_lps: tuple[float, float, float]
    narrowest: Narrowest
    offers: tuple[ReachOffer, ...]
    behind_wall: Containment | None

    def to_dict(self) -> dict[str, Any]:
        """JSON's types only; without ``narrowest``, for which there is ``narrowest_values``."""
        wall = self.behind_wall
        return {
            "depth_mm": self.depth_mm, "path_mm": self.path_mm, "limit": self.limit, "words": self.words,
            "at_lps": list(self.at_lps), "offers": [asdict(offer) for offer in self.offers],
            "behind_wall": None if wall is None else {"share": wall.outside, "depth_mm": list(wall.depth_mm)},
        }  # fmt: skip


def reach_of(
    pathway: Pathway,
    snake: SnakeModel,
    settings: DriveSettings | None = None,
    curve: Curve | None = None,
    slack: Array | None = None,
    *,
    mesh: TriangleMesh | None = None,
    offers: bool = True,
    hand: HandEdits | None = None,
    middle: Centreline | None = None,
) -> Reach:
    """How deep a snake comes into a pathway at rest; takes about a second for 30 links, up to ten where it is held.

    Args:
        pathway: of the lumen, which is tried at rest. snake: the whole robot. settings: bounds and pathway.
        curve, slack: as for ``SnakeDrive``.
        mesh: the lumen's surface, for ``behind_wall``. offers: whether to look for what would come deeper.
        hand, middle: as for ``narrowest``, for the words of a narrow place.

    Raises:
        InputError, PathwayError: as ``SnakeDrive``.
    """
    settings, line = settings or DriveSettings(), driven_curve(pathway, curve)
    if line is not curve:  # a robot in moving tissue follows the pathway's own centres, and so it does here
        curve = slack = None
    pathway = pathway.moved(None)
    try_out = _TryOut(pathway, settings, curve, slack, line, hand, middle)
    found, narrow = try_out.of(snake, settings.bound_mm)
    return Reach(
        found.depth_mm, try_out.line.length, found.limit, found.words, found.at_lps, narrow,
        try_out.deeper(snake, found) if offers else (), None if mesh is None else containment(mesh, pathway),
    )  # fmt: skip


class _Found(NamedTuple):
    depth_mm: float
    limit: ReachLimit
    words: str
    at_lps: tuple[float, float, float]


class _TryOut(NamedTuple):
    """Robots inserted into one lumen."""

    pathway: Pathway
    settings: DriveSettings
    curve: Curve | None
    slack: Array | None
    line: Curve
    hand: HandEdits | None = None
    middle: Centreline | None = None

    def of(self, snake: SnakeModel, bound_mm: float | None) -> tuple[_Found, Narrowest]:
        """How deep a robot comes under a bound, and the narrowest place on its way."""
        length = self.line.length
        target = min(length, snake.reach_mm())
        narrow = narrowest(self.pathway, snake, bound_mm, target, self.curve, self.hand, self.middle)
        free = target if narrow.first is None else 0.0 if narrow.free is None else narrow.free.at_mm
        came_mm, held = self._inserted(snake, bound_mm, min(target, free))
        if held is not None:
            limit, words, at_lps = held
            return _Found(came_mm, limit, words + self._by_hand(at_lps), at_lps), narrow
        if (first := narrow.first) is not None:
            words = f"{narrow.subject} narrower than the robot's {narrow.robot_mm:g} mm: its radius is {first.words}"
            return _Found(came_mm, "narrow", words, first.at_lps), narrow
        place = self._place(came_mm)
        if target < length - _SAME_MM:
            need = math.ceil(length / snake.length_mm)
            words = (
                f"{snake.links} links of {snake.length_mm:g} mm are too few: {need} reach the end, {length:.0f} mm in"
            )
            return _Found(came_mm, "links", words, place), narrow
        return _Found(came_mm, "end", "the robot reaches the end of the path", place), narrow

    def deeper(self, snake: SnakeModel, found: _Found) -> tuple[ReachOffer, ...]:
        """What comes deeper than ``found``, the deepest first; each is tried."""
        bound, length = self.settings.bound_mm, self.line.length
        tried: list[tuple[str, SnakeModel, float | None]] = []
        if found.limit == "links":
            longer = replace(snake, links=math.ceil(length / snake.length_mm))
            tried.append((f"{longer.links} links", longer, bound))
        if found.limit == "bound" and bound is not None:
            tried.append(("bounds by place", snake, None))
        if found.limit in ("narrow", "bound", "shape"):
            tried += [self._thin(snake, share) for share in _SHORTER]
        offers, deepest = list[ReachOffer](), found.depth_mm
        for words, robot, limit in tried:
            depth = self.of(robot, limit)[0].depth_mm
            if depth >= deepest + _DEEPER_MM:
                short = "" if depth >= length - _DEEPER_MM else f" of {length:.0f}"
                offers.append(ReachOffer(f"{words}: {depth:.0f}{short} mm", robot, limit, depth))
                deepest = depth
            if depth >= min(length, snake.reach_mm()) - _DEEPER_MM:
                break  # it arrives: nothing comes deeper
        return tuple(sorted(offers, key=lambda offer: -offer.depth_mm))

    def _thin(self, snake: SnakeModel, share: float) -> tuple[str, SnakeModel, float | None]:
        """A thinner robot with links of this share of the length, in tenths of a millimetre."""
        length_mm = max(round(share * snake.length_mm, 1), _LEAST_MM)
        radius_mm = max(math.floor(10.0 * min(_THINNER * snake.radius_mm, 0.9 * length_mm)) / 10.0, 0.5 * _LEAST_MM)
        links = min(math.ceil(min(self.line.length, snake.reach_mm()) / length_mm), _MOST)
        thin = replace(snake, links=links, length_mm=length_mm, radius_mm=radius_mm, sphere_radius_mm=None)
        return f"{links} links of {length_mm:g} mm and {radius_mm:g} mm radius", thin, self.settings.bound_mm

    def _inserted(
        self, snake: SnakeModel, bound_mm: float | None, target: float
    ) -> tuple[float, tuple[ReachLimit, str, tuple[float, float, float]] | None]:
        """Arc length that the tip reaches, and what holds it before ``target``."""
        if target <= 0.0:
            return 0.0, None
        same = bound_mm == self.settings.bound_mm
        settings = replace(
            self.settings, speed_max=_UNLIMITED, insertion_step_mm=self.settings.waypoint_mm, bound_mm=bound_mm,
            tip_bound_mm=self.settings.tip_bound_mm if same else None,
        )  # fmt: skip
        drive = SnakeDrive(snake, self.pathway, settings, self.curve, self.slack, longer_allowed=True)
        operator, held, retry = inserted(target, _ATTEMPTS), drive.state, None
        while (act := operator(drive.system, drive.state)) is not None:
            drive.act(act)
            retry = act.note.retry or retry
            if drive.state.outcome == "held" and act.note.command.insert_mm_per_s > 0.0:
                held = drive.state
        if drive.tip_s >= target - _SAME_MM:
            return drive.tip_s, None
        # A robot that draws back to come again may end less deep than it was.
        depth = max(drive.tip_s, held.tip_s, 0.0 if retry is None else retry.at_mm)
        if held.limit == "bound" and held.held_at is not None:
            x, y, z = held.held_at.tolist()
            words = f"{held.held_by}, near {point_text(held.held_at)}"
            return depth, ("bound", words, (x, y, z))
        return depth, ("shape", held.held_by or "no shape of the robot conforms to the path there", self._place(depth))

    def _by_hand(self, at_lps: tuple[float, float, float]) -> str:
        """Which contour placed by hand is where a robot is held, in words; '' for none."""
        if self.hand is None:
            return ""
        number = self.hand.reaching(self.pathway.curve().closest(at_lps))
        return "" if number is None else f"; {self.hand.named(number).words}, is there"

    def _place(self, s: float) -> tuple[float, float, float]:
        x, y, z = np.asarray(self.line.position(s)).tolist()
        return x, y, z
