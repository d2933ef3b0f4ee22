"""The skin of the open case as one client sees it: made when it is first shown; a click on it is a place before it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

from app.cases.service import Case
from app.exchange.patient_images import FACE_WARNING, holds_images
from app.imaging.derived_of_ct import has_head_ct
from app.scene import palette
from app.scene.anatomy import Look, SkinNode
from app.scene.picking import Hit, SurfacePicker
from app.scene.view import ClickRay
from app.services import Services
from app.workspace.latest import BackgroundTask, Latest
from app.workspace.layers import Layer
from app.workspace.sections import SkinSection
from vfix_engine.geometry.mesh import TriangleMesh

BEFORE_MM = 1.0  # a click means air so far before the skin, not the border of both


@dataclass(frozen=True)
class _Made:
    mesh: TriangleMesh
    picker: SurfacePicker


class SkinView:
    """Makes and reads skins in the background; everything else belongs to the session's thread."""

    def __init__(self, services: Services, executor: Executor, post: Callable[[Callable[[], None]], Any]) -> None:
        """post: queues a request onto the session's thread."""
        self._services, self._latest = services, Latest(executor, post)
        self._case: Case | None = None
        self._made: _Made | None = None
        self._asked = False
        self._failure = ""

    def opened(self, case: Case) -> None:
        """Another case is open; its skin is not asked for yet."""
        self._latest.drop()
        self._case, self._made, self._asked, self._failure = case, None, False, ""

    def ask(self) -> None:
        """The skin is to be shown: it is read, or made as a job, unless that goes on or is done."""
        case = self._case
        if case is None or self._asked:
            return
        self._asked, self._failure = True, ""

        def find(run: BackgroundTask) -> _Made | None:
            ended = self._services.jobs.wait(self._services.skins.start(case.id).id)
            if ended.state == "cancelled":
                return None
            if ended.error is not None:
                raise ended.error
            mesh = self._services.skins.make(case.id)
            return _Made(mesh, SurfacePicker(mesh, "skin", BEFORE_MM))

        self._latest.ask("The skin could not be made", find, self._found, self._failed, lane=case.id)

    def _found(self, made: _Made | None) -> None:
        """None: the job was cancelled."""
        self._made, self._asked = made, made is not None

    def _failed(self, words: str) -> None:
        self._asked, self._failure = False, words

    def layers(self, look: Look, made_for: object) -> list[Layer[SkinNode]]:
        """The skin, once it is there; hidden, it stays in the scene, so that it is soon shown again."""
        made = self._made
        if made is None:
            return []
        return [
            Layer(
                "case.skin",
                look,
                lambda view: SkinNode(view.scene, made.mesh),
                lambda node: node.show(look),
                made_for=made_for,
            )
        ]

    def hit(self, ray: ClickRay, look: Look) -> Hit | None:
        """The place before the skin that a click meets; None where it is hidden."""
        if self._made is None or not self.is_shown(look):
            return None
        return self._made.picker.hit(ray.origin, ray.direction, look.cut, look.cut_at)

    def is_shown(self, look: Look) -> bool:
        """Whether it is switched on, and is there or being made."""
        return look.skin and self._asked

    def section(self, look: Look) -> SkinSection:
        case, shown = self._case, self.is_shown(look)
        warns = shown and self._made is not None and case is not None and holds_images(case)  # there is a face
        return {
            "possible": case is not None and has_head_ct(case),
            "shown": shown,
            "opacity": look.skin_opacity,
            "colour": palette.hex_colour(palette.SKIN),
            "words": FACE_WARNING if warns else self._failure,
        }
