"""What can be the wall of a lumen and what cannot, and what is said of one that is doubtful, with its figure."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from vfix_engine.anatomy import lumen_import
from vfix_engine.anatomy.lumen.colon_case import colon_case
from vfix_engine.anatomy.lumen_checks import mean_width_mm, wall_notes
from vfix_engine.anatomy.lumen_import import LumenRequest, read_lumen
from vfix_engine.errors import MeshError
from vfix_engine.files.mesh_files import write_ply
from vfix_engine.geometry.mesh import TriangleMesh

RADIUS, LENGTH = 15.0, 200.0


def tube(radius: float = RADIUS, sections: int = 48, rings: int = 24, scale: float = 1.0) -> TriangleMesh:
    """A closed tube along z, whose triangles face outwards."""
    angle, z = 2.0 * np.pi * np.arange(sections) / sections, np.linspace(0.0, LENGTH, rings)
    rim = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    places = np.concatenate([np.column_stack([rim, np.full(sections, height)]) for height in z])
    i, j = (one.ravel() for one in np.meshgrid(np.arange(rings - 1), np.arange(sections), indexing="ij"))
    a, b, k = i * sections + j, i * sections + (j + 1) % sections, np.arange(sections)
    low, last = len(places), (rings - 1) * sections
    faces = [np.column_stack([a, b, b + sections]), np.column_stack([a, b + sections, a + sections])]
    faces.append(np.column_stack([np.full(sections, low), (k + 1) % sections, k]))
    faces.append(np.column_stack([np.full(sections, low + 1), last + k, last + (k + 1) % sections]))
    ends = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, LENGTH]])
    return TriangleMesh(scale * np.concatenate([places, ends]), np.concatenate(faces).astype(np.int32))


def turned(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(mesh.vertices, np.ascontiguousarray(mesh.faces[:, ::-1]))


def aside(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(mesh.vertices + np.array([60.0, 0.0, 0.0]), mesh.faces)


def both(one: TriangleMesh, other: TriangleMesh) -> TriangleMesh:
    vertices = np.concatenate([one.vertices, other.vertices])
    return TriangleMesh(vertices, np.concatenate([one.faces, other.faces + len(one.vertices)]).astype(np.int32))


@pytest.fixture(autouse=True)
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """The import without worker processes, which take seconds each; test_lumen_import.py has it with them."""

    def isolated(function: Callable[..., Any], *args: Any, progress: Callable[..., None], **_: Any) -> Any:
        return function(*args, progress=progress)

    monkeypatch.setattr(lumen_import, "run_isolated", isolated)


def imported(mesh: TriangleMesh, folder: Path) -> str:
    """The notes of a file of a surface."""
    write_ply(file := folder / "wall.ply", mesh)
    return " ".join(read_lumen(LumenRequest(file)).notes)


TETRAHEDRON = TriangleMesh(
    np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [0.0, 100.0, 0.0], [0.0, 0.0, 100.0]]),
    np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], dtype=np.int32),
)


@pytest.mark.parametrize(
    ("mesh", "words"),
    [
        (TETRAHEDRON, r"has 4 triangles only.*at least 100 are needed.*Export it finer"),
        (tube(scale=1e-3), r"0\.03 x 0\.03 x 0\.2 mm large, which cannot be a lumen\. Its unit is metres, perhaps"),
        (tube(scale=20.0), r"4e\+03 mm large, which cannot be a lumen"),
        (tube(scale=0.1), r"encloses 0\.14 ml, which is no lumen; is its unit right"),
        (tube(1.2), r"encloses 0\.90 ml, which is no lumen"),
        (both(tube(18.0), turned(tube(15.0))), r"a wall with a thickness: 141 of the 203 ml.*inner surface alone"),
    ],
)
def test_what_cannot_be_a_lumen_is_refused_with_its_figure(mesh: TriangleMesh, words: str, tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=words):
        imported(mesh, tmp_path)


def test_a_lumen_too_narrow_for_every_robot_is_refused(tmp_path: Path) -> None:
    flat = tube(100.0)
    thin = TriangleMesh(flat.vertices * [1.0, 0.002, 1.0], flat.faces)
    with pytest.raises(MeshError, match=r"about 0\.\d mm across, and the thinnest robot 1 mm"):
        imported(thin, tmp_path)


@pytest.mark.parametrize(
    ("mesh", "words"),
    [
        (tube(sections=12, rings=6), "The surface has 144 triangles only, with edges of 41 mm: it is too coarse"),
        (turned(tube()), "The triangles of the surface faced inwards and were turned: its inside is the lumen."),
        (tube(4.0), "about 8 mm across. That is narrower than the usual robot, 12 mm: choose thinner links"),
        (tube(scale=5.0), "150 x 150 x 1e+03 mm large, which is unusual for a lumen; check its unit."),
        (
            both(tube(), aside(tube(8.0))),
            "in 2 separate pieces",
        ),
        (both(tube(20.0), turned(tube(6.0))), "ml within it belong to surfaces that face the other way"),
    ],
)
def test_what_is_doubtful_is_told_with_its_figure(mesh: TriangleMesh, words: str, tmp_path: Path) -> None:
    assert words in imported(mesh, tmp_path)


def test_the_width_is_that_of_a_long_tube_and_a_usual_lumen_is_not_doubtful() -> None:
    assert mean_width_mm(tube(8.0, rings=200)) == pytest.approx(16.0, rel=0.05)
    (only,) = wall_notes(colon_case().mesh)
    assert "ml and is about 36 mm across." in only


def test_words_of_a_lumen_are_not_those_of_a_head(tmp_path: Path) -> None:
    solid = trimesh.creation.cylinder(RADIUS, LENGTH, sections=24).subdivide()
    told = imported(TriangleMesh(np.asarray(solid.vertices), np.asarray(solid.faces, dtype=np.int32)), tmp_path)
    assert not any(word in told.lower() for word in ("bone", "head", "skull", "teeth"))
