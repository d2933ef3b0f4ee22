"""3D Slicer's `.seg.nrrd`: layers of labels that may overlap, with name, colour, layer and label of each segment.

The keys are those of Slicer's segmentation file format
(https://slicer.readthedocs.io/en/latest/developer_guide/modules/segmentations.html#segmentations-file-format-nrrd):
the voxels are cropped to the segmented region, and 'space origin' is that of the cropped box.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from vfix_engine.anatomy.labels.label_map import MAX_LABELS, MAX_VALUE, CroppedLabel, LabelLook, LabelMap, labels_of
from vfix_engine.anatomy.labels.names import Looks, hex_colour
from vfix_engine.errors import ImageError
from vfix_engine.files.frame_report import MM_PER_UNIT, resolve_frame
from vfix_engine.files.grid_header import MAX_VOXELS, check_length, inflated, inflated_length
from vfix_engine.files.nrrd import is_packed, placement, read_fields, voxel_type
from vfix_engine.files.text_bytes import text_of_bytes
from vfix_engine.frames import RAS_TO_LPS

_KEY = re.compile(r"Segment(\d{1,4})_(\w+)")


def read_seg_nrrd(
    path: Path, names: Looks, frame: str | None = None, unit: str | None = None, *, assume: bool = False
) -> LabelMap:
    """Read every segment of the file; `names` is used for segments without a name.

    Raises ImageError, and FrameError as `resolve_frame` does.
    """
    with path.open("rb") as file:
        fields, keys = read_fields(file)
        layers = _layers(file, fields)
    file_transform, file_frame, file_unit = placement(fields)
    used_frame, used_unit, report = resolve_frame((file_frame, file_unit), (frame, unit), assume=assume)
    transform = np.diag([*(RAS_TO_LPS if used_frame == "RAS" else np.ones(3)), 1.0]) @ file_transform
    transform[:3] *= MM_PER_UNIT[used_unit]
    labels: list[CroppedLabel] = []
    empty: list[str] = []
    for layer, looks in _segments(keys, len(layers)).items():
        if not 0 <= layer < len(layers):
            raise ImageError(f"a segment names the layer {layer}, but the file has {len(layers)}.")
        known = names | {value: look if look.name else names.get(value, look) for value, look in looks.items()}
        found = labels_of(layers[layer], transform, known) if layers[layer].any() else ()
        labels += found
        there = {label.value for label in found}
        empty += [look.name or str(value) for value, look in looks.items() if value not in there]
    if not labels:
        raise ImageError("the segmentation is empty: none of its segments has a voxel.")
    if len(labels) > MAX_LABELS:
        raise ImageError(f"the file holds {len(labels)} segments; at most {MAX_LABELS} are read.")
    return LabelMap(tuple(labels), report, tuple(empty))


def _layers(file: BinaryIO, fields: Mapping[str, str]) -> npt.NDArray[Any]:
    """Read the voxels (layers, K, J, I) from the present position of the file."""
    sizes = _sizes(fields)
    voxel = voxel_type(fields)
    if voxel.kind not in "iu":
        raise ImageError("the voxels of a segmentation are whole numbers, those of this file are not.")
    claimed = math.prod(sizes) * voxel.itemsize
    begin = file.tell()
    if is_packed(fields):
        check_length(inflated_length(file, 31, claimed), claimed)
        file.seek(begin)
        data = b"".join(inflated(file, 31, claimed))
    else:
        check_length(os.fstat(file.fileno()).st_size - begin, claimed)
        data = file.read()
    count, i, j, k = sizes
    stored = np.frombuffer(data, dtype=voxel)
    # The first axis of the file varies fastest: that of the layers, if there is one.
    return np.moveaxis(stored.reshape(k, j, i, count), -1, 0)


def _sizes(fields: Mapping[str, str]) -> tuple[int, int, int, int]:
    """Number of layers, and voxels along i, j, k."""
    words = fields.get("sizes", "").split()
    if fields.get("dimension") not in ("3", "4") or str(len(words)) != fields["dimension"]:
        raise ImageError("a segmentation has three dimensions, or four with its layers.")
    if not all(word.isascii() and word.isdigit() and 0 < len(word) < 10 for word in words):
        raise ImageError("the sizes in the NRRD header are not whole numbers.")
    sizes = [int(word) for word in words]
    if len(sizes) == 4:
        if not fields.get("space directions", "").lower().startswith("none"):
            raise ImageError("the layers of a segmentation are the first of its four axes; those of this file are not.")
    else:
        sizes.insert(0, 1)
    if min(sizes) < 1 or math.prod(sizes) > MAX_VOXELS:
        raise ImageError(f"the header claims {math.prod(sizes):,} voxels; 1 to {MAX_VOXELS:,} can be read.")
    return sizes[0], sizes[1], sizes[2], sizes[3]


def _segments(keys: Mapping[str, str], layers: int) -> dict[int, Looks]:
    """Names and colours by layer and label. Before Slicer 4.11 each segment had a layer of its own and the label 1."""
    found: dict[int, dict[str, str]] = {}
    for key, text in keys.items():
        if match := _KEY.fullmatch(key):
            found.setdefault(int(match[1]), {})[match[2]] = text
    if not found:
        raise ImageError("the segmentation's header names no segment.")
    placed: dict[int, Looks] = {}
    for number, written in sorted(found.items()):
        layer = _whole(written.get("Layer", str(number if layers > 1 else 0)))
        value = _whole(written.get("LabelValue", "1"))
        if not 0 < value <= MAX_VALUE or value in placed.setdefault(layer, {}):
            raise ImageError(f"segment {number} has label {value} in layer {layer}, which is not possible or not free.")
        placed[layer][value] = LabelLook(_text(written.get("Name", "")), _colour(written.get("Color", "")))
    return placed


def _text(value: str) -> str:
    """Decode a name that Slicer wrote in UTF-8, or in Latin-1; the header is read byte by byte."""
    return text_of_bytes(value.encode("latin-1")).strip()


def _whole(text: str) -> int:
    if not re.fullmatch(r"\d{1,9}", text.strip()):
        raise ImageError("a layer or label in the segmentation's header is not a whole number.")
    return int(text)


def _colour(text: str) -> str | None:
    try:
        return hex_colour([float(word) for word in text.split()])
    except ValueError:
        return None
