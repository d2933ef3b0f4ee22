"""Protected structures and bone to be removed as a client edits them: drawn by clicks, selected, dragged, changed."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from app.cases.service import Case
from app.kit.kept import Same
from app.kit.values import Position
from app.messages.fields import ClientMessage
from app.messages.sections import Section
from app.operations.operation import Change
from app.planning.shape_meshes import shape_mesh
from app.plans.operations.regions import ChangeRegion, found_region, placed
from app.plans.operations.removed_bone import AddBone
from app.plans.operations.zones import AddZone
from app.plans.service import Plan
from app.plans.shapes import anchor, box_at, moved, size_of
from app.plans.zones import COLOURS, PlanZone, RemovedBone
from app.scene.dragging import DragEvent
from app.scene.regions import DrawnRegion
from app.services import Services
from app.tabs.plan import region_commands as c
from app.tabs.plan.region_sections import DrawingView, RegionsSection, RegionView, StructureChoice
from app.tabs.plan.region_words import DRAW_WORDS, zone_words
from vfix_engine.errors import PlanError

HANDLE = "region:"  # before the id of a region, of the ball that it is dragged by
REMOVED_COLOUR = "#d98880"
_FREE = {"R": (-1, 0, 0), "L": (1, 0, 0), "A": (0, -1, 0), "P": (0, 1, 0), "S": (0, 0, 1), "I": (0, 0, -1)}
_SIZES: dict[str, tuple[float, ...]] = {"box": (5.0, 5.0, 5.0)}

Perform = Callable[[Change], object]


@dataclass(frozen=True)
class Drawing:
    """What the next clicks draw. places: of a chain so far."""

    request: c.DrawRegion
    places: tuple[Position, ...] = ()

    @property
    def sizes(self) -> list[float]:
        return list(self.request.sizes_mm or _SIZES.get(self.request.kind, (3.0,)))


class Regions:
    """What one client does with the regions of one plan. Owned by the session's thread."""

    def __init__(self, services: Services, plan: Callable[[], Plan], perform: Perform) -> None:
        """plan: as it is shown; perform: does an operation on the revision that is shown."""
        self._services, self._plan, self._perform = services, plan, perform
        self._case_id = plan().case_id
        self.selected: str | None = None
        self.drawing: Drawing | None = None
        self._dragged: tuple[str, Position] | None = None

    # -- what there is

    def _all(self) -> tuple[PlanZone | RemovedBone, ...]:
        plan = self._plan()
        return (*plan.content.zones, *plan.content.removed_bone)

    def section(self) -> Section[RegionsSection]:
        """The page's section."""
        case = self._services.cases.shown(self._case_id)
        key = (Same(self._plan()), Same(case), self.selected, self.drawing, self._dragged)
        return Section(key, lambda: self._view(case))

    def _view(self, case: Case) -> RegionsSection:
        known = {region.id for region in self._all()}
        structures: list[StructureChoice] = [
            {"id": item.id, "name": item.name} for item in case.structures if item.id != case.anatomy.id
        ]
        return {
            "items": [self._entry(region) for region in self._all()],
            "selected": self.selected if self.selected in known else None,
            "drawing": self._drawing_view(),
            "structures": structures,
            "locked": self._plan().locked,
        }

    def _drawing_view(self) -> DrawingView | None:
        if self.drawing is None:
            return None
        request = self.drawing.request
        return {
            "purpose": request.purpose,
            "kind": request.kind,
            "places": [list(place) for place in self.drawing.places],
            "radius_mm": self.drawing.sizes[0],
            "colour": self._next_colour(request),
            "words": DRAW_WORDS[request.kind],
        }

    def _next_colour(self, request: c.DrawRegion) -> str:
        return (
            REMOVED_COLOUR if request.purpose == "remove" else COLOURS[len(self._plan().content.zones) % len(COLOURS)]
        )

    def _entry(self, region: PlanZone | RemovedBone) -> RegionView:
        shape, place = self._shape(region), None
        if (at := anchor(shape)) is not None:
            place = list(at)
        zone = region if isinstance(region, PlanZone) else None
        return {
            "id": region.id,
            "purpose": "remove" if zone is None else "spare",
            "name": region.name,
            "kind": shape["kind"],
            "sub": zone_words(region),
            "sizes_mm": size_of(shape),
            "place": place,
            "shape": dict(shape),
            "colour": REMOVED_COLOUR if zone is None else zone.drawn_colour,
            "visible": zone is None or zone.visible,
            "soft": zone is not None and zone.kind == "soft",
            "margin_mm": None if zone is None else zone.margin_mm,
            "stiffness_n_per_mm": None if zone is None else zone.stiffness_n_per_mm,
            "max_depth_mm": None if zone is None else zone.max_depth_mm,
        }

    def _shape(self, region: PlanZone | RemovedBone) -> Mapping[str, Any]:
        """The shape, under a dragging hand where there is one."""
        if self._dragged is not None and self._dragged[0] == region.id:
            return moved(region.shape, self._dragged[1])
        return region.shape

    # -- the scene

    def handles(self) -> list[tuple[str, np.ndarray]]:
        """Places of the balls that regions are taken by, with their ids in the scene."""
        found = [(region, anchor(self._shape(region))) for region in self._all() if _is_visible(region)]
        return [(HANDLE + region.id, np.array(at)) for region, at in found if at is not None]

    def drawn(self) -> tuple[DrawnRegion, ...]:
        """What the scene shows, the chain that is being drawn included."""
        regions = [self._drawn(region) for region in self._all() if _is_visible(region)]
        if (drawing := self.drawing) is not None and drawing.places:
            shape = {"kind": "capsules", "points": [list(at) for at in drawing.places], "radius": drawing.sizes[0]}
            removes, colour = drawing.request.purpose == "remove", self._next_colour(drawing.request)
            regions.append(DrawnRegion("drawing", colour, removes, None, False, *self._mesh(shape)))
        return tuple(regions)

    def _drawn(self, region: PlanZone | RemovedBone) -> DrawnRegion:
        shape = self._shape(region)
        colour = region.drawn_colour if isinstance(region, PlanZone) else REMOVED_COLOUR
        removed, chosen = isinstance(region, RemovedBone), region.id == self.selected
        return DrawnRegion(region.id, colour, removed, anchor(shape), chosen, *self._mesh(shape))

    def _mesh(self, shape: Mapping[str, Any]) -> tuple[str, Any]:
        key = json.dumps([self._case_id, shape])
        return key, functools.partial(shape_mesh, self._services.cases, self._case_id, shape)

    def select(self, item_id: str) -> bool:
        """Select a region by its ball in the scene; False where that is none."""
        if not item_id.startswith(HANDLE):
            return False
        self.selected = found_region(self._plan().content, item_id.removeprefix(HANDLE)).id
        return True

    def dragged(self, drag: DragEvent) -> bool:
        """A drag of a region's ball; False where it is of something else."""
        if not drag.item_id.startswith(HANDLE):
            return False
        region = found_region(self._plan().content, drag.item_id.removeprefix(HANDLE))
        if self._plan().locked:
            return True
        self.selected, self._dragged = region.id, (region.id, drag.position)
        if drag.phase == "end":
            self._dragged = None
            self._perform(ChangeRegion(region_id=region.id, place=drag.position))
        return True

    def pick(self, position: Sequence[float] | npt.NDArray[np.float64]) -> Position:
        """A click while something is drawn: a region, or a place of a chain."""
        if self.drawing is None:
            raise PlanError("nothing is being drawn.")
        x, y, z = (float(value) for value in position)
        request, places = self.drawing.request, (*self.drawing.places, (x, y, z))
        if request.kind in ("capsules", "capsule"):
            self.drawing = replace(self.drawing, places=places)
            if request.kind == "capsule" and len(places) == 2:
                self._done()
        else:
            self._add(self._shape_at((x, y, z)))
        return (x, y, z)

    def _shape_at(self, at: Position) -> dict[str, Any]:
        assert self.drawing is not None
        request, sizes = self.drawing.request, self.drawing.sizes
        if request.kind == "box":
            return box_at(at, sizes if len(sizes) == 3 else [sizes[0]] * 3)
        if request.kind == "half_space":
            return {"kind": "half_space", "point": list(at), "normal": list(_FREE[request.free_side])}
        shape = {"kind": request.kind, "centre": list(at), "radius": sizes[0]}
        return placed(self._services.cases, self._case_id, shape, at)

    # -- commands

    def handle(self, command: ClientMessage) -> None:
        """Answer a command of a region. Raises InputError with the reason where that cannot be done."""
        match command:
            case c.DrawRegion():
                self._begin(command)
            case c.RegionPlain(type="region.done"):
                self._done()
            case c.RegionPlain():
                self.cancel()
            case c.SelectRegion():
                self.selected = found_region(self._plan().content, command.region_id).id

    def select_added(self, added: str) -> bool:
        """Select what was added to the plan, by its id; False where that is no region."""
        if not any(region.id == added for region in self._all()):
            return False
        self.selected = added
        return True

    def cancel(self) -> None:
        """What is half drawn or half dragged is taken back."""
        self.drawing = None
        self.let_go()

    def let_go(self) -> None:
        """What a hand was dragging is back where it is stored."""
        self._dragged = None

    def _begin(self, request: c.DrawRegion) -> None:
        if self._plan().locked:
            raise PlanError("the plan is locked; unlock it to draw.")
        if request.purpose == "remove" and request.kind not in ("sphere", "capsule", "box"):
            raise PlanError("bone to be removed is a sphere, a capsule or a box.")
        self.drawing = Drawing(request)

    def _done(self) -> None:
        if self.drawing is None or not self.drawing.places:
            raise PlanError("click at least one place first.")
        places, sizes = [list(at) for at in self.drawing.places], self.drawing.sizes
        if self.drawing.request.kind == "capsule":
            self._add({"kind": "capsule", "start": places[0], "end": places[-1], "radius": sizes[0]})
        else:
            self._add({"kind": "capsules", "points": places, "radius": sizes[0]})

    def _add(self, shape: dict[str, Any]) -> None:
        assert self.drawing is not None
        removes, self.drawing = self.drawing.request.purpose == "remove", None
        self._perform(AddBone(shape=shape) if removes else AddZone(shape=shape))


def _is_visible(region: PlanZone | RemovedBone) -> bool:
    return not isinstance(region, PlanZone) or region.visible
