"""What one client is shown: sections of its page, layers of its scene."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from app.messages.sections import Section, Sections
from app.scene.view import SceneView
from app.services import Services
from app.session.sections import TabSection, jobs_section
from app.session.tab_view import TabView
from app.session.view_model import ViewModel
from app.tabs.base import Tab
from app.workspace.case_view import ShownSurface
from app.workspace.layers import Layer, LayerStack
from app.workspace.sections import SceneSection
from app.workspace.workspace import Workspace

SCENE_INTERVAL_S = 0.045  # between two pictures of what changes by itself: a browser draws some 20 a second


class Display:
    """Owned by the session's thread; only the view model is read on others.

    scene: the layers that the client's scene shows, None while there is no scene.
    """

    def __init__(
        self,
        services: Services,
        workspace: Workspace,
        tabs: Iterable[Tab],
        warming: Callable[[], str],
        guarded: Callable[[Callable[[], Any]], bool],
    ) -> None:
        """warming: as of a session. guarded: calls, and tells the user why where that fails."""
        self._services, self._workspace, self._warming, self._guarded = services, workspace, warming, guarded
        self.model = ViewModel()
        self.scene: LayerStack | None = None
        self._views = {tab: TabView(tab) for tab in tabs}  # in the order of the tabs
        self._published = -1  # the store's changes then
        self._jobs = services.jobs.going_on()
        self._drawn_at = 0.0
        self._own: list[str] = []  # names of the active tab's layers when everything was drawn
        self._viewed: ShownSurface | None = None  # the surface that the camera was turned to

    @property
    def is_behind(self) -> bool:
        """Something was stored since everything was published."""
        return self._published != self._services.store.changes.count

    def touch(self, tab: Tab) -> None:
        """Something happens to a tab: it is asked again what it shows."""
        self._views[tab].touch()

    def touch_all(self) -> None:
        """Something happens that may be about any tab."""
        for view in self._views.values():
            view.touch()

    def attach(self, view: SceneView | None) -> None:
        """The client's scene is there, or gone."""
        self.scene = None if view is None else LayerStack(view)
        self._workspace.camera.attach(view)
        self._viewed = None

    # -- sections

    def publish(self) -> None:
        """Everything, after a request: of tabs that nothing has happened to, what they showed before."""
        self._jobs = self._services.jobs.going_on()
        self._published = self._services.store.changes.count  # before anything is read
        case = self._workspace.case
        self._guarded(case.refresh)
        for view in self._views.values():
            self._guarded(view.refresh)
        self._publish_sections([case.sections(), *(view.sections for view in self._active_last())])
        self._guarded(self._draw)
        self._guarded(self._publish_labels)
        self.model.commit()

    def publish_ticking(self, jobs: Any) -> None:
        """Between requests: only the tabs whose sections and layers change by themselves.

        jobs: as of `Jobs.going_on`, read before it was known that nothing else has changed.
        """
        self._jobs = jobs
        ticking = [view for view in self._active_last() if view.tab.ticks]
        for view in ticking:  # each has just ticked
            self._guarded(view.ask)
        self._publish_sections([*(view.sections for view in ticking), self._active.sections])  # whose count, as above
        self._draw_ticking()
        self.model.commit()

    @property
    def _active(self) -> TabView:
        return next(view for view in self._views.values() if view.tab.active)

    def _active_last(self) -> list[TabView]:
        """Of sections and layers with one name the last counts: before the active tab those for the open case do."""
        return sorted(self._views.values(), key=lambda view: (view.tab.active, view.tab.offered))

    def _publish_sections(self, sources: Sequence[Sections]) -> None:
        """One that cannot be built keeps no other one from being shown."""
        sections = dict[str, Section[object]]()
        for source in sources:
            sections.update(source)
        self._guarded(lambda: sections.update(self.own_sections()))
        for name, section in sections.items():
            self._guarded(lambda name=name, section=section: self.model.publish(name, section))  # type: ignore[misc]

    def own_sections(self) -> Sections:
        """The :class:`SessionSections`, without the labels, which are there once the scene is drawn."""
        ready = self.scene is not None and self._workspace.case.surface is not None
        words = "" if ready else self._workspace.case.loading or "Preparing the scene …"
        scene: SceneSection = {"ready": ready, "words": words}
        return {
            "step": Section.of(self.tab_section()),
            "scene": Section.of(scene),
            "camera": Section.of(self._workspace.camera.section()),
            "jobs": Section(self._jobs[0], lambda: jobs_section(*self._jobs)),
        }

    def tab_section(self) -> TabSection:
        """The active tab, and those that are beside it."""
        warming, view = self._warming(), self._active
        spec = view.tab.spec
        if warming and spec.for_heads:
            hint = f"{warming} …"
        elif self._workspace.case.deleted and not view.tab.busy:
            hint = "This head was deleted elsewhere. Restore it from the list of deleted heads, or open another one."
        else:
            hint = view.hint
        return {
            "name": spec.name,
            "input": spec.input,
            "endoscope": spec.endoscope,
            "available": [tab.spec.name for tab in self._views if tab.available],
            "hint": hint,
            "offered": [tab.spec.name for tab in self._views if tab.offered],
        }

    # -- the scene

    def layers(self) -> list[Layer[Any]]:
        """What the scene shows now; of two with one name the later counts."""
        layers = self._workspace.case.layers()
        for view in self._active_last():
            self._guarded(lambda view=view: layers.extend(view.layers))  # type: ignore[misc]
        return layers

    def _draw(self) -> None:
        """Bring the scene up to date."""
        if self.scene is None:
            return
        self._draw_layers(self.scene)
        view, surface = self._active, self._workspace.case.surface
        if surface is not None and self._viewed is not surface:
            self._viewed = surface
            self._workspace.camera.look_from(view.tab.first_view)

    def _draw_layers(self, scene: LayerStack) -> None:
        self._own = [layer.name for layer in self._active.layers]
        scene.draw(self.layers())

    def _draw_ticking(self) -> None:
        """Of an active tab that changes by itself, so often as a browser draws."""
        view, now = self._active, time.monotonic()
        if self.scene is None or not view.tab.ticks or now - self._drawn_at < SCENE_INTERVAL_S:
            return
        self._drawn_at = now
        if [layer.name for layer in view.layers] == self._own:
            self.scene.update(view.layers)
        else:
            self._draw_layers(self.scene)
        self._publish_labels()

    def _publish_labels(self) -> None:
        if self.scene is not None:
            self.model.publish("labels", Section.of(self._workspace.camera.labels()))
