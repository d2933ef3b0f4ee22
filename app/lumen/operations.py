"""What can be done to routes through a lumen."""

from __future__ import annotations

from typing import Any

from msgspec.structs import replace

from app.documents import Document
from app.kit.names import unused_name
from app.lumen.contour_operations import OPERATIONS as CONTOURS
from app.lumen.document import ROUTE, Bound, LinkLength, LinkRadius, Links, Route
from app.lumen.mark_operations import OPERATIONS as MARKS
from app.lumen.motion_operations import OPERATIONS as MOTION
from app.lumen.places import check_end, wall_of
from app.operations.fields import Name, Position
from app.operations.operation import Context, Creation, Edit, Option, Verb
from app.operations.spec import DocumentSpec
from app.operations.standard import STANDARD, Redo, Rename, Undo
from vfix_engine.errors import InputError

Routes = Context[Route, Any]


class CreateRoute(Creation, frozen=True):
    """Make a route through a lumen, from its first landmark to its last one where it has landmarks."""

    title = "New route"
    rest = "POST /cases/{case_id}/routes"
    message = "route.new"
    verb = (Verb("route new", options=(Option("--name", "name", "", "of the route", None),)),)
    name: Name | None = None

    def create(self, context: Routes, case_id: str) -> Document[Route]:
        case = context.service.cases.get(case_id)
        if case.kind != "lumen":
            raise InputError(f"a route leads through a lumen, and this case is a {case.kind}; open a lumen first.")
        places = [mark.position for mark in case.landmarks]
        ends = Route(entry=places[0], end=places[-1]) if len(places) > 1 else Route()
        taken = {title.name for title in context.documents.titles(case_id, include_deleted=True)}
        name = unused_name("Route", taken | {"Route"})  # numbered from the second one on, whatever the first is called
        return context.documents.create(case_id, self.name or (name if taken else "Route"), ends)


class _InLumen(Edit, frozen=True):
    """An edit whose place is looked up in the wall."""

    def run(self, context: Routes, document_id: str) -> Document[Route]:
        wall_of(context, context.documents.title(document_id).case_id)  # takes up to seconds: before the store is held
        return super().run(context, document_id)


class SetEntry(_InLumen, frozen=True):
    """Say where the robot enters. A place in the lumen or on its wall, LPS mm."""

    title = "Entry of the route"
    rest = "PUT /routes/{id}/entry"
    message = "route.entry"
    of_open = True
    verb = "route entry"
    at: Position

    def apply(self, content: Route, context: Routes) -> Route:
        check_end("entry", self.at, content.end, wall_of(context, context.case_id))
        return replace(content, entry=self.at)


class SetEnd(_InLumen, frozen=True):
    """Say where the route ends. A place in the lumen or on its wall, LPS mm."""

    title = "End of the route"
    rest = "PUT /routes/{id}/end"
    message = "route.end"
    of_open = True
    verb = "route end"
    at: Position

    def apply(self, content: Route, context: Routes) -> Route:
        check_end("end", self.at, content.entry, wall_of(context, context.case_id))
        return replace(content, end=self.at)


class SwapEnds(Edit, frozen=True):
    """Enter at the end, and go to the entry."""

    title = "Swap entry and end"
    rest = "POST /routes/{id}/swap"
    message = "route.swap"
    of_open = True
    verb = "route swap"

    def apply(self, content: Route, context: Routes) -> Route:
        return replace(content, entry=content.end, end=content.entry)


class SetRobot(Edit, frozen=True):
    """Say which robot goes there. Length and radius are of each link, in mm; links null: as many as the way needs."""

    title = "Robot of the route"
    rest = "PUT /routes/{id}/robot"
    message = "route.robot"
    of_open = True
    verb = (
        Verb(
            "route robot",
            options=(Option("--links", "links", "N", "number of links, else as many as the way needs", None),),
        ),
    )
    length_mm: LinkLength
    radius_mm: LinkRadius
    links: Links | None = None

    def apply(self, content: Route, context: Routes) -> Route:
        return replace(content, links=self.links, length_mm=self.length_mm, radius_mm=self.radius_mm)


class SetBound(Edit, frozen=True):
    """Bound how far a link may leave its pathway, in mm. null: by the lumen's radius, 8 mm at most."""

    title = "Bound of the links"
    rest = "PUT /routes/{id}/bound"
    message = "route.bound"
    of_open = True
    verb = (Verb("route bound", options=(Option("--mm", "bound_mm", "MM", "else by the lumen's radius", None),)),)
    bound_mm: Bound | None = None

    def apply(self, content: Route, context: Routes) -> Route:
        return replace(content, bound_mm=self.bound_mm)


class RenameRoute(Rename, frozen=True):
    """Give a route another name."""

    verb = "route rename"


class UndoRoute(Undo, frozen=True):
    """Take the newest edit of a route back."""

    title = "Undo in the route"
    message = "route.undo"
    of_open = True
    verb = "route undo"


class RedoRoute(Redo, frozen=True):
    """Do again what was taken back in a route."""

    title = "Redo in the route"
    message = "route.redo"
    of_open = True
    verb = "route redo"


OPERATIONS = (
    CreateRoute,
    RenameRoute,
    *(operation for operation in STANDARD if operation not in (Rename, Undo, Redo)),
    UndoRoute,
    RedoRoute,
    SetEntry,
    SetEnd,
    SwapEnds,
    SetRobot,
    SetBound,
    *MOTION,
    *CONTOURS,
    *MARKS,
)
SPEC = DocumentSpec(kind=ROUTE, path="routes", id="route_id", operations=OPERATIONS, service="lumen_routes")
