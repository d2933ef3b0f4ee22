"""Preparation of a lumen for a snake: from its surface and two clicks to centreline, followable curve and pathway."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ...anatomy.lumen.centreline import Centreline, centreline_between
from ...anatomy.lumen.free_radius import free_radius
from ...arrays import Array
from ...errors import PathwayError
from ...geometry.curve import Curve
from ...geometry.mesh import TriangleMesh
from ...pathway.fit import fit_pathway
from ...pathway.hand_contours import EditedPathway, HandContour, with_hand_contours
from ...pathway.pathway import Pathway, TissueMotion
from ...robots.snake import SnakeModel
from ...snake.conform.conforming import driven_curve
from ...snake.conform.follow import followable
from .settings import DriveSettings

FAR_MARK_MM = 60.0  # a landmark farther from the robot's curve is not on its way
_NEARNESS = 1.0, 2.0, 4.0  # of the followable curve to the middle, one after the other
_BESIDE_MM = 40.0  # of the centreline, for two places on the way that are some mm apart
_STATION_MM = 0.4  # between two positions at which the width of the surface is measured
_ROOM_MM = 1.0  # more than the robot's radius: a larger width is not measured
_MOST_SLACK_MM = 4.0  # one that uses more of a wide section reaches a narrow one in the wrong orientation


@dataclass(frozen=True, eq=False)
class Lumen:
    """A prepared lumen: its centreline, the curve that a snake follows, and the pathway around that.

    slack: (N,) mm at the curve's points, how far a joint centre may leave the curve before the snake touches the wall.
    """

    centreline: Centreline
    curve: Curve
    slack: Array
    pathway: Pathway

    def beside_mm(self, places: Array) -> Array:
        """Distances (n,) in mm to the wall from the places of the centreline beside places (n, 3) along the way."""
        line, at = self.centreline.curve, np.zeros(len(places) + 1)
        for number, place in enumerate(places):  # each near the one before: another limb may be nearer
            at[number + 1] = line.closest(place, at[number], _BESIDE_MM)
        found: Array = np.interp(at[1:], np.arange(len(line.points)) * line.step_mm, self.centreline.radius)
        return found

    def snake(self, model: SnakeModel, links: int | None) -> SnakeModel:
        """A robot of ``links`` of the model's links; None: as many as the path to the end needs.

        Raises:
            RobotError: an invalid number of links.
        """
        length = driven_curve(self.pathway, self.curve).length
        return replace(model, links=links if links is not None else math.ceil(length / model.length_mm))


def lumen_between(
    mesh: TriangleMesh,
    start: ArrayLike,
    end: ArrayLike,
    snake: SnakeModel,
    settings: DriveSettings,
    tissue: TissueMotion | None = None,
) -> Lumen:
    """Centreline, followable curve and pathway from two clicks in a lumen.

    Args:
        mesh: the lumen's surface, mm; start, end: (3,) clicks in the patient frame.
        snake: the length and the radius of its links count; settings: those of the pathway.
        tissue: how the pathway moves; None: it is still.

    Raises:
        PathwayError: as ``centreline_between`` and ``fit_pathway``.
    """
    centreline = centreline_between(mesh, start, end)
    curve, pathway = _wide_enough(mesh, centreline, snake, settings)
    return _lumen(mesh, centreline, curve, pathway, snake, tissue)


def _wide_enough(
    mesh: TriangleMesh, centreline: Centreline, snake: SnakeModel, settings: DriveSettings
) -> tuple[Curve, Pathway]:
    """The followable curve and its pathway, nearer to the middle where that makes the pathway wide enough.

    A curve that rounds bends leaves the middle, and where it comes near the wall, or turns more sharply than the
    contours around it are wide, these are narrower than the robot although the lumen is not. Then the slack of the
    curve is given more weight, as a penalty method does with a constraint that is not kept yet.
    """
    best, least = None, math.inf
    for nearness in _NEARNESS:
        curve = followable(centreline, snake, nearness=nearness)
        try:
            pathway = fit_pathway(
                mesh, curve, settings.contours, settings.interpolated, settings.angles, quantile=settings.quantile
            )
        except PathwayError:
            if best is None and nearness == _NEARNESS[-1]:
                raise
            continue
        narrow = _narrow_mm(centreline, pathway, snake)
        if narrow < least:
            best, least = (curve, pathway), narrow
        if narrow == 0.0:
            break
    assert best is not None
    return best


def _narrow_mm(centreline: Centreline, pathway: Pathway, snake: SnakeModel) -> float:
    """Along how many mm of it a pathway is narrower than the robot where the lumen about its middle is not."""
    contours, line = pathway.contours(), centreline.curve
    narrow = np.flatnonzero(contours.radius.min(axis=1) < snake.sphere_mm)
    at = np.array([line.closest(place) for place in contours.centre[narrow]])
    radius = np.interp(at, np.arange(len(line.points)) * line.step_mm, centreline.radius)
    return float(np.gradient(contours.s)[narrow][radius >= snake.sphere_mm].sum())


def edited_lumen(
    mesh: TriangleMesh, fitted: Lumen, contours: Sequence[HandContour], snake: SnakeModel
) -> tuple[Lumen, EditedPathway]:
    """A lumen whose pathway has contours placed by hand, and which of its contours they are.

    Args:
        mesh, snake: as for ``lumen_between``, which made ``fitted``; its tissue stays.

    Raises:
        PathwayError: as ``with_hand_contours``.
    """
    edited = with_hand_contours(fitted.pathway, fitted.curve, contours)
    if not edited.changed:
        return fitted, edited
    tissue = fitted.pathway.motion
    return _lumen(mesh, fitted.centreline, edited.curve, edited.pathway, snake, tissue), edited


def _lumen(
    mesh: TriangleMesh,
    centreline: Centreline,
    curve: Curve,
    pathway: Pathway,
    snake: SnakeModel,
    tissue: TissueMotion | None,
) -> Lumen:
    """With what is measured of the surface along the robot's curve; the pathway moves from here on."""
    pathway = replace(pathway, wall_radius=_wall_radius(mesh, curve if tissue is None else None, pathway, snake))
    slack = _slack(curve, pathway, snake)
    if tissue is not None:
        pathway = pathway.moved(tissue)
    return Lumen(centreline, curve, slack, pathway)


def _wall_radius(mesh: TriangleMesh, curve: Curve | None, pathway: Pathway, snake: SnakeModel) -> Array:
    """The lumen's radius by its surface along the robot's curve, as in ``Pathway.wall_radius``.

    curve: the curve on which the pathway's knots are arc lengths; None: the robot follows the pathway's own centres.
    """
    knots = pathway.at_s if curve is None else pathway.knots
    assert knots is not None
    longest = max(1.0, float((np.diff(knots) / np.diff(pathway.at_s)).max()))  # mm of the curve for one of the pathway
    s = np.linspace(0.0, pathway.length, math.ceil(longest * pathway.length / _STATION_MM) + 1)
    line = pathway.curve() if curve is None else curve
    return free_radius(mesh, line, np.interp(s, pathway.at_s, knots), snake.sphere_mm + _ROOM_MM)


def _slack(curve: Curve, pathway: Pathway, snake: SnakeModel) -> Array:
    """How far the robot may leave the curve: the lumen's least radius there less the robot's, with an upper limit."""
    assert pathway.knots is not None
    at = np.interp(np.arange(len(curve.points)) * curve.step_mm, pathway.knots, pathway.at_s)
    radius = np.interp(at, pathway.s, pathway.contours().radius.min(axis=1))
    radius = np.minimum(radius, pathway.narrowest_between(at, at))
    found: Array = np.clip(radius - snake.radius_mm, 0.0, _MOST_SLACK_MM)
    return found
