"""Route on the server: the open route, clicks that choose its ends, and the pathway that is computed of it."""

from __future__ import annotations

from functools import partial
from typing import Any

from app.documents.editor import check_still_newest
from app.kit.kept import Same
from app.lumen.document import StoredRoute
from app.lumen.mark_operations import AddMark, MoveMark
from app.lumen.marks import MARK_KINDS
from app.lumen.operations import SPEC as ROUTES
from app.lumen.operations import SetEnd, SetEntry
from app.lumen.paths import RoutePath
from app.messages.fields import ClientMessage
from app.messages.sections import Section, Sections
from app.operations.messages import OperationMessage
from app.operations.operation import Change, Creation
from app.operations.standard import Delete, Redo, Restore, Undo
from app.scene.dragging import DragEvent
from app.scene.fiducials import FiducialNodes, FiducialShape
from app.scene.lumen import PathwayNodes
from app.scene.view import ClickRay
from app.tabs.base import Tab
from app.tabs.route import SPEC
from app.tabs.route import commands as c
from app.tabs.route.contours import ContourHand
from app.tabs.route.marks import marks_layer, stop_layer
from app.tabs.route.sections import RouteList
from app.tabs.route.view import path_section, route_section
from app.tabs.route.views import ViewHand
from app.workspace.latest import BackgroundTask, Latest
from app.workspace.layers import Layer
from app.workspace.plan_items import position_of
from app.workspace.workspace import Workspace
from vfix_engine.errors import InputError, VfixError

KIND = "route"
_PICKED = {
    "entry": "Click on the wall where the robot enters.",
    "end": "Click on the wall where the route ends.",
    "move": "Click on the wall where it is to be.",
} | {kind: f"Click on the wall where {style.many} are." for kind, style in MARK_KINDS.items()}


class RouteTab(Tab):
    """Owned by the session's thread; pathways are computed on others."""

    spec = SPEC
    first_view = "anterior"

    def __init__(self, workspace: Workspace, shared: Any = None) -> None:
        super().__init__(workspace, shared)
        self._routes = workspace.services.lumen_routes
        self._latest = Latest(workspace.executor, workspace.post)
        self._document: StoredRoute | None = None
        self._picking: str = ""
        self._moving = ""  # id of the polyp or label that the next click moves
        self._contours = ContourHand(self._routes.paths, self._do)
        self._wanted = ""  # the key of the path that is computed, known, or has failed
        self._path: RoutePath | None = None
        self._failure = ""
        self._seen = ViewHand(workspace, self._routes.views)
        workspace.on_case_opened(self._case_opened)

    # -- which route is open

    def _case_opened(self, wanted: str | None) -> None:
        """Open the route that the client asked for, else the newest."""
        case_id = self.workspace.case.case_id
        titles = () if case_id is None or not self.offered else self._routes.documents.titles(case_id)
        ids = [title.id for title in titles]
        self._open(wanted if wanted in ids else ids[-1] if ids else None)

    def _open(self, route_id: str | None) -> None:
        self._document, self._picking, self._moving = None, "", ""
        self.workspace.opened.set(KIND, route_id)
        self._read()

    def _read(self) -> None:
        """The open route as it is stored, and its pathway where that is another one. Raises VfixError."""
        route_id = self.workspace.opened.id(KIND)
        self._document = None if route_id is None else self._routes.documents.get(route_id)
        self._ask()
        self._contours.read(self._document, self._path)
        self._seen.read(self._document, self._wanted)

    def _need(self) -> StoredRoute:
        if self._document is None:
            raise InputError("no route is open; make one first.")
        return self._document

    # -- the pathway

    def _ask(self) -> None:
        """Compute the pathway of the open route, unless that goes on or is done."""
        route = self._document
        complete = route is not None and route.content.entry is not None and route.content.end is not None
        key = self._routes.paths.key(route) if route is not None and complete else ""
        if key == self._wanted:
            return
        self._wanted, self._path, self._failure = key, None, ""
        self._latest.drop()
        if route is None or not key:
            return
        if (known := self._routes.paths.known(route)) is not None:
            self._path = known
            return

        def find(run: BackgroundTask) -> RoutePath:
            return self._routes.paths.wait(route)

        self._latest.ask("The pathway could not be computed", find, self._found, self._failed, lane=KIND)

    def _found(self, path: RoutePath) -> None:
        self._path = path
        self._contours.read(self._document, path)

    def _failed(self, words: str) -> None:
        self._failure = words
        self._contours.read(self._document, None)

    # -- requests

    def handle(self, command: ClientMessage) -> None:
        match command:
            case c.OpenRoute():
                title = self._routes.documents.title(command.route_id)
                if title.case_id != self.workspace.case.case_id or title.deleted_at is not None:
                    raise InputError("that route is deleted, or belongs to another case; open that case first.")
                self._open(command.route_id)
            case c.PickRoutePlace():
                self._need()
                self._picking, self._moving = command.what, command.mark_id or ""
            case c.ViewWall(shown=None):
                self._seen.find()
            case c.ViewWall():
                self._seen.shown = bool(command.shown)
            case c.ChooseContour():
                self._contours.choose(command.at_mm)

    def operate(self, message: OperationMessage) -> None:
        """Do an operation, on the open route where it names none."""
        (operation,) = message.operations
        if message.target or isinstance(operation, Creation):
            self._manage(message, operation)
        else:
            self._do(operation, message.revision)

    def _manage(self, message: OperationMessage, operation: object) -> None:
        case_id = self.workspace.case.case_id
        if case_id is None:
            raise InputError("open a case first; a route belongs to one.")
        done = message.perform(message.spec.context(self.workspace.services, message.revision), case_id)
        assert done is not None
        if isinstance(operation, Delete) and done.id == self.workspace.opened.id(KIND):
            self._case_opened(None)
        elif isinstance(operation, Creation | Restore):
            self._open(done.id)
        else:
            self._read()

    def _do(self, operation: Any, seen: int | None = None) -> None:
        """Do it on the revision that is shown."""
        route = self._need()
        assert isinstance(operation, Change)
        check_still_newest(seen, route.revision)
        nothing = isinstance(operation, Undo) and not route.can_undo, isinstance(operation, Redo) and not route.can_redo
        if any(nothing):
            self.workspace.note(f"There is nothing to {'undo' if nothing[0] else 'redo'}.")
            return
        try:
            operation.run(ROUTES.context(self.workspace.services, route.revision), route.id)
        finally:
            self._read()
        self._contours.done(operation)

    def clicked(self, ray: ClickRay) -> None:
        """What is to be chosen; else another contour where one is edited, else the view turns about the place."""
        hit = self.workspace.case.hit(ray)
        if hit is None and self._picking:
            self.workspace.note("No wall there.")
            return
        if hit is None or not self._picking:
            if hit is None or not self._contours.choose_near(hit.position):
                super().clicked(ray)
            return
        place = position_of(hit.position)
        if self._picking in MARK_KINDS:  # there are several: it goes on until it is switched off
            self._do(AddMark(kind=self._picking, at=place))
            return
        operation: Any = SetEntry(at=place) if self._picking == "entry" else SetEnd(at=place)
        if self._picking == "move":
            operation = MoveMark(mark_id=self._moving, to=place)
        self._picking = self._moving = ""
        self._do(operation)

    def dragged(self, drag: DragEvent) -> None:
        if not self._contours.dragged(drag):
            super().dragged(drag)

    # -- what the page and the scene show

    def subject(self) -> object:
        stored = self.workspace.services.store.changes.of(KIND)
        return Same(self.workspace.case.case), stored, self.workspace.opened.id(KIND)

    def refresh(self) -> None:
        """Raises VfixError when the open route cannot be read any more; it is closed then."""
        if not self.offered:
            return
        try:
            self._read()
        except VfixError:
            self._open(None)
            raise

    def sections(self) -> Sections:
        """The :class:`RouteSections`."""
        document, picking, case_id = self._document, (self._picking, self._moving), self.workspace.case.case_id
        computing = bool(self._wanted) and self._path is None and not self._failure
        told = self._path, computing, self._failure
        stored = self.workspace.services.store.changes.of(KIND)
        return {
            "routes": Section((case_id, stored), lambda: self._list(case_id)),
            "route": Section(
                (Same(document), picking), lambda: None if document is None else route_section(document, *picking)
            ),
            "route_path": Section((Same(told[0]), *told[1:]), lambda: path_section(*told)),
            "route_contours": self._contours.section(),
            "route_views": self._seen.section(),
        }

    def _list(self, case_id: str | None) -> RouteList:
        titles = () if case_id is None else self._routes.documents.titles(case_id)
        return {"items": [{"id": one.id, "name": one.name, "modified": str(one.modified)} for one in titles]}

    def layers(self) -> list[Layer[Any]]:
        if not self.active or self._document is None:
            return []
        content, case_id, layers = self._document.content, self.workspace.case.case_id, list[Layer[Any]]()
        ends = (("entry", "Entry", content.entry), ("end", "End", content.end))
        shapes = tuple(
            FiducialShape(name, label, at, "confirmed" if name == "entry" else "found", name == self._picking)
            for name, label, at in ends
            if at is not None
        )
        layers.append(Layer("route.ends", shapes, FiducialNodes, lambda nodes: nodes.show(shapes), case_id))
        if content.marks:
            layers.append(marks_layer(content, case_id))
        layers += [*self._contours.layers(), *self._seen.layers()]
        if (path := self._path) is not None:
            show = partial(PathwayNodes.show, centreline=path.lumen.centreline.curve.points, rings=path.rings())
            if path.reach.limit not in ("end", "base"):
                layers.append(stop_layer(path, case_id))
            layers.append(Layer("route.path", Same(path), PathwayNodes, show, Same(path)))
        return layers

    def hint(self) -> str:
        document = self._document
        if self._picking:
            return _PICKED[self._picking]
        if document is None:
            return "Make a route first."
        if document.content.entry is None or document.content.end is None:
            return "Choose entry and end of the route."
        if self._failure:
            return "No way between entry and end; choose others."
        return "The pathway is being computed." if self._path is None else "Press Drive above to go along the route."
