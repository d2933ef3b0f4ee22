"""A drive as it is at one instant, for one client: read under one lock, and then a plain value."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Generic, Literal, TypeVar

from app.drives.prepared_drive import PreparedDrive
from app.drives.sections import DrivePhase
from app.messages.client import Client
from vfix_engine.runtime.requests import Request
from vfix_engine.runtime.settings import WorldSettings
from vfix_engine.runtime.snapshot import Snapshot

P = TypeVar("P", bound=PreparedDrive[Any])
T = TypeVar("T", bound=Snapshot)

ProcessStatus = Literal["absent", "starting", "ready", "silent", "failed"]


@dataclass(frozen=True, eq=False)
class DriveRecord(Generic[P, T]):
    """State of a shared drive. P is the type of what is prepared for it, T that of its snapshots.

    state, words: of the control process; words: what is going on while it starts, or why it failed.
    snapshot: the newest; None before the first. prepared: what is driven; None while there is no robot.
    made_of: what it was prepared from. requested: the request that was sent last, None before the first.
    settings: in force, as the process has confirmed them; None while there is no robot. answered: number of changes
    that were answered, refusals included. refusal: why the newest change was not taken, '' where it was.
    holder: who holds the handle. mine: it is this client. hand_lost: this client still presses, and was heard of too
    late for that to count.
    may_instruct: this client may send requests and settings. may_prepare: it may change what the next drive is
    prepared from: the holder, who instructs, or who may hold what nobody holds.
    words_for_holder: what the process has said to this client since the last record. accepted: settings of this client
    that came into force and that the document has not kept yet.
    unrecorded: why the drive is not recorded, or not to its end; '' where it is.
    """

    state: ProcessStatus = "absent"
    words: str = ""
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
        """Whether the robot that stands here, or comes, was prepared from this."""
        return self.made_of == made_of and self.state in ("starting", "ready", "silent")
