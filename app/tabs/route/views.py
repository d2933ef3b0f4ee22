"""The viewable wall of the open route, computed when a client asks for it, and tinted in its scene."""

from __future__ import annotations

from typing import Any

from app.kit.kept import Same
from app.lumen.document import StoredRoute
from app.lumen.views import RouteViews, WallViews
from app.messages.sections import Section
from app.scene.lumen import SeenWallNodes
from app.tabs.route.sections import WallViewsSection
from app.workspace.latest import BackgroundTask, Latest
from app.workspace.layers import Layer
from app.workspace.workspace import Workspace


class ViewHand:
    """Owned by the session's thread; views are computed on others."""

    def __init__(self, workspace: Workspace, views: RouteViews) -> None:
        self._views, self._latest = views, Latest(workspace.executor, workspace.post)
        self._key = ""
        self._route: StoredRoute | None = None
        self._found: WallViews | None = None
        self._state, self._words = "none", ""
        self._job = ""  # that goes on for this client
        self.shown = True

    def read(self, route: StoredRoute | None, key: str) -> None:
        """Take the open route and the key of its pathway, '' where it has none."""
        if key == self._key:
            return
        self._key, self._route = key, route if key else None
        self._latest.drop()
        if self._state == "computing" and self._job:
            self._views.cancel(self._job)  # of a robot or pathway that the route does not have any more
        self._found = None if self._route is None else self._views.known(self._route)
        self._state, self._words = "none" if self._found is None else "ready", ""

    def find(self) -> None:
        """Compute it, unless that goes on or is done."""
        route = self._route
        if route is None or self._state in ("computing", "ready"):
            return
        self._state, self._words = "computing", ""
        self._job = self._views.start(route).id

        def find(run: BackgroundTask) -> WallViews:
            return self._views.wait(route)

        self._latest.ask("What can be viewed could not be computed", find, self._came, self._failed, lane="views")

    def _came(self, found: WallViews) -> None:
        self._found, self._state = found, "ready"

    def _failed(self, words: str) -> None:
        self._state, self._words = "failed", words

    def section(self) -> Section[object]:
        """The :class:`WallViewsSection`."""
        return Section((Same(self._found), self._state, self._words, self.shown), self._built)

    def _built(self) -> WallViewsSection:
        found = self._found
        return {
            "state": self._state,  # type: ignore[typeddict-item]
            "words": self._words,
            "share": None if found is None else round(found.share, 4),
            "depth_mm": None if found is None else round(found.depth_mm, 1),
            "shown": self.shown,
        }

    def layers(self) -> list[Layer[Any]]:
        """The viewable wall, where it is known and shown."""
        found = self._found
        if found is None or found.seen is None or not self.shown:
            return []
        seen = found.seen
        return [Layer("route.seen", Same(found), lambda view: SeenWallNodes(view, seen), lambda _: None, Same(found))]
