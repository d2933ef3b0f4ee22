"""Import of a lumen: the surface of its wall from a surface, a label map, or the air of a CT, in worker processes."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from vfix_engine.anatomy.airway import body
from vfix_engine.anatomy.bone import SurfaceReport
from vfix_engine.anatomy.enclosing import enclosing_surface
from vfix_engine.anatomy.head_files import assumption
from vfix_engine.anatomy.head_import import HeadRequest, kernel_folders, read_or_ask
from vfix_engine.anatomy.labels.label_map import CroppedLabel, LabelMap
from vfix_engine.anatomy.labels.reading import read_label_map
from vfix_engine.anatomy.labels.surfaces import surface_of
from vfix_engine.anatomy.lumen.closing import outwards, with_caps
from vfix_engine.anatomy.lumen.smoothing import smoothed
from vfix_engine.anatomy.lumen_checks import (
    LEAST_ML,
    check_enclosed,
    check_lumen_surface,
    check_no_shell,
    wall_notes,
)
from vfix_engine.anatomy.segmentation import LOWEST_HU
from vfix_engine.anatomy.surface import Dropped
from vfix_engine.anatomy.thinning import collapsed
from vfix_engine.arrays import Array, BoolArray
from vfix_engine.errors import ImageError, InputError, SegmentationFound
from vfix_engine.files.detached import files_of, is_header
from vfix_engine.files.frame_report import FrameReport
from vfix_engine.files.mesh_files import is_mesh, mesh_suffixes, read_mesh
from vfix_engine.files.readers import VOLUME_SUFFIXES, is_volume, read_volume
from vfix_engine.files.sandbox.isolated import Cancellation, run_isolated
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.progress import ProgressCallback, no_progress
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.validate import point_text

READ_SECONDS = 180.0
WALL_SECONDS = 600.0
AIR_HU = -500.0  # half-way from gas, -1000 HU, to a wall of soft tissue
SEED_MM = 8.0  # from a seed to the nearest voxel of air
MOST_TRIANGLES = 120_000  # of a wall that is made of voxels
_MOST_LABELS = 250  # values of a label map, none negative
_WORDS = ("lumen", "colon", "bowel", "rectum", "airway", "trachea")


@dataclass(frozen=True)
class LumenRequest(HeadRequest):
    """The file of a lumen, and what the user states about it.

    label: number of the label of a label map that is the lumen; None: the only one, one by its name, or the largest.
    seed: (3,) LPS mm, in the air of a CT that is the lumen; None: the largest air in the body. air_hu: of the lumen at
    most.
    """

    _: KW_ONLY
    label: int | None = None
    seed: tuple[float, float, float] | None = None
    air_hu: float = AIR_HU


@dataclass(frozen=True, eq=False)
class ReadLumen:
    """A lumen that was read, LPS mm.

    wall: closed, normals outwards. volume: the CT, if it is made of one.
    source: what it is made of. report: by how
    much the wall may be off. notes: sentences on what was done and what is doubtful.
    """

    wall: TriangleMesh
    volume: Volume | None
    source: str
    frame: FrameReport
    report: SurfaceReport
    notes: tuple[str, ...]
    voxel_mm: float | None = None  # largest spacing of the image that it is made of


def read_lumen(
    request: LumenRequest,
    progress: ProgressCallback = no_progress,
    *,
    cancellation: Cancellation | None = None,
    folder: Path | None = None,
) -> ReadLumen:
    """Read a lumen in worker processes; other arguments as in `read_head`.

    Raises:
        FrameError: neither file nor request names frame or unit; `missing` lists them.
        InputError: the file cannot be used for another reason.
        OSError: the worker's files could not be written.
    """
    if not request.path.exists():
        raise InputError("there is no such file or folder.")
    if request.label is not None and is_mesh(request.path):
        raise InputError("a label is chosen of a label map, and this is a surface.")
    if request.seed is not None and is_mesh(request.path):
        raise InputError("a seed lies in the air of a CT, and this is a surface.")
    if not (is_mesh(request.path) or is_volume(request.path)):
        known = ", ".join((*mesh_suffixes(), *VOLUME_SUFFIXES))
        raise InputError(f"a lumen is made of {known}, or of a folder of DICOM files.")
    isolate = partial(run_isolated, progress=progress, cancellation=cancellation, folder=folder)
    files = files_of(request.path) if is_header(request.path) else ()
    told = request.path, request.frame, request.unit, request.assume, request.series, request.label, files
    read, source, report, notes = isolate(_read, *told, seconds=READ_SECONDS)
    # No decoder runs in this worker, so it may write to the cache of compiled kernels.
    wall, made, more = isolate(
        _wall, read, request.seed, request.air_hu, seconds=WALL_SECONDS, writable=kernel_folders()
    )
    volume, voxel_mm = read if isinstance(read, Volume) else None, None
    if not isinstance(read, TriangleMesh):
        voxel_mm = float((read.spacing if isinstance(read, Volume) else np.linalg.norm(read[1][:3, :3], axis=0)).max())
    return ReadLumen(wall, volume, source, report, made, (*notes, *more, *wall_notes(wall)), voxel_mm)


_Grid = tuple[npt.NDArray[np.uint8], Array, npt.NDArray[np.int64]]  # a label: mask, transform and first index


class LumenOfVolume(NamedTuple):
    """The wall of a lumen in a CT: closed, normals outwards, LPS mm; report and notes as of `ReadLumen`."""

    wall: TriangleMesh
    report: SurfaceReport
    notes: tuple[str, ...]


def lumen_of_volume(
    volume: Volume,
    seed: tuple[float, float, float],
    air_hu: float = AIR_HU,
    progress: ProgressCallback = no_progress,
    *,
    cancellation: Cancellation | None = None,
    folder: Path | None = None,
) -> LumenOfVolume:
    """The air at a seed in a CT that was read before; errors as of `wall_of_air`, other arguments as of `read_head`."""
    wall, report, notes = run_isolated(
        _wall, volume, seed, air_hu, seconds=WALL_SECONDS, progress=progress, cancellation=cancellation,
        folder=folder, writable=kernel_folders(),
    )  # fmt: skip
    return LumenOfVolume(wall, report, (*notes, *wall_notes(wall)))


def _read(
    path: Path,
    frame: str | None,
    unit: str | None,
    assume: bool,
    series: int | None,
    label: int | None,
    files: tuple[Path, ...],
    *,
    progress: ProgressCallback,
) -> tuple[TriangleMesh | Volume | _Grid, str, FrameReport, tuple[str, ...]]:
    """The surface, the CT or the label of a file, and which of them it is."""
    progress("Reading the file", 0.0)
    if is_mesh(path):
        mesh, report = read_or_ask(read_mesh, path, frame, unit, assume)
        return mesh, "surface", report, (*assumption(report), *check_lumen_surface(mesh, report))
    try:
        volume, report = read_or_ask(partial(_read_ct, series=series, files=files), path, frame, unit, assume)
    except SegmentationFound:
        found = read_or_ask(_read_labels, path, frame, unit, assume)
        chosen, notes = chosen_label(found.labels, label)
        grid = chosen.mask.astype(np.uint8), chosen.transform, chosen.first
        return grid, "labels", found.frame, (*assumption(found.frame), *notes)
    if label is not None:
        raise ImageError("a label is chosen of a label map, and this is a CT.")
    return volume, "ct", report, assumption(report)


def _wall(
    read: TriangleMesh | Volume | _Grid,
    seed: tuple[float, float, float] | None,
    air_hu: float,
    *,
    progress: ProgressCallback,
) -> tuple[TriangleMesh, SurfaceReport, tuple[str, ...]]:
    if isinstance(read, TriangleMesh):
        wall, notes = closed_wall(read)
        check_no_shell(wall)
        return wall, _no_report(), notes
    if isinstance(read, Volume):
        return wall_of_air(read, seed, air_hu, progress)
    if seed is not None:
        raise ImageError("a seed lies in the air of a CT, and this is a label map.")
    mask, transform, first = read
    return wall_of_label(CroppedLabel(1, "", None, mask.astype(np.bool_), first, transform), progress)


def _read_labels(path: Path, frame: str | None, unit: str | None, *, assume: bool) -> LabelMap:
    return read_label_map(path, {}, frame, unit, assume=assume)


def _read_ct(
    path: Path,
    frame: str | None,
    unit: str | None,
    *,
    assume: bool,
    series: int | None = None,
    files: tuple[Path, ...] = (),
) -> tuple[Volume, FrameReport]:
    """Raises SegmentationFound for what can only be labels."""
    if path.name.lower().endswith(".seg.nrrd"):
        raise SegmentationFound("the file is a segmentation.")
    volume, report = read_volume(path, frame, unit, assume=assume, series=series, files=files)
    low, high = int(volume.hu.min()), int(volume.hu.max())
    if low >= 0:
        words = f"the values run from {low} to {high}: there is no air in them, so they are not Hounsfield units."
        raise SegmentationFound(words) if high < _MOST_LABELS else ImageError(words)
    return volume, report


def chosen_label(labels: tuple[CroppedLabel, ...], value: int | None) -> tuple[CroppedLabel, tuple[str, ...]]:
    """The label that is the lumen, and a note where there was a choice.

    Raises ImageError for a number that no label has.
    """
    if value is not None:
        for label in labels:
            if label.value == value:
                return label, ()
        raise ImageError(f"no voxel has the label {value}; there are {_listed(labels)}.")
    if len(labels) == 1:
        return labels[0], ()
    named = [label for label in labels if any(word in label.name.lower() for word in _WORDS)]
    largest = max(named or labels, key=lambda label: int(np.count_nonzero(label.mask)))
    why = "by its name" if named else "the largest"
    return largest, (f"Label {_listed((largest,))} was taken, {why}, of {_listed(labels)}.",)


def _listed(labels: tuple[CroppedLabel, ...]) -> str:
    shown = [f"{label.value}{f' ({label.name[:40]})' if label.name else ''}" for label in labels[:8]]
    return ", ".join(shown) + (f" and {len(labels) - 8} more" if len(labels) > 8 else "")


def closed_wall(mesh: TriangleMesh) -> tuple[TriangleMesh, tuple[str, ...]]:
    """A lumen's surface closed by caps, normals outwards, and notes on what was done.

    Raises MeshError where it cannot be closed.
    """
    closed, notes = with_caps(mesh), list[str]()
    if len(closed.openings):
        widest = closed.openings[:, 0].max()
        count = "1 opening was" if len(closed.openings) == 1 else f"{len(closed.openings)} openings were"
        notes.append(f"{count} closed by a cap; the widest is {widest:.0f} mm across. A way may begin or end there.")
    wall, turned = outwards(closed.mesh)
    if turned:
        notes.append("The triangles of the surface faced inwards and were turned: its inside is the lumen.")
    check_enclosed(wall)
    return wall, tuple(notes)


def wall_of_label(
    label: CroppedLabel, progress: ProgressCallback = no_progress
) -> tuple[TriangleMesh, SurfaceReport, tuple[str, ...]]:
    """The wall of a label: of its largest island, smoothed and of at most 120,000 triangles.

    Raises ImageError where the label is no lumen.
    """
    from scipy import ndimage  # imported here: slow to load

    progress("Telling the islands apart", 0.1)
    islands, count = ndimage.label(label.mask)
    sizes = np.bincount(islands.ravel(), minlength=count + 1)
    sizes[0] = 0
    progress("Finding the wall", 0.3)
    largest = replace(label, mask=islands == int(sizes.argmax()))
    notes = () if count == 1 else (f"{count - 1:,} smaller islands of {count:,} were left out.",)
    return _finished(surface_of(largest).mesh, _no_report(), notes, progress)


def _finished(
    voxels: TriangleMesh, report: SurfaceReport, notes: tuple[str, ...], progress: ProgressCallback
) -> tuple[TriangleMesh, SurfaceReport, tuple[str, ...]]:
    """The surface of voxels smoothed, thinned and closed; the distance of each of its vertices is in the report."""
    progress("Smoothing the wall", 0.5)
    fewer = collapsed(smoothed(voxels), MOST_TRIANGLES) if len(voxels.faces) > MOST_TRIANGLES else smoothed(voxels)
    wall, more = closed_wall(fewer)
    progress("Measuring how far it is off", 0.8)
    off = ProximityTree(wall).point_distance(voxels.vertices)[0]
    report = replace(report, mean_deviation_mm=float(off.mean()), max_deviation_mm=float(off.max()))
    words = f"The wall was smoothed, and thinned from {len(voxels.faces):,} to {len(fewer.faces):,} triangles"
    return wall, report, (*notes, f"{words}, {off.max():.2f} mm off at most.", *more)


def wall_of_air(
    volume: Volume,
    seed: tuple[float, float, float] | None,
    air_hu: float = AIR_HU,
    progress: ProgressCallback = no_progress,
) -> tuple[TriangleMesh, SurfaceReport, tuple[str, ...]]:
    """The wall of an air-filled lumen in a CT.

    Air is what is below ``air_hu`` within the body; the lumen is its component at the seed, or the largest that does
    not reach the ends of the scan, as lungs and the room do.

    Raises:
        ImageError: there is no air, or none within 8 mm of the seed.
    """
    from scipy import ndimage  # imported here: slow to load

    if not LOWEST_HU < air_hu <= 0.0:
        raise ImageError(f"air is below a threshold of {LOWEST_HU:g} to 0 HU, not {air_hu:g}.")
    progress("Finding the air in the body", 0.1)
    air = (volume.hu <= air_hu) & body(volume)
    component, count = ndimage.label(air)
    if not count:
        raise ImageError(f"no voxel within the body is at most {air_hu:g} HU; is the lumen filled with air?")
    voxel_ml = float(np.prod(volume.spacing)) / 1000.0
    sizes: Array = voxel_ml * np.bincount(component.ravel(), minlength=count + 1).astype(np.float64)
    sizes[0] = 0.0
    chosen = _at_seed(volume, component, np.asarray(seed)) if seed is not None else _largest(component, sizes)
    if sizes[chosen] < LEAST_ML:
        raise ImageError(f"the air there holds {sizes[chosen]:.2f} ml only, which is no lumen; choose another seed.")
    mask: BoolArray = component == chosen
    progress("Finding the wall", 0.4)
    mesh = enclosing_surface(volume, mask, (LOWEST_HU, air_hu))
    others = [f"{size:.0f} ml" for size in np.sort(np.delete(sizes, [0, chosen]))[::-1][:3] if size >= LEAST_ML]
    which = "The air at the seed was taken" if seed is not None else "The largest air in the body was taken"
    rest = f"; next in size: {', '.join(others)}" if others else ""
    notes = [f"{which}, {sizes[chosen]:.0f} ml at most {air_hu:g} HU{rest}."]
    if (mask[0] | mask[-1]).any():
        notes.append("It reaches the end of the scan, where it is closed; it may be a lung, or the room's air.")
    report = replace(_no_report(), resampled_mm=volume.resampled_mm or 0.0)
    return _finished(mesh, report, tuple(notes), progress)


def _at_seed(volume: Volume, component: npt.NDArray[np.integer], seed: Array) -> int:
    """Number of the air nearest to a seed."""
    reach = np.ceil(SEED_MM / volume.spacing).astype(int)
    middle = np.rint(volume.lps_to_index(seed[None])[0]).astype(int)
    sizes = np.array(component.shape[::-1])
    low, high = np.clip(middle - reach, 0, sizes), np.clip(middle + reach + 1, 0, sizes)
    box = component[low[2] : high[2], low[1] : high[1], low[0] : high[0]]
    voxels = np.argwhere(box > 0)
    away = np.linalg.norm(volume.index_to_lps(voxels[:, ::-1] + low) - seed, axis=1) if len(voxels) else np.zeros(0)
    if not len(away) or away.min() > SEED_MM:
        raise ImageError(
            f"there is no air within {SEED_MM:g} mm of the seed {point_text(seed)}; put it into the lumen."
        )
    return int(box[tuple(voxels[away.argmin()])])


def _largest(component: npt.NDArray[np.integer], sizes: Array) -> int:
    """Number of the largest air that ends within the scan, else of the largest."""
    at_ends = np.union1d(component[0], component[-1])
    within = sizes.copy()
    within[at_ends] = 0.0
    return int((within if within.max() >= LEAST_ML else sizes).argmax())


def _no_report() -> SurfaceReport:
    return SurfaceReport(0.0, 0.0, Dropped())
