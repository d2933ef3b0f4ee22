"""The surface of an inspection cone: as wide as its directions, closed, and never wider."""

import numpy as np
import pytest

from vfix_engine.errors import InputError
from vfix_engine.worlds.rigid.cone_surface import cone_surface, mean_direction
from vfix_engine.worlds.rigid.inspection_cone import InspectionCone, spread_directions

TARGET = np.array([3.0, -60.0, 12.0])
LENGTH_MM = 30.0


def cone_of(chosen: np.ndarray) -> InspectionCone:
    directions = spread_directions()[chosen]
    return InspectionCone(directions, np.ones(len(directions), np.int64), len(directions))


def oblong() -> np.ndarray:
    """Directions within 40 degrees of one axis and 15 of a plane through it."""
    y = spread_directions()
    return (y[:, 1] > np.cos(np.radians(40.0))) & (abs(y[:, 0]) < np.sin(np.radians(15.0)))


def test_it_is_closed_and_its_cap_lies_where_the_tails_of_the_tools_are() -> None:
    vertices, faces = cone_surface(cone_of(oblong()), TARGET, LENGTH_MM)
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert np.allclose(vertices[0], TARGET)
    towards = (vertices[1:] - TARGET) / LENGTH_MM
    members = -spread_directions()[oblong()]
    assert (abs(towards @ members.T - 1.0).min(axis=1) < 1e-12).all(), "each corner is a direction that was found"


def test_its_cap_covers_the_directions_and_no_others() -> None:
    """Against rays through every triangle."""
    chosen = oblong()
    vertices, faces = cone_surface(cone_of(chosen), TARGET, LENGTH_MM)
    corners = (vertices - TARGET)[faces[(faces != 0).all(axis=1)]]
    rng = np.random.default_rng(4)
    rays = rng.normal(size=(4000, 3))
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    share = np.linalg.solve(np.swapaxes(corners, 1, 2)[None], rays[:, None, :, None])[..., 0]
    within = (share >= 0.0).all(axis=2).any(axis=1)
    x, y = -rays[:, 0], -rays[:, 1]
    inner = (y > np.cos(np.radians(34.0))) & (abs(x) < np.sin(np.radians(9.0)))
    outer = (y > np.cos(np.radians(40.0))) & (abs(x) < np.sin(np.radians(15.0)))
    assert inner.sum() > 50
    assert within[inner].all()
    assert not within[~outer].any()


def test_directions_that_span_no_area_are_a_thin_round_cone_and_none_is_nothing() -> None:
    one = np.zeros(len(spread_directions()), bool)
    one[700] = True
    cone = cone_of(one)
    vertices, faces = cone_surface(cone, TARGET, LENGTH_MM)
    assert len(faces)
    tail = (vertices[1:] - TARGET) / LENGTH_MM
    opening = 2.0 * np.degrees(np.arccos(tail @ -cone.directions[0]))
    assert opening == pytest.approx(np.full(len(tail), cone.cone_deg), rel=1e-6)
    nothing = cone_of(np.zeros(len(one), bool))
    assert [len(part) for part in cone_surface(nothing, TARGET, LENGTH_MM)] == [0, 0]
    assert np.isnan(mean_direction(nothing)).all()
    with pytest.raises(InputError):
        cone_surface(cone, [np.nan, 0.0, 0.0], LENGTH_MM)


def test_the_middle_of_a_cone_points_to_the_tail() -> None:
    y = spread_directions()
    cone = cone_of(y[:, 1] > 0.9)
    assert mean_direction(cone) == pytest.approx([0.0, -1.0, 0.0], abs=0.02)
