"""The task of study II as a state machine: pure functions over an immutable state, for a page, a replay and a script.

On each label lies a thin object as long as the arrow. It is shortened from its aimed end while the button is held and
the marker is near that end, and is gone when that end is at the arrow's tip (Kwok 2013, section IV.C.2).
The marker is on a label only while the line of sight from the camera to it is free; the paper does not print that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...arrays import Array
from .labels import HALF_MM, Label, Marker, marker_on

NEAR_MM = 2.0  # from the marker to the aimed end while it is shortened; assumed, the paper prints no number

Sight = Callable[[Array, Array], bool]
"""Whether the line from an eye (3,) to a point (3,), LPS mm, is free; ``Wall.free`` of the cavity is one."""


class DiathermySample(NamedTuple):
    """What the task sees of one moment: t in s, the camera (4, 4) transform_camera_to_patient, the button held."""

    t: float
    camera: Array
    pressed: bool


class LabelProgress(NamedTuple):
    """How far one label is done.

    end_mm: of the object's aimed end along the arrow, from −10 to 10. began_s, done_s: the first cut and the last, None
    before them. held_s: of that time with the button held and the marker on the label; angle_deg_s, line_mm_s:
    integrals over it of the errors. travel_mm: of the camera since the label before was done; None for the first.
    """

    end_mm: float = -HALF_MM
    began_s: float | None = None
    done_s: float | None = None
    held_s: float = 0.0
    angle_deg_s: float = 0.0
    line_mm_s: float = 0.0
    travel_mm: float | None = None

    @property
    def left_mm(self) -> float:
        """Length of the object that is left."""
        return HALF_MM - self.end_mm

    def row(self) -> dict[str, float | None]:
        """The label's column of Table IV; None where there is no value.

        time_s: from the first cut to the last. angle_error_deg: mean angle between the optical axis and the direction
        from the camera to the object's aimed end; line_error_mm: mean distance of the marker to the arrow, both while
        the button is held and the marker on the label. distance_mm: of the camera between two labels. None of them for
        a label that is not done.
        """
        if self.done_s is None or self.began_s is None:
            return {"time_s": None, "angle_error_deg": None, "line_error_mm": None, "distance_mm": None}
        held = self.held_s if self.held_s > 0.0 else math.inf
        return {
            "time_s": self.done_s - self.began_s, "angle_error_deg": self.angle_deg_s / held,
            "line_error_mm": self.line_mm_s / held, "distance_mm": self.travel_mm,
        }  # fmt: skip


class DiathermyState(NamedTuple):
    """The task at one moment.

    labels: one each. aimed: the label on which the marker is and is seen, None: none; cutting: its object is being
    shortened, and the tip's way is drawn red. travel_mm: of the camera since the last label was done, or since the
    start.
    """

    labels: tuple[LabelProgress, ...]
    t: float | None = None
    eye: tuple[float, float, float] | None = None
    aimed: int | None = None
    cutting: bool = False
    travel_mm: float = 0.0

    @property
    def traced(self) -> int:
        """Number of labels that are done."""
        return sum(one.done_s is not None for one in self.labels)

    @property
    def done(self) -> bool:
        """Whether all labels are done."""
        return self.traced == len(self.labels)


def first_state(labels: Sequence[Label]) -> DiathermyState:
    """The task before the first sample."""
    return DiathermyState(tuple(LabelProgress() for _ in labels))


def stepped(labels: Sequence[Label], state: DiathermyState, sample: DiathermySample, sight: Sight) -> DiathermyState:
    """The task after the next sample; samples come in the order of time.

    sight: asked only about the marker on the nearest label; where it is not free, no label is aimed at.
    """
    eye = sample.camera[:3, 3]
    dt = 0.0 if state.t is None else max(sample.t - state.t, 0.0)
    gone = 0.0 if state.eye is None else float(np.linalg.norm(eye - np.array(state.eye)))
    here = (float(eye[0]), float(eye[1]), float(eye[2]))
    state = state._replace(t=sample.t, eye=here, travel_mm=state.travel_mm + gone, aimed=None, cutting=False)
    aimed = _aimed(labels, sample.camera)
    if aimed is None:
        return state
    number, marker = aimed
    if not sight(eye, labels[number].at(marker.along, marker.across)):
        return state
    state = state._replace(aimed=number)
    one = state.labels[number]
    if not sample.pressed or one.done_s is not None:
        return state
    near = math.hypot(marker.along - one.end_mm, marker.across) <= NEAR_MM
    if one.began_s is None:
        if not near:
            return state
        first = not any(other.done_s is not None for other in state.labels)
        one = one._replace(began_s=sample.t, travel_mm=None if first else state.travel_mm)
        dt = 0.0  # errors count from here on
    off = angle_to(labels[number].at(one.end_mm), sample.camera)
    one = one._replace(
        held_s=one.held_s + dt, angle_deg_s=one.angle_deg_s + dt * math.degrees(off),
        line_mm_s=one.line_mm_s + dt * marker.off_arrow_mm,
    )  # fmt: skip
    travel = state.travel_mm
    if near:
        one = one._replace(end_mm=min(max(one.end_mm, marker.along), HALF_MM))
        if one.end_mm == HALF_MM:
            one, travel = one._replace(done_s=sample.t), 0.0
    progress = (*state.labels[:number], one, *state.labels[number + 1 :])
    return state._replace(labels=progress, cutting=near, travel_mm=travel)


def followed(labels: Sequence[Label], samples: Iterable[DiathermySample], sight: Sight) -> DiathermyState:
    """The task after all samples."""
    state = first_state(labels)
    for sample in samples:
        state = stepped(labels, state, sample, sight)
    return state


def table_iv(state: DiathermyState) -> list[dict[str, Any]]:
    """Table IV of one person: a row for each label, in the order of the labels."""
    return [one.row() for one in state.labels]


def angle_to(point: Array, camera: Array) -> float:
    """Angle in rad between the optical axis of a camera (4, 4) and the direction to a point (3,)."""
    x, y, z = camera[:3, :3].T @ (point - camera[:3, 3])
    return math.atan2(math.hypot(x, y), z)


def _aimed(labels: Sequence[Label], camera: Array) -> tuple[int, Marker] | None:
    """The nearest label on which the optical axis is, and the marker there."""
    found = [(n, marker) for n, label in enumerate(labels) if (marker := marker_on(label, camera)) is not None]
    return min(found, key=lambda one: one[1].distance) if found else None
