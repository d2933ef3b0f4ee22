"""The operation that says which registration a plan uses."""

from __future__ import annotations

from dataclasses import replace

from app.operations.fields import Identifier
from app.plans.document import plan_of
from app.plans.model import PlanContent, check_registration_id, without_placement
from app.plans.operations.base import PlanEdit, Plans, StoredPlan


class UseRegistration(PlanEdit, frozen=True):
    """Use a registration of the plan's case, or none, as one edit that undo takes back.

    A placement of the robot is in the patient's frame, which is the image's without a registration: it is dropped where
    the plan gets its first registration or loses its last one.
    """

    rest = "PUT /plans/{id}/registration"
    registration: Identifier | None

    def run(self, context: Plans, document_id: str) -> StoredPlan:
        if self.registration is not None:
            plan = plan_of(context.documents.get(document_id))
            context.service.registrations.check_usable(replace(plan, registration=self.registration))
        return super().run(context, document_id)

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        used = check_registration_id(self.registration)
        crossed = (content.registration is None) != (used is None)
        robot = without_placement(content.robot) if crossed else content.robot
        return replace(content, registration=used, robot=robot)


OPERATIONS = (UseRegistration,)
