"""The exception hierarchy.

    VfixError
    ├── InputError              an input is wrong
    │   ├── FrameError          frame or unit missing, unknown or contradictory
    │   ├── ImageError          a CT volume cannot be used
    │   │   ├── SegmentationFound   it is a segmentation, which is imported into a case
    │   │   └── SeriesUnclear       there are several DICOM series
    │   ├── MeshError           a surface cannot be used
    │   ├── PlanError           a plan cannot be used
    │   ├── RobotError          a robot or tool description cannot be used
    │   └── PathwayError        a lumen, centreline or constraint pathway cannot be used
    └── ControlError            the controller refuses
        └── StartRefused        the start pose violates a limit or the margin

A message states what is wrong, with the values, and what to do. It contains no patient data.
"""

from typing import Any


class VfixError(Exception):
    """Base class of all errors that vfix raises deliberately."""


class InputError(VfixError):
    """An input is wrong."""


class FrameError(InputError):
    """Frame or unit is missing, unknown or contradictory.

    missing: what the file does not state and the user must provide: 'frame', 'unit', both or nothing.
    """

    def __init__(self, message: str, missing: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.missing = missing


class ImageError(InputError):
    """A CT volume cannot be used."""


class SegmentationFound(ImageError):
    """The file is a segmentation; it is imported into a case, whose id the user must provide."""

    missing = ("into",)


class SeriesUnclear(ImageError):
    """There are several DICOM series, one of which the user must select.

    series: number from 1, modality, description, size and spacing of each, to be displayed but not stored: the
    description may contain a name.
    """

    missing = ("series",)

    def __init__(self, message: str, series: tuple[dict[str, Any], ...] = ()) -> None:
        super().__init__(message)
        self.series = series


class MeshError(InputError):
    """A surface cannot be used."""


class PlanError(InputError):
    """A plan cannot be used."""


class RobotError(InputError):
    """A robot or tool description cannot be used."""


class PathwayError(InputError):
    """A lumen, centreline or constraint pathway cannot be used."""


class ControlError(VfixError):
    """The controller refuses."""


class StartRefused(ControlError):
    """The start pose violates a limit or the margin."""
