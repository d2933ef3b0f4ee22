"""The section of a drive that every tab with one publishes, under the name `rehearsal`."""

from __future__ import annotations

from typing import Literal, TypedDict

from app.messages.sections import Position

DrivePhase = Literal["absent", "starting", "ready", "running", "paused", "silent", "failed"]


class DriveMotion(TypedDict, total=False):
    """The newest snapshot of a world; absent while there is no robot. Numbers that do not exist are None.

    holding: the active constraint, in words.
    taken_ms: when the snapshot was read from the control process, ms since 1970-01-01 UTC; None while it rests.
    """

    holding: str
    force_n: float | None
    progress_mm: float | None
    length_mm: float | None
    taken_ms: int | None
    tip: Position


class CommentView(TypedDict):
    """A comment on a drive, at a driven time."""

    id: str
    t_s: float | None
    text: str


class DriveSection(DriveMotion):
    """A drive and the holder of its handle; mine: this client, holder: another one.

    fraction: of what the words say of a start, None where that is not known. unrecorded: why the drive is not recorded,
    or not to its end; None where it is. comments: the newest first.
    """

    state: DrivePhase
    words: str
    fraction: float | None
    mine: bool
    holder: str | None
    can_take: bool
    unrecorded: str | None
    comments: list[CommentView]


class DetailsSection(TypedDict, total=False):
    """Timing of the control loop; empty while there is no robot. rows: of the solved program."""

    loop_hz: float | None
    step_us: float | None
    step_us_p99: float | None
    lateness_us_p50: float | None
    lateness_us_p99: float | None
    overruns: int
    rows: int
    steps: int
    priority: str


class DriveSections(TypedDict):
    """The drive of the open case or document, and its loop."""

    rehearsal: DriveSection
    details: DetailsSection
