"""A segmentation in memory: masks of named labels on regular grids in LPS mm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.arrays import Array
from vfix_engine.errors import ImageError
from vfix_engine.files.frame_report import FrameReport

MAX_LABELS = 250  # TotalSegmentator has 117
MAX_VALUE = 65_535
ROUNDED = 1e-3  # tolerance from an integer, caused by a slope such as 0.99999 in the file


@dataclass(frozen=True, eq=False)
class CroppedLabel:
    """One label, cropped to its voxels.

    value: its number in the file. name: '' if neither the file nor its table has one. colour: '#rrggbb', None if the
    file has none. mask: (K, J, I) bool, indexed [k, j, i]; first: (3,) index i, j, k of its first voxel in the grid.
    transform: (4, 4) from the grid's index (i, j, k) to LPS mm.
    """

    value: int
    name: str
    colour: str | None
    mask: npt.NDArray[np.bool_]
    first: npt.NDArray[np.int64]
    transform: Array


@dataclass(frozen=True, eq=False)
class LabelMap:
    """Content of a label file; empty: names or numbers of labels that the file declares but no voxel has."""

    labels: tuple[CroppedLabel, ...]
    frame: FrameReport
    empty: tuple[str, ...] = ()


@dataclass(frozen=True)
class LabelLook:
    """Name and colour of a label in a file."""

    name: str = ""
    colour: str | None = None


def labels_of(values: npt.NDArray[Any], transform: Array, looks: dict[int, LabelLook]) -> tuple[CroppedLabel, ...]:
    """Split a map (K, J, I) of integers into labels, in the order of their numbers; 0 is no label.

    Raises ImageError for values that are not labels, and if there are none or too many.
    """
    from scipy.ndimage import find_objects  # imported here: slow to load

    whole = whole_labels(values)
    found = find_objects(whole)
    numbers = [number for number, box in enumerate(found, start=1) if box is not None]
    if not numbers:
        raise ImageError("the segmentation is empty: no voxel of it has a label.")
    if len(numbers) > MAX_LABELS:
        raise ImageError(
            f"the file holds {len(numbers)} different values, and a segmentation may have {MAX_LABELS}; it is a "
            "picture and not a map of labels, perhaps: a CT is imported as a case of its own."
        )
    labels = []
    for number in numbers:
        box, look = found[number - 1], looks.get(number, LabelLook())
        first = np.array([part.start for part in box[::-1]], dtype=np.int64)
        labels.append(CroppedLabel(number, look.name, look.colour, whole[box] == number, first, transform))
    return tuple(labels)


def whole_labels(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Convert values to unsigned integers, rounding errors that a scaling in the file has caused.

    Raises ImageError if they are not labels.
    """
    low, high = values.min(), values.max()
    if not (np.isfinite(low) and np.isfinite(high)) or low < -ROUNDED or high > MAX_VALUE + ROUNDED:
        raise ImageError(
            f"the values run from {low:g} to {high:g}; labels are whole numbers from 0 to {MAX_VALUE:,}. A CT is "
            "imported as a case of its own."
        )
    if values.dtype.kind != "f":
        return values.astype(np.uint16)
    whole = np.empty(values.shape, dtype=np.uint16)
    for target, part in zip(whole, values, strict=True):
        rounded = np.rint(part)
        if np.abs(part - rounded).max() > ROUNDED:
            raise ImageError(
                "the values are not whole numbers, so they are no labels; export the segmentation as a label map."
            )
        target[...] = rounded
    return whole
