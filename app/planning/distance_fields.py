"""Signed distance fields of bone and soft tissue of a case: fine around the plan, coarse elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt

from app.kit.cache import Cache
from app.planning.bone_removal import removal_solids
from app.plans.model import Plan
from vfix_engine.anatomy.piercing import Ways
from vfix_engine.anatomy.room_air import RoomAir, room_air
from vfix_engine.anatomy.soft_tissue import TISSUE_HU
from vfix_engine.anatomy.solids import COARSE_MM, FINE_MM, refined_solid, solid_of_volumes
from vfix_engine.errors import InputError
from vfix_engine.files.volume import BONE_HU, Volume
from vfix_engine.kernels.threads import threads
from vfix_engine.progress import ProgressCallback, no_progress
from vfix_engine.proximity.fields.distance_field import DistanceField, field_of_surface, refined_by_surface
from vfix_engine.proximity.fields.opened_field import opened_field

if TYPE_CHECKING:  # a drive of files alone needs no store
    from app.cases.service import Case, CaseService

AROUND_MM = 30.0  # the fine grid reaches at least this far from the planned places
_BOX_MM = 15.0  # corners of the fine grid are multiples of this, so that a dragged point rarely needs a new grid
OUTSIDE_MM = 60.0  # without a CT: distances are known up to this far around the surface

Bounds = tuple[tuple[float, float, float], tuple[float, float, float]]
Solid = Literal["bone", "tissue"]

_THRESHOLD_HU: dict[Solid, float] = {"bone": BONE_HU, "tissue": TISSUE_HU}
_STAGES: dict[Solid, str] = {"bone": "Measuring distances to bone", "tissue": "Measuring distances to soft tissue"}


class CaseDistanceFields:
    """The distance fields of one case around some places; each is computed on first access.

    Signed distances in mm, positive outside; NaN beyond the end of the scan.
    """

    def __init__(self, make: Callable[[Solid], DistanceField | None]) -> None:
        self._make = make

    @property
    def bone(self) -> DistanceField:
        """Distance to bone: denser than 250 HU in the CT, or the inside of the bone surface in a case without one."""
        field = self._make("bone")
        assert field is not None
        return field

    @property
    def tissue(self) -> DistanceField | None:
        """Distance to skin, mucosa and bone, above -300 HU; None without a CT."""
        return self._make("tissue")

    def both(self) -> tuple[DistanceField, DistanceField | None]:
        """Bone and tissue, computed at the same time."""
        with threads(2) as pool:
            bone, tissue = pool.submit(lambda: self.bone), pool.submit(lambda: self.tissue)
        return bone.result(), tissue.result()


Sources = tuple[str, ...]


def _sources(case: Case) -> Sources:
    """Return the stored files that the fields of a case are computed from, as a cache key.

    A content hash that was imported with a case is not trusted as a key.
    """
    volumes = tuple(one.source for one in case.volumes)
    return volumes or tuple(one.source for one in case.surfaces if one.name == case.anatomy.surface)


class DistanceFields:
    """Distance fields of cases, cached. Thread-safe."""

    def __init__(self, cases: CaseService) -> None:
        self._cases = cases
        self._coarse: Cache[tuple[Sources, Solid], DistanceField] = Cache(4)
        self._fine: Cache[tuple[Sources, Solid, Bounds], DistanceField] = Cache(8)
        self._air: Cache[Sources, RoomAir] = Cache(4)

    def around(self, case: Case, places: npt.ArrayLike, progress: ProgressCallback = no_progress) -> CaseDistanceFields:
        """Return the fields of a case, with a 0.5 mm grid for at least 30 mm around places (n, 3) in LPS mm.

        progress: called with the stage in words before a computation that takes seconds; may raise to cancel it.
        Access to a field raises InputError if no place lies in the case's CT or near its surface.
        """
        box = _box(places)

        def make(solid: Solid) -> DistanceField | None:
            if solid == "tissue" and not case.has_volume:
                return None
            key = (_sources(case), solid, box)
            if not self._fine.has(key):
                progress(_STAGES[solid], 0.0)
            return self._fine.get(key, lambda: self._refined(case, solid, box))

        return CaseDistanceFields(make)

    def of_plan(self, plan: Plan, progress: ProgressCallback = no_progress) -> CaseDistanceFields:
        """Return the fields around the path points and targets of a plan, after its bone removal."""
        places = [point.position for point in plan.content.points] + [
            target.position for target in plan.content.targets
        ]
        found, removed = self.around(self._cases.get(plan.case_id), places, progress), removal_solids(plan)

        @cache
        def make(solid: Solid) -> DistanceField | None:
            field = found.bone if solid == "bone" else found.tissue
            return None if field is None else opened_field(field, removed)

        return CaseDistanceFields(make)

    def whole(self, case: Case) -> None:
        """Measure the grids of the whole head in the CT of a case, which `around` refines."""
        with threads(2) as pool:
            for solid in _THRESHOLD_HU:
                pool.submit(self._coarse_field, case, solid)

    def air(self, case: Case) -> RoomAir:
        """Return the air of the room in the CT of a case, which must have one."""
        return self._air.get(
            _sources(case), lambda: room_air(self._coarse_field(case, "tissue"), self._cases.volumes(case))
        )

    def _coarse_field(self, case: Case, solid: Solid) -> DistanceField:
        return self._coarse.get((_sources(case), solid), lambda: self._whole(case, solid))

    def _refined(self, case: Case, solid: Solid, box: Bounds) -> DistanceField:
        whole = self._coarse_field(case, solid)
        if not case.has_volume:
            return refined_by_surface(whole, self._cases.tree(case), np.array(box), FINE_MM)
        return refined_solid(whole, self._cases.volumes(case), _THRESHOLD_HU[solid], np.array(box))

    def _whole(self, case: Case, solid: Solid) -> DistanceField:
        if case.has_volume:
            return solid_of_volumes(self._cases.volumes(case), _THRESHOLD_HU[solid])
        low, high = self._cases.case_surface(case.id).bounds
        box = np.stack([low - OUTSIDE_MM, high + OUTSIDE_MM])
        return field_of_surface(self._cases.tree(case), box, COARSE_MM)


def plan_tissue(volumes: Sequence[Volume], plan: Plan) -> DistanceField:
    """Return the field of a plan's soft tissue after bone removal, as `DistanceFields.of_plan`, from scans alone.

    volumes: scans of one head, the widest first. Raises InputError as `DistanceFields.around`.
    """
    places = [point.position for point in plan.content.points] + [target.position for target in plan.content.targets]
    return opened_field(solid_of_volumes(volumes, TISSUE_HU, np.array(_box(places))), removal_solids(plan))


def plan_ways(volumes: Sequence[Volume], plan: Plan) -> Ways | None:
    """Return the search for airways around tissue for a head given by scans; None if no scan shows the path."""
    if not volumes:
        return None
    try:
        tissue = plan_tissue(volumes, plan)
    except InputError:
        return None
    return Ways(tissue, room_air(tissue, volumes), plan.content.points[0].position)


def _box(places: npt.ArrayLike) -> Bounds:
    at = np.asarray(places, dtype=np.float64)
    if at.ndim != 2 or at.shape[1:] != (3,) or not len(at) or not np.isfinite(at).all():
        raise InputError("distances are measured around places (n, 3), in LPS mm; there are none yet")
    low = _BOX_MM * np.floor((at.min(axis=0) - AROUND_MM) / _BOX_MM)
    high = _BOX_MM * np.ceil((at.max(axis=0) + AROUND_MM) / _BOX_MM)
    first, last = low.tolist(), high.tolist()
    return (first[0], first[1], first[2]), (last[0], last[1], last[2])
