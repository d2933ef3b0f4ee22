"""Surfaces and volumes of a case as files: numpy archives without pickle (HAZ-22), or assets that travel with vfix."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from app.cases.model import SurfaceInfo, VolumeInfo, to_bounds, to_triple
from app.kit.array_files import ArraysUnusable, read_arrays
from app.kit.errors import TooLarge
from app.store import FileStore
from app.store.errors import StorageError
from vfix_engine.anatomy.bone import SurfaceReport
from vfix_engine.anatomy.lumen.colon_case import ColonCase, colon_case
from vfix_engine.anatomy.phantom import load_head_ct, load_nose_ct
from vfix_engine.errors import InputError
from vfix_engine.files.mesh_files import read_mesh
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.resources import assets_dir

if TYPE_CHECKING:  # slow to load
    from vfix_engine.worlds.snake.cavity import CavityCase

ASSET, STORED = "asset:", "sha256:"
# The phantom's CT is shipped without noise, which its loader adds.
PHANTOM_CT: dict[str, Callable[[], Volume]] = {"phantom:head": load_head_ct, "phantom:nose": load_nose_ct}


@functools.cache
def shipped_colon(hard: bool = False) -> ColonCase:
    """A synthetic colon that travels with vfix, the usual one or the hard one, made once in a process."""
    return colon_case(hard=hard)


@functools.cache
def shipped_cavity() -> CavityCase:
    """The synthetic body cavity of study II of Kwok 2013, made once in a process."""
    from vfix_engine.worlds.snake.cavity import cavity_case

    return cavity_case()


PHANTOM_SURFACES: dict[str, Callable[[], TriangleMesh]] = {
    "phantom:colon": lambda: shipped_colon().mesh,
    "phantom:hardcolon": lambda: shipped_colon(hard=True).mesh,
    "phantom:cavity": lambda: shipped_cavity().mesh,
}


class CaseFiles:
    """Writes and reads the files of cases."""

    def __init__(self, files: FileStore) -> None:
        self._files = files

    def put_surface(self, name: str, mesh: TriangleMesh, report: SurfaceReport | None = None) -> SurfaceInfo:
        """Store a surface; every coordinate comes back bit for bit."""
        key = self._files.put_with(lambda file: np.savez(file, **surface_arrays(mesh)))
        return surface_info(name, mesh, STORED + key, report)

    def put_volume(self, name: str, volume: Volume) -> VolumeInfo:
        """Store a volume."""
        key = self._files.put_with(lambda file: np.savez(file, **volume_arrays(volume)))
        return volume_info(name, volume, STORED + key)

    def surface(self, source: str) -> TriangleMesh:
        """Read a surface. Raises StorageError when its file is gone or damaged."""
        if source.startswith(ASSET):
            return read_mesh(assets_dir() / source.removeprefix(ASSET), "LPS", "mm")[0]
        if source in PHANTOM_SURFACES:
            return PHANTOM_SURFACES[source]()
        arrays = self._arrays(source, {"vertices", "faces"}, set())
        return TriangleMesh(arrays["vertices"], arrays["faces"])

    def volume(self, source: str) -> Volume:
        """Read a volume. Raises StorageError when its file is gone or damaged."""
        if source in PHANTOM_CT:
            return PHANTOM_CT[source]()
        more: dict[str, tuple[int, ...]] = {"slice_thickness_mm": (), "window": (2,), "resampled_mm": ()}
        arrays = self._arrays(source, {"hu", "origin", "spacing", "direction"}, set(more))
        for name, shape in more.items():
            if name in arrays and arrays[name].shape != shape:
                raise StorageError(f"the stored file of a volume has another {name} than it should; import it again.")
        return Volume(**arrays)

    def _arrays(self, source: str, needed: set[str], possible: set[str]) -> dict[str, Any]:
        path = self._files.path(source.removeprefix(STORED))
        try:
            arrays = read_arrays(path)
            if not needed <= set(arrays) <= needed | possible:
                raise ArraysUnusable("a file of arrays does not hold what it should.")
        except (OSError, ArraysUnusable, TooLarge) as error:
            why = f" ({str(error).rstrip('.')})" if isinstance(error, InputError) else ""
            raise StorageError(f"the stored file {path.name[:12]} is damaged{why}; import the case again.") from error
        return arrays


def surface_arrays(mesh: TriangleMesh) -> dict[str, Any]:
    """What the file of a surface holds."""
    return {"vertices": mesh.vertices, "faces": mesh.faces}


def volume_arrays(volume: Volume) -> dict[str, Any]:
    """What the file of a volume holds: its fields, without those that it leaves open."""
    values = {field.name: getattr(volume, field.name) for field in fields(volume)}
    return {name: value for name, value in values.items() if value is not None}


def surface_info(name: str, mesh: TriangleMesh, source: str, report: SurfaceReport | None = None) -> SurfaceInfo:
    return SurfaceInfo(name, len(mesh.faces), to_bounds(mesh.bounds), source, report)


def volume_info(name: str, volume: Volume, source: str) -> VolumeInfo:
    k, j, i = volume.hu.shape
    spacing, bounds = to_triple(volume.spacing), to_bounds(volume.bounds)
    return VolumeInfo(name, spacing, (i, j, k), bounds, source, volume.slice_thickness_mm, volume.window)
