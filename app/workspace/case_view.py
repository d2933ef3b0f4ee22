"""The open case: display of its anatomy, and position of its slices."""

from __future__ import annotations

from collections.abc import Callable, Collection
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from app.cases.kinds import kind_of, uncertainty_words
from app.cases.model import Overlay
from app.cases.segments import OUTLINE_COLOUR
from app.cases.service import Case
from app.cases.structures import CaseKind, Structure
from app.exchange.patient_images import holds_images
from app.kit.errors import NotFound
from app.kit.kept import Same
from app.kit.values import Position
from app.messages.fields import ClientMessage
from app.messages.sections import Section, Sections
from app.scene import palette
from app.scene.anatomy import LETTER_GAP_MM, AnatomyNodes, Look, SliceNodes
from app.scene.picking import Hit, SurfacePicker, hit_plane
from app.scene.view import ClickRay
from app.services import Services
from app.workspace import commands as c
from app.workspace.latest import BackgroundTask, Latest
from app.workspace.layers import Layer
from app.workspace.sections import CaseSection, ScopeSection, ViewSection
from app.workspace.skin_view import SkinView
from app.workspace.slice_view import Greys, SliceView
from vfix_engine.arrays import Array
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh

DISPLAY_ORDER = ("skull", "skull_display", "display", "bone")
MOST_VOLUMES = 2  # in the slices: the wide CT and a finer one of a part
OUTLINE_COLOURS = (OUTLINE_COLOUR, "#e07a5f", "#7fb7be", "#b48ead", "#a3be8c", "#d08770")


@dataclass(frozen=True)
class ShownSurface:
    """The displayed surface of a case. key: identifies a loaded case. bounds: (2, 3), LPS mm."""

    key: str
    mesh: TriangleMesh
    bounds: Array


class CaseView:
    """Reads cases in the background; everything else belongs to the session's thread."""

    def __init__(self, services: Services, executor: Executor, post: Callable[[Callable[[], None]], Any]) -> None:
        """post: queues a request onto the session's thread."""
        self._services, self._latest = services, Latest(executor, post)
        self._skin = SkinView(services, executor, post)
        self.case_id: str | None = None
        self.loading = ""
        self.hidden: frozenset[str] = frozenset()  # ids of hidden structures
        self.surface: ShownSurface | None = None
        self._case: Case | None = None
        self._look = Look()
        self._slices: SliceView | None = None
        self._picker: SurfacePicker | None = None
        self._opens = 0  # counter of loaded cases, for their keys
        self._pending_cross: Array | None = None
        self._opened_up = False

    # -- opening

    def open_first(self, case_id: str | None) -> None:
        """Open the case that the page remembers, else the shipped one, else the first; none when all are deleted."""
        known = [case.id for case in self._services.cases.list() if not case.unreadable]
        for wanted in (case_id, self._services.cases.embedded_case().id, *known):
            if wanted in known:
                self.open(wanted)
                return

    def open(self, case_id: str) -> None:
        """Show a case; its surface and volume are read in the background. Raises VfixError when there is none."""
        case = self._services.cases.get(case_id)
        kind = kind_of(case)
        if self.kind != case.kind:
            self._look = replace(self._look, opacity=kind.opacity)
        self.case_id, self._case = case.id, case
        self.loading = f"Reading the {kind.noun} …"
        self.surface = self._slices = self._picker = None
        self._look = replace(self._look, cut="whole", slices="none", skin=False)
        self._skin.opened(case)
        self._opened_up = False
        self._pending_cross = None
        self._opens += 1

        def read(run: BackgroundTask) -> tuple[TriangleMesh, SurfacePicker, Volume | None, Volume | None]:
            mesh = self._display_mesh(case.id)
            return (mesh, SurfacePicker(mesh), *self._volumes(case))

        self._latest.ask(
            "The case could not be read", read, lambda found: self._loaded(*found), self._failed, lane=case_id
        )

    def _volumes(self, case: Case) -> tuple[Volume | None, Volume | None]:
        """The wide CT and a finer one of a part, if available."""
        found = [self._services.cases.volume(case, volume.name) for volume in case.volumes[:MOST_VOLUMES]]
        wide, fine = (*found, None, None)[:2]
        return wide, fine

    def _display_mesh(self, case_id: str) -> TriangleMesh:
        meshes = self._services.cases.display_meshes(case_id)
        for name in DISPLAY_ORDER:
            if name in meshes:
                return meshes[name]
        return self._services.cases.case_surface(case_id)

    def _loaded(self, mesh: TriangleMesh, picker: SurfacePicker, volume: Volume | None, detail: Volume | None) -> None:
        bounds = np.asarray(mesh.bounds)
        self.surface = ShownSurface(f"{self.case_id}:{self._opens}", mesh, bounds)
        self._picker = picker
        centre = bounds.mean(axis=0)
        cross = centre if self._pending_cross is None else self._pending_cross
        self._slices = None if volume is None else SliceView(volume, cross, detail)
        self._look = replace(self._look, cut_at=float(cross[0]))
        self.loading = ""

    def _failed(self, words: str) -> None:
        self.loading = words

    # -- changes

    def handle(self, command: ClientMessage) -> None:
        """Answer a command for slices or look."""
        match command:
            case c.SetView():
                self._set_view(command)
            case c.SetCross() if self._slices is not None:
                self._slices.set_cross(command.position)
                self._cut_at_cross()
            case c.SetSlice() if self._slices is not None:
                self._slices.move(command.axis, command.position)
                self._cut_at_cross()
            case c.SetWindow() if self._slices is not None:
                self._slices.greys = Greys(command.name, command.window, command.level)
                self._cut_at_cross()

    def _cut_at_cross(self) -> None:
        if self._slices is not None:
            self._look = replace(self._look, cut_at=float(self._slices.cross[0]))

    def _set_view(self, command: c.SetView) -> None:
        if command.opacity is not None:
            self._look = replace(self._look, opacity=command.opacity)
        if command.cut is not None:
            self._look = replace(self._look, cut=command.cut)
        if command.slices is not None:
            self._look = replace(self._look, slices=command.slices)
        if command.skin_opacity is not None:
            self._look = replace(self._look, skin_opacity=command.skin_opacity)
        if command.skin is not None:
            self._look = replace(self._look, skin=command.skin)
            if command.skin:
                self._skin.ask()

    def go_to(self, position: Position | None) -> None:
        """Move the slices, and the cut, to a position; None leaves them."""
        if position is None:
            return
        self._pending_cross = np.array(position)
        if self._slices is not None:
            self._slices.set_cross(position)
        self._look = replace(self._look, cut_at=float(position[0]))

    def open_up(self, places: list[tuple[float, float, float]]) -> None:
        """Cut the anatomy open along a path, once, so that the tool inside is visible; the user can close it again."""
        if self._opened_up or self._look.cut != "whole" or not places:
            return
        self._opened_up = True
        self.go_to(tuple(float(value) for value in np.median(np.array(places), axis=0)))  # type: ignore[arg-type]
        self._look = replace(self._look, cut="left", slices="none" if self._slices is None else "sagittal")

    def scope(self) -> ScopeSection | None:
        """What a camera within the open anatomy sees, without one that is driven; None where the kind has none."""
        case = self._case
        look = None if case is None else kind_of(case).scope
        if case is None or look is None:
            return None
        surface = f"/api/v1/cases/{case.id}/endoscope"
        return ScopeSection(
            surface=surface, key=case.content_hash, poses="", look=look, hand=False, own=True, pose=None, words=""
        )

    # -- for the scene

    def layers(self) -> list[Layer[Any]]:
        """Bone with the letters around it, the CT slices, and the skin."""
        surface, look, slices, case = self.surface, self._look, self._slices, self._case
        if surface is None or case is None:
            return []
        colour = palette.ANATOMY[case.anatomy.role]
        anatomy = Layer(
            "case.anatomy",
            look,
            lambda view: AnatomyNodes(view, surface.mesh, surface.bounds, colour),
            lambda nodes: nodes.show(look),
            made_for=surface.key,
        )
        shown = slices is not None and look.slices != "none"
        pictures = Layer(
            "case.slices",
            (look.slices, slices.key()) if shown and slices is not None else None,
            SliceNodes,
            lambda nodes: nodes.show([] if slices is None else slices.pictures(look.slices)),
            made_for=surface.key,
        )
        return [anatomy, pictures, *self._skin.layers(look, surface.key)]

    def extent(self) -> tuple[Array, Array]:
        """Centre (3,) [LPS mm] and half sizes (3,) [mm] of what is shown, with its letters."""
        if self.surface is None:
            return np.zeros(3), np.full(3, 120.0)
        return self.surface.bounds.mean(axis=0), 0.5 * np.ptp(self.surface.bounds, axis=0) + LETTER_GAP_MM

    def hit(self, ray: ClickRay) -> Hit | None:
        """The first intersection of a click: displayed bone or skin, or a CT plane in the scene."""
        if self._picker is None:
            return None
        hits = [self._picker.hit(ray.origin, ray.direction, self._look.cut, self._look.cut_at)]
        hits.append(self._skin.hit(ray, self._look))
        if self._slices is not None and self._look.slices != "none":
            hits += [hit_plane(ray.origin, ray.direction, plane) for plane in self._slices.planes(self._look.slices)]
        return min((hit for hit in hits if hit is not None), key=lambda hit: hit.distance_mm, default=None)

    # -- for the page

    @property
    def case(self) -> Case | None:
        """The open case as stored at the last :meth:`refresh`; None where none is open, or it is gone."""
        return self._case

    @property
    def cross(self) -> Position | None:
        """The crosshair of the page, LPS mm; None without slices."""
        if self._slices is None:
            return None
        x, y, z = (round(float(value), 3) for value in self._slices.cross)
        return x, y, z

    @property
    def kind(self) -> CaseKind | None:
        """The anatomy that is driven in; None where no case is open."""
        return None if self._case is None else self._case.kind

    @property
    def deleted(self) -> bool:
        """Whether the open case was deleted, from the command line or over REST, when it was last read."""
        return self._case is not None and self._case.deleted_at is not None

    def refresh(self) -> None:
        """Read the case from the store, which others may have changed."""
        if self.case_id is not None:
            try:
                self._case = self._services.cases.shown(self.case_id)
            except NotFound:
                self._case = None

    def sections(self) -> Sections:
        """The :class:`CaseSections`."""
        case, loading, hidden, slices, look = self._case, self.loading, self.hidden, self._slices, self._look
        view: ViewSection = {
            "opacity": look.opacity,
            "cut": look.cut,
            "slices": look.slices,
            "skin": self._skin.section(look),
        }
        return {
            "case": Section(
                (Same(case), loading, hidden), lambda: None if case is None else case_section(case, loading, hidden)
            ),
            "slices": Section(
                None if slices is None else (Same(slices), slices.key()),
                lambda: None if slices is None else slices.section(),
            ),
            "view": Section.of(view),
        }


def overlay_words(overlay: Overlay) -> str:
    """The grid of a volume over the head, in words."""
    spacing = " × ".join(f"{value:.2f}" for value in overlay.volume.spacing_mm)
    return f"{' × '.join(str(size) for size in overlay.volume.shape)} voxels of {spacing} mm"


def _outline_colour(case: Case, item: Structure, index: int) -> str:
    """Colour of a structure; the first colour is reserved for the anatomy."""
    if item is case.anatomy:
        return OUTLINE_COLOURS[0]
    return item.colour or OUTLINE_COLOURS[1 + index % (len(OUTLINE_COLOURS) - 1)]


def case_section(case: Case, loading: str, hidden: Collection[str] = ()) -> CaseSection:
    """The page's section of the open case. hidden: ids of structures that are not drawn in the slices either."""
    kind = kind_of(case)
    low, high = case.surfaces[0].bounds_lps_mm
    return {
        "id": case.id,
        "name": case.name,
        "kind": case.kind,
        "noun": kind.noun,
        "surface": kind.surface,
        "parts": list(kind.parts),
        "sliced": kind.sliced or case.has_volume,
        "size_mm": [round(b - a, 1) for a, b in zip(low, high, strict=True)],
        "landmarks": [{"name": item.name, "position": list(item.position)} for item in case.landmarks],
        "frame": {"name": case.frame.name, "assumed": case.frame.assumed},
        "spacing_mm": None if case.spacing_mm is None else [float(value) for value in case.spacing_mm],
        "surfaces": [
            {"name": surface.name, "triangles": surface.triangles, "words": surface.words}
            for surface in case.own_surfaces
        ],
        "uncertainty": uncertainty_words(case),
        "has_volume": case.has_volume,
        "images": holds_images(case),
        "beads": len(case.beads),
        "window": list(case.volumes[0].window) if case.volumes and case.volumes[0].window else None,
        "overlays": [
            {"id": item.id, "name": item.name, "words": overlay_words(item), "notes": list(item.notes)}
            for item in case.overlays
        ],
        "notes": list(case.notes),
        "detail": case.volumes[1].name if len(case.volumes) > 1 else None,
        "loading": loading or None,
        "volumes": [volume.name for volume in case.volumes[:MOST_VOLUMES]],
        "outlines": [
            {
                "surface": item.surface,
                "colour": _outline_colour(case, item, index),
                "closed": item is case.anatomy and case.has_volume,
            }
            for index, item in enumerate(case.structures)
            if item.id not in hidden
        ],
    }
