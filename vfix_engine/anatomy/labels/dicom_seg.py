"""DICOM segmentations (SEG): binary and label map, by highdicom.

SimpleITK silently reads a binary SEG as one stack of all frames of all segments, and cannot read a label map.
Of the text in the file only the label of each segment is used.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.anatomy.labels.label_map import MAX_LABELS, CroppedLabel, LabelMap
from vfix_engine.anatomy.labels.names import Looks, hex_colour
from vfix_engine.errors import ImageError
from vfix_engine.files.dicom import fault_named, pydicom_silenced
from vfix_engine.files.dicom_stack import check_on_grid
from vfix_engine.files.frame_report import resolve_frame
from vfix_engine.files.grid_header import MAX_VOXELS, check_transform
from vfix_engine.files.text_bytes import text_of_element

BINARY_OR_FRACTIONAL, LABEL_MAP = "1.2.840.10008.5.1.4.1.1.66.4", "1.2.840.10008.5.1.4.1.1.66.7"
MAX_BYTES = 1 << 30
_WHERE = "the DICOM segmentation"


def read_dicom_seg(
    path: Path, names: Looks, frame: str | None = None, unit: str | None = None, *, assume: bool = False
) -> LabelMap:
    """Read every segment of the file, in LPS mm by the standard; `names` is used for segments without a label.

    Raises ImageError, and FrameError if frame or unit contradict the standard.
    """
    _, _, report = resolve_frame(("LPS", "mm"), (frame, unit), assume=assume)
    if path.stat().st_size > MAX_BYTES:
        raise ImageError(f"the DICOM segmentation is larger than {MAX_BYTES >> 20} MiB.")
    data = path.read_bytes()
    with pydicom_silenced(), fault_named(_WHERE):
        seg, written = _opened(data)
        labels, empty = _labels(seg, written, names)
    if not labels:
        raise ImageError("the segmentation is empty: none of its segments has a voxel.")
    return LabelMap(tuple(labels), report, tuple(empty))


def is_dicom_seg(path: Path) -> bool:
    """Whether a DICOM file is a segmentation. Raises ImageError if it is damaged."""
    import pydicom

    with pydicom_silenced(), fault_named("the file"):
        head = pydicom.dcmread(path, stop_before_pixels=True, specific_tags=["SOPClassUID"])
        return str(head.get("SOPClassUID")) in (BINARY_OR_FRACTIONAL, LABEL_MAP)


def _opened(data: bytes) -> tuple[Any, dict[int, str]]:
    """Open the segmentation, check its header, and return its segments' labels by number. Raises ImageError."""
    import highdicom
    import pydicom

    head = pydicom.dcmread(io.BytesIO(data), stop_before_pixels=True)
    kind = head.get("SegmentationType")
    if str(head.get("SOPClassUID")) not in (BINARY_OR_FRACTIONAL, LABEL_MAP) or kind not in ("BINARY", "LABELMAP"):
        words = " Its voxels are shares, not labels: export it as a binary one." if kind == "FRACTIONAL" else ""
        raise ImageError(f"the file is no binary or label map segmentation of DICOM.{words}")
    frames = int(head.get("NumberOfFrames") or 0)
    if frames * int(head.Rows) * int(head.Columns) > MAX_VOXELS:
        raise ImageError(f"the segmentation claims more than {MAX_VOXELS:,} voxels.")
    if len(head.get("SegmentSequence") or ()) > MAX_LABELS:
        raise ImageError(f"the file holds more than {MAX_LABELS} segments.")
    written = {
        int(one.SegmentNumber): text_of_element(one, "SegmentLabel") for one in head.get("SegmentSequence") or ()
    }
    seg = highdicom.seg.segread(io.BytesIO(data))
    _check_pixels(seg, frames)
    return seg, written


def _check_pixels(seg: Any, frames: int) -> None:
    """Raise ImageError for a truncated file, whose missing frames highdicom would interpret as gaps."""
    if (there := len(seg.get("PixelData") or b"")) == 0:
        raise ImageError("the DICOM segmentation has no voxels: it is cut off; copy or export the file again.")
    bits = frames * int(seg.Rows) * int(seg.Columns) * int(seg.BitsAllocated)
    if not seg.file_meta.TransferSyntaxUID.is_compressed and there < (claimed := (bits + 7) // 8):
        raise ImageError(
            f"the DICOM segmentation is cut off: its header claims {claimed:,} bytes of voxels, {there:,} are there;"
            " copy or export the file again."
        )


def _labels(seg: Any, written: dict[int, str], names: Looks) -> tuple[list[CroppedLabel], list[str]]:
    """Return the segments with voxels, and the names or numbers of those without."""
    labels: list[CroppedLabel] = []
    empty: list[str] = []
    for number in seg.segment_numbers:
        described = seg.get_segment_description(number)
        name = written.get(int(number), "") or (names[number].name if number in names else "")
        if label := _label(seg, int(number), name, _colour(described)):
            labels.append(label)
        else:
            empty.append(name or str(number))
    return labels, empty


def _label(seg: Any, number: int, name: str, colour: str | None) -> CroppedLabel | None:
    from scipy.ndimage import find_objects

    try:
        volume = seg.get_volume(segment_numbers=[number], combine_segments=False)
    except (RuntimeError, ValueError):
        raise ImageError(
            f"the frames of segment {number} do not form a regular grid; export the segmentation resampled to the CT."
        ) from None
    affine = np.asarray(volume.affine, dtype=np.float64)[:, [2, 1, 0, 3]]
    check_on_grid(_positions(seg), affine)
    # Indexed [slice, row, column, segment]; its affine maps (slice, row, column) to LPS mm.
    values = np.asarray(volume.array).reshape(volume.array.shape[:3]).astype(np.uint8)
    (box,) = find_objects(values, max_label=1)
    if box is None:
        return None
    transform = check_transform(affine, 1.0)
    first = np.array([part.start for part in box[::-1]], dtype=np.int64)
    return CroppedLabel(number, name, colour, values[box] == 1, first, transform)


def _positions(seg: Any) -> npt.NDArray[np.float64]:
    """Positions (frames, 3) of the frames according to the file, LPS mm."""
    shared = (seg.get("SharedFunctionalGroupsSequence") or [None])[0]
    found = []
    for group in seg.PerFrameFunctionalGroupsSequence:
        place = group.get("PlanePositionSequence") or shared.PlanePositionSequence
        found.append([float(value) for value in place[0].ImagePositionPatient])
    return np.array(found)


def _colour(described: Any) -> str | None:
    """'#rrggbb' of the recommended CIELab colour, encoded in 16 bits as in PS3.3 C.10.7.1.1."""
    coded = described.get("RecommendedDisplayCIELabValue")
    if coded is None or len(coded) != 3:
        return None
    lightness, a, b = (float(value) / 65535.0 for value in coded)
    return hex_colour([float(part) for part in _srgb(100.0 * lightness, 255.0 * a - 128.0, 255.0 * b - 128.0)])


def _srgb(lightness: float, a: float, b: float) -> npt.NDArray[np.float64]:
    from skimage.color import lab2rgb

    colour: npt.NDArray[np.float64] = lab2rgb(np.array([[[lightness, a, b]]]), illuminant="D50")[0, 0].clip(0.0, 1.0)
    return colour
