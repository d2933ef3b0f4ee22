"""Reader of CT volumes (NRRD, NIfTI, MetaImage, DICOM) as Hounsfield units in LPS mm.

The header is validated here before SimpleITK decodes any voxel, and both readings of the grid's transform must agree.
Untrusted files are read in a worker (`isolated.run_isolated`), because SimpleITK's decoders are not hardened.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import ImageError
from vfix_engine.files import dicom, metaimage, nifti, nrrd
from vfix_engine.files.detached import HEADER_SUFFIXES, files_of, is_header, joined
from vfix_engine.files.frame_report import MM_PER_UNIT, FrameReport, resolve_frame
from vfix_engine.files.grid_header import GridHeader
from vfix_engine.files.itk import decode
from vfix_engine.files.volume import Volume, to_hu, volume_of
from vfix_engine.frames import RAS_TO_LPS

VOLUME_SUFFIXES = (".nrrd", ".nii", ".nii.gz", ".mha", ".zip")
_READINGS_AGREE = 0.01  # [mm]


def is_volume(path: Path) -> bool:
    """Whether the path looks like a CT volume: a folder or zip of DICOM, or an image file."""
    return is_dicom(path) or path.name.lower().endswith((*VOLUME_SUFFIXES, *HEADER_SUFFIXES))


def is_dicom(path: Path) -> bool:
    """Whether the path is treated as a DICOM series: a folder, a zip, or a file with the DICOM preamble."""
    return path.is_dir() or path.name.lower().endswith((".zip", ".dcm")) or _begins_as_dicom(path)


def _begins_as_dicom(path: Path) -> bool:
    """Check files whose names do not state their format, as scanners write them."""
    if path.name.lower().endswith((*VOLUME_SUFFIXES, *HEADER_SUFFIXES)) or not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(132)[128:] == b"DICM"


def read_volume(
    path: str | Path,
    frame: str | None = None,
    unit: str | None = None,
    *,
    assume: bool = False,
    series: int | None = None,
    files: tuple[Path, ...] = (),
    modalities: tuple[str, ...] = ("CT",),
    convert: Callable[[npt.NDArray[Any]], npt.NDArray[np.int16]] = to_hu,
) -> tuple[Volume, FrameReport]:
    """Read a CT volume into LPS mm.

    Args:
        path: .nrrd, .nii, .nii.gz, .mha, a folder or .zip of one DICOM series or one image, or the header of an image
            (.nhdr, .mhd, .hdr) whose voxels are in another file.
        frame, unit: 'LPS' or 'RAS', 'mm' or 'm', if the file does not state them.
        assume: if neither states them, assume LPS mm and report it instead of raising FrameError.
        series: number of one of several DICOM series, from 1; an error lists them.
        files: for a header, itself and the files beside it; by default those with its name in its folder.
        modalities: accepted modalities of DICOM images, CT and optionally MR, whose values are not Hounsfield units.
        convert: converts the values of other files to int16 voxels.

    Raises:
        ImageError: the volume cannot be used.
        FrameError: frame or unit are missing, or contradict the file.
    """
    path = Path(path)
    if not path.exists():
        raise ImageError("there is no such file or folder.")
    if path.is_dir() or is_header(path) or path.name.lower().endswith(".zip"):
        with tempfile.TemporaryDirectory() as folder:
            whole = joined(path, files or (files_of(path) if is_header(path) else ()), Path(folder))
            if whole is not None:
                told = {"assume": assume, "series": series, "modalities": modalities, "convert": convert}
                return read_volume(whole, frame, unit, **told)  # type: ignore[arg-type]
    if is_dicom(path):
        _, _, report = resolve_frame(("LPS", "mm"), (frame, unit), assume=assume)  # the DICOM standard fixes both
        read = dicom.read_series(path, series, modalities)
        return read.volume, replace(report, notes=read.notes, modality=read.modality, description=read.description)
    if series is not None:
        raise ImageError("a series is chosen among those of a DICOM folder or zip, which this file is not.")
    values, transform, report = read_grid(path, frame, unit, assume=assume)
    return volume_of(convert(values), transform), report


def read_grid(
    path: Path, frame: str | None = None, unit: str | None = None, *, assume: bool = False
) -> tuple[npt.NDArray[Any], npt.NDArray[np.float64], FrameReport]:
    """Stored values [k, j, i] of an image file, (4, 4) from index (i, j, k) to LPS mm, and its frame.

    Arguments and errors as in `read_volume`; DICOM is not supported here.
    """
    name = path.name.lower()
    if name.endswith(".nrrd"):
        return _read_nrrd(path, (frame, unit), assume)
    if name.endswith((".nii", ".nii.gz")):
        return _read_nifti(path, (frame, unit), assume)
    if name.endswith(".mha"):
        return _read_grid(path, metaimage.read_header(path), "MetaImageIO", (frame, unit), assume)
    raise ImageError(f"a CT volume is read from {', '.join(VOLUME_SUFFIXES)} or a folder of DICOM files.")


def _read_nrrd(
    path: Path, given: tuple[str | None, str | None], assume: bool
) -> tuple[npt.NDArray[Any], npt.NDArray[np.float64], FrameReport]:
    header = nrrd.read_header(path)
    if header.frame is not None and not header.further_axes:
        return _read_grid(path, header, "NrrdImageIO", given, assume)
    frame, _, report = resolve_frame((header.frame, header.unit), given, assume=assume)
    with tempfile.TemporaryDirectory() as folder:
        plain = Path(folder) / "plain.nrrd"
        nrrd.write_plain(path, frame, plain)
        values, transform, _ = _read_grid(plain, nrrd.read_header(plain), "NrrdImageIO", (None, None), assume)
    return values, transform, report


def _read_nifti(
    path: Path, given: tuple[str | None, str | None], assume: bool
) -> tuple[npt.NDArray[Any], npt.NDArray[np.float64], FrameReport]:
    frame, unit = given
    header = nifti.read_header(path, unit)
    if header.unit_named:
        return _read_grid(path, header, "NiftiImageIO", given, assume)
    values, transform, report = _read_grid(path, header, "NiftiImageIO", (frame, None), assume, decoded=unit is None)
    return values, transform, replace(report, unit=unit or "mm", unit_named=False)


def _read_grid(
    path: Path,
    header: GridHeader,
    decoder: str,
    given: tuple[str | None, str | None],
    assume: bool,
    *,
    decoded: bool = True,
) -> tuple[npt.NDArray[Any], npt.NDArray[np.float64], FrameReport]:
    """decoded: whether the decoder reads the lengths in the same unit, so that its transform can be compared."""
    frame, unit, report = resolve_frame((header.frame, header.unit), given, assume=assume)
    image, values = decode(path, decoder)
    if tuple(image.GetSize()[:3]) != header.sizes:
        raise ImageError("two readings of the header disagree about the number of voxels.")
    to_lps = np.diag([*(RAS_TO_LPS if frame == "RAS" else np.ones(3)), 1.0])
    transform = to_lps @ header.transform_index_to_file
    transform[:3] *= MM_PER_UNIT[unit]
    if decoded and header.frame is not None and header.unit == "mm":
        _check_agreement(image, transform, header.sizes)
    return values, transform, replace(report, notes=header.notes)


def _check_agreement(image: Any, transform: npt.NDArray[np.float64], sizes: tuple[int, int, int]) -> None:
    """Raise ImageError unless the decoder positions the grid's corners as the header check does."""
    for corner in np.ndindex(2, 2, 2):
        index = np.array(corner) * (np.array(sizes) - 1.0)
        ours = transform[:3, :3] @ index + transform[:3, 3]
        theirs = image.TransformContinuousIndexToPhysicalPoint(index.tolist())
        if not np.abs(ours - theirs).max() <= _READINGS_AGREE:
            raise ImageError("two readings of the header place the volume differently; save it anew.")
