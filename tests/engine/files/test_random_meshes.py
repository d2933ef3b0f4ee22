"""500 surfaces spoiled at random: each is refused with the reason that it has, or measured rightly (HAZ-09)."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

from tests.engine.geometry_oracle import every_distance
from vfix_engine.anatomy.head_files import read_surface_of_head
from vfix_engine.errors import MeshError
from vfix_engine.geometry.capsules import Segments
from vfix_engine.proximity.proximity import ProximityTree

MESHES = 500
Surface = tuple[np.ndarray, np.ndarray]
Spoil = Callable[[np.ndarray, np.ndarray, np.random.Generator], Surface]


def some(items: np.ndarray, random: np.random.Generator) -> np.ndarray:
    return random.choice(len(items), 1 + len(items) // 10, replace=False)


def changed(array: np.ndarray, places: object, value: object) -> np.ndarray:
    copy = array.copy()
    copy[places] = value
    return copy


def flattened(faces: np.ndarray, rows: np.ndarray) -> np.ndarray:
    return changed(faces, (rows, 2), faces[rows, 1])


HARMLESS: dict[str, Spoil] = {
    "holes": lambda v, f, random: (v, np.delete(f, some(f, random), axis=0)),
    "doubled": lambda v, f, random: (v, np.vstack([f, f[some(f, random)]])),
    "turned": lambda v, f, random: (v, changed(f, rows := some(f, random), f[rows][:, ::-1])),
    "flat": lambda v, f, random: (v, flattened(f, some(f, random))),
    "rough": lambda v, f, random: (v + random.normal(size=v.shape), f),
    "crossing": lambda v, f, random: (v, random.permuted(f.ravel()).reshape(-1, 3)),
    "moved": lambda v, f, random: (v + random.uniform(-2000, 2000, 3), f),
}
FATAL: dict[str, tuple[str, Spoil]] = {
    "nan": ("not finite", lambda v, f, random: (changed(v, some(v, random), np.nan), f)),
    "infinite": ("not finite", lambda v, f, random: (changed(v, some(v, random), -np.inf), f)),
    "beyond": (
        "names corner",
        lambda v, f, random: (v, changed(f, (some(f, random), 1), len(v) + random.integers(99))),
    ),
    "negative": ("names corner -", lambda v, f, random: (v, changed(f, (some(f, random), 0), -random.integers(1, 9)))),
    "small": ("cannot be a head", lambda v, f, random: (v * 10.0 ** random.uniform(-4, -2), f)),
    "large": ("cannot be a head|from the origin", lambda v, f, random: (v * 10.0 ** random.uniform(2, 30), f)),
    "empty": ("no triangles", lambda v, f, random: (v, f[:0])),
    "all flat": ("without area", lambda v, f, random: (v, flattened(f, np.arange(len(f))))),
}


def save(vertices: np.ndarray, faces: np.ndarray, file: Path) -> Path:
    """A binary PLY or STL, written by hand so that nothing is mended on the way."""
    if file.suffix == ".stl":
        records = np.zeros(len(faces), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
        records["corners"] = vertices[faces]
        file.write_bytes(bytes(80) + np.uint32(len(faces)).tobytes() + records.tobytes())
        return file
    head = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\nproperty double x\nproperty double y\n"
        f"property double z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = np.empty(len(faces), [("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, faces
    file.write_bytes(head.encode() + vertices.astype("<f8").tobytes() + rows.tobytes())
    return file


def test_random_surfaces_are_refused_with_their_reason_or_measured(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """HAZ-09: half of them with a fault that is fatal, all with some that are not."""
    random, whole = np.random.default_rng(9), trimesh.creation.icosphere(subdivisions=2, radius=60.0)
    refused = 0
    for number in range(MESHES):
        vertices, faces = np.array(whole.vertices), np.array(whole.faces)
        kinds = random.choice(list(HARMLESS), 2, replace=False)
        for kind in kinds:
            vertices, faces = HARMLESS[kind](vertices, faces, random)
        fault = random.choice(list(FATAL)) if number % 2 else None
        indexed = fault in ("beyond", "negative")
        file = tmp_path / f"head.{'ply' if indexed or random.random() < 0.5 else 'stl'}"
        if fault is not None:
            words, spoil = FATAL[fault]
            with pytest.raises(MeshError, match=words), np.errstate(over="ignore"):
                read_surface_of_head(save(*spoil(vertices, faces, random), file), "LPS", "mm")
            refused += 1
            continue
        mesh, _, notes = read_surface_of_head(save(vertices, faces, file), "LPS", "mm")
        assert len(mesh.faces) == len(faces)
        flat = int(np.count_nonzero(~mesh.face_normals.any(axis=1)))
        assert [note for note in notes if note.startswith(f"{flat:,} of ")] != [] or flat == 0
        assert flat > 0 or "flat" not in kinds
        low, high = mesh.bounds
        ends = random.uniform(low - 20.0, high + 20.0, (2, 3))
        tool = Segments(ends[:1], ends[1:], np.array([1.5]))
        nearest = every_distance(ends[0], ends[1], mesh.triangles).min() - 1.5
        assert ProximityTree(mesh).clearance(tool) == pytest.approx(nearest, abs=1e-9)
    with capsys.disabled():
        print(f"\n{MESHES} random surfaces: {refused} refused with their reason, {MESHES - refused} measured", end="")
