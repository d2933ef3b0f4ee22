"""Requests that only a snake understands."""

from __future__ import annotations

from dataclasses import dataclass

from ...runtime.requests import Request

SIDES = 8  # of a look-round, about the straight view; 0 is to the right in its picture, and they go round clockwise


@dataclass(frozen=True)
class FollowTissue(Request):
    """Whether the robot's shape follows the moving tissue; without it links leave the pathway as that moves.

    The pathway is seen and the certificate holds either way: nothing goes deeper than the tissue has brought it.
    """

    on: bool


@dataclass(frozen=True)
class LookRound(Request):
    """Turn the view to eight sides one after the other, each as far as the bounds let it, and straighten in between.

    It lasts until it is done or a command comes. aim_deg: the first view on a path that is turned by so much is its
    last; from 1 to 90.
    """

    aim_deg: float = 45.0


@dataclass(frozen=True)
class ChooseJoint(Request):
    """The universal joint that the hand turns in the manual arm: 1 is the last one, 2 the one before.

    On a fixed base also those before them, up to the number of links.
    """

    joint: int


@dataclass(frozen=True)
class SetPeriod(Request):
    """Steps of a scripted drive take so many s from now on."""

    dt: float


@dataclass(frozen=True)
class BendTowards(Request):
    """Every step of a scripted drive from now on has this goal of the distal links (2L',) rad; None: none."""

    bend: tuple[float, ...] | None


@dataclass(frozen=True)
class PlanAnew(Request):
    """Forget what was planned ahead; from here on in shapes ``waypoint_mm`` apart."""

    waypoint_mm: float


@dataclass(frozen=True)
class GetReady(Request):
    """Let the control of the distal links get ready here, if it is not."""
