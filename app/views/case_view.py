"""The head of a tab: which case is open, how it is shown, where its slices stand."""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from app.messages.sections import CaseEntry, CaseSection, HeadSections
from app.scene.anatomy import LETTER_GAP_MM, Look, SlicePicture
from app.scene.picking import BonePicker, Hit, hit_plane
from app.scene.view import ClickRay
from app.services import Services
from app.services.cases import Case
from app.session.view_model import ViewModel
from app.steps.patient import commands as p
from app.steps.patient.hints import patient_hint
from app.views import commands as c
from app.views.scene_link import Head
from app.views.slice_view import Greys, SliceView
from vfix_engine.errors import InputError, VfixError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.imaging.volume import Volume

Floats = npt.NDArray[np.float64]
DISPLAY_ORDER = ("skull", "skull_display", "display", "bone")
_LOG = logging.getLogger(__name__)


class CaseView:
    """Opens heads in the background; its workspace's thread owns everything else."""

    def __init__(
        self, services: Services, board: ViewModel, executor: Executor, ask: Callable[[Callable[[], None]], Any]
    ) -> None:
        self._services, self._board, self._executor, self._ask = services, board, executor, ask
        self.case_id: str | None = None
        self.loading = ""
        self.head: Head | None = None
        self._look = Look()
        self._slices: SliceView | None = None
        self._picker: BonePicker | None = None
        self._ticket = 0
        self._pending_cross: Floats | None = None
        self._cases: list[Case] = []
        self._opened_up = False

    # -- opening

    def open_first(self, case_id: str | None) -> None:
        """Open the case the page remembers, else the embedded one, else the first; none when all are deleted."""
        known = [case.id for case in self._services.cases.list()]
        for wanted in (case_id, self._services.cases.embedded_case().id, *known):
            if wanted in known:
                self.open(wanted)
                return

    def open(self, case_id: str) -> None:
        """Show a case; its surface and volume are read in the background. Raises VfixError when there is none."""
        case = self._services.cases.get(case_id)
        self.case_id = case.id
        self.loading = "Reading the head …"
        self.head = self._slices = self._picker = None
        self._look = replace(self._look, cut="whole", slices="none")
        self._opened_up = False
        self._pending_cross = None
        self._ticket += 1
        ticket = self._ticket

        def read() -> None:
            try:
                mesh = self._display_mesh(case.id)
                loaded = (mesh, BonePicker(mesh), *self._volumes(case))
            except VfixError as error:
                words = str(error)
                self._ask(lambda: self._failed(ticket, words))
            except Exception:
                _LOG.exception("a head could not be read")
                self._ask(lambda: self._failed(ticket, "The head could not be read; the planner's log says why."))
            else:
                self._ask(lambda: self._loaded(ticket, *loaded))

        self._executor.submit(read)

    def _volumes(self, case: Case) -> tuple[Volume | None, Volume | None]:
        """The wide CT and a finer one of a part, where there are such."""
        found = [self._services.cases.volume(case.id, volume.name) for volume in case.volumes[:2]]
        wide, fine = (*found, None, None)[:2]
        return wide, fine

    def _display_mesh(self, case_id: str) -> TriangleMesh:
        meshes = self._services.cases.display_meshes(case_id)
        for name in DISPLAY_ORDER:
            if name in meshes:
                return meshes[name]
        raise InputError("this head has no bone surface to show.")

    def _loaded(
        self, ticket: int, mesh: TriangleMesh, picker: BonePicker, volume: Volume | None, detail: Volume | None
    ) -> None:
        if ticket != self._ticket:
            return
        bounds = np.asarray(mesh.bounds)
        self.head = Head(f"{self.case_id}:{ticket}", mesh, bounds)
        self._picker = picker
        centre = bounds.mean(axis=0)
        cross = centre if self._pending_cross is None else self._pending_cross
        self._slices = None if volume is None else SliceView(volume, cross, detail)
        self._look = replace(self._look, cut_at=float(cross[0]))
        self.loading = ""

    def _failed(self, ticket: int, words: str) -> None:
        if ticket == self._ticket:
            self.loading = words

    # -- changes

    def do(self, command: c.SetCross | c.SetSlice | c.SetWindow | c.SetView) -> None:
        if isinstance(command, c.SetView):
            self._set_view(command)
            return
        if self._slices is None:
            return
        if isinstance(command, c.SetCross):
            self._slices.set_cross(command.position)
        elif isinstance(command, c.SetSlice):
            self._slices.move(command.axis, command.position)
        else:
            self._slices.greys = Greys(command.name, command.window, command.level)
        self._look = replace(self._look, cut_at=float(self._slices.cross[0]))

    def _set_view(self, command: c.SetView) -> None:
        if command.opacity is not None:
            self._look = replace(self._look, opacity=command.opacity)
        if command.cut is not None:
            self._look = replace(self._look, cut=command.cut)
        if command.slices is not None:
            self._look = replace(self._look, slices=command.slices)

    def go_to(self, position: tuple[float, float, float]) -> None:
        """Bring the slices, and the cut, to a place."""
        self._pending_cross = np.array(position)
        if self._slices is not None:
            self._slices.set_cross(position)
        self._look = replace(self._look, cut_at=float(position[0]))

    def open_up(self, places: list[tuple[float, float, float]]) -> None:
        """Cut the whole head open along a path, once, so that the tool inside is seen; the user may close it again."""
        if self._opened_up or self._look.cut != "whole" or not places:
            return
        self._opened_up = True
        self.go_to(tuple(float(value) for value in np.median(np.array(places), axis=0)))  # type: ignore[arg-type]
        self._look = replace(self._look, cut="left", slices="none" if self._slices is None else "sagittal")

    def change(self, command: p.CaseCommand | p.RenameCase) -> None:
        """Rename, delete, restore; the open head cannot be deleted."""
        if isinstance(command, p.RenameCase):
            self._services.cases.rename(command.case_id, command.name)
        elif command.type == "case.restore":
            self._services.cases.restore(command.case_id)
        elif command.case_id == self.case_id:
            raise InputError("the open head cannot be deleted; open another one first.")
        else:
            self._services.cases.delete(command.case_id)

    # -- for the scene

    def look(self) -> Look:
        return self._look

    def slices_key(self) -> Any:
        """Changes when the slices in the scene have to be drawn anew; None when they are not shown."""
        if self._slices is None or self._look.slices == "none":
            return None
        return (self._look.slices, self._slices.key())

    def slice_pictures(self) -> list[SlicePicture]:
        return [] if self._slices is None else self._slices.pictures(self._look.slices)

    def extent(self) -> tuple[Floats, float]:
        """Centre [LPS mm] and radius [mm] of the head."""
        if self.head is None:
            return np.zeros(3), 120.0
        return self.head.bounds.mean(axis=0), 0.5 * float(np.ptp(self.head.bounds, axis=0).max()) + LETTER_GAP_MM

    def hit(self, ray: ClickRay) -> Hit | None:
        """What a click meets first: bone as it is shown, or a CT plane in the scene."""
        if self._picker is None:
            return None
        hits = [self._picker.hit(ray.origin, ray.direction, self._look.cut, self._look.cut_at)]
        if self._slices is not None:
            hits += [hit_plane(ray.origin, ray.direction, plane) for plane in self._slices.planes(self._look.slices)]
        return min((hit for hit in hits if hit is not None), key=lambda hit: hit.distance_mm, default=None)

    # -- for the page

    def hint(self) -> str:
        return patient_hint(self.case_id is not None, bool(self.loading))

    def publish(self, fresh: bool) -> None:
        """Publish the sections; ``fresh`` reads the list of cases anew, which other tabs may have changed."""
        if fresh or not self._cases:
            self._cases = list(self._services.cases.list(include_deleted=True))
        items: list[CaseEntry] = [
            {"id": case.id, "name": case.name, "created": str(case.created), "deleted": case.deleted_at is not None}
            for case in self._cases
        ]
        case = next((case for case in self._cases if case.id == self.case_id), None)
        look = self._look
        sections: HeadSections = {
            "cases": {"items": items},
            "case": None if case is None else case_section(case, self.loading),
            "slices": None if self._slices is None else self._slices.view(),
            "view": {"opacity": look.opacity, "cut": look.cut, "slices": look.slices},
        }
        self._board.publish(sections)


def case_section(case: Case, loading: str) -> CaseSection:
    """The page's section of the open case."""
    return {
        "id": case.id,
        "name": case.name,
        "frame": {"name": case.frame.name, "assumed": case.frame.assumed},
        "spacing_mm": None if case.spacing_mm is None else [float(value) for value in case.spacing_mm],
        "surfaces": [
            {"name": surface.name, "triangles": surface.triangles, "words": surface.words} for surface in case.surfaces
        ],
        "uncertainty": case.uncertainty.words(),
        "has_volume": case.has_volume,
        "beads": len(case.beads),
        "notes": list(case.notes),
        "detail": case.volumes[1].name if len(case.volumes) > 1 else None,
        "loading": loading or None,
    }
