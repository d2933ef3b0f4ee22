"""Messages of a plan: its path and targets, and the registration of its image."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from app.documents import Document
from app.link import LinkMessage, ListPoint, PointList, Text, Transform
from app.link.messages import MAX_POINT_NAME, cut_name
from app.live.frames import registration_to_ras, to_ras
from app.plans.model import NOTICE, Plan, PlanPoint
from app.registration.document import RegistrationContent
from app.registration.fit_report import report_of
from vfix_engine.arrays import Array
from vfix_engine.frames import RegisteredTo

PATH, TARGETS, TOOL, TOOL_MODE, PLAN = "Path", "Targets", "ToolTip", "ToolMode", "Plan"
REGISTRATIONS: dict[RegisteredTo, str] = {"patient": "Registration", "base": "RegistrationToBase"}
_PATH_COLOUR, _TARGET_COLOUR = (109, 179, 242, 255), (229, 143, 208, 255)


def plan_messages(plan: Plan) -> list[LinkMessage]:
    """Return path points and targets in Slicer's scene, and a text that names the plan."""
    words = f"{plan.name}, revision {plan.revision}{', locked' if plan.locked else ''}. {NOTICE}."
    if plan.content.registration is None:
        words += " It uses no registration."
    cut = sum(cut_name(point.label) != point.label for point in (*plan.content.points, *plan.content.targets))
    if cut:
        words += f" {cut} labels are longer than {MAX_POINT_NAME - 1} bytes and are cut."
    return [
        PointList(PATH, _listed(plan.content.points, _PATH_COLOUR)),
        PointList(TARGETS, _listed(plan.content.targets, _TARGET_COLOUR)),
        Text(PLAN, words),
    ]


def registration_messages(plan: Plan, registrations: Sequence[Document[RegistrationContent]]) -> list[Transform]:
    """Return the registration of the plan under the name of its target frame, and the identity under the other name.

    Both are the identity if the plan has no registration or it is not usable.
    """
    used = [one for one in registrations if one.id == plan.content.registration and not one.unreadable]
    if not used or not report_of(used[0].content).usable:
        return no_registration()
    image = used[0].content.registration
    matrix = registration_to_ras(image.transform)
    return [_transform(to, matrix if to == image.to else np.eye(4)) for to in REGISTRATIONS]


def no_registration() -> list[Transform]:
    """Return identities, which withdraw a registration: OpenIGTLink has no such message, and they move nothing."""
    return [_transform(to, np.eye(4)) for to in REGISTRATIONS]


def _transform(to: RegisteredTo, matrix: Array) -> Transform:
    return Transform(REGISTRATIONS[to], matrix)


def _listed(points: Sequence[PlanPoint], colour: tuple[int, int, int, int]) -> tuple[ListPoint, ...]:
    return tuple(ListPoint(point.label, to_ras(point.position), colour) for point in points)
