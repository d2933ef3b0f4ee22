"""A drive at one instant, for one client: read under one lock, then an immutable value."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Generic, Literal, TypeVar

from app.drives.live_comments import RunComment
from app.drives.prepared_drive import PreparedDrive
from app.drives.sections import DrivePhase
from app.messages.client import Client
from vfix_engine.runtime.control_mode import Control
from vfix_engine.runtime.requests import Request
from vfix_engine.runtime.settings import WorldSettings
from vfix_engine.runtime.snapshot import Snapshot

P = TypeVar("P", bound=PreparedDrive[Any])
T = TypeVar("T", bound=Snapshot)

HAND = Control()  # a hand on the robot

ProcessStatus = Literal["absent", "starting", "ready", "silent", "failed"]


@dataclass(frozen=True, eq=False)
class DriveRecord(Generic[P, T]):
    """State of a shared drive. P is the type of the prepared drive, T that of its snapshots.

    state, words: of the control process; words: progress of its start, or why it failed. fraction: of what they say
    of its start, None where that is not known.
    snapshot: the newest; None before the first. prepared: the driven one; None while there is no robot.
    made_of: key of the inputs that it was prepared from. requested: the request that was sent last, None before the
        first.
    settings: the present ones, confirmed by the process; None while there is no robot. answered: number of changes
    that were answered, refusals included. refusal: why the newest change was refused, '' where it was not.
    holder: the client that holds the handle. mine: it is this client. hand_lost: this client still presses, but its
    input came too late to be used.
    may_instruct: this client may send requests and settings. may_prepare: it may change what the next drive is
    prepared from: the holder, a client that instructs, or one that may take the free handle.
    words_for_holder: messages of the process to this client since the last record. accepted: settings of this client
    that took effect and are not stored in the document yet.
    unrecorded: why the drive is not recorded, or not to its end; '' where it is.
    control, preset, options: chosen for this drive and the next one; options: of the tab's own type.
    comments: on this drive so far, by any client.
    """

    state: ProcessStatus = "absent"
    words: str = ""
    fraction: float | None = None
    snapshot: T | None = None
    prepared: P | None = None
    made_of: Any = None
    requested: Request | None = None
    settings: WorldSettings | None = None
    answered: int = 0
    refusal: str = ""
    holder: Client | None = None
    mine: bool = False
    hand_lost: bool = False
    may_instruct: bool = False
    may_prepare: bool = False
    words_for_holder: tuple[str, ...] = ()
    accepted: dict[str, float] = field(default_factory=dict)
    unrecorded: str = ""
    control: Control = HAND
    preset: str | None = None
    options: Any = None
    comments: tuple[RunComment, ...] = ()

    @property
    def shown_state(self) -> DrivePhase:
        """The state on the page: that of the process, and whether the robot runs."""
        if self.state != "ready":
            return self.state
        if self.snapshot is None:
            return "starting"
        if self.snapshot.running:
            return "running"
        return "paused" if self.snapshot.steps > 0 else "ready"

    def is_for(self, made_of: object) -> bool:
        """Whether the present or starting robot was prepared from these inputs."""
        return self.made_of == made_of and self.state in ("starting", "ready", "silent")
