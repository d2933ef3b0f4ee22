"""Synthetic colon cases: closed surfaces along a course, the same by seed, that a pathway can be fitted to."""

import numpy as np
import pytest
import trimesh

from vfix_engine.anatomy.lumen.colon_case import ColonCase, colon_case
from vfix_engine.errors import InputError
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.worlds.snake.lumen import lumen_between
from vfix_engine.worlds.snake.narrow import narrowest
from vfix_engine.worlds.snake.settings import DriveSettings

HALF_LINKS = SnakeModel(60, length_mm=14.0, radius_mm=4.0)
IN_ORDER = (
    "anus", "rectosigmoid", "descending_sigmoid", "splenic_flexure", "hepatic_flexure", "ascending", "caecum",
)  # fmt: skip


@pytest.fixture(scope="module", params=[False, True], ids=["usual", "hard"])
def case(request: pytest.FixtureRequest) -> ColonCase:
    return colon_case(hard=request.param)


def test_the_surface_is_one_closed_piece_with_outward_normals(case: ColonCase) -> None:
    mesh = trimesh.Trimesh(case.mesh.vertices, case.mesh.faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.body_count == 1
    assert 0.8e6 < case.mesh.volume_mm3 < 1.2e6  # with inward normals it would be negative
    assert 35_000 < len(case.mesh.faces) < 45_000
    assert 860.0 < case.course.curve.length < 900.0


def test_the_wall_is_where_the_course_says(case: ColonCase) -> None:
    """Nowhere does another part of the colon come into its lumen."""
    curve = case.course.curve
    away = ProximityTree(case.mesh).point_distance(curve.points)[0]
    assert (away[8:-8] > 0.6 * case.course.radius[8:-8]).all()


def test_landmarks_and_clicks_are_inside_and_in_order(case: ColonCase) -> None:
    mesh = trimesh.Trimesh(case.mesh.vertices, case.mesh.faces, process=False)
    marks = case.course.landmarks
    assert tuple(marks) == IN_ORDER
    assert mesh.contains(np.array([*marks.values(), case.start, case.end])).all()
    places = [case.course.curve.closest(mark) for mark in marks.values()]
    assert (np.diff(places) > 40.0).all()


def test_the_same_seed_gives_the_same_surface() -> None:
    first, again, other, hard = colon_case(3), colon_case(3), colon_case(4), colon_case(3, hard=True)
    assert first.mesh.content_hash == again.mesh.content_hash
    assert len({one.mesh.content_hash for one in (first, other, hard)}) == 3
    with pytest.raises(InputError, match="the seed"):
        colon_case(-1)


def test_the_usual_robot_fits_through_the_usual_colon_and_the_thin_one_through_both(case: ColonCase) -> None:
    hard = case.course.radius.min() < 6.0
    for model, fits in ((SnakeModel(30), not hard), (HALF_LINKS, True)):
        lumen = lumen_between(case.mesh, case.start, case.end, model, DriveSettings())
        assert lumen.centreline.curve.length == pytest.approx(case.course.curve.length, rel=0.03)
        found = narrowest(lumen.pathway, model, None, min(lumen.curve.length, model.reach_mm()), lumen.curve)
        assert (found.first is None) == fits
        if not fits:
            assert found.first is not None
            assert found.first.at_mm == pytest.approx(400.0, abs=20.0)  # the second slit, 10 mm high
