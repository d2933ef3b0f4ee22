"""One tab's workspace: which head, which plan, which step; a thread of its own answers requests in order."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from concurrent.futures import Executor
from typing import Any, cast, get_args

import numpy as np
import viser

from app.messages.fields import Command, Position
from app.messages.sections import ProjectAnswer, SessionSections, StepName, StepSection
from app.scene.camera import Lens
from app.scene.hand import GripDrag
from app.scene.plan import DragEvent
from app.scene.view import ClickRay, SceneEvents, SceneView
from app.services import Services
from app.session import commands as c
from app.session.inbox import Inbox, Request
from app.session.view_model import ViewModel
from app.steps.patient import commands as on_patient
from app.steps.plan import commands as on_plan
from app.steps.plan.step import PlanStep
from app.steps.rehearse import commands as on_robot
from app.steps.rehearse.shared_drive import Prepared, SharedDrives
from app.steps.rehearse.step import RehearseStep
from app.views import commands as on_view
from app.views.case_view import CaseView
from app.views.scene_link import Head, Picture, SceneLink
from vfix_engine.errors import VfixError

Reply = Callable[[bool, Any], None]
Note = Callable[[str, bool], None]
_LOG = logging.getLogger(__name__)


class ClientSession:
    """State of one tab on the server; it outlives a lost connection."""

    def __init__(
        self, tab: str, services: Services, rooms: SharedDrives, executor: Executor, warming: Callable[[], str]
    ) -> None:
        self.tab = tab
        self._warming = warming
        self.board = ViewModel()
        self.note: Note = lambda words, error: None
        self._inbox = Inbox()
        self._step: StepName = "plan"
        self._link: SceneLink | None = None
        self._lens: Lens | None = None
        self._viewed: Head | None = None  # the head that the camera was turned to
        self._list_stale = True
        self.head = CaseView(services, self.board, executor, self.ask)
        self.planning = PlanStep(services, self.board, executor, self.ask)
        self.rehearsal = RehearseStep(services, rooms, executor, tab)
        self._thread = threading.Thread(target=self._run, name=f"workspace-{tab[:6]}", daemon=True)

    # -- from other threads: queue only

    def start(self, wanted: dict[str, str]) -> None:
        """Begin work; ``wanted`` names the case, plan and step to open, where the page remembers them."""
        self._inbox.put(lambda: self._open_first(wanted))
        self._thread.start()

    def close(self) -> None:
        """The thread ends after what waits already, and leaves the rehearsal."""
        self._inbox.close()

    def tick(self, changed: bool) -> None:
        """The planner's clock: look at the rehearsal; changed: at the stored cases and plans as well."""
        if changed:
            self.ask(self._look_again, "look again")
        self.ask(self._tick, "tick")

    @property
    def lively(self) -> bool:
        """A robot is there or comes: what is shown of it changes by itself."""
        room = self.rehearsal.room
        return room is not None and room.state != "absent"

    def hand_gone(self) -> None:
        """The page is not there any more: whatever the hand held is let go of."""
        if self.rehearsal.room is not None:
            self.rehearsal.room.release(self.tab)
        self.ask(self.planning.let_go)

    def give_up_handle(self, still_away: Callable[[], bool]) -> None:
        """The page does not come back: the robot pauses, and somebody else may have the handle."""
        self.ask(lambda: self.rehearsal.give_up() if still_away() else None)

    def give_up_rehearsal(self, still_away: Callable[[], bool]) -> None:
        """The page has been gone for long: a robot that nobody else watches is sent home."""
        self.ask(lambda: self.rehearsal.away() if still_away() else None)

    def page_back(self) -> None:
        self.ask(self.rehearsal.back)
        self.ask(self._look_again, "look again")

    def ask(self, request: Request, slot: str | None = None) -> bool:
        return self._inbox.put(request, slot)

    def command(self, command: Command, reply: Reply | None = None) -> bool:
        """Answer a command of the page; False when too many wait already."""
        if isinstance(command, on_robot.HandCommand | on_robot.Push):
            self._hand(command)
            return True
        slot = command.stream()
        return self.ask(lambda: self._answer(command, reply), slot)

    def scene_connected(self, client: viser.ClientHandle) -> None:
        self.ask(lambda: self._attach(client))

    def scene_gone(self) -> None:
        self.ask(self._detach)

    def _hand(self, command: on_robot.HandCommand | on_robot.Push) -> None:
        """The hand's messages go straight to the control process; each is a write into shared memory."""
        room = self.rehearsal.room
        if room is None:
            return
        if isinstance(command, on_robot.Push):
            (room.drive if command.type == "drive" else room.twist)(self.tab, command.direction)
        elif command.type == "heartbeat":
            room.heartbeat(self.tab)
        elif command.type == "grip.release":
            room.release_grip(self.tab)
        elif command.type == "rehearsal.take":
            room.lease.take(self.tab)
        elif command.type == "rehearsal.let_go":
            room.leave(self.tab)

    def _events(self) -> SceneEvents:
        return SceneEvents(
            clicked=lambda ray: self.ask(lambda: self._clicked(ray)),
            item_dragged=lambda drag: self.ask(lambda: self._dragged(drag), _drag_slot(drag)),
            grip_dragged=self._grip_dragged,
            camera_moved=lambda lens: self.ask(lambda: self._camera_moved(lens), "camera"),
        )

    def _grip_dragged(self, drag: GripDrag) -> None:
        room = self.rehearsal.room
        if room is None:
            return
        if drag.phase == "end":
            room.release_grip(self.tab)
        elif drag.phase == "start":
            room.set_grip(self.tab, drag.position)
        else:
            room.move_grip(self.tab, drag.position)

    # -- on the workspace's own thread

    def _run(self) -> None:
        while (request := self._inbox.get()) is not None:
            self._guarded(request)
            if request != self._tick:
                self._guarded(self._publish)
        self._guarded(self.rehearsal.leave)

    def _guarded(self, request: Request) -> None:
        try:
            request()
        except VfixError as error:
            self.note(str(error), True)
        except Exception:
            _LOG.exception("a request of a workspace failed")
            self.note("That did not work; the planner's log says why.", True)

    def _tick(self) -> None:
        for words in self.rehearsal.tick():
            self.note(words, True)
        edited, self.rehearsal.plan_edited = self.rehearsal.plan_edited, False
        self._list_stale |= edited
        drawn = self._driven()
        self.rehearsal.compare(self.planning.plan)
        if edited or self._driven() is not drawn:
            self._publish()
        else:
            self._publish_rehearsal()
            self.board.commit()

    def _look_again(self) -> None:
        """Other tabs and the command line change cases and plans too."""
        self._list_stale = True

    def _open_first(self, wanted: dict[str, str]) -> None:
        self.head.open_first(wanted.get("case"))
        self._open_plan(wanted.get("plan"))
        if self.head.case_id is None:
            self._set_step("patient")
        elif (step := wanted.get("step")) in get_args(StepName):
            self._set_step(cast(StepName, step))

    def _open_plan(self, plan_id: str | None) -> None:
        self.rehearsal.leave()
        case_id = self.head.case_id
        if case_id is None:
            self.planning.close()
        elif words := self.planning.open(case_id, plan_id):
            self.note(words, True)
        self._enter_room()

    def _enter_room(self) -> None:
        self.rehearsal.enter(self.planning.plan_id)

    def _answer(self, command: Command, reply: Reply | None) -> None:
        self._list_stale |= isinstance(
            command,
            on_patient.CaseCommand | on_patient.RenameCase | on_plan.PlanCommand | on_plan.NewPlan | on_plan.RenamePlan,
        )
        try:
            result = self._do(command)
        except VfixError as error:
            if reply is None:
                raise
            reply(False, str(error))
            return
        if reply is not None:
            self._publish()
            reply(True, result)

    def _do(self, command: Command) -> Any:
        match command:
            case on_view.Project():
                return self._project(command.points)
            case c.SetStep():
                self._set_step(command.name)
            case on_patient.CaseCommand() | on_patient.RenameCase():
                self._do_case(command)
            case on_plan.PlanCommand() | on_plan.NewPlan() | on_plan.RenamePlan():
                self._do_plan(command)
            case on_view.SetCross() | on_view.SetSlice() | on_view.SetWindow() | on_view.SetView():
                self.head.do(command)
            case on_view.SetCamera():
                self._look_from(command.view)
            case on_robot.SetMode() | on_robot.SetRehearsalSettings():
                self.rehearsal.do(command)
            case on_robot.DriveCommand():
                self.rehearsal.do_plain(command.type, self.planning.plan, self.head.case_id)
            case _:
                self._say(self.planning.do(command))
        return None

    def _say(self, words: str) -> None:
        if words:
            self.note(words, False)

    def _set_step(self, name: StepName) -> None:
        if name == self._step:
            return
        if self._step == "rehearse":
            self.rehearsal.pause()
        self._step = name
        self.planning.quiet()
        if name == "rehearse":
            self.head.open_up(self.planning.places())
            self._look_from("nose")
            self.rehearsal.prepare(self.planning.plan)

    def _do_case(self, command: on_patient.CaseCommand | on_patient.RenameCase) -> None:
        if command.type == "case.open":
            self.head.open(command.case_id)
            self._open_plan(None)
        else:
            self.head.change(command)

    def _do_plan(self, command: on_plan.PlanCommand | on_plan.NewPlan | on_plan.RenamePlan) -> None:
        before = self.planning.plan_id
        if words := self.planning.do_plan(command):
            self.note(words, True)
        if self.planning.plan_id != before:
            self.rehearsal.leave()
            self._enter_room()

    def _follow_selection(self) -> None:
        """Slices go through the point that was just chosen or added."""
        position = self.planning.take_focus()
        if position is not None:
            self.head.go_to(position)

    # -- the scene

    def _attach(self, client: viser.ClientHandle) -> None:
        self._link = SceneLink(SceneView(client, self._events()))
        self._viewed = None

    def _detach(self) -> None:
        self._link = self._lens = None
        self.planning.let_go()
        if self.rehearsal.room is not None:
            self.rehearsal.room.release(self.tab)

    def _look_from(self, name: str) -> None:
        if self._link is None:
            return
        centre, radius = self.head.extent()
        if name == "nose":
            places = np.array(self.planning.places() + self.rehearsal.places())
            if len(places):
                centre = (places.min(axis=0) + places.max(axis=0)) / 2.0
                radius = max(45.0, 0.5 * float(np.linalg.norm(np.ptp(places, axis=0))) + 12.0)
            else:
                radius *= 0.45
        self._link.look_from(name, centre, radius)

    def _clicked(self, ray: ClickRay) -> None:
        if self._step == "plan":
            self._say(self.planning.click(ray, self.head))

    def _dragged(self, drag: DragEvent) -> None:
        if self._step == "plan":
            self._say(self.planning.dragged(drag))

    def _camera_moved(self, lens: Lens) -> None:
        self._lens = lens

    def _project(self, points: list[Position]) -> ProjectAnswer:
        """Places on the canvas in parts of its size; null behind the camera."""
        lens = self._link.view.lens() if self._link else None
        if lens is None:
            return {"places": None}
        places = lens.project(np.array(points, dtype=np.float64).reshape(-1, 3))
        return {"places": [place.tolist() if np.isfinite(place).all() else None for place in places]}

    # -- what the page and the scene show

    def _publish(self) -> None:
        """Everything, after a request; between requests only the rehearsal moves."""
        self._follow_selection()
        fresh, self._list_stale = self._list_stale, False
        self.head.publish(fresh)
        self.planning.publish(fresh)
        self.rehearsal.compare(self.planning.plan)
        self._publish_camera()
        self._draw()
        self._publish_rehearsal()
        self.board.commit()

    def _publish_rehearsal(self) -> None:
        self.rehearsal.publish(self.board, self._driven())
        self._show({"step": self._step_section()})
        if self._link is None:
            return
        showing = self._step == "rehearse"
        self._link.draw_rehearsal(
            self.rehearsal.snapshot if showing else None, self.rehearsal.robot if showing else None, self.rehearsal.mine
        )
        if showing and self.rehearsal.arrived():
            self._look_from("nose")

    def _draw(self) -> None:
        """Bring the still part of the scene up to date, and say whether there is one."""
        ready = self._link is not None and self.head.head is not None
        words = "" if ready else self.head.loading or "Preparing the scene …"
        self._show({"scene": {"ready": ready, "words": words}})
        if self._link is None:
            return
        self._link.draw(self._picture())
        if ready and self._viewed is not self.head.head:
            self._viewed = self.head.head
            self._look_from("nose" if self._step == "rehearse" else "oblique")

    def _picture(self) -> Picture:
        head, planning, driven = self.head, self.planning, self._driven()
        return Picture(
            head=head.head,
            look=head.look(),
            slices_key=head.slices_key(),
            slices=head.slice_pictures,
            items=planning.items() if driven is None else driven.items,
            selected=planning.selected if self._step == "plan" else None,
            locked=planning.locked or self._step != "plan",
            curve_key=planning.curve_key() if driven is None else id(driven),
            curve=planning.curve if driven is None else lambda: (driven.curve, None),
            ghost=planning.ghost,
        )

    def _driven(self) -> Prepared | None:
        """What is to be drawn instead of the plan: the rehearsal of another one."""
        return self.rehearsal.driven() if self._step == "rehearse" else None

    def _publish_camera(self) -> None:
        lens = self._lens
        height = None if lens is None or lens.height <= 0 else round(lens.mm_per_pixel * lens.height, 2)
        self._show({"camera": {"view_height_mm": height}})

    def _show(self, sections: SessionSections) -> None:
        self.board.publish(sections)

    def _step_section(self) -> StepSection:
        available: list[StepName] = ["patient"]
        if self.head.case_id is not None:
            available.append("plan")
        if self.planning.plan_id is not None:
            available.append("rehearse")
        return {"name": self._step, "available": available, "hint": self._hint()}

    def _hint(self) -> str:
        if warming := self._warming():
            return f"{warming} …"
        if self._step == "patient":
            return self.head.hint()
        if self._step == "plan":
            return self.planning.hint()
        return self.rehearsal.hint(self.planning.plan)


def _drag_slot(drag: DragEvent) -> str | None:
    return f"drag.{drag.item_id}" if drag.phase == "update" else None
