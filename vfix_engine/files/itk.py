"""The only caller of SimpleITK: one file, one named decoder, warnings suppressed."""

from __future__ import annotations

import importlib
import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import ImageError

_SUFFIXES = {"NrrdImageIO": ".nrrd", "NiftiImageIO": ".nii", "MetaImageIO": ".mha", "GDCMImageIO": ".dcm"}


def decode(path: Path, decoder: str) -> tuple[Any, npt.NDArray[Any]]:
    """Read a file with the named decoder ('NrrdImageIO', ...): (image, values [k, j, i]) on three axes.

    Raises ImageError if it cannot be decoded.
    """
    simpleitk: Any = importlib.import_module("SimpleITK")  # imported here: slow to load
    simpleitk.ProcessObject.SetGlobalWarningDisplay(False)  # its warnings quote the header
    with tempfile.TemporaryDirectory() as folder:
        reader = simpleitk.ImageFileReader()
        reader.SetImageIO(decoder)
        reader.SetFileName(str(_neutral(path, decoder, Path(folder))))
        try:
            image = reader.Execute()
        except RuntimeError:
            raise ImageError("the voxels cannot be decoded; the file is damaged.") from None
    axes = image.GetDimension()
    if image.GetNumberOfComponentsPerPixel() != 1 or axes < 3 or any(size != 1 for size in image.GetSize()[3:]):
        raise ImageError("the file does not hold one number per voxel on a grid of three axes.")
    if axes > 3:
        image = image[(slice(None), slice(None), slice(None), *([0] * (axes - 3)))]
    return image, np.asarray(simpleitk.GetArrayFromImage(image))


def _neutral(path: Path, decoder: str, folder: Path) -> Path:
    """Return a path to the file with an ASCII name: a name that is not UTF-8 terminates the process in SimpleITK.

    A link if the system supports them, else a copy.
    """
    name = folder / f"image{_SUFFIXES[decoder]}"
    if decoder == "NiftiImageIO" and path.name.lower().endswith(".gz"):
        name = name.with_name(f"{name.name}.gz")
    try:
        name.symlink_to(path.absolute())
    except (OSError, NotImplementedError):
        shutil.copyfile(path, name)
    return name
