"""How deep a snake comes, before any motion: what ends it, where, and what would come deeper."""

import json

import numpy as np
import pytest

from vfix_engine.anatomy.lumen.colon_case import colon_case
from vfix_engine.geometry.curve import Curve
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.pathway.pathway import Pathway
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.worlds.snake.lumen import Lumen, lumen_between
from vfix_engine.worlds.snake.reach import Reach, reach_of
from vfix_engine.worlds.snake.settings import DriveSettings

SETTINGS = DriveSettings(vertices_per_link=30, waypoint_mm=2.0)


@pytest.fixture(scope="module")
def hard() -> tuple[TriangleMesh, Lumen]:
    case = colon_case(hard=True)
    return case.mesh, lumen_between(case.mesh, case.start, case.end, SnakeModel(1), SETTINGS)


def reach(lumen: Lumen, snake: SnakeModel, settings: DriveSettings = SETTINGS) -> Reach:
    return reach_of(lumen.pathway, snake, settings, lumen.curve, lumen.slack)


def test_a_narrow_place_ends_it_and_thinner_links_of_half_the_length_pass(hard: tuple[TriangleMesh, Lumen]) -> None:
    mesh, lumen = hard
    found = reach_of(lumen.pathway, SnakeModel(30), SETTINGS, lumen.curve, lumen.slack, mesh=mesh)
    assert found.limit == "narrow"
    assert 370.0 < found.depth_mm < 400.0
    first = found.narrowest.first
    assert first is not None
    assert found.at_lps == first.at_lps
    assert first.words in found.words
    assert lumen.curve.closest(found.at_lps) == pytest.approx(first.at_mm, abs=10.0)
    (offer,) = found.offers
    assert (offer.snake.links, offer.snake.length_mm, offer.snake.radius_mm) == (60, 14.0, 4.0)
    assert offer.depth_mm == pytest.approx(840.0)
    assert found.behind_wall is not None
    assert 0.1 < found.behind_wall.outside < 0.5
    assert 0.0 < found.behind_wall.depth_mm[0] < found.behind_wall.depth_mm[2] < 8.0
    told = json.loads(json.dumps(found.to_dict()))
    assert told["behind_wall"]["share"] == found.behind_wall.outside
    assert told["offers"][0]["snake"]["links"] == 60


def test_too_few_links_end_it_and_the_number_that_reaches_is_told(hard: tuple[TriangleMesh, Lumen]) -> None:
    found = reach(hard[1], SnakeModel(5, length_mm=14.0, radius_mm=4.0))
    assert found.limit == "links"
    assert found.depth_mm == pytest.approx(70.0)
    assert found.path_mm == pytest.approx(hard[1].curve.length)
    (offer,) = found.offers
    assert offer.snake.links == np.ceil(found.path_mm / 14.0)
    assert offer.depth_mm == pytest.approx(found.path_mm)
    assert str(offer.snake.links) in found.words
    assert found.behind_wall is None


def test_a_bound_too_small_for_the_links_ends_it_where_a_link_would_leave() -> None:
    """Chords of 28 mm in a bend of 30 mm leave a tube of 3 mm by more than 0.2 mm; chords of 14 mm do not."""
    turn = np.linspace(0.0, np.pi, 60)
    arc = np.column_stack([30.0 - 30.0 * np.cos(turn), np.zeros(60), 60.0 + 30.0 * np.sin(turn)])
    line = np.concatenate([np.column_stack([np.zeros((20, 2)), np.linspace(0.0, 58.0, 20)]), arc])
    pathway = Pathway(line, np.full(len(line), 3.0), 120)
    thin = SnakeModel(5, radius_mm=2.0)
    found = reach_of(pathway, thin, DriveSettings(bound_mm=0.2, vertices_per_link=30))
    assert found.limit == "bound"
    assert 55.0 < found.depth_mm < 130.0
    assert "its bound is" in found.words
    axis = Curve.through(line)
    away = np.array(found.at_lps) - axis.position(axis.closest(found.at_lps))
    assert np.linalg.norm(away) == pytest.approx(3.2, abs=0.02)  # just beyond the tube and the bound
    assert found.offers
    assert all(offer.depth_mm > found.depth_mm for offer in found.offers)
    assert not reach_of(pathway, thin, DriveSettings(bound_mm=0.2, vertices_per_link=30), offers=False).offers


def test_a_robot_that_fits_reaches_the_end_and_needs_no_offer() -> None:
    line = np.column_stack([np.zeros((20, 2)), np.linspace(0.0, 140.0, 20)])
    found = reach_of(Pathway(line, np.full(20, 12.0), 60), SnakeModel(5), SETTINGS)
    assert (found.limit, found.offers) == ("end", ())
    assert found.depth_mm == pytest.approx(140.0)
