"""A CT volume: Hounsfield units on a regular grid, placed in the patient frame (LPS, mm)."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from vfix_engine.arrays import Array
from vfix_engine.errors import ImageError
from vfix_engine.files.sampling import sample_plane, sample_points

Axis = Literal["axial", "coronal", "sagittal"]

AIR_HU = -1000
BONE_HU = 250.0
LONGEST_SIDE = 1024  # [pixel] largest side of a slice image

# Columns: LPS directions of a pixel column, of a pixel row, and of the slice's position.
# The radiologist's view: the patient's right on the image's left, anterior and superior up, sagittal from the left.
_VIEW_AXES: dict[str, Array] = {
    "axial": np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).T,
    "coronal": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]).T,
    "sagittal": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]).T,
}


@dataclass(frozen=True, eq=False)
class Volume:
    """CT volume in Hounsfield units; arrays are read-only.

    hu: (K, J, I) int16, indexed [k, j, i].
    origin: (3,) LPS position [mm] of the centre of voxel (0, 0, 0).
    spacing: (3,) distance [mm] between voxel centres along i, j, k.
    direction: (3, 3) orthonormal; columns are the unit LPS directions of i, j, k. A left-handed triple is allowed,
        since files can store it; every mapping here uses the full matrix.
    slice_thickness_mm: thickness of the layer that the scanner averaged to one slice, if the file states it; it can
        exceed the distance between slices.
    window: (2,) width and centre of the grey values that the scanner's files suggest, or None.
    resampled_mm: upper bound of the displacement of a border by resampling within the slices; None without resampling.

    Raises ImageError if the grid is invalid.
    """

    hu: npt.NDArray[np.int16]
    origin: Array
    spacing: Array
    direction: Array
    slice_thickness_mm: float | None = None
    window: tuple[float, float] | None = None
    resampled_mm: float | None = None

    def __post_init__(self) -> None:
        hu = np.asarray(self.hu)
        if hu.ndim != 3 or min(hu.shape) < 2:
            raise ImageError(f"a volume needs three axes of at least two voxels, not the shape {hu.shape}.")
        if hu.dtype != np.int16:
            raise ImageError(f"voxels must be int16 Hounsfield units, not {hu.dtype}.")
        origin, spacing = _vector(self.origin, "origin"), _vector(self.spacing, "spacing")
        if not (spacing > 0).all():
            raise ImageError(f"the voxel spacing must be positive, not {_figures(spacing)} mm.")
        direction = np.array(self.direction, dtype=np.float64)
        if direction.shape != (3, 3) or not np.isfinite(direction).all():
            raise ImageError("the direction of the axes must be a finite 3x3 matrix.")
        if np.abs(direction.T @ direction - np.eye(3)).max() > 1e-4:
            raise ImageError("the directions of the voxel axes are not at right angles; a sheared grid cannot be used.")
        thickness = None if self.slice_thickness_mm is None else float(self.slice_thickness_mm)
        if thickness is not None and not 0.0 < thickness < np.inf:
            raise ImageError(f"the slices must have a positive thickness, not {thickness:g} mm.")
        resampled = None if self.resampled_mm is None else float(self.resampled_mm)
        if resampled is not None and not 0.0 <= resampled < np.inf:
            raise ImageError(f"resampling cannot move a border by {resampled:g} mm; import the CT again.")
        view = hu.view()
        for array in (view, origin, spacing, direction):
            array.setflags(write=False)
        for name, value in (("hu", view), ("origin", origin), ("spacing", spacing), ("direction", direction)):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "slice_thickness_mm", thickness)
        object.__setattr__(self, "resampled_mm", resampled)
        if self.window is not None:
            width, centre = (float(value) for value in self.window)
            object.__setattr__(self, "window", (width, centre))

    @property
    def resolution_mm(self) -> float:
        """The larger of largest voxel spacing and slice thickness in mm; smaller structures may be invisible."""
        return max(float(self.spacing.max()), self.slice_thickness_mm or 0.0)

    @property
    def content_hash(self) -> str:
        """SHA-256 of grid and voxels, without slice thickness, window and resampling error."""
        digest = hashlib.sha256(repr(self.hu.shape).encode())
        for part in (self.origin, self.spacing, self.direction):
            digest.update(part.astype("<f8").tobytes())
        for layer in self.hu:
            digest.update(np.ascontiguousarray(layer, dtype="<i2").data)
        return digest.hexdigest()

    @property
    def transform_index_to_lps(self) -> Array:
        """(4, 4) affine from (i, j, k) to LPS mm."""
        transform = np.eye(4)
        transform[:3, :3] = self.direction * self.spacing
        transform[:3, 3] = self.origin
        return transform

    def index_to_lps(self, ijk: npt.ArrayLike) -> Array:
        """LPS positions [mm] of voxel indices; (n, 3) or (3,), fractions allowed, order i, j, k."""
        return np.asarray(ijk, dtype=np.float64) @ (self.direction * self.spacing).T + self.origin

    def lps_to_index(self, points: npt.ArrayLike) -> Array:
        """Fractional voxel indices (i, j, k) of LPS positions [mm]; (n, 3) or (3,)."""
        return (np.asarray(points, dtype=np.float64) - self.origin) @ self.direction / self.spacing

    @property
    def bounds(self) -> Array:
        """(2, 3) smallest and largest LPS coordinates [mm] of the voxel centres."""
        last = np.array(self.hu.shape[::-1], dtype=np.float64) - 1.0
        corners = np.stack(np.meshgrid(*zip(np.zeros(3), last, strict=True), indexing="ij"), axis=-1).reshape(-1, 3)
        placed = self.index_to_lps(corners)
        return np.stack([placed.min(axis=0), placed.max(axis=0)])

    def sample(self, points: npt.ArrayLike, outside: float = AIR_HU) -> Array:
        """Trilinear HU (n,) at LPS points (n, 3) [mm]; `outside` beyond the outermost voxel centres."""
        placed = np.atleast_2d(np.asarray(points, dtype=np.float64))
        return sample_points(self.hu, placed, self.origin, self.direction.T / self.spacing[:, None], float(outside))

    def slice_image(
        self, axis: Axis, position_mm: float, window: float = 2000.0, level: float = 400.0
    ) -> tuple[npt.NDArray[np.uint8], Array]:
        """Grey image of the plane at an LPS position, and the positions of its pixels.

        axis: 'axial' (position = superior z), 'coronal' (position = posterior y) or 'sagittal' (position = left x).
        window, level: range of HU from black to white, and the HU in its middle.

        Returns (image, transform_pixel_to_lps): (h, w) uint8, and the (4, 4) affine from (column, row, 0, 1) at pixel
        *centres* to LPS mm. Axial: columns run to the left (+x), rows to posterior (+y). Coronal: columns +x, rows to
        inferior (-z). Sagittal: columns to posterior (+y), rows to inferior (-z). Pixels are square, of the finest
        inferior (-z). Sagittal: columns to posterior (+y), rows to inferior (-z). Pixels are square, of the finest
        voxel spacing; the centre of pixel (0, 0) is a corner of `bounds`. Areas outside the volume are black.

        Raises ImageError for an unknown axis, a plane outside the volume or a window that is not positive.
        """
        if not (np.isfinite(window) and np.isfinite(level) and window > 0):
            raise ImageError(f"a window must be positive and finite, not {window} HU at a level of {level} HU.")
        shape, transform = self.slice_grid(axis, position_mm)
        hu = self._plane(transform[:3, 3], transform[:3, :2], shape, -np.inf)
        grey = np.clip((hu - (level - window / 2.0)) * np.float32(255.0 / window), 0.0, 255.0)
        return np.rint(grey).astype(np.uint8), transform

    def slice_grid(self, axis: Axis, position_mm: float) -> tuple[tuple[int, int], Array]:
        """Height and width [pixel] of that image, and the (4, 4) affine of its pixels; raises as `slice_image`."""
        if axis not in get_args(Axis):
            raise ImageError(f"a slice is axial, coronal or sagittal, not {axis!r}.")
        view = _VIEW_AXES[axis]
        low, high = self.bounds
        through = int(np.abs(view[:, 2]).argmax())
        if not low[through] - 1e-6 <= position_mm <= high[through] + 1e-6:
            raise ImageError(
                f"the {axis} position {position_mm:g} mm is outside the volume, "
                f"which covers {low[through]:.2f} to {high[through]:.2f} mm."
            )
        start = np.where(view[:, :2].sum(axis=1) < 0, high, low)
        start[through] = position_mm
        extent = np.abs(view[:, :2].T @ (high - low))
        pixel = max(float(self.spacing.min()), float(extent.max()) / (LONGEST_SIDE - 1))
        width, height = (np.floor(extent / pixel + 1e-6) + 1).astype(int)
        transform = np.eye(4)
        transform[:3, :3] = view * pixel
        transform[:3, 3] = start
        return (int(height), int(width)), transform

    def _plane(self, start: Array, steps: Array, shape: tuple[int, int], outside: float) -> npt.NDArray[np.float32]:
        """(h, w) HU on the grid start + column * steps[:, 0] + row * steps[:, 1], all LPS mm."""
        to_index = self.direction.T / self.spacing[:, None]
        index_steps = np.ascontiguousarray((to_index @ steps).T)
        return sample_plane(self.hu, self.lps_to_index(start), index_steps[0], index_steps[1], shape, outside)


def to_hu(values: npt.NDArray[Any]) -> npt.NDArray[np.int16]:
    """Convert values to int16 HU, rounded and clipped to that type's range. Raises ImageError for NaN or infinity."""
    if values.dtype == np.int16:
        return values
    if values.dtype.kind == "f":
        check_finite(values)
    limits = np.iinfo(np.int16)
    hu = np.empty(values.shape, dtype=np.int16)
    for target, part in zip(hu, values, strict=True):  # slice by slice: 64-bit voxels would take gigabytes twice
        target[...] = np.clip(np.rint(part) if part.dtype.kind == "f" else part, limits.min, limits.max)
    return hu


def check_finite(values: npt.NDArray[Any]) -> None:
    """Raise ImageError for voxels that are NaN or infinite."""
    bad = values.size - int(np.count_nonzero(np.isfinite(values)))
    if bad:
        raise ImageError(
            f"{bad:,} voxels are not finite numbers (NaN or infinity); export the CT with a number in each voxel."
        )


def volume_of(
    hu: npt.NDArray[np.int16],
    transform_index_to_lps: Array,
    slice_thickness_mm: float | None = None,
    window: tuple[float, float] | None = None,
    resampled_mm: float | None = None,
) -> Volume:
    """Create a volume on the grid of a (4, 4) affine from (i, j, k) to LPS mm."""
    spacing = np.linalg.norm(transform_index_to_lps[:3, :3], axis=0)
    direction = transform_index_to_lps[:3, :3] / spacing
    return Volume(hu, transform_index_to_lps[:3, 3], spacing, direction, slice_thickness_mm, window, resampled_mm)


def _vector(value: npt.ArrayLike, name: str) -> Array:
    vector = np.array(value, dtype=np.float64)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise ImageError(f"the volume's {name} must be three finite numbers.")
    return vector


def _figures(values: Array) -> str:
    return " x ".join(f"{value:g}" for value in values)
