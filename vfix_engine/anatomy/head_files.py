"""Reader of a head from a file, with plausibility checks; doubts are returned as sentences.

`read_mesh` and `read_volume` accept any surface and any volume; a head has a plausible size, air around it and bone.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vfix_engine.errors import ImageError, MeshError, SegmentationFound
from vfix_engine.files.frame_report import MM_PER_UNIT, FrameReport
from vfix_engine.files.mesh_files import read_mesh
from vfix_engine.files.nrrd import INTO_A_CASE
from vfix_engine.files.readers import read_volume
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh

HEAD_MM = (20.0, 2500.0)  # longest side: from a part of a nose to a scan of the whole body
USUAL_MM = (60.0, 400.0)
FEW_TRIANGLES = 1000
FINE_MM = 1.25  # largest slice spacing recommended for navigation of the sinuses
PLAUSIBLE_HU = (-2000, 10_000)  # from the values of scanners outside their circle to metal
STRANGE_SHARE = 0.01  # fraction of voxels outside that range above which it is not metal
_INWARDS_MM = -0.05  # volume over area of a surface whose triangles face inwards: half of a shell's thickness
_MOST_LABELS = 250  # a label map has fewer values than this, all of them non-negative integers

Notes = tuple[str, ...]


def read_surface_of_head(
    path: Path, frame: str | None = None, unit: str | None = None, *, assume: bool = False
) -> tuple[TriangleMesh, FrameReport, Notes]:
    """Call `read_mesh` and list doubts about the surface. Raises MeshError if it cannot be a head's."""
    mesh, report = read_mesh(path, frame, unit, assume=assume)
    return mesh, report, (*assumption(report), *check_surface(mesh, report))


def read_ct_of_head(
    path: Path,
    frame: str | None = None,
    unit: str | None = None,
    *,
    assume: bool = False,
    series: int | None = None,
    files: tuple[Path, ...] = (),
) -> tuple[Volume, FrameReport, Notes]:
    """Call `read_volume` and list doubts about the CT. Raises ImageError if it cannot be a head's."""
    volume, report = read_volume(path, frame, unit, assume=assume, series=series, files=files)
    return volume, report, (*assumption(report), *check_ct(volume, report))


def assumption(report: FrameReport) -> Notes:
    """List what the reader assumed, omitted or resampled."""
    if not report.missing:
        return report.notes
    words = {"frame": "LPS", "unit": "mm"}
    taken = f"{' and '.join(words[part] for part in report.missing)} {'were' if len(report.missing) > 1 else 'was'}"
    check = " Check left and right." if "frame" in report.missing else ""
    return (f"The file does not name its {' and its '.join(report.missing)}; {taken} assumed.{check}", *report.notes)


def check_surface(mesh: TriangleMesh, report: FrameReport) -> Notes:
    """List doubts about the bone of a head. Raises MeshError if it cannot be one."""
    sides = mesh.bounds[1] - mesh.bounds[0]
    fault = size_fault(sides, "surface", report)
    if fault:
        raise MeshError(fault)
    unsound = unsound_triangles(mesh, "the tool is kept away from them too")
    notes = list(size_notes(sides, "surface"))
    if len(mesh.faces) < FEW_TRIANGLES:
        notes.append(f"The surface has {len(mesh.faces):,} triangles only, which is little for the bone of a head.")
    if _volume_over_area(mesh) < _INWARDS_MM:
        notes.append(
            "The triangles of the surface face inwards: bone and air are taken for each other where a path point is "
            "judged. Flip the normals of the file."
        )
    return (*notes, *unsound)


def unsound_triangles(mesh: TriangleMesh, so: str) -> Notes:
    """List triangles without area, of which `so` is said, and corners without a triangle.

    Raises MeshError where every triangle is without area.
    """
    notes, flat = list[str](), int(np.count_nonzero(~mesh.face_normals.any(axis=1)))
    if flat == len(mesh.faces):
        raise MeshError(f"all {flat:,} triangles of the surface are without area.")
    if flat:
        notes.append(f"{flat:,} of {len(mesh.faces):,} triangles are without area; {so}.")
    used = np.zeros(len(mesh.vertices), dtype=np.bool_)
    used[mesh.faces] = True
    unused = int(np.count_nonzero(~used))
    if unused:
        notes.append(
            f"{unused:,} of {len(mesh.vertices):,} corners belong to no triangle; a file that was cut off looks so."
        )
    return tuple(notes)


def _volume_over_area(mesh: TriangleMesh) -> float:
    """Signed volume enclosed by the triangles over their area, in mm: negative if the normals face inwards."""
    a, b, c = np.moveaxis(mesh.triangles - mesh.bounds.mean(axis=0), 1, 0)
    normals = np.cross(b - a, c - a)
    return float(np.einsum("ij,ij->", a, normals) / 3.0 / np.linalg.norm(normals, axis=1).sum())


def check_ct(volume: Volume, report: FrameReport) -> Notes:
    """List doubts about the CT of a head. Raises ImageError if it cannot be one."""
    low, high = int(volume.hu.min()), int(volume.hu.max())
    if low >= 0:
        words = f"the values run from {low} to {high}: {_why_no_air(volume, high)}"
        raise SegmentationFound(words) if high < _MOST_LABELS else ImageError(words)
    sides = volume.bounds[1] - volume.bounds[0]
    fault = size_fault(sides, "CT", report)
    if fault:
        raise ImageError(fault)
    return (*_strange_values(volume, low, high), *size_notes(sides, "CT"), *_coarseness(volume))


def _why_no_air(volume: Volume, high: int) -> str:
    if high < _MOST_LABELS:
        return (
            f"{len(np.unique(volume.hu))} whole numbers from 0 on are the labels of a segmentation, not Hounsfield "
            f"units. {INTO_A_CASE}"
        )
    return (
        "there is no air in them, so they are not Hounsfield units; an offset of 1024 is missing, perhaps. "
        "Export the CT with its rescale applied."
    )


def check_size(volume: Volume, report: FrameReport) -> Notes:
    """List doubts about the size of a volume. Raises ImageError if it cannot be of a head."""
    sides = volume.bounds[1] - volume.bounds[0]
    if fault := size_fault(sides, "volume", report):
        raise ImageError(fault)
    return size_notes(sides, "volume")


def _strange_values(volume: Volume, low: int, high: int) -> Notes:
    """Report values that do not occur in a head: many voxels, or any at a limit of int16, where values were clipped."""
    least, most = PLAUSIBLE_HU
    if least <= low and high <= most:
        return ()
    # Slice by slice: a mask of the whole volume would take hundreds of megabytes.
    count = sum(int(np.count_nonzero((plane < least) | (plane > most))) for plane in volume.hu)
    ends = np.iinfo(np.int16)
    cut = low == ends.min, high == ends.max
    if not any(cut) and count <= STRANGE_SHARE * volume.hu.size:
        return ()
    return (
        f"{count:,} of {volume.hu.size:,} voxels lie under {least:,} or over {most:,} HU, as nothing in a head does: "
        f"the values run from {low:,}{' or less' if cut[0] else ''} to {high:,}{' or more' if cut[1] else ''}. "
        "They were written in another byte order, perhaps, are not Hounsfield units, or mark what was not scanned: "
        "compare the slices with the scanner's.",
    )


def _coarseness(volume: Volume) -> Notes:
    if volume.resolution_mm <= FINE_MM:
        return ()
    sizes = " x ".join(f"{value:.3g}" for value in volume.spacing)
    thick = volume.slice_thickness_mm
    thickness = f", its slices {thick:.3g} mm thick" if thick is not None else ""
    return (
        f"The CT is coarse: its voxels are {sizes} mm{thickness}, where at most {FINE_MM:g} mm are advised. Thin bone "
        "is missing from it.",
    )


def size_fault(sides: np.ndarray, what: str, report: FrameReport, of: str = "head") -> str | None:
    """Why something with these sides (3,), in mm, cannot be of a head, or of what `of` names; None where it can."""
    longest = float(sides.max())
    if HEAD_MM[0] <= longest <= HEAD_MM[1]:
        return None
    hint = ""
    if report.unit == "mm" and USUAL_MM[0] <= longest * MM_PER_UNIT["m"] <= HEAD_MM[1]:
        remedy = "but the file names mm: correct the unit in the file" if report.unit_named else "say so"
        hint = f" Its unit is metres, perhaps{', ' if report.unit_named else ': '}{remedy}."
    return f"the {what} is {_figures(sides)} mm large, which cannot be a {of}.{hint}"


def size_notes(sides: np.ndarray, what: str, of: str = "head", usual: tuple[float, float] = USUAL_MM) -> Notes:
    """A doubt about sides (3,), in mm, whose longest one is not within the usual range."""
    if usual[0] <= float(sides.max()) <= usual[1]:
        return ()
    return (f"The {what} is {_figures(sides)} mm large, which is unusual for a {of}; check its unit.",)


def _figures(sides: np.ndarray) -> str:
    return " x ".join(f"{side:.3g}" for side in sides)
