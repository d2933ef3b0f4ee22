"""Small lumens in which a small robot uses every kernel of steps and plans, to load them before the first step."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...pathway.pathway import Pathway
from ...pathway.tissue_motion import breathing
from ...robots.snake import SnakeModel
from ...snake.conform.conforming import driven_curve
from .plans.planner import Planner
from .settings import DriveSettings, SnakeSettings
from .stepping.constants import Start, start_of

LINKS, TIP_MM = 6, 160.0
_BEND_MM, _TURN, _RADIUS_MM, _CONTOURS = 26.0, 4.2, 9.0, 41  # sharper than joints of ± 45° can follow


def small_lumens() -> Iterator[tuple[Start, Planner]]:
    """Robots deep in a narrow loop that is too sharp for their joints: one in moving tissue, one in still tissue."""
    turn = np.linspace(0.0, _TURN, _CONTOURS)
    centre = np.column_stack([_BEND_MM * (1.0 - np.cos(turn)), 6.0 * turn, _BEND_MM * np.sin(turn)])
    straight = np.column_stack([np.zeros((20, 2)), np.linspace(-60.0, -3.0, 20)])
    centre = np.concatenate([straight, centre])
    settings = SnakeSettings(bound_mm=4.0, tip_bound_mm=2.0)
    fixed = settings.of_drive(DriveSettings(bends=8, vertices_per_link=20, manipulated=4))
    snake = SnakeModel(LINKS, radius_mm=5.0)
    for motion in (breathing((0.0, 0.3, 1.0), 2.0, 1.0, 60.0), None):
        pathway = Pathway(centre, np.full((len(centre), 1), _RADIUS_MM), len(centre), motion=motion)
        curve = driven_curve(pathway, None)
        start = start_of(snake, pathway, fixed, curve, None, TIP_MM, adjusted=settings, beyond_allowed=True)
        yield start, Planner(snake, pathway, curve, None, fixed)
