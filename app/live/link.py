"""The live link: tells of the open plan and the rehearsed tool, and takes proposals."""

from __future__ import annotations

import logging
import threading
from typing import Protocol

from app.documents import Documents
from app.link import LinkMessage, LinkServer, Text, Transform
from app.link.server import STATUS
from app.live.board import LiveBoard
from app.live.frames import pose_to_ras
from app.live.incoming import Intake
from app.live.outgoing import PLAN, TOOL, no_registration, plan_messages, registration_messages
from app.plans.service import PlanService
from app.plans.versions import PlanVersions
from app.registration.document import RegistrationContent
from app.settings import LinkAddress
from vfix_engine.error_places import error_places
from vfix_engine.errors import VfixError

_LOG = logging.getLogger(__name__)
_TICK_S = 1.0 / 60.0  # between poses of the tool
_LOOK_EVERY = 15  # ticks between looks at the plan


class LinkServices(Protocol):
    """The part of the services that is needed here."""

    @property
    def live(self) -> LiveBoard: ...

    @property
    def plans(self) -> PlanService: ...

    @property
    def versions(self) -> PlanVersions: ...

    @property
    def registrations(self) -> Documents[RegistrationContent]: ...


class LiveLink:
    """An OpenIGTLink server that tells of the open plan when it changes and of the tool while it is rehearsed."""

    def __init__(self, address: LinkAddress, services: LinkServices) -> None:
        self._board, self._plans, self._registrations = services.live, services.plans, services.registrations
        self._intake = Intake(services.live, services.plans, services.versions, services.registrations)
        self._server = LinkServer(address.host, address.port, self._intake.hear, self._greeting)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="live-link", daemon=True)
        self._known: object = None
        self._poses = 0

    def start(self) -> int:
        """Listen; returns the port. Raises InputError where the address cannot be had."""
        port = self._server.start()
        self._board.wanted = True
        self._thread.start()
        return port

    def close(self) -> None:
        """Let go of every client and of the port."""
        self._board.wanted = False
        self._ended.set()
        if self._thread.is_alive():
            self._thread.join()
        self._server.close()

    def _run(self) -> None:
        tick = 0
        while not self._ended.wait(_TICK_S):
            tick += 1
            for due, do in ((True, self._tell_tool), (tick % _LOOK_EVERY == 0, self._look)):
                try:
                    if due:
                        do()
                except Exception as error:  # the link must not end with one pose, or one plan that cannot be read
                    _LOG.error("the live link stumbled: %s", error_places(error))

    def _tell_tool(self) -> None:
        poses, transform = self._board.tool
        if poses != self._poses and transform is not None:
            self._poses = poses
            self._server.tell([Transform(TOOL, pose_to_ras(transform))])

    def _look(self) -> None:
        """Tell of the plan where it, or a registration of its head, has changed; make the proposals that are due."""
        words = self._intake.settle()
        if words:
            self._server.tell([Text(STATUS, " ".join(words))])
        if not self._server.clients:
            self._known = None
            return
        now = self._state()
        if now != self._known:
            self._known = now
            self._server.tell(self._now())

    def _greeting(self) -> list[LinkMessage]:
        """What a new client is told; the look after it need not tell the first one the same again."""
        state, messages = self._state(), self._now()  # in this order: what changes in between is told once more
        if self._known is None:
            self._known = state
        return messages

    def _state(self) -> object:
        """Equal as long as everything that is told of the open plan is the same."""
        if (plan_id := self._board.plan_id) is None:
            return "no plan"
        try:
            plan = self._plans.get(plan_id)
            return plan.id, plan.revision, [(one.id, one.revision) for one in self._registrations.list(plan.case_id)]
        except VfixError as error:
            return str(error)

    def _now(self) -> list[LinkMessage]:
        """Everything that is told of the open plan."""
        plan_id = self._board.plan_id
        if plan_id is None:
            return [Text(PLAN, "No plan is open."), *no_registration()]
        try:
            plan = self._plans.get(plan_id)
            return [*plan_messages(plan), *registration_messages(plan, self._registrations.list(plan.case_id))]
        except VfixError as error:
            return [Text(STATUS, str(error)), *no_registration()]
