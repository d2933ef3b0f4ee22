"""The live link: sends the open plan and the pose of the rehearsed tool, and receives proposals."""

from __future__ import annotations

import logging
import threading
from typing import Protocol

from app.documents.documents import Documents
from app.link import LinkMessage, LinkServer, Text, Transform
from app.link.server import STATUS
from app.live.board import LiveBoard
from app.live.frames import pose_to_ras
from app.live.incoming import Intake
from app.live.outgoing import PLAN, TOOL, TOOL_MODE, no_registration, plan_messages, registration_messages
from app.plans.service import PlanService
from app.plans.versions import PlanVersions
from app.registration.document import RegistrationContent
from app.settings import LinkAddress
from vfix_engine.error_places import error_places
from vfix_engine.errors import VfixError

_LOG = logging.getLogger(__name__)
_TICK_S = 1.0 / 60.0  # between poses of the tool
_LOOK_EVERY = 15  # ticks between checks of the plan


class LinkServices(Protocol):
    """The services used by the live link."""

    @property
    def live(self) -> LiveBoard: ...

    @property
    def plans(self) -> PlanService: ...

    @property
    def versions(self) -> PlanVersions: ...

    @property
    def registrations(self) -> Documents[RegistrationContent]: ...


class LiveLink:
    """An OpenIGTLink server that sends the open plan when it changes, and the tool's pose during a rehearsal."""

    def __init__(self, address: LinkAddress, services: LinkServices) -> None:
        self._board, self._plans, self._registrations = services.live, services.plans, services.registrations
        self._intake = Intake(services.live, services.plans, services.versions, services.registrations)
        self._server = LinkServer(address.host, address.port, self._intake.receive, self._greeting)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="live-link", daemon=True)
        self._known: object = None
        self._poses = 0
        self._driven = ""  # as it was sent last

    def start(self) -> int:
        """Start to listen and return the port. Raises InputError if the address is not available."""
        port = self._server.start()
        self._board.wanted = True
        self._thread.start()
        return port

    def close(self) -> None:
        """Disconnect every client and close the port."""
        self._board.wanted = False
        self._ended.set()
        if self._thread.is_alive():
            self._thread.join()
        self._server.close()

    def _run(self) -> None:
        tick = 0
        while not self._ended.wait(_TICK_S):
            tick += 1
            for due, do in ((True, self._send_tool), (tick % _LOOK_EVERY == 0, self._check)):
                try:
                    if due:
                        do()
                except Exception as error:  # one invalid pose or unreadable plan must not end the link
                    _LOG.error("the live link met an error: %s", error_places(error))

    def _send_tool(self) -> None:
        poses, transform, driven = self._board.tool
        if poses == self._poses or transform is None:
            return
        words = [Text(TOOL_MODE, driven)] if driven != self._driven else []  # before the first pose that is driven so
        self._poses, self._driven = poses, driven
        self._server.broadcast([*words, Transform(TOOL, pose_to_ras(transform))])

    def _check(self) -> None:
        """Send the plan if it or a registration of its head has changed, and make the proposals that are due."""
        words = self._intake.settle()
        if words:
            self._server.broadcast([Text(STATUS, " ".join(words))])
        if not self._server.clients:
            self._known = None
            return
        now = self._state()
        if now != self._known:
            self._known = now
            self._server.broadcast(self._messages())

    def _greeting(self) -> list[LinkMessage]:
        """Return the messages for a new client; for the first client the next check need not send them again."""
        state, messages = self._state(), self._messages()  # in this order: a change in between is sent again
        if self._known is None:
            self._known = state
        driven = self._board.tool[2]
        return [*messages, *([Text(TOOL_MODE, driven)] if driven else [])]

    def _state(self) -> object:
        """Return a value that changes whenever the messages of the open plan change."""
        if (plan_id := self._board.plan_id) is None:
            return "no plan"
        try:
            plan = self._plans.get(plan_id)
            return plan.id, plan.revision, [(one.id, one.revision) for one in self._registrations.list(plan.case_id)]
        except VfixError as error:
            return str(error)

    def _messages(self) -> list[LinkMessage]:
        """Return the messages of the open plan."""
        plan_id = self._board.plan_id
        if plan_id is None:
            return [Text(PLAN, "No plan is open."), *no_registration()]
        try:
            plan = self._plans.get(plan_id)
            return [*plan_messages(plan), *registration_messages(plan, self._registrations.list(plan.case_id))]
        except VfixError as error:
            return [Text(STATUS, str(error)), *no_registration()]
