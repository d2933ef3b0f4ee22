"""Operations on a plan's robot, its placement, the tool, and the registration through which they are placed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, ClassVar

import msgspec
from msgspec import Meta

from app.operations.fields import Identifier, Name
from app.operations.operation import Verb
from app.plans.instruments import shaped_tool
from app.plans.model import PlanContent, check_registration_id, check_robot, check_tool_shape, without_placement
from app.plans.operations.base import PlanEdit, Plans, StoredPlan
from app.plans.points import PlanPoint, check_point
from vfix_engine.errors import PlanError

Hash = Annotated[str, Meta(min_length=64, max_length=64)]
ShapeNumber = Annotated[float, Meta(ge=-1e3, le=1e3)]  # what a tool may have, its reader says


class RobotChoice(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A shipped robot by its name, or a URDF that was uploaded: its hash, and the link that holds the tool."""

    name: Name
    urdf: Hash | None = None
    tool_frame: Name | None = None


class ToolChoice(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A shipped tool by its name; omitted bend and shaft radius stay the shipped ones."""

    name: Name
    bend_deg: ShapeNumber | None = None
    shaft_radius_mm: ShapeNumber | None = None


class ChooseRobot(PlanEdit, frozen=True):
    """Choose another robot, which has no placement yet."""

    rest = "PATCH /plans/{id}"
    message = "plan.robot"
    aliases: ClassVar[Mapping[str, str]] = {f"robot.{name}": name for name in RobotChoice.__struct_fields__}
    robot: RobotChoice

    def run(self, context: Plans, document_id: str) -> StoredPlan:
        context.service.instruments.robot(self._checked())  # before the edit, since a URDF takes long to read
        return super().run(context, document_id)

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        return replace(content, robot=self._checked())

    def _checked(self) -> dict[str, Any]:
        return check_robot(without_placement(msgspec.to_builtins(self.robot)))


class ChooseTool(PlanEdit, frozen=True):
    """Choose another tool, or another shape of it; the robot's placement, made for the old one, is dropped.

    A bend or shaft radius that is left out is the shipped one's.
    """

    rest = "PATCH /plans/{id}"
    message = "plan.tool"
    aliases: ClassVar[Mapping[str, str]] = {f"tool.{name}": name for name in ToolChoice.__struct_fields__}
    tool: ToolChoice

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        shape = msgspec.to_builtins(self.tool)
        checked = check_tool_shape({name: value for name, value in shape.items() if name != "name"})
        shaped_tool(self.tool.name, **checked)
        return content.with_tool(self.tool.name, checked)


class TakeTool(PlanEdit, frozen=True):
    """Another tool for the chosen path, with the shaft's directions that it was simulated with, as one edit."""

    tool: str
    tool_shape: Mapping[str, float]
    points: tuple[PlanPoint, ...]

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        return content.with_tool(self.tool, self.tool_shape).with_points([check_point(point) for point in self.points])


class PlaceRobot(PlanEdit, frozen=True):
    """Keep the placing that the dry run finds for the plan's robot with the plan, as one edit."""

    title = "Keep robot base"
    rest = "POST /plans/{id}/placing"
    message = "base.keep"
    verb = (Verb("plan place", "keep the placing of the robot that the dry run finds with the plan"),)

    def run(self, context: Plans, document_id: str) -> StoredPlan:
        plan = context.documents.get(document_id)
        robot = context.service.planning.placed_robot(plan)
        expected = plan.revision if context.expected is None else context.expected
        return KeepPlacement(robot=robot).run(replace(context, expected=expected), document_id)


class KeepPlacement(PlanEdit, frozen=True):
    """Keep a robot with its placement."""

    robot: dict[str, Any]

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        return replace(content, robot=check_robot(self.robot))


class DropPlacement(PlanEdit, frozen=True):
    """Keep no placing with the plan, as one edit: each dry run places the robot anew."""

    title = "Place robot automatically"
    rest = "DELETE /plans/{id}/placing"
    message = "base.free"

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        if content.robot["base"] is None:
            raise PlanError("the plan keeps no placing of its robot.")
        return content.without_placement()


class UseRegistration(PlanEdit, frozen=True):
    """Use a registration of the plan's case, or null for none, as one edit that undo takes back."""

    rest = "PUT /plans/{id}/registration"
    registration: Identifier | None

    def run(self, context: Plans, document_id: str) -> StoredPlan:
        if self.registration is not None:
            context.service.registering.check_usable(context.documents.get(document_id), self.registration)
        return ReferToRegistration(registration=self.registration).run(context, document_id)


class ReferToRegistration(PlanEdit, frozen=True):
    """Refer to a registration by its id, whether it can be used or not; None refers to none.

    A placement of the robot is in the patient's frame, which is the image's without a registration: it is dropped where
    the plan gets its first or loses its last.
    """

    registration: str | None

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        checked = check_registration_id(self.registration)
        crossed = (content.registration is None) != (checked is None)
        robot = without_placement(content.robot) if crossed else content.robot
        return replace(content, registration=checked, robot=robot)


OPERATIONS = (ChooseRobot, ChooseTool, PlaceRobot, DropPlacement, UseRegistration)
