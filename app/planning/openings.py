"""The bone that a plan is driven in: the case's, without what the plan removes first."""

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


def regions_of(plan: Plan | None) -> tuple[Shape, ...]:
    """The solids of what a plan removes."""
    return () if plan is None else tuple(solid for region in plan.removed_bone for solid in solids(region.shape))


def opened_tree(tree: ProximityTree, volume: Volume | None, plan: Plan) -> tuple[ProximityTree, float]:
    """The tree of a head's bone without what a plan removes, and the volume of that in mm³; for a head of a file.

    Raises PlanError where nothing would be left of it.
    """
    regions = regions_of(plan)
    if not regions:
        return tree, 0.0
    opened = _opened(tree, regions, inside_of(() if volume is None else (volume,), tree))
    return ProximityTree(opened.mesh), opened.removed_mm3


def _opened(tree: ProximityTree, regions: tuple[Shape, ...], inside: InsideTest) -> OpenedBone:
    try:
        return opened_bone(tree.mesh, regions, inside=inside)
    except InputError as error:
        raise PlanError(f"the bone cannot be opened so: {error}.") from error


def inside_of(volumes: Sequence[Volume], tree: ProximityTree) -> InsideTest:
    """What tells bone by the finest of the scans that show a place, the widest first; without one, by the surface."""
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
    """Bone of a plan. regions: what is removed, as the engine's solids; removed_mm3: the bone in them.

    whole: tree of the case's own surface. volume: its CT, None without one.
    """

    tree: ProximityTree
    regions: tuple[Shape, ...]
    removed_mm3: float
    whole: ProximityTree
    volume: Volume | None

    @property
    def mesh(self) -> TriangleMesh:
        """Its surface."""
        return self.tree.mesh

    @cached_property
    def inside(self) -> InsideTest:
        """What tells bone that is left from air: the CT, or without one the side of the surface."""
        return without_regions(inside_of(() if self.volume is None else (self.volume,), self.whole), self.regions)


class Openings:
    """Bone of plans, kept by what is removed; may be used from any thread."""

    def __init__(self, cases: CaseService) -> None:
        self._cases = cases
        self._kept: Cache[str, PlanBone] = Cache(6)

    def bone(self, case: Case, plan: Plan | None) -> PlanBone:
        """The bone that a plan of a case is driven in; that of the case where nothing is removed, or without a plan.

        Raises PlanError where nothing would be left of it.
        """
        removed = () if plan is None else plan.removed_bone
        key = json.dumps([case.anatomy.geometry, case.content_hash, [dict(region.shape) for region in removed]])
        regions = regions_of(plan)
        return self._kept.get(key, lambda: self._opened(case, regions))

    def _opened(self, case: Case, regions: tuple[Shape, ...]) -> PlanBone:
        whole, volume = self._cases.tree(case), self._cases.volume(case)
        if not regions:
            return PlanBone(whole, (), 0.0, whole, volume)
        opened = _opened(whole, regions, inside_of(self._cases.volumes(case), whole))
        return PlanBone(ProximityTree(opened.mesh), regions, opened.removed_mm3, whole, volume)
