"""Bone removal: the bone of a case without the regions that a plan removes before the tool is driven."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from app.kit.cache import Cache
from app.plans.model import Plan
from app.plans.shapes import solids
from vfix_engine.anatomy.opened_bone import OpenedBone, opened_bone, without_regions
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError, PlanError
from vfix_engine.files.volume import BONE_HU, Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.shapes import Shape
from vfix_engine.proximity.fields.side import SurfaceSide
from vfix_engine.proximity.fit import InsideTest
from vfix_engine.proximity.proximity import ProximityTree

if TYPE_CHECKING:  # a drive of files alone needs no store
    from app.cases.service import Case, CaseService


def removal_solids(plan: Plan | None) -> tuple[Shape, ...]:
    """Return the regions of bone that a plan removes, as solids of the engine in LPS mm."""
    return (
        () if plan is None else tuple(solid for region in plan.content.removed_bone for solid in solids(region.shape))
    )


def tree_without_removed_bone(tree: ProximityTree, volume: Volume | None, plan: Plan) -> tuple[ProximityTree, float]:
    """Return the tree of a head's bone after the removal, and the removed volume in mm³; for a head read from a file.

    Raises PlanError if no bone would be left.
    """
    regions = removal_solids(plan)
    if not regions:
        return tree, 0.0
    remaining = _remove(tree, regions, bone_test(() if volume is None else (volume,), tree))
    return ProximityTree(remaining.mesh), remaining.removed_mm3


def _remove(tree: ProximityTree, regions: tuple[Shape, ...], inside: InsideTest) -> OpenedBone:
    try:
        return opened_bone(tree.mesh, regions, inside=inside)
    except InputError as error:
        raise PlanError(f"the bone cannot be opened so: {error}.") from error


def bone_test(volumes: Sequence[Volume], tree: ProximityTree) -> InsideTest:
    """Return a test whether places (n, 3) in LPS mm are in bone.

    The finest of the scans that show a place decides; volumes are ordered from the widest to the finest. Without a
    scan the side of the surface decides.
    """
    if not volumes:
        side = SurfaceSide(tree)
        return lambda places: ~side.outside(places)

    def inside(places: Array) -> NDArray[np.bool_]:
        hu = volumes[0].sample(places)
        for volume in volumes[1:]:
            finer = volume.sample(places, outside=np.nan)
            hu = np.where(np.isnan(finer), hu, finer)
        found: NDArray[np.bool_] = hu >= BONE_HU
        return found

    return inside


@dataclass(frozen=True, eq=False)
class PlanBone:
    """The bone of a plan.

    tree: proximity tree of the bone that is left. regions: the removed regions as solids of the engine. removed_mm3:
    volume of the bone in them. whole: tree of the case's own surface. volume: the CT of the case, None without one.
    """

    tree: ProximityTree
    regions: tuple[Shape, ...]
    removed_mm3: float
    whole: ProximityTree
    volume: Volume | None

    @property
    def mesh(self) -> TriangleMesh:
        """Surface of the bone that is left."""
        return self.tree.mesh

    @cached_property
    def inside(self) -> InsideTest:
        """Test whether places are in bone that is left: by the CT, or without one by the side of the surface."""
        return without_regions(bone_test(() if self.volume is None else (self.volume,), self.whole), self.regions)


class BoneRemoval:
    """The bone of plans after their removals; cached by the removed regions. Thread-safe."""

    def __init__(self, cases: CaseService) -> None:
        self._cases = cases
        self._kept: Cache[str, PlanBone] = Cache(6)

    def bone(self, case: Case, plan: Plan | None) -> PlanBone:
        """Return the bone that a plan is driven in; the bone of the case if nothing is removed or plan is None.

        Raises PlanError if no bone would be left.
        """
        removed = () if plan is None else plan.content.removed_bone
        key = json.dumps([case.anatomy.geometry, case.content_hash, [dict(region.shape) for region in removed]])
        regions = removal_solids(plan)
        return self._kept.get(key, lambda: self._remaining(case, regions))

    def _remaining(self, case: Case, regions: tuple[Shape, ...]) -> PlanBone:
        whole, volume = self._cases.tree(case), self._cases.volume(case)
        if not regions:
            return PlanBone(whole, (), 0.0, whole, volume)
        remaining = _remove(whole, regions, bone_test(self._cases.volumes(case), whole))
        return PlanBone(ProximityTree(remaining.mesh), regions, remaining.removed_mm3, whole, volume)
