"""Enhanced multi-frame CT: the frames of one file as slices (PS3.3 A.38, functional groups C.7.6.16)."""

from __future__ import annotations

from typing import Any

from vfix_engine.errors import ImageError

_SHARED, _PER_FRAME = "SharedFunctionalGroupsSequence", "PerFrameFunctionalGroupsSequence"
GROUPS = (_SHARED, _PER_FRAME)
_OF_THE_FILE = (
    "Modality", "SeriesInstanceUID", "SamplesPerPixel", "Rows", "Columns", "PixelPaddingValue",
    "PixelPaddingRangeLimit",
)  # fmt: skip
# Functional group macro of each tag of a slice.
_MACROS = {
    "ImagePositionPatient": "PlanePositionSequence",
    "ImageOrientationPatient": "PlaneOrientationSequence",
    "PixelSpacing": "PixelMeasuresSequence",
    "SliceThickness": "PixelMeasuresSequence",
    "WindowCenter": "FrameVOILUTSequence",
    "WindowWidth": "FrameVOILUTSequence",
    "RescaleSlope": "PixelValueTransformationSequence",
    "RescaleIntercept": "PixelValueTransformationSequence",
    "RescaleType": "PixelValueTransformationSequence",
}


def is_enhanced(dataset: Any) -> bool:
    """Whether a file has frames with individual positions."""
    return _PER_FRAME in dataset


def frames_of(dataset: Any, where: str) -> list[Any]:
    """Return a dataset for each frame, with the tags of a slice at its top and without pixels.

    Raises ImageError if the number of frames differs from that of their descriptions.
    """
    groups = dataset.get(_PER_FRAME)
    count = int(dataset.get("NumberOfFrames") or 1)
    if len(groups) != count:
        raise ImageError(f"{where} claims {count} frames and describes {len(groups)}; it is damaged.")
    shared = (dataset.get(_SHARED) or [None])[0]
    return [_frame(dataset, group, shared) for group in groups]


def _frame(dataset: Any, group: Any, shared: Any) -> Any:
    from pydicom.dataset import Dataset

    one = Dataset()
    for keyword in _OF_THE_FILE:
        if keyword in dataset:
            one[keyword] = dataset[keyword]
    for keyword, macro in _MACROS.items():
        for level in (group, shared):
            sequence = None if level is None else level.get(macro)
            if sequence and sequence[0].get(keyword) is not None:
                setattr(one, keyword, sequence[0].get(keyword))
                break
    for level in (group, shared):
        kinds = None if level is None else level.get("CTImageFrameTypeSequence")
        if kinds and kinds[0].get("FrameType"):
            one.ImageType = kinds[0].FrameType
            break
    return one
