"""How much of what was certified lies behind the wall: of the pathway's surface, and of the links."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...geometry.mesh import TriangleMesh
from ...pathway.fit import containment
from ...robots.snake_kernel import snake_frames
from ...worlds.snake.link_depth import LinkDepth
from ...worlds.snake.spec import SnakeSystemSpec
from .samples import LumenSamples

EVERY_S = 0.5  # between two poses whose links are measured
MOST_POSES = 400


@dataclass(frozen=True)
class BehindWall:
    """A certificate speaks of the pathway, not of the wall.

    share: of the pathway's surface at rest that is behind the wall; depth_mm: the most that it is; so deep, and by its
    bound deeper, a certified link can be. links_mm: the most that a link was, every ``EVERY_S`` of the run, of a long
    one at ``MOST_POSES`` times; None where the tissue moves, as the surface does not move with it.
    """

    share: float
    depth_mm: float
    links_mm: float | None


def behind_wall_of(samples: LumenSamples, spec: SnakeSystemSpec, wall: TriangleMesh) -> BehindWall:
    """Measure a run against the surface of its lumen.

    wall: LPS mm, normals outwards.
    Raises PathwayError: the lumen gives no pathway, or it does not lie in the surface.
    """
    pathway, curve = spec.way()
    found = containment(wall, pathway.moved(None))
    links_mm = None
    if spec.tissue is None:
        if spec.base is None:
            start, ahead = curve.position(0.0), curve.tangent(0.0)
        else:
            start, ahead = spec.base[:3, 3], spec.base[:3, 2]
        links_mm = _deepest(samples, LinkDepth(wall, start, ahead), spec.base is not None)
    return BehindWall(found.outside, found.depth_mm[-1], links_mm)


def _deepest(samples: LumenSamples, wall: LinkDepth, fixed: bool) -> float:
    """The most in mm that a link was behind the wall; ``fixed``: all links are in the lumen, on a base."""
    snake, last = samples.snake, len(samples.t) - 1
    count = min(MOST_POSES, 1 + math.ceil(samples.t[-1] / EVERY_S))
    rows = np.unique(np.searchsorted(samples.t, np.linspace(samples.t[0], samples.t[-1], count)).clip(0, last))
    frames, deepest = np.empty((snake.links, 3, 4)), 0.0
    left = snake.length_mm * (snake.links - np.arange(snake.links))  # from a link's near joint to the tip
    for row in rows.tolist():
        snake_frames(samples.q[row], samples.base[row], snake.length_mm, frames)
        chain = np.concatenate([samples.base[row, None, :, 3], frames[:, :, 3]])
        inside = np.full(snake.links, True) if fixed else samples.depth[row] >= left
        deepest = max(deepest, wall.deepest(chain, snake.radius_mm, inside).mm)
    return deepest
