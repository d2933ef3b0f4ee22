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
    curve = followable(centreline, snake)
    pathway = fit_pathway(
        mesh, curve, settings.contours, settings.interpolated, settings.angles, quantile=settings.quantile
    )
    return _lumen(mesh, centreline, curve, pathway, snake, tissue)


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
    at = np.linspace(0.0, pathway.length, len(curve.points))
    radius = np.interp(at, pathway.s, pathway.contours().radius.min(axis=1))
    radius = np.minimum(radius, pathway.narrowest_between(at, at))
    found: Array = np.clip(radius - snake.radius_mm, 0.0, _MOST_SLACK_MM)
    return found
