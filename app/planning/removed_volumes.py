"""Bone removal: the volume of bone that a plan removes, by region."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np

from app.cases.service import Case, CaseService
from app.kit.cache import Cache
from app.planning.bone_removal import bone_test
from app.plans.model import Plan
from app.plans.shapes import solids
from app.plans.zones import RemovedBone
from vfix_engine.anatomy.opened_bone import removed_mm3
from vfix_engine.geometry.shape_distance import signed_distance

_NONE_MM3 = 0.05  # a smaller volume counts as no bone


@dataclass(frozen=True)
class RegionVolume:
    """The bone in one region. words: a description, with the distance to bone for a region that holds none."""

    id: str
    name: str
    removed_mm3: float
    words: str


@dataclass(frozen=True)
class RemovedVolumes:
    """The bone in each region of a plan, and in their union, where overlaps count once."""

    regions: tuple[RegionVolume, ...] = ()
    removed_mm3: float = 0.0

    @property
    def words(self) -> str:
        """A sentence on the total; '' if the plan removes nothing."""
        if not self.regions:
            return ""
        if self.removed_mm3 < _NONE_MM3:
            return "No bone is removed."
        return f"{_volume(self.removed_mm3)} of bone are removed in all."


class RemovedVolumeService:
    """Volumes of the bone that plans remove, measured in the bone of their drives; cached. Thread-safe."""

    def __init__(self, cases: CaseService) -> None:
        self._cases = cases
        self._kept: Cache[str, tuple[float, str]] = Cache(64)

    def of_plan(self, plan: Plan) -> RemovedVolumes:
        """Return the volumes that a plan removes; takes a second for large regions in a head without a CT.

        Raises NotFound if there is no such case.
        """
        if not plan.content.removed_bone:
            return RemovedVolumes()
        case = self._cases.get(plan.case_id)
        found = [(region, *self._counted(case, (region,))) for region in plan.content.removed_bone]
        regions = tuple(RegionVolume(region.id, region.name, volume, words) for region, volume, words in found)
        return RemovedVolumes(regions, self._counted(case, plan.content.removed_bone)[0])

    def _counted(self, case: Case, regions: tuple[RemovedBone, ...]) -> tuple[float, str]:
        key = json.dumps([case.id, case.anatomy.geometry, case.content_hash, [dict(one.shape) for one in regions]])
        return self._kept.get(key, lambda: self._count(case, regions))

    def _count(self, case: Case, regions: tuple[RemovedBone, ...]) -> tuple[float, str]:
        shapes = [solid for region in regions for solid in solids(region.shape)]
        tree = self._cases.tree(case)
        volume = removed_mm3(shapes, bone_test(self._cases.volumes(case), tree))
        if volume >= _NONE_MM3:
            return volume, f"{_volume(volume)} of bone"
        away = min(float(signed_distance(shape, tree.mesh.vertices).min()) for shape in shapes)
        beside = f"; bone is {away:.1f} mm away" if np.round(away, 1) > 0.0 else ""
        return volume, f"removes nothing{beside}"


def _volume(mm3: float) -> str:
    return f"{mm3:.0f} mm³" if mm3 >= 10.0 else f"{mm3:.1f} mm³"
