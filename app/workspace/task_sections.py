"""What every client is told of a task of Kwok 2013 at one moment, of a drive or of a run."""

from __future__ import annotations

from typing import TypedDict

from app.messages.sections import Position


class TaskPolypView(TypedDict):
    """A polyp. at: its middle now, LPS mm; colour: 0, blue, to 1, yellow; cleared: it was viewed for long enough."""

    at: Position
    colour: float
    cleared: bool


class PolypSeenView(TypedDict):
    """A polyp in the picture: its distance from the lens, and its angle off the optical axis."""

    distance_mm: float
    angle_deg: float


class TaskNowView(TypedDict):
    """Study I. polyps: all of them, so many, in the order of their numbers; cleared: how many are.

    held_s: for how long what is aimed at is viewed, of hold_s. frame_deg: half the opening of the aiming frame. end_mm:
    of the tip, where the task ends; end_name: of the landmark there. viewable_share: of the wall there, None if nobody
    asked. words: why this may differ from the run's score. seen: how far in mm and how many degrees off the axis the
    nearest polyp is that is left and in the picture, while none is viewed; None for none.
    """

    of: int
    cleared: int
    viewed: bool
    seen: PolypSeenView | None
    held_s: float
    hold_s: float
    polyps: list[TaskPolypView]
    radius_mm: float
    frame_deg: float
    end_mm: float
    end_name: str
    viewable_share: float | None
    completed: bool
    words: str


class TaskLabelView(TypedDict):
    """A label of study II, LPS: its middle in mm, unit vectors of its face and of its arrow, and what is to be cut.

    end_mm: of the object's aimed end along the arrow, from −10 to 10, where it is done.
    """

    centre: Position
    normal: Position
    along: Position
    end_mm: float


class LabelsNowView(TypedDict):
    """Study II. traced: how many labels are done; aimed: number of the one under the marker, from 1.

    cutting: its object is being shortened. near_mm: as near the marker has to be. words: why this may differ from the
    run's score.
    """

    labels: list[TaskLabelView]
    traced: int
    aimed: int | None
    cutting: bool
    near_mm: float
    completed: bool
    words: str


class TaskMomentView(TypedDict):
    """A task at one moment: of study I ``now``, of study II ``labels``."""

    now: TaskNowView | None
    labels: LabelsNowView | None
