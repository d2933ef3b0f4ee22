"""The body cavity as a case: its pathway comes along, and what is driven on the page is the study's world."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from app.cases.kinds import kind_of
from app.cases.model import CAVITY_PHANTOM, COLON_PHANTOM, HEAD_PHANTOM
from app.exchange.patient_images import image_warning
from app.lumen.cavity import cavity_path
from app.lumen.document import Route
from app.lumen.tasks import TaskChoice, tasks_in
from app.services import Services
from app.tabs.patient.hints import patient_hint
from app.workspace.case_view import case_section
from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.fields.side import SurfaceSide
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.study.diathermy import placing
from vfix_engine.study.diathermy.bend_map import BendMap
from vfix_engine.worlds.snake.cavity import BASE_MM, CavityCase, cavity_case

ENDS = Route(entry=(0.0, 0.0, 0.0), end=(0.0, 0.0, 250.0))


def test_the_route_of_the_cavity_has_the_world_of_the_study() -> None:
    path, study = cavity_path(ENDS), cavity_case().spec()
    for field in dataclasses.fields(study.lumen):
        ours, theirs = getattr(path.contours, field.name), getattr(study.lumen, field.name)
        assert np.array_equal(ours, theirs) if isinstance(theirs, np.ndarray) else ours == theirs, field.name
    assert (path.snake, path.settings) == (study.snake, study.drive)
    assert path.base is not None
    assert path.base[:3, 3].tolist() == list(BASE_MM)
    assert path.reach.behind_wall is not None
    assert path.reach.behind_wall.outside == 0.0
    assert (path.reach.limit, path.reach.depth_mm) == ("base", study.snake.reach_mm())  # no tip stops on its way


def test_distances_to_the_wall_are_those_of_the_triangles() -> None:
    path, mesh = cavity_path(ENDS), cavity_case().mesh
    at = path.lumen.curve.position(path.s_mm)
    least = [_nearest(mesh, point) for point in at[::10]]
    assert path.wall_mm[::10] == pytest.approx(least, abs=1e-6)
    assert not SurfaceSide(ProximityTree(mesh)).outside(at).any()


def test_a_bound_of_the_route_counts() -> None:
    path = cavity_path(Route(entry=ENDS.entry, end=ENDS.end, bound_mm=2.0))
    assert (path.settings.bound_mm, path.settings.tip_bound_mm) == (2.0, None)


def test_labels_are_offered_in_the_cavity_and_polyps_in_a_colon(phantom_services: Services) -> None:
    cases = [phantom_services.cases.get(case) for case in (CAVITY_PHANTOM, COLON_PHANTOM, HEAD_PHANTOM)]
    assert [tasks_in(case) for case in (*cases, None)] == [("labels",), ("polyps",), (), ()]


def test_a_cavity_is_called_one_on_the_page_and_in_what_is_said_of_its_images(phantom_services: Services) -> None:
    cavity, colon = (phantom_services.cases.get(case) for case in (CAVITY_PHANTOM, COLON_PHANTOM))
    assert patient_hint(kind_of(cavity), False) == "Drag to turn the cavity. Then go to Route."
    assert patient_hint(kind_of(colon), False) == "Drag to turn the lumen. Then go to Route."
    assert case_section(cavity, "")["noun"] == "cavity"
    assert image_warning(cavity).startswith("Images of a cavity can")


def test_labels_in_a_colon_are_refused(phantom_services: Services, monkeypatch: pytest.MonkeyPatch) -> None:
    routes = phantom_services.lumen_routes
    (sample,) = routes.documents.list(COLON_PHANTOM)
    monkeypatch.setattr(routes.paths, "wait", lambda route: dataclasses.replace(cavity_path(ENDS), base=None))
    with pytest.raises(InputError, match="open that case"):
        routes.tasks.labels(sample, TaskChoice("labels"))


def test_labels_are_drawn_within_the_bound_of_the_route(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    routes = phantom_services.lumen_routes
    (sample,) = routes.documents.list(CAVITY_PHANTOM)
    maps: list[BendMap] = []

    def drawn(case: CavityCase, bends: BendMap, seed: int, count: int) -> placing.PlacedLabels:
        maps.append(bends)
        return placing.PlacedLabels((), (), 0, 0, 0, seed)

    monkeypatch.setattr(placing, "placed_labels", drawn)
    for bound_mm in (None, 2.0):
        path = cavity_path(Route(entry=ENDS.entry, end=ENDS.end, bound_mm=bound_mm))
        monkeypatch.setattr(routes.paths, "wait", lambda route, path=path: path)
        routes.tasks.labels(sample, TaskChoice("labels"))
    usual, narrow = maps
    assert narrow.context.bound.max() == 2.0
    assert usual.context.bound.max() > 2.0


def _nearest(mesh: TriangleMesh, point: np.ndarray) -> float:
    """By brute force over all triangles."""
    import trimesh

    corners = mesh.vertices[mesh.faces]
    closest = trimesh.triangles.closest_point(corners, np.tile(point, (len(corners), 1)))
    return float(np.linalg.norm(closest - point, axis=1).min())
