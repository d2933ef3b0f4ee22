"""The synthetic head shipped under assets/: its CT, bone surface and landmarks. Not for clinical use.

``scripts/make_head_phantom.py`` generates the files. Scanner noise is added when a CT is read.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.anatomy.bone import SurfaceReport
from vfix_engine.anatomy.surface import Dropped
from vfix_engine.errors import InputError
from vfix_engine.files.mesh_files import read_mesh
from vfix_engine.files.readers import read_volume
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.resources import assets_dir

SCHEMA = "vfix-phantom/1"
HEAD_CT, NOSE_CT, BONE, DESCRIPTION = "ct_head.nrrd", "ct_nose.nrrd", "bone_nose.ply", "phantom.json"
DISPLAY = {"skull": "skull_display.ply", "skull_half": "skull_half_display.ply", "skin": "skin_display.ply"}
# Deviation of the bone surface from the CT of the nose by decimation, with the triangles restored to limit it.
BONE_REPORT = SurfaceReport(0.008, 0.112, Dropped(), 0.076, 3663)
NOISE_HU = 14.0  # standard deviation
NOISE_SEED = 20
_NOISE_GRAIN = 0.55  # [voxel] Gaussian width: reconstruction correlates the noise of neighbouring voxels


@dataclass(frozen=True)
class LabelledPoint:
    """A named point, LPS [mm]."""

    label: str
    position: npt.NDArray[np.float64]


@dataclass(frozen=True)
class KnownBead:
    """A radio-opaque ball with a known centroid, LPS [mm]."""

    name: str
    centroid: npt.NDArray[np.float64]
    radius_mm: float


@dataclass(frozen=True)
class Landmarks:
    """Content of phantom.json: positions LPS [mm], and sizes by name, whose suffix is the unit."""

    beads: tuple[KnownBead, ...]
    landmarks: tuple[LabelledPoint, ...]
    corridor: tuple[LabelledPoint, ...]
    targets: tuple[LabelledPoint, ...]
    sizes: dict[str, float]


def phantom_dir() -> Path:
    """Return the folder of the shipped phantom."""
    return assets_dir() / "head_phantom"


def load_head_ct(*, noise: bool = True) -> Volume:
    """Load the whole head, with seeded scanner noise unless it is disabled."""
    return _load_ct(HEAD_CT, noise)


def load_nose_ct(*, noise: bool = True) -> Volume:
    """Load nose and sinuses at 0.5 mm, with seeded scanner noise unless it is disabled."""
    return _load_ct(NOSE_CT, noise)


def load_bone_surface() -> TriangleMesh:
    """Load the bone around the nose for proximity queries: closed, with outward normals."""
    return read_mesh(phantom_dir() / BONE)[0]


def load_landmarks() -> Landmarks:
    """Load beads, landmarks, the verified path through the nose, targets and sizes. Raises InputError."""
    data: dict[str, Any] = json.loads((phantom_dir() / DESCRIPTION).read_text(encoding="utf-8"))
    if data["schema"] != SCHEMA or (data["frame"], data["unit"]) != ("LPS", "mm"):
        raise InputError(f"{DESCRIPTION} is of the schema {data['schema']!r}, expected {SCHEMA!r} in LPS mm.")
    return Landmarks(
        tuple(KnownBead(b["name"], _position(b["centroid"]), float(b["radius_mm"])) for b in data["beads"]),
        _points(data["landmarks"]),
        _points(data["corridor"]["points"]),
        _points(data["targets"]),
        {name: float(value) for name, value in data["sizes"].items()},
    )


def with_noise(ct: Volume, seed: int = NOISE_SEED, sigma_hu: float = NOISE_HU) -> Volume:
    """Add seeded scanner noise to a volume: normal, slightly correlated between neighbours."""
    from scipy import ndimage  # imported here: slow to load

    noise = np.random.default_rng(seed).standard_normal(ct.hu.shape, dtype=np.float32)
    noise = ndimage.gaussian_filter(noise, _NOISE_GRAIN, mode="wrap", truncate=3.0)
    noisy = ct.hu + noise * np.float32(sigma_hu / noise.std())
    return Volume(np.clip(np.rint(noisy), -1024, 3071).astype(np.int16), ct.origin, ct.spacing, ct.direction)


def _load_ct(file: str, noise: bool) -> Volume:
    ct = read_volume(phantom_dir() / file)[0]
    return with_noise(ct) if noise else ct


def _points(entries: list[dict[str, Any]]) -> tuple[LabelledPoint, ...]:
    return tuple(LabelledPoint(entry["label"], _position(entry["position"])) for entry in entries)


def _position(values: list[float]) -> npt.NDArray[np.float64]:
    position = np.array(values, dtype=np.float64)
    position.setflags(write=False)
    return position
