"""What can be done to plans. Files, computations and jobs have routes of their own."""

from app.operations.spec import DocumentSpec
from app.operations.standard import SetDeleted
from app.plans.document import PLAN
from app.plans.operations import (
    document,
    instruments,
    paths,
    points,
    regions,
    removed_bone,
    second_volume,
    versions,
    zones,
)
from app.plans.operations.base import PlanEdit
from app.plans.public import PlanPublic

__all__ = ["SPEC", "PlanEdit"]

SPEC = DocumentSpec(
    kind=PLAN,
    path="plans",
    id="plan_id",
    public=PlanPublic,
    public_of=lambda service, stored: PlanPublic.of(stored),
    operations=(
        document.CreatePlan, document.DuplicatePlan, document.RenamePlan, document.LockPlan, SetDeleted,
        document.SetSettings, instruments.ChooseRobot, instruments.ChooseTool, document.DeletePlan,
        document.RestorePlan, document.UndoPlan, document.RedoPlan, document.SetNotes,
        instruments.ChooseRobotByName, instruments.ChooseToolByName, instruments.PlaceRobot,
        points.AddPoint, points.AddTarget, points.TakeTargets, points.MovePoint, points.RenamePoint,
        points.RenameItem, points.DeletePoint, paths.SetShaft, paths.AddPath, paths.CopyPath, paths.RenamePath,
        paths.SetEntrySide, paths.ChoosePath, paths.DeletePath,
        *zones.OPERATIONS, *removed_bone.OPERATIONS, *regions.OPERATIONS, *versions.OPERATIONS,
        *second_volume.OPERATIONS, instruments.UseRegistration,
    ),
    service="plans",
)  # fmt: skip
