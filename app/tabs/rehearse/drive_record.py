"""A drive as it is at one instant, for one client: read under one lock, and then a plain value."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from app.messages.client import Client
from app.planning.rehearsal_options import Switches
from app.tabs.rehearse.preparation import Prepared
from app.tabs.rehearse.sections import RehearsalPhase
from vfix_engine.control import ControlSettings
from vfix_engine.robots import PlacedRobot
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot

ProcessStatus = Literal["absent", "starting", "ready", "silent", "failed"]


@dataclass(frozen=True, eq=False)
class DriveRecord:
    """State of a shared drive.

    state, words: of the control process; words: what is going on while it starts, or why it failed.
    snapshot: the newest; None before the first. prepared, robot: what is driven; None while there is no robot.
    plan_key: what it was placed for. target_id: the target that was chosen last for inspection.
    settings: in force, as the process has confirmed them. answered: number of changes that were answered, refusals
    included. refusal: why the newest change was not taken, '' where it was.
    holder: who holds the handle. mine: it is this client. hand_lost: this client still presses, and was heard of too
    late for that to count.
    may_instruct: this client may change mode, target and settings. may_switch: it may change the switches: the holder,
    who instructs, or who may hold what nobody holds.
    words_for_holder: what the process has said to this client since the last record. accepted: settings of this client
    that came into force and that the plan has not kept yet.
    unrecorded: why the drive is not recorded, or not to its end; '' where it is.
    """

    state: ProcessStatus = "absent"
    words: str = ""
    snapshot: RigidSnapshot | None = None
    prepared: Prepared | None = None
    robot: PlacedRobot | None = None
    plan_key: object = None
    target_id: str | None = None
    settings: ControlSettings = field(default_factory=ControlSettings)
    answered: int = 0
    refusal: str = ""
    holder: Client | None = None
    mine: bool = False
    hand_lost: bool = False
    may_instruct: bool = False
    may_switch: bool = False
    words_for_holder: tuple[str, ...] = ()
    accepted: dict[str, float] = field(default_factory=dict)
    unrecorded: str = ""

    @property
    def shown_state(self) -> RehearsalPhase:
        """The state on the page: that of the process, and whether the robot runs."""
        if self.state != "ready":
            return self.state
        if self.snapshot is None:
            return "starting"
        if self.snapshot.running:
            return "running"
        return "paused" if self.snapshot.steps > 0 else "ready"

    def is_for(self, plan_key: object) -> bool:
        """Whether the robot that stands here, or comes, was placed for this revision of the plan."""
        return self.plan_key == plan_key and self.state in ("starting", "ready", "silent")

    @property
    def switches(self) -> Switches | None:
        """Those in force; None while there is no robot."""
        return None if self.prepared is None else self.prepared.switches


NO_DRIVE = DriveRecord()
