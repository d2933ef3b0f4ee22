"""A folder or zip of masks, one NIfTI file per structure, as written by TotalSegmentator: `liver.nii.gz`, ...

Only here do names of files become names of structures, which the user requests by importing such a folder.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path, PurePosixPath

import numpy as np

from vfix_engine.anatomy.labels.label_map import MAX_LABELS, ROUNDED, CroppedLabel, LabelMap
from vfix_engine.errors import ImageError
from vfix_engine.files.dicom_files import contents, names
from vfix_engine.files.frame_report import FrameReport
from vfix_engine.files.readers import read_grid

MASK_SUFFIXES = (".nii.gz", ".nii")


def is_mask_folder(path: Path) -> bool:
    """Whether a folder or zip contains only NIfTI files, tables and texts. Raises ImageError for an invalid zip."""
    if not (path.is_dir() or path.name.lower().endswith(".zip")):
        return False
    found = names(path)
    return bool(found) and all(name.lower().endswith(MASK_SUFFIXES) for name in found)


def name_of_mask(file_name: str) -> str:
    """Convert 'optic_nerve_left.nii.gz' to 'Optic nerve left'."""
    name = PurePosixPath(file_name.replace("\\", "/")).name
    stem = name[: next((-len(end) for end in MASK_SUFFIXES if name.lower().endswith(end)), None)]
    words = " ".join(stem.replace("_", " ").split())
    return words[:1].upper() + words[1:]


def read_mask_folder(
    path: Path, frame: str | None = None, unit: str | None = None, *, assume: bool = False
) -> LabelMap:
    """Read the masks as labels, numbered from 1 in the order of their file names; empty masks are reported by name.

    Raises ImageError, and FrameError as `resolve_frame` does. To be called in a worker.
    """
    count = len(names(path))
    if count > MAX_LABELS:
        raise ImageError(f"there are {count} masks in it, and a segmentation may have {MAX_LABELS}.")
    labels: list[CroppedLabel] = []
    empty: list[str] = []
    notes: dict[str, None] = {}  # of all masks, without duplicates
    report: FrameReport | None = None
    with tempfile.TemporaryDirectory() as folder:
        for place, data in contents(path):
            name = place.name
            file = Path(folder) / ("mask" + next(end for end in MASK_SUFFIXES if name.lower().endswith(end)))
            file.write_bytes(data)
            label, report = _label_of(file, name, len(labels) + 1, (frame, unit, assume))
            file.unlink()
            notes |= dict.fromkeys(report.notes)
            if label is None:
                empty.append(name_of_mask(name))
            else:
                labels.append(label)
    if not labels or report is None:
        raise ImageError("all masks in it are empty.")
    return LabelMap(tuple(labels), replace(report, notes=tuple(notes)), tuple(empty))


def _label_of(
    file: Path, name: str, number: int, told: tuple[str | None, str | None, bool]
) -> tuple[CroppedLabel | None, FrameReport]:
    try:
        values, transform, report = read_grid(file, told[0], told[1], assume=told[2])
    except ImageError as error:  # name the mask, one of up to a hundred files
        raise ImageError(f"the mask {name_of_mask(name)!r:.80} cannot be used: {error}") from None
    mask = values > ROUNDED
    inside = values[mask]
    if inside.size and float(np.ptp(inside)) > ROUNDED:
        raise ImageError(
            f"{name_of_mask(name)!r:.80} holds several values and is no mask of one structure. Import a label map by "
            "itself, and a CT as a case of its own."
        )
    if values.size and float(values.min()) < -ROUNDED:
        raise ImageError(f"{name_of_mask(name)!r:.80} holds values below 0 and is no mask.")
    if not inside.size:
        return None, report
    axes = [np.flatnonzero(mask.any(axis=tuple(other for other in range(3) if other != axis))) for axis in range(3)]
    box = tuple(slice(int(one[0]), int(one[-1]) + 1) for one in axes)
    first = np.array([one[0] for one in axes[::-1]], dtype=np.int64)
    return CroppedLabel(number, name_of_mask(name), None, mask[box].copy(), first, transform), report
