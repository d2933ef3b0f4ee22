"""What is told of a plan: its path and its targets, and the registration of its image."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from app.link import Message, Point, PointList, Text, Transform
from app.link.messages import MAX_POINT_NAME, cut_name
from app.services.documents import Document
from app.services.live_link.frames import registration_to_ras, to_ras
from app.services.plan_model import NOTICE, Plan, PlanPoint
from app.services.registration import RegistrationContent
from app.services.registration_fit import report_of

PATH, TARGETS, REGISTRATION, TOOL, PLAN = "Path", "Targets", "Registration", "ToolTip", "Plan"
_PATH_COLOUR, _TARGET_COLOUR = (109, 179, 242, 255), (229, 143, 208, 255)


def plan_messages(plan: Plan) -> list[Message]:
    """Path points and targets in Slicer's scene, and as a text which plan that is."""
    words = f"{plan.name}, revision {plan.revision}{', locked' if plan.locked else ''}. {NOTICE}."
    if plan.registration is None:
        words += " It uses no registration."
    cut = sum(cut_name(point.label) != point.label for point in (*plan.points, *plan.targets))
    if cut:
        words += f" {cut} labels are longer than {MAX_POINT_NAME - 1} bytes and are cut."
    return [
        PointList(PATH, _listed(plan.points, _PATH_COLOUR)),
        PointList(TARGETS, _listed(plan.targets, _TARGET_COLOUR)),
        Text(PLAN, words),
    ]


def registration_message(plan: Plan, registrations: Sequence[Document[RegistrationContent]]) -> Transform:
    """The registration that the plan goes by; the identity where there is none, or it is not made or does not fit."""
    used = [one for one in registrations if one.id == plan.registration and not one.unreadable]
    if not used or not report_of(used[0].content).usable:
        return no_registration()
    return Transform(REGISTRATION, registration_to_ras(used[0].content.registration.transform))


def no_registration() -> Transform:
    """Takes back what was told before: OpenIGTLink has no word for that, and the identity moves nothing in Slicer."""
    return Transform(REGISTRATION, np.eye(4))


def _listed(points: Sequence[PlanPoint], colour: tuple[int, int, int, int]) -> tuple[Point, ...]:
    return tuple(Point(point.label, to_ras(point.position), colour) for point in points)
