"""Import of a segmentation: one worker process reads an untrusted file and extracts the surface of each label."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from vfix_engine.anatomy.head_files import assumption
from vfix_engine.anatomy.labels.dicom_seg import is_dicom_seg, read_dicom_seg
from vfix_engine.anatomy.labels.label_map import LabelMap, labels_of
from vfix_engine.anatomy.labels.mask_folder import is_mask_folder, read_mask_folder
from vfix_engine.anatomy.labels.names import NAMES_SUFFIXES, Looks, names_in_nifti, read_names
from vfix_engine.anatomy.labels.seg_nrrd import read_seg_nrrd
from vfix_engine.anatomy.labels.surfaces import LabelSurface, surface_of
from vfix_engine.errors import ImageError, InputError
from vfix_engine.files import nrrd
from vfix_engine.files.dicom_files import names as listed
from vfix_engine.files.frame_report import FrameReport
from vfix_engine.files.nifti import bytes_before_voxels
from vfix_engine.files.readers import read_grid
from vfix_engine.files.sandbox.isolated import Cancellation, run_isolated
from vfix_engine.progress import ProgressCallback

SEGMENTATION_SUFFIXES = (".seg.nrrd", ".nrrd", ".nii", ".nii.gz", ".mha", ".dcm")
READ_SECONDS = 180.0
MASK_SECONDS = 4.0  # additional time for each mask of a folder
_ON_GRID = 0.01  # of a voxel
_SAME_AXES = 1e-4


@dataclass(frozen=True)
class SegmentationRequest:
    """The file of a segmentation, or a folder or zip of masks, and what the user states about it.

    names: a table that names the labels, or None. frame, unit, assume: as in `HeadRequest`.
    """

    path: Path
    _: KW_ONLY
    names: Path | None = None
    frame: str | None = None
    unit: str | None = None
    assume: bool = False


@dataclass(frozen=True, eq=False)
class AnatomyPlace:
    """Extent of the case's anatomy, with which a segmentation is compared.

    bounds: (2, 3) LPS mm. transform: (4, 4) from the CT's index (i, j, k) to LPS mm, and sizes: (3,) numbers of voxels
    along i, j, k; both None for a case without a CT.
    """

    bounds: npt.NDArray[np.float64]
    transform: npt.NDArray[np.float64] | None = None
    sizes: tuple[int, int, int] | None = None


@dataclass(frozen=True, eq=False)
class Segmentation:
    """The surfaces of a segmentation. notes: sentences on doubts about the file as a whole."""

    surfaces: tuple[LabelSurface, ...]
    frame: FrameReport
    notes: tuple[str, ...]


def read_segmentation(
    request: SegmentationRequest,
    place: AnatomyPlace,
    progress: ProgressCallback,
    *,
    cancellation: Cancellation | None = None,
    folder: Path | None = None,
) -> Segmentation:
    """Read a segmentation in a worker process and extract the surface of each label.

    Raises:
        FrameError: neither file nor request states frame or unit; `missing` lists them.
        InputError: the file cannot be used for another reason, such as a position off the case's anatomy.
        OSError: the worker's files could not be written.
    """
    if not request.path.exists() or not (request.names is None or request.names.is_file()):
        raise InputError("there is no such file.")
    if request.names is not None and request.names.suffix.lower() not in NAMES_SUFFIXES:
        raise InputError(f"names of labels are read from a table as {', '.join(NAMES_SUFFIXES)}.")
    options = request.path, request.names, request.frame, request.unit, request.assume, place
    masks = len(listed(request.path)) if is_mask_folder(request.path) else 0
    seconds = READ_SECONDS + MASK_SECONDS * masks
    return run_isolated(_read, *options, seconds=seconds, progress=progress, cancellation=cancellation, folder=folder)


def _read(
    path: Path,
    names: Path | None,
    frame: str | None,
    unit: str | None,
    assume: bool,
    place: AnatomyPlace,
    *,
    progress: ProgressCallback,
) -> Segmentation:
    progress("Reading the segmentation", 0.0)
    table = {} if names is None else read_names(names)
    found = read_label_map(path, table, frame, unit, assume=assume)
    surfaces: list[LabelSurface] = []
    outside: list[str] = []
    for number, label in enumerate(found.labels):
        progress("Making the surface of each label", 0.2 + 0.8 * number / len(found.labels))
        surface = surface_of(label)
        share = _share_outside(surface, place)
        if share < 1.0:
            surfaces.append(surface if place.transform is None else _noted(surface, share))
        else:
            outside.append(surface.name or str(surface.value))
    where = "the CT" if place.transform is not None else "the case's surface"
    if not surfaces:
        raise ImageError(
            f"the segmentation lies outside {where}: {_apart(found, place)}. It was drawn on another scan, or its "
            "frame (LPS or RAS) is wrong in the file."
        )
    notes = [*assumption(found.frame), *_grid_notes(found, place)]
    if outside:
        notes.append(f"{_listed(outside)} {_lie(outside)} outside {where} and {_was(outside)} left out.")
    if found.empty:
        notes.append(f"{_listed(list(found.empty))} {_has(found.empty)} no voxel and {_was(found.empty)} left out.")
    return Segmentation(tuple(surfaces), found.frame, tuple(notes))


def read_label_map(
    path: Path, names: Looks, frame: str | None = None, unit: str | None = None, *, assume: bool = False
) -> LabelMap:
    """Read the labels of a file: `.seg.nrrd`, DICOM SEG, or a map of integers as NRRD, NIfTI or MetaImage.

    A folder or zip of NIfTI masks has a label for each file.

    names: of the labels; a name in the file itself takes precedence.
    Raises ImageError, and FrameError as `resolve_frame` does. To be called in a worker.
    """
    if is_mask_folder(path):
        return read_mask_folder(path, frame, unit, assume=assume)
    name = path.name.lower()
    if path.is_dir() or name.endswith(".zip"):
        raise ImageError("a folder or zip of a segmentation holds one NIfTI mask for each structure, and nothing else.")
    with path.open("rb") as file:
        dicom = file.read(132)[128:] == b"DICM"
    if dicom and is_dicom_seg(path):
        return read_dicom_seg(path, names, frame, unit, assume=assume)
    if dicom:
        raise ImageError("the DICOM file is not a segmentation (SEG); a CT is imported as a case of its own.")
    if name.endswith(".nrrd") and nrrd.marks_segmentation(path):
        return read_seg_nrrd(path, names, frame, unit, assume=assume)
    if not name.endswith(SEGMENTATION_SUFFIXES):
        raise ImageError(f"a segmentation is read from {', '.join(SEGMENTATION_SUFFIXES)}, the last one a DICOM SEG.")
    own = names_in_nifti(bytes_before_voxels(path)) if name.endswith((".nii", ".nii.gz")) else {}
    values, transform, report = read_grid(path, frame, unit, assume=assume)
    return LabelMap(labels_of(values, transform, names | own), report)


def _share_outside(surface: LabelSurface, place: AnatomyPlace) -> float:
    """Fraction of the surface's vertices outside the CT, or outside the box of the case's surface."""
    if place.transform is None or place.sizes is None:
        low, high = place.bounds
        return float(((surface.mesh.vertices < low) | (surface.mesh.vertices > high)).any(axis=1).mean())
    inverse = np.linalg.inv(place.transform)
    index = surface.mesh.vertices @ inverse[:3, :3].T + inverse[:3, 3]
    slack = 0.5 + 1e-3  # a voxel extends half its size beyond its centre, and so does the surface of a label there
    return float(((index < -slack) | (index > np.array(place.sizes) - 1.0 + slack)).any(axis=1).mean())


def _noted(surface: LabelSurface, share: float) -> LabelSurface:
    if share < 0.001:
        return surface
    note = f"{100.0 * share:.0f} % of its surface lie outside the CT."
    return LabelSurface(**{**vars(surface), "notes": (note,)})


def _grid_notes(found: LabelMap, place: AnatomyPlace) -> tuple[str, ...]:
    if place.transform is None or place.sizes is None:
        return ()
    for label in found.labels:
        if not _on_grid(label.transform, place.transform):
            theirs = " x ".join(f"{value:.3g}" for value in np.linalg.norm(label.transform[:3, :3], axis=0))
            ours = " x ".join(f"{value:.3g}" for value in np.linalg.norm(place.transform[:3, :3], axis=0))
            return (
                f"The segmentation has a grid of its own ({theirs} mm), not that of the CT ({ours} mm); its surfaces "
                "are made in its own. Compare them with the slices.",
            )
    return ()


def _on_grid(theirs: npt.NDArray[np.float64], ours: npt.NDArray[np.float64]) -> bool:
    """Whether voxel centres of one grid coincide with those of the other, for any order of the axes."""
    between = np.linalg.inv(ours) @ theirs
    whole = np.rint(between)
    axes = np.abs(whole[:3, :3])
    return bool(
        (axes.sum(axis=0) == 1).all()
        and (axes.sum(axis=1) == 1).all()
        and np.abs(between - whole)[:3, :3].max() < _SAME_AXES
        and np.abs(between - whole)[:3, 3].max() < _ON_GRID
    )


def _apart(found: LabelMap, place: AnatomyPlace) -> str:
    """Describe the positions of both in numbers."""
    corners = [label.transform[:3, :3] @ label.first + label.transform[:3, 3] for label in found.labels]
    middle, centre = np.mean(corners, axis=0), place.bounds.mean(axis=0)
    return f"it begins near ({_place(middle)}), and the middle of the case is at ({_place(centre)}) in LPS mm"


def _place(point: npt.NDArray[np.float64]) -> str:
    return ", ".join(f"{value:.0f}" for value in point)


def _listed(names: list[str]) -> str:
    shown = ", ".join(f"'{name[:60]}'" for name in names[:5])
    return shown + (f" and {len(names) - 5} more" if len(names) > 5 else "")


def _lie(names: list[str]) -> str:
    return "lies" if len(names) == 1 else "lie"


def _was(names: list[str] | tuple[str, ...]) -> str:
    return "was" if len(names) == 1 else "were"


def _has(names: tuple[str, ...]) -> str:
    return "has" if len(names) == 1 else "have"
