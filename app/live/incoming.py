"""Received messages become proposals: the open plan does not change before a user accepts them on the page.

Points named 'Path' or 'Targets' become a version of the open plan, which the page compares with it and switches to by
one edit that can be undone. A transform named 'Registration' becomes a new registration to the patient, and one named
'RegistrationToBase' a new registration to the robot's base.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from app.documents.documents import Documents
from app.kit.errors import PlanLocked
from app.kit.names import check_label, unused_name
from app.kit.values import check_position
from app.link import LinkFault, LinkMessage, ListPoint, PointList, Transform
from app.link.messages import cut_name
from app.live.board import LiveBoard
from app.live.frames import SAME_MM, as_in_a_file, registration_to_ras, rigid, same_transform, to_ras
from app.live.outgoing import PATH, REGISTRATIONS, TARGETS
from app.plans.model import MAX_POINTS, Plan, PlanContent, PlanPoint, check_content, new_point_id
from app.plans.service import PlanService
from app.plans.versions import PlanVersions
from app.registration.document import RegistrationContent, check_registration
from vfix_engine.errors import PlanError, VfixError

SETTLED_S = 1.0  # a dragged point is sent continuously; its proposal is made after a pause of this length
FROM = "From 3D Slicer"
NO_REGISTRATION = "The identity as a registration says that there is none; nothing was stored."
MAX_REGISTRATIONS = 20  # received registrations of a case


@dataclass(frozen=True)
class _Waiting:
    message: PointList | Transform
    due: float
    plan_id: str


class Intake:
    """Checks received messages, and makes proposals of them after a pause. Thread-safe."""

    def __init__(
        self,
        board: LiveBoard,
        plans: PlanService,
        versions: PlanVersions,
        registrations: Documents[RegistrationContent],
    ) -> None:
        self._board, self._plans = board, plans
        self._versions, self._registrations = versions, registrations
        self._lock = threading.Lock()
        self._waiting: dict[str, _Waiting] = {}

    def receive(self, message: LinkMessage) -> str:
        """Take a message; return a text for the sender, '' if its proposal follows or the message is not for vfix.

        Raises VfixError with the reason if it is refused.
        """
        wanted = isinstance(message, PointList) and message.name in (PATH, TARGETS)
        wanted |= isinstance(message, Transform) and message.name in REGISTRATIONS.values()
        if not wanted or not isinstance(message, PointList | Transform):
            return ""
        plan = self._open_plan()
        if isinstance(message, PointList):
            _proposed(plan, message)  # raises for invalid points
        elif same_transform(rigid(message.matrix), np.eye(4)):
            return NO_REGISTRATION
        else:
            check_registration(_registered(message))
        with self._lock:
            self._waiting[message.name] = _Waiting(message, time.monotonic() + SETTLED_S, plan.id)
        return ""

    def settle(self) -> list[str]:
        """Make the proposals that are due, and return the texts for their senders."""
        with self._lock:
            now = time.monotonic()
            due = [self._waiting.pop(name) for name, one in list(self._waiting.items()) if one.due <= now]
        return [words for one in due if (words := self._propose(one.message, one.plan_id))]

    def _propose(self, message: PointList | Transform, plan_id: str) -> str:
        """Make the proposal of a message; return a text for its sender, '' if it changes nothing."""
        try:
            plan = self._open_plan()
            if plan.id != plan_id:
                raise PlanError("another plan was opened meanwhile; send it again for that one.")
            return self._version(plan, message) if isinstance(message, PointList) else self._register(plan, message)
        except VfixError as error:
            return str(error)

    def _open_plan(self) -> Plan:
        plan_id = self._board.plan_id
        if plan_id is None:
            raise PlanError("no plan is open; open one on the page first.")
        plan = self._plans.get(plan_id)
        if plan.deleted_at is not None:
            raise PlanError("the plan that was open is deleted; open another one on the page first.")
        if plan.locked:
            raise PlanLocked("the open plan is locked; unlock it to propose a change.")
        return plan

    def _version(self, plan: Plan, message: PointList) -> str:
        content = _proposed(plan, message)
        if content is None:
            return ""
        taken = {one.name for one in self._versions.list(plan.id)}
        name = unused_name(f"{FROM}: {message.name}", taken, last=True)
        self._versions.propose(plan.id, name, content)
        return f"Proposed as version {name!r} of {plan.name!r}; compare it and go over to it on the page."

    def _register(self, plan: Plan, message: Transform) -> str:
        content = _registered(message)
        image = content.registration
        known = [one for one in self._registrations.list(plan.case_id) if not one.unreadable]
        made = [one for one in known if one.content.made_from != "none" and one.content.to == image.to]
        if any(same_transform(one.content.registration.transform, image.transform) for one in made):
            return ""
        for one in made:
            if same_transform(as_in_a_file(one.content.registration.transform), image.transform):
                raise PlanError(
                    f"{one.name!r} has the patient's frame turned by half a turn. So 3D Slicer "
                    "shows its .tfm file. Send back the transform that came by this link instead. Nothing was stored."
                )
        taken = {one.name for one in known}
        if sum(name.startswith(FROM) for name in taken) >= MAX_REGISTRATIONS:
            raise PlanError(f"{MAX_REGISTRATIONS} registrations came from outside; delete some of them first.")
        name = unused_name(FROM, taken, last=True)
        stored = self._registrations.create(plan.case_id, name, content, numbered=True)
        return f"Stored as registration {stored.name!r}; check it before it is used."


def _registered(message: Transform) -> RegistrationContent:
    """Return the registration of a received transform. Raises LinkFault if the matrix is not rigid."""
    transform = registration_to_ras(rigid(message.matrix))
    to = next(to for to, name in REGISTRATIONS.items() if name == message.name)
    return RegistrationContent(to, tuple(transform.ravel().tolist()), made_from="given")


def _proposed(plan: Plan, message: PointList) -> PlanContent | None:
    """Return the plan's content with the received points; None if they equal those of the plan.

    Raises LinkFault and PlanError if they are not allowed in a plan.
    """
    of_path = message.name == PATH
    own = plan.content.points if of_path else plan.content.targets
    if not message.points or len(message.points) > MAX_POINTS:
        raise LinkFault(f"{message.name} came with {len(message.points)} points; a plan has 1 to {MAX_POINTS}.")
    points = tuple(_point(sent, at, own) for at, sent in enumerate(message.points))
    if points == own:
        return None
    content = plan.content.with_points(points) if of_path else replace(plan.content, targets=points)
    return check_content(content)


def _point(sent: ListPoint, at: int, own: Sequence[PlanPoint]) -> PlanPoint:
    """Return the plan's point with the same index and label, moved to the received position, or else a new point.

    A point that differs by no more than the rounding of float32 keeps its exact position.
    """
    label, position = check_label(sent.name, "label"), check_position(to_ras(sent.position))
    known = own[at] if at < len(own) and cut_name(own[at].label) == label else None
    if known is None:
        return PlanPoint(new_point_id(), label, position)
    near = math.dist(known.position, position) <= SAME_MM
    return known if near else replace(known, position=position)
