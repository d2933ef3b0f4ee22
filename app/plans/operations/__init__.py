"""What can be done to plans. Files, computations and jobs have routes of their own."""

from app.operations.spec import DocumentSpec
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
        *document.OPERATIONS, *instruments.OPERATIONS, *points.OPERATIONS, *paths.OPERATIONS, *zones.OPERATIONS,
        *removed_bone.OPERATIONS, *regions.OPERATIONS, *versions.OPERATIONS, *second_volume.OPERATIONS,
    ),
    service="plans",
)  # fmt: skip
