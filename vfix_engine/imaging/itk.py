"""The only caller of SimpleITK: one file, one named decoder, its warnings silenced."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import ImageError


def decode(path: Path, decoder: str) -> tuple[Any, npt.NDArray[Any]]:
    """(image, values [k, j, i]) of a file read by the decoder of that name ('NrrdImageIO', ...), on three axes.

    Raises ImageError when it cannot be decoded.
    """
    simpleitk: Any = importlib.import_module("SimpleITK")  # imported here: slow to load
    simpleitk.ProcessObject.SetGlobalWarningDisplay(False)  # its warnings quote the header
    reader = simpleitk.ImageFileReader()
    reader.SetImageIO(decoder)
    reader.SetFileName(str(path))
    try:
        image = reader.Execute()
    except RuntimeError:
        raise ImageError("the voxels cannot be decoded; the file is damaged.") from None
    if image.GetNumberOfComponentsPerPixel() != 1 or image.GetDimension() not in (3, 4):
        raise ImageError("the file does not hold one number per voxel on a grid of three axes.")
    if image.GetDimension() == 4:
        image = image[:, :, :, 0]
    return image, np.asarray(simpleitk.GetArrayFromImage(image))
