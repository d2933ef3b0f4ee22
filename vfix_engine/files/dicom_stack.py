"""Assembly of the slices of a DICOM series into a volume, with a check of their positions against a line; LPS mm.

Slices that are shifted within their planes, as by a gantry tilt, are resampled; uneven spacing is refused.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vfix_engine.arrays import Array
from vfix_engine.errors import ImageError
from vfix_engine.files.dicom_rescale import HU, rescale_notes
from vfix_engine.files.grid_header import check_sizes, check_transform
from vfix_engine.files.slice_alignment import aligned, alignment_error_mm
from vfix_engine.files.volume import Volume, volume_of

_FARTHEST_OFF = 0.1  # [mm] largest distance of a slice from the fitted line
_SHARE_OFF = 0.1  # of the spacing, if that is less
_ROUNDING = 0.02  # [mm] some scanners write positions with two decimals
_FARTHEST_ASIDE = 1.0  # [mm] largest in-plane offset of a slice from the line: more is neither tilt nor jitter
_SAME_PLACE = 0.01  # of the spacing
_SAME_DIRECTION = 1e-4
_SCOUT_COSINE = 0.7  # between normals: a plane rotated further cannot be part of the stack
_MOST_SCOUTS = 0.1  # of the slices
_SHOWN = 6


@dataclass(frozen=True, eq=False)
class Slice:
    """One slice. hu: (rows, columns) int16; the rest is geometry in LPS mm.

    pixel_mm: (2,) distance between columns and between rows. axes: (3, 2) unit directions along a row and a column.
    thickness_mm: None if the file does not state it. window: width and centre that the file suggests, or None.
    reference: UID of the frame of reference of the position; '' if the file has none.
    rescale, unit: slope and intercept of the values, and the unit that the file states.
    where: its name in a message, such as "the file 'IM5'". told: its name in a note, which is stored.
    """

    hu: npt.NDArray[np.int16]
    position: Array
    axes: Array
    pixel_mm: Array
    thickness_mm: float | None
    window: tuple[float, float] | None = None
    where: str = "a slice"
    told: str = "a slice"
    rescale: tuple[float, float] = (1.0, 0.0)
    unit: str = HU
    reference: str = ""

    @property
    def normal(self) -> Array:
        normal: Array = np.cross(self.axes[:, 0], self.axes[:, 1])
        return normal


@dataclass(frozen=True, eq=False)
class SliceLine:
    """Line through slices. spacing_mm, start_mm: of the equally spaced positions along the normal that fit best.

    sideways: (n, 2) position of each first pixel along rows and columns [mm]. tolerance_mm: largest deviation of a
        slice.
    """

    spacing_mm: float
    start_mm: float
    sideways: Array
    tolerance_mm: float

    @property
    def middle(self) -> Array:
        """(2,) mean position of the first pixels along rows and columns [mm]."""
        middle: Array = 0.5 * (self.sideways.min(axis=0) + self.sideways.max(axis=0))
        return middle

    @property
    def is_straight(self) -> bool:
        """Whether the slices are aligned along their normal."""
        return bool(np.linalg.norm(self.sideways - self.middle, axis=1).max() <= self.tolerance_mm)

    @property
    def tilt_deg(self) -> float:
        """Angle between the line through the slices and their normal."""
        return float(np.degrees(np.arctan2(np.linalg.norm(_fitted(self.sideways)[1]), self.spacing_mm)))


def stack(slices: list[Slice]) -> tuple[Volume, tuple[str, ...]]:
    """Stack the slices into one volume, and list what was omitted or resampled, in sentences.

    Raises ImageError if they do not fit one regular grid.
    """
    slices, notes = _without_scouts(slices)
    if len(slices) < 2:
        raise ImageError("one slice is not a volume; name the folder or a zip of the whole series.")
    notes = (*notes, *rescale_notes(slices))
    first = slices[0]
    for one in slices:
        if one.hu.shape != first.hu.shape or np.abs(one.pixel_mm - first.pixel_mm).max() > 1e-4:
            raise ImageError(f"the slices differ in their number of pixels or in their pixel size: see {one.where}.")
        if np.abs(one.axes - first.axes).max() > _SAME_DIRECTION:
            raise ImageError(
                f"the slices differ in orientation: {one.where} and {first.where} do. Name one series only."
            )
    named = [one for one in slices if one.reference]
    for one in named:
        if one.reference != named[0].reference:
            raise ImageError(
                f"the slices lie in different frames of reference (FrameOfReferenceUID): {one.where} and "
                f"{named[0].where} do, so that their places cannot be compared. Name slices of one scan only."
            )
    normal = first.normal
    ordered = sorted(slices, key=lambda one: float(one.position @ normal))
    line = _line(ordered, normal)
    check_sizes([first.hu.shape[1], first.hu.shape[0], len(ordered)])
    thickness = max((one.thickness_mm for one in slices if one.thickness_mm is not None), default=None)
    windows = [one.window for one in slices if one.window is not None]
    window = tuple(np.median(windows, axis=0).tolist()) if windows else None
    images, sideways, error_mm = [one.hu for one in ordered], line.middle, None
    if line.is_straight:
        hu = np.stack(images)
    else:
        shifts = line.sideways / first.pixel_mm
        error_mm = alignment_error_mm(images, shifts, first.pixel_mm)
        hu, start = aligned(images, shifts)
        sideways = start * first.pixel_mm
        notes = (*notes, _resampled_words(line, error_mm))
    transform = np.eye(4)
    transform[:3, :2] = first.axes * first.pixel_mm
    transform[:3, 2] = normal * line.spacing_mm
    transform[:3, 3] = first.axes @ sideways + normal * line.start_mm
    return volume_of(hu, check_transform(transform, 1.0), thickness, window, error_mm), notes


def check_on_grid(positions: Array, transform: Array) -> None:
    """Raise ImageError if slices at `positions` (n, 3) are off those of a grid (4, 4, index i, j, k to LPS mm).

    Gaps in the grid are allowed.
    """
    step = transform[:3, 2]
    spacing = float(np.linalg.norm(step))
    number = np.rint((positions - transform[:3, 3]) @ step / spacing**2)
    off = float(np.linalg.norm(positions - transform[:3, 3] - np.outer(number, step), axis=1).max())
    if off > (allowed := tolerance_mm(spacing)):
        raise ImageError(
            f"a slice lies {off:.2f} mm off the even places {spacing:.3g} mm apart, where {allowed:.2g} mm is allowed: "
            "the slices are uneven, or shifted against each other as by a gantry tilt. Export it resampled to the CT."
        )


def tolerance_mm(spacing_mm: float) -> float:
    """Largest allowed deviation of a slice from its position."""
    return max(_ROUNDING, min(_FARTHEST_OFF, _SHARE_OFF * spacing_mm))


def _without_scouts(slices: list[Slice]) -> tuple[list[Slice], tuple[str, ...]]:
    """Remove the few slices whose plane crosses that of all others, which cannot be part of their stack."""
    if len(slices) < 3:
        return slices, ()
    normals = np.array([one.normal for one in slices])
    usual = normals[int(np.argmax((np.abs(normals @ normals.T) > 1.0 - _SAME_DIRECTION).sum(axis=0)))]
    crossing = [one for one in slices if abs(float(one.normal @ usual)) < _SCOUT_COSINE]
    if not crossing or len(crossing) > max(1.0, _MOST_SCOUTS * len(slices)):
        return slices, ()
    kept = [one for one in slices if one not in crossing]
    return kept, (left_out_words([one.told for one in crossing]),)


def left_out_words(scouts: list[str]) -> str:
    """Note on localizers among the slices."""
    listed = ", ".join(scouts[:_SHOWN]) + (", …" if len(scouts) > _SHOWN else "")
    many = len(scouts) > 1
    return (
        f"{len(scouts)} localizer{'s' * many} (scout view{'s' * many}) in the series {'were' if many else 'was'} left "
        f"out: {listed}."
    )


def _fitted(values: Array) -> tuple[Array, Array]:
    """Intercept and slope (…) of the least-squares line through the rows of `values` (n, …) over their indices."""
    numbers = np.arange(len(values)) - 0.5 * (len(values) - 1)
    mean = values.mean(axis=0)
    slope = numbers @ (values - mean) / (numbers @ numbers)
    return mean - slope * 0.5 * (len(values) - 1), slope


def _line(ordered: list[Slice], normal: Array) -> SliceLine:
    """Fit the line through slices ordered along their normal. Raises ImageError if their spacing is uneven."""
    positions = np.array([one.position for one in ordered])
    along, sideways = positions @ normal, positions @ ordered[0].axes
    start, spacing = (float(value) for value in _fitted(along))
    gaps = np.diff(along)
    _check_single(ordered, gaps < max(1e-3, _SAME_PLACE * spacing))
    line = SliceLine(round(spacing, 9), round(start, 9), np.round(sideways, 9), tolerance_mm(spacing))
    off = float(np.abs(along - start - spacing * np.arange(len(along))).max())
    if off > line.tolerance_mm:
        values, counts = np.unique(np.round(gaps, 2), return_counts=True)
        pairs = zip(values[:_SHOWN], counts[:_SHOWN], strict=True)
        shown = ", ".join(f"{value:.2f} mm ({count}x)" for value, count in pairs)
        tilt = "" if line.is_straight else f"; besides, there is a gantry tilt of {line.tilt_deg:.1f} degrees"
        raise ImageError(
            f"the slices are not evenly spaced: gaps of {shown}, so that one lies {off:.2f} mm off its even place; a "
            f"slice is missing or two scans are mixed{tilt}. Export it resampled to even slices."
        )
    start_aside, slope = _fitted(sideways)
    aside = np.linalg.norm(sideways - start_aside - np.outer(np.arange(len(sideways)), slope), axis=1)
    worst = int(aside.argmax())
    if aside[worst] > _FARTHEST_ASIDE:
        raise ImageError(
            f"{ordered[worst].where} lies {aside[worst]:.1f} mm to the side of the line through the slices, which no "
            "gantry tilt explains: its position is wrong, or scans are mixed. Remove it, or export the series again."
        )
    return line


def _check_single(ordered: list[Slice], same: npt.NDArray[np.bool_]) -> None:
    """Raise ImageError for coincident slices; same: (n - 1,) whether a slice coincides with the next one."""
    if not same.any():
        return
    pairs = [(ordered[n], ordered[n + 1]) for n in np.flatnonzero(same)]
    shown = "; ".join(f"{a.where} and {b.where}" for a, b in pairs[:_SHOWN])
    alike = all(np.array_equal(a.hu, b.hu) for a, b in pairs)
    why = "copies of the same image" if alike else "different images: the series is doubled, or two are mixed"
    raise ImageError(f"two slices lie at the same position ({len(pairs)}x): {shown}. They are {why}; remove one.")


def _resampled_words(line: SliceLine, error_mm: float) -> str:
    apart = float(np.ptp(line.sideways, axis=0).max())
    return (
        f"The slices are shifted against each other by up to {apart:.1f} mm, as by a gantry tilt of "
        f"{line.tilt_deg:.1f}\N{DEGREE SIGN}: each was resampled within its plane. That may move a surface "
        f"by {error_mm:.2f} mm, which is added to the error of the surface."
    )
