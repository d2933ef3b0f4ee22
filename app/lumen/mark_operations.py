"""Polyps and labels put on the wall of a lumen, moved, renamed and removed."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any

import numpy as np
from msgspec import Meta
from msgspec.structs import replace

from app.cases.model import to_triple
from app.documents import Document
from app.kit.names import check_name
from app.kit.values import Position as Triple
from app.lumen.document import Route
from app.lumen.marks import MARK_KINDS, MOST_MARKS, MarkKind, RouteMark, seeded_places
from app.operations.fields import Identifier, Name, Position
from app.operations.operation import Context, Edit, Option, Verb
from vfix_engine.errors import InputError

SNAP_MM = 8.0  # from the wall, to which a place is moved
Seed = Annotated[int, Meta(ge=0, le=2**31 - 1)]
Count = Annotated[int, Meta(ge=1, le=50)]


class AddMark(Edit, frozen=True):
    """Put a polyp or a label on the wall. at: LPS mm, at most 8 mm from it; name: null for the kind and a number."""

    title = "Add polyp or label"
    rest = "POST /routes/{id}/marks"
    message = "route.mark.add"
    of_open = True
    verb = (Verb("route mark add", options=(Option("--name", "name", "", "of it", None),)),)
    kind: MarkKind
    at: Position
    name: Name | None = None

    def apply(self, content: Route, context: Context[Any, Any]) -> Route:
        if len(content.marks) >= MOST_MARKS:
            raise InputError(f"a route has at most {MOST_MARKS} polyps and labels; remove some first.")
        mark = _new(self.kind, _on_wall(self.at, context), content.marks)
        if self.name is not None:
            mark = replace(mark, name=check_name(self.name, f"{self.kind}'s name"))
        return replace(content, marks=(*content.marks, mark))


class MoveMark(Edit, frozen=True):
    """Move a polyp or a label to another place of the wall. to: LPS mm, at most 8 mm from it."""

    title = "Move polyp or label"
    rest = "PUT /routes/{id}/marks/{mark_id}/place"
    message = "route.mark.move"
    of_open = True
    verb = "route mark move"
    mark_id: Identifier
    to: Position

    def apply(self, content: Route, context: Context[Any, Any]) -> Route:
        mark = _known(content, self.mark_id)
        return _with(content, replace(mark, at=_on_wall(self.to, context)))


class RenameMark(Edit, frozen=True):
    """Give a polyp or a label another name."""

    title = "Rename polyp or label"
    rest = "PUT /routes/{id}/marks/{mark_id}/name"
    message = "route.mark.rename"
    of_open = True
    verb = "route mark rename"
    mark_id: Identifier
    name: Name

    def apply(self, content: Route, context: Context[Any, Any]) -> Route:
        mark = _known(content, self.mark_id)
        return _with(content, replace(mark, name=check_name(self.name, f"{mark.kind}'s name")))


class RemoveMark(Edit, frozen=True):
    """Remove a polyp or a label."""

    title = "Remove polyp or label"
    rest = "DELETE /routes/{id}/marks/{mark_id}"
    message = "route.mark.remove"
    of_open = True
    verb = "route mark remove"
    mark_id: Identifier

    def apply(self, content: Route, context: Context[Any, Any]) -> Route:
        _known(content, self.mark_id)
        return replace(content, marks=tuple(mark for mark in content.marks if mark.id != self.mark_id))


class SeedPolyps(Edit, frozen=True):
    """Put polyps on the wall by chance, one in each of as many equal parts of the way, instead of those that are there.

    Equal seeds give equal places. Whether a robot can view them is not asked.
    """

    title = "Polyps by seed"
    rest = "POST /routes/{id}/marks/polyps"
    message = "route.mark.seed"
    of_open = True
    verb = (Verb("route mark seed", options=(Option("--count", "count", "N", "of polyps, else 10", None),)),)
    seed: Seed
    count: Count = 10

    def run(self, context: Context[Any, Any], document_id: str) -> Document[Any]:
        context.service.paths.fit(context.documents.get(document_id))  # takes seconds: before the store is held
        return super().run(context, document_id)

    def apply(self, content: Route, context: Context[Any, Any]) -> Route:
        fit = context.service.paths.fit_of(context.case_id, content)
        mesh = context.service.cases.case_surface(context.case_id)
        marks = tuple(mark for mark in content.marks if mark.kind != "polyp")
        for place in seeded_places(mesh, fit.centreline.curve, self.count, self.seed):
            marks = (*marks, _new("polyp", to_triple(place), marks))
        if len(marks) > MOST_MARKS:
            raise InputError(f"a route has at most {MOST_MARKS} polyps and labels; remove some first.")
        return replace(content, marks=marks)


def _on_wall(place: Triple, context: Context[Any, Any]) -> Triple:
    """The nearest place of the wall."""
    tree = context.service.cases.tree(context.service.cases.get(context.case_id))
    distance, closest, _ = tree.point_distance(np.array([place]))
    if distance[0] > SNAP_MM:
        raise InputError(f"that place is {distance[0]:.0f} mm from the wall; choose one at most {SNAP_MM:g} mm off.")
    return to_triple(closest[0])


def _new(kind: MarkKind, at: Triple, others: Iterable[RouteMark]) -> RouteMark:
    """A mark with the next number of its kind."""
    taken = [int(mark.id[1:]) for mark in others if mark.kind == kind and mark.id[1:].isdecimal()]
    number = max(taken, default=0) + 1
    return RouteMark(f"{MARK_KINDS[kind].letter}{number}", kind, f"{kind.capitalize()} {number}", at)


def _known(content: Route, mark_id: str) -> RouteMark:
    for mark in content.marks:
        if mark.id == mark_id:
            return mark
    known = ", ".join(mark.id for mark in content.marks) or "none"
    raise InputError(f"the route has no polyp or label {mark_id!r:.40}; it has: {known}.")


def _with(content: Route, changed: RouteMark) -> Route:
    return replace(content, marks=tuple(changed if mark.id == changed.id else mark for mark in content.marks))


OPERATIONS = (AddMark, MoveMark, RenameMark, RemoveMark, SeedPolyps)
