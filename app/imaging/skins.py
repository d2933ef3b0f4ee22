"""The skin of a head for display, made of its widest CT when it is first asked for.

It is a face (HAZ-34): derived from the CT and stored beside it, not in the case, so that no plan refers to it and no
export holds it.
"""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

import numpy as np

from app.cases.files import surface_arrays
from app.imaging.derived_of_ct import DerivedOfCt
from app.kit.array_files import read_arrays
from vfix_engine.anatomy.skin import skin_of_volume
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.progress import ProgressCallback


class Skins(DerivedOfCt[TriangleMesh]):
    """Makes, stores and reads the skins of cases. Thread-safe."""

    job = "skin"
    file = "skin-1.npz"
    no_ct = "only the CT of a head shows skin."

    def find(self, volume: Volume, progress: ProgressCallback) -> TriangleMesh:
        return skin_of_volume(volume, progress=progress).mesh

    def write(self, value: TriangleMesh, file: BinaryIO) -> None:
        np.savez(file, **surface_arrays(value))

    def read(self, path: Path) -> TriangleMesh:
        arrays = read_arrays(path)
        return TriangleMesh(arrays["vertices"], arrays["faces"])
