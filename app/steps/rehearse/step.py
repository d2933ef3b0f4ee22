"""A tab's side of the rehearsal: which room it is in, whether it holds the handle, what it shows."""

from __future__ import annotations

import logging
from concurrent.futures import Executor
from typing import Any

from app.messages.sections import RehearsalSections, RehearsalState, ToolSection
from app.services import Services
from app.services.errors import PlanLocked
from app.session.view_model import ViewModel
from app.steps.plan.edited_plan import curve_section, entries
from app.steps.rehearse import commands as c
from app.steps.rehearse.hints import rehearse_hint
from app.steps.rehearse.preparation import plan_key, prepare
from app.steps.rehearse.shared_drive import Prepared, SharedDrive, SharedDrives
from app.steps.rehearse.view import details_section, rehearsal_section, settings_section
from vfix_engine.control import ControlSettings
from vfix_engine.errors import PlanError, VfixError
from vfix_engine.imaging.surface_uncertainty import SurfaceUncertainty
from vfix_engine.robots import PlacedRobot
from vfix_engine.simulation.snapshot import Snapshot

_LOG = logging.getLogger(__name__)
_HAND_LOST = "The window was late, so the hand let go: press again"
_NOT_HELD = "only the window that holds the handle can do that; you can watch, or take over when it lets go."


class RehearseStep:
    """Owned by its workspace's thread; only :attr:`room` is read from others."""

    def __init__(self, services: Services, rooms: SharedDrives, executor: Executor, tab: str) -> None:
        self._services, self._rooms, self._executor, self._tab = services, rooms, executor, tab
        self._plan_id: str | None = None
        self._uncertainty: SurfaceUncertainty | None = None  # of the bone that the margin is kept to
        self.room: SharedDrive | None = None
        self.snapshot: Snapshot | None = None
        self._before: Snapshot | None = None  # the one that was read before it
        self._changed = False  # the plan is another one than what is driven
        self._run_when_ready = False
        self._arrived = False
        self._unkept: dict[str, float] = {}  # settings that the plan could not keep when it was tried last
        self.plan_edited = False  # the plan in the store has changed by what was done here

    def enter(self, plan_id: str | None) -> None:
        """Go to the room of a plan."""
        self.leave()
        if plan_id is not None:
            self._plan_id = plan_id
            self._uncertainty = self._services.cases.get(self._services.plans.get(plan_id).case_id).uncertainty
            self.room = self._rooms.enter(plan_id, self._tab)

    def leave(self) -> None:
        """Go out of the room."""
        self.away()
        self.room = self.snapshot = self._before = self._plan_id = None
        self._run_when_ready = self._changed = False
        self._unkept = {}

    @property
    def mine(self) -> bool:
        return self.room is not None and self.room.lease.held_by(self._tab)

    @property
    def robot(self) -> PlacedRobot | None:
        return None if self.room is None else self.room.robot

    @property
    def state(self) -> RehearsalState:
        """What the page shows: the room's state, and in it whether the robot runs."""
        if self.room is None:
            return "absent"
        state = self.room.state
        if state != "ready" or self.snapshot is None:
            return "starting" if state == "ready" else state
        if self.snapshot.running:
            return "running"
        return "paused" if self.snapshot.steps > 0 else "ready"

    def places(self) -> list[tuple[float, float, float]]:
        """What a view of the rehearsal has to show besides the plan: the grip."""
        if self.snapshot is None:
            return []
        x, y, z = (float(value) for value in self.snapshot.grip)
        return [(x, y, z)]

    def driven(self) -> Prepared | None:
        """What is driven, where that is not the plan as it is now."""
        return self.room.prepared if self.room is not None and self._changed else None

    def compare(self, plan: Any) -> None:
        """Look whether the robot was placed for the plan as it is now."""
        if (room := self.room) is None or room.prepared is None:
            self._changed = False
        else:
            self._changed = plan is None or not room.is_for(plan_key(plan))

    def give_up(self) -> None:
        """Nobody is at this desk for now: the robot pauses where it is and the handle is free."""
        self._run_when_ready = False
        if self.room is None:
            return
        room, accepted = self.room, self.room.accepted(self._tab)
        try:
            room.pause(self._tab)
        finally:  # a process that has just ended cannot be paused; the handle is free all the same
            room.leave(self._tab)
            for words in self._keep_settings(room, accepted):  # last: it waits for the disk
                _LOG.warning("%s", words)  # nobody is there to read it

    def away(self) -> None:
        """Nobody is at this desk any more: the handle is free, and a robot that nobody watches is sent home."""
        if self.room is not None:
            self.room.leave(self._tab)
            self._rooms.leave(self.room, self._tab)

    def back(self) -> None:
        """The page is there again: into the room of its plan, which may be another one by now."""
        if self._plan_id is None:
            return
        self._unkept = {}
        room = self._rooms.enter(self._plan_id, self._tab)
        if room is not self.room:
            self.room, self.snapshot = room, None

    def arrived(self) -> bool:
        """True once after a robot has been put in place: the time to look at it."""
        arrived, self._arrived = self._arrived, False
        return arrived

    # -- commands

    def prepare(self, plan: Any) -> None:
        """Put the robot at the entry, unless it stands there already or another window has it."""
        room = self.room
        if room is None or plan is None or len(plan.points) < 2 or room.is_for(plan_key(plan)):
            return
        if room.lease.take(self._tab):
            self._open(room, plan)

    def do_plain(self, name: str, plan: Any, case_id: str | None) -> None:
        """Start, pause, reset, or end a process that hangs. Raises PlanError where this window may not."""
        room = self.room
        if room is None or plan is None or case_id is None:
            raise PlanError("open a plan first.")
        if name == "rehearsal.start":
            self._start(room, plan)
        elif name == "rehearsal.end":
            self._take(room)
            room.close()
        elif name == "rehearsal.pause":
            self._run_when_ready = False
            room.halt()
        elif not room.lease.held_by(self._tab):
            raise PlanError(_NOT_HELD)
        else:
            self._reset(room, plan)

    def _take(self, room: SharedDrive) -> None:
        if not room.lease.take(self._tab):
            raise PlanError(_NOT_HELD)

    def _start(self, room: SharedDrive, plan: Any) -> None:
        """A robot that stands goes on along what it was placed for; one that is not there comes and runs then."""
        self._take(room)
        if room.state == "ready":
            room.run(self._tab)
            return
        if not room.is_for(plan_key(plan)):
            self._open(room, plan)
        self._run_when_ready = True

    def _reset(self, room: SharedDrive, plan: Any) -> None:
        if room.is_for(plan_key(plan)):
            room.reset(self._tab)
        else:
            self._open(room, plan)

    def _open(self, room: SharedDrive, plan: Any) -> None:
        if len(plan.points) < 2:
            raise PlanError("a rehearsal needs a path of two points at least.")
        room.open(plan_key(plan), lambda: prepare(self._services, plan), self._executor)

    def do(self, command: c.SetMode | c.SetRehearsalSettings) -> None:
        """Raises PlanError where this window does not hold the handle."""
        if self.room is None:
            return
        if not self.room.lease.held_by(self._tab):
            raise PlanError(_NOT_HELD)
        if isinstance(command, c.SetMode):
            self.room.set_mode(self._tab, command.mode, command.target_id)
        else:
            self.room.change_settings(self._tab, command.values)

    def pause(self) -> None:
        if self.room is not None:
            self.room.release(self._tab)
            self.room.pause(self._tab)

    # -- each tick

    def tick(self) -> list[str]:
        """Read the newest snapshot; returns words of the control process for the user."""
        room = self.room
        if room is None:
            return []
        room.check()
        words, accepted = room.take_words(self._tab), room.accepted(self._tab)
        if accepted != self._unkept:
            words += self._keep_settings(room, accepted)
        before, self.snapshot = self.snapshot, room.snapshot()
        self._before = before if before is not self.snapshot else self._before
        self._arrived |= before is None and self.snapshot is not None
        if self._run_when_ready and room.state == "ready":
            self._run_when_ready = False
            room.run(self._tab)
        elif room.state == "failed":
            self._run_when_ready = False
        return words

    def _keep_settings(self, room: SharedDrive, accepted: dict[str, float]) -> list[str]:
        """The plan keeps the settings that came into force, unless it is locked; returns words where it does not.

        Where the store refuses, it is tried again with the next change, or by the next window that has the handle.
        """
        self._unkept, words = {}, list[str]()
        if not accepted or self._plan_id is None:
            return words
        try:
            before = self._services.plans.get(self._plan_id)
            after = self._services.plans.editor(self._plan_id).set_settings(accepted)
        except PlanLocked:
            words.append("The plan is locked: the changed settings hold for this rehearsal only.")
        except VfixError as error:
            self._unkept = accepted
            return [f"The changed settings hold for this rehearsal only, the plan could not keep them: {error}"]
        else:
            room.plan_changed(plan_key(before), plan_key(after))
            self.plan_edited = True
        room.kept(accepted)
        return words

    # -- for the page

    def hint(self, plan: Any) -> str:
        points, targets = (0, 0) if plan is None else (len(plan.points), len(plan.targets))
        mode, done = ("path", False) if self.snapshot is None else (self.snapshot.mode, self.snapshot.phase == "done")
        free = self.room is not None and self.room.lease.holder is None
        return rehearse_hint(points, self.state, self.mine, free, mode, done, targets, self._changed)

    def publish(self, board: ViewModel, driven: Prepared | None) -> None:
        """driven: what is to be shown instead of the plan, where the plan is another one by now."""
        room = self.room
        holder = room is not None and room.lease.holder is not None
        words = "" if room is None else room.words
        section = rehearsal_section(self.snapshot, self.state, words, self.mine, holder, self._before)
        section["plan_changed"] = self._changed
        if room is not None and room.hand_lost(self._tab) and "holding" in section:
            section["holding"] = _HAND_LOST
        section["target_id"] = room.target_id if room is not None and section.get("mode") == "inspect" else None
        settings, answered, refusal = ControlSettings(), 0, ""
        if room is not None:
            settings, answered, refusal = room.settings, room.settings_answered, room.settings_refusal
        warning = "" if self._uncertainty is None else self._uncertainty.warning(settings.margin_mm)
        sections: RehearsalSections = {
            "rehearsal": section,
            "driven": None if driven is None else entries(driven.items),
            "details": details_section(self.snapshot),
            "settings": settings_section(settings, answered, refusal, warning),
            "tool": self._tool(),
        }
        if driven is not None:
            sections["curve"] = curve_section(driven.curve)
        board.publish(sections)

    def _tool(self) -> ToolSection:
        if self.snapshot is None:
            return {"segments": []}
        pairs = zip(self.snapshot.segments_start, self.snapshot.segments_end, strict=True)
        return {"segments": [[[round(float(v), 2) for v in end] for end in pair] for pair in pairs]}
