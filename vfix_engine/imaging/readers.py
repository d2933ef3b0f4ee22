"""CT volumes at the door: NRRD, NIfTI, MetaImage and DICOM in; Hounsfield units in LPS mm out.

The header is checked by our own few lines before SimpleITK decodes a voxel, and SimpleITK's placement of the grid must
agree with ours: two independent readings of where the patient is. Files that were not made by the user's own hands are
read in a worker (`isolated.run_isolated`), because the decoders behind SimpleITK are not written for hostile input.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import ImageError
from vfix_engine.frames import RAS_TO_LPS
from vfix_engine.imaging import dicom, metaimage, nifti, nrrd
from vfix_engine.imaging.frame_report import MM_PER_UNIT, FrameReport, settle
from vfix_engine.imaging.grid_header import GridHeader
from vfix_engine.imaging.itk import decode
from vfix_engine.imaging.volume import Volume, to_hu, volume_of

VOLUME_SUFFIXES = (".nrrd", ".nii", ".nii.gz", ".mha", ".zip")
_READINGS_AGREE = 0.01  # [mm]


def is_volume(path: Path) -> bool:
    """Whether the name says that a CT volume is in it: a folder or zip of DICOM, or an image file."""
    return path.is_dir() or path.name.lower().endswith((*VOLUME_SUFFIXES, ".dcm"))


def is_dicom(path: Path) -> bool:
    """Whether the path is taken as a DICOM series: a folder or a zip."""
    return path.is_dir() or path.name.lower().endswith((".zip", ".dcm"))


def read_volume(
    path: str | Path,
    frame: str | None = None,
    unit: str | None = None,
    *,
    assume: bool = False,
    series: int | None = None,
) -> tuple[Volume, FrameReport]:
    """Read a CT volume into LPS mm.

    path: .nrrd, .nii, .nii.gz, .mha, or a folder or .zip of one DICOM series.
    frame, unit: what the user says where the file does not ('LPS' or 'RAS', 'mm' or 'm').
    assume: take LPS mm where nobody says, and report it, instead of raising.
    series: which one of several DICOM series, counted from 1; an error lists them.

    Raises ImageError when the volume cannot be used and FrameError when frame or unit are missing or contradict it.
    """
    path = Path(path)
    name = path.name.lower()
    if not path.exists():
        raise ImageError("there is no such file or folder.")
    if is_dicom(path):
        _, _, report = settle(("LPS", "mm"), (frame, unit), assume=assume)  # both are fixed by the DICOM standard
        return dicom.read_series(path, series), report
    if series is not None:
        raise ImageError("a series is chosen among those of a DICOM folder or zip, which this file is not.")
    if name.endswith(".nrrd"):
        return _read_nrrd(path, (frame, unit), assume)
    if name.endswith((".nii", ".nii.gz")):
        return _read_grid(path, nifti.read_header(path), "NiftiImageIO", (frame, unit), assume)
    if name.endswith(".mha"):
        return _read_grid(path, metaimage.read_header(path), "MetaImageIO", (frame, unit), assume)
    raise ImageError(f"a CT volume is read from {', '.join(VOLUME_SUFFIXES)} or a folder of DICOM files.")


def _read_nrrd(path: Path, given: tuple[str | None, str | None], assume: bool) -> tuple[Volume, FrameReport]:
    header = nrrd.read_header(path)
    if header.frame is not None:
        return _read_grid(path, header, "NrrdImageIO", given, assume)
    frame, _, report = settle((None, header.unit), given, assume=assume)
    with tempfile.TemporaryDirectory() as folder:
        named = Path(folder) / "named.nrrd"
        nrrd.write_named(path, frame, named)
        volume, _ = _read_grid(named, nrrd.read_header(named), "NrrdImageIO", (None, None), assume)
    return volume, report


def _read_grid(
    path: Path, header: GridHeader, decoder: str, given: tuple[str | None, str | None], assume: bool
) -> tuple[Volume, FrameReport]:
    frame, unit, report = settle((header.frame, header.unit), given, assume=assume)
    image, values = decode(path, decoder)
    if tuple(image.GetSize()[:3]) != header.sizes:
        raise ImageError("two readings of the header disagree about the number of voxels.")
    to_lps = np.diag([*(RAS_TO_LPS if frame == "RAS" else np.ones(3)), 1.0])
    transform = to_lps @ header.transform_index_to_file
    transform[:3] *= MM_PER_UNIT[unit]
    if header.frame is not None and header.unit == "mm":
        _check_agreement(image, transform, header.sizes)
    return volume_of(to_hu(values), transform), report


def _check_agreement(image: Any, transform: npt.NDArray[np.float64], sizes: tuple[int, int, int]) -> None:
    """The decoder must place the grid's corners where the header check does."""
    for corner in np.ndindex(2, 2, 2):
        index = np.array(corner) * (np.array(sizes) - 1.0)
        ours = transform[:3, :3] @ index + transform[:3, 3]
        theirs = image.TransformContinuousIndexToPhysicalPoint(index.tolist())
        if not np.abs(ours - theirs).max() <= _READINGS_AGREE:
            raise ImageError("two readings of the header place the volume differently; save it anew.")
