"""Contours of a route added, moved, resized and removed by hand, as the operators of Kwok 2013 (section IV.A) did."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from msgspec import Meta
from msgspec.structs import replace

from app.cases.model import to_triple
from app.documents import Document
from app.lumen.contours import MOST_CONTOURS, ContourRadius, Radii, RouteContour, check_radii, with_contours
from app.lumen.document import Route
from app.lumen.places import check_contours, wall_of
from app.operations.fields import Position
from app.operations.operation import Context, Edit, Option, Verb
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError

if TYPE_CHECKING:  # slow to load, as in `paths`
    from vfix_engine.pathway.hand_contours import EditedPathway
    from vfix_engine.worlds.snake.lumen import Lumen

AlongMm = Annotated[float, Meta(ge=0.0, le=1e4, description="along the way of the robot, in mm")]


class ContourEdit(Edit, frozen=True):
    """An edit of the contours; the pathway has to be possible with it."""

    of_open = True
    at_mm: AlongMm

    def run(self, context: Context[Any, Any], document_id: str) -> Document[Any]:
        # The fit takes seconds where it is not known: before the store is held.
        document = context.documents.get(document_id)
        context.service.paths.fit(document)
        wall_of(context, document.case_id)
        return super().run(context, document_id)

    def apply(self, content: Route, context: Context[Any, Any]) -> Route:
        fit: Lumen = context.service.paths.fit_of(context.case_id, content)
        before = with_contours(fit, content.contours)
        edited = replace(content, contours=self.changed(content.contours, before, fit))
        if len(edited.contours) > MOST_CONTOURS:
            raise InputError(f"a route has at most {MOST_CONTOURS} contours by hand; remove some first.")
        after = with_contours(fit, edited.contours)
        check_contours(edited.contours, content.contours, after, wall_of(context, context.case_id))
        return edited

    def changed(self, contours: tuple[RouteContour, ...], now: EditedPathway, fit: Lumen) -> tuple[RouteContour, ...]:
        """The contours by hand after it. now: the pathway before it, of those of `fit` and by hand."""
        raise NotImplementedError

    def of_nearest(
        self,
        contours: tuple[RouteContour, ...],
        now: EditedPathway,
        fit: Lumen,
        change: Callable[[RouteContour], RouteContour | None],
    ) -> tuple[RouteContour, ...]:
        """The contours with the nearest one changed, which is by hand from then on; None: it is gone."""
        number = now.nearest(self.at_mm)
        own = int(now.of_hand[number])
        if own >= 0:
            after = change(contours[own])
            return (*contours[:own], *([] if after is None else [after]), *contours[own + 1 :])
        here = fit.curve.position(now.fit_knots[number])
        radii = fit.pathway.radius[int(np.abs(_knots(fit) - now.fit_knots[number]).argmin())]
        after = change(RouteContour(to_triple(here), tuple(float(value) for value in radii), None, of_fit=True))
        return contours if after is None else (*contours, after)


class AddContour(ContourEdit, frozen=True):
    """Add a contour at so many mm along the way. radius_mm: null for the pathway's there."""

    title = "Add contour"
    rest = "POST /routes/{id}/contours"
    message = "route.contour.add"
    verb = (Verb("route contour add", options=(Option("--radius", "radius_mm", "MM", "else the pathway's", None),)),)
    radius_mm: ContourRadius | None = None

    def changed(self, contours: tuple[RouteContour, ...], now: EditedPathway, fit: Lumen) -> tuple[RouteContour, ...]:
        now.nearest(self.at_mm)  # raises where that is not on the way
        found = now.pathway.contours()
        knot, s = (float(np.interp(self.at_mm, now.at_mm, one)) for one in (now.fit_knots, now.pathway.at_s))
        taken = int(np.abs(now.fit_knots - knot).argmin())
        if abs(now.fit_knots[taken] - knot) < 1.0:
            raise InputError(f"there is a contour at {now.at_mm[taken]:.1f} mm already; resize or move that one.")
        around = [float(np.interp(s, found.s, column)) for column in found.radius.T]
        radii = tuple(around) if self.radius_mm is None else (self.radius_mm,)
        return (*contours, RouteContour(to_triple(fit.curve.position(knot)), radii))


class ResizeContour(ContourEdit, frozen=True):
    """Give the contour nearest to a place along the way another radius, or three and more around its centre.

    radii_mm: in mm; of several the first is towards the spoke that is drawn, the others follow at equal angles.
    """

    title = "Resize contour"
    rest = "POST /routes/{id}/contours/resize"
    message = "route.contour.resize"
    verb = "route contour resize"
    radii_mm: Radii

    def changed(self, contours: tuple[RouteContour, ...], now: EditedPathway, fit: Lumen) -> tuple[RouteContour, ...]:
        check_radii(self.radii_mm)
        return self.of_nearest(contours, now, fit, lambda one: replace(one, radii_mm=self.radii_mm))


class MoveContour(ContourEdit, frozen=True):
    """Move the centre of the contour nearest to a place along the way; its neighbours go along. to: LPS mm."""

    title = "Move contour"
    rest = "POST /routes/{id}/contours/move"
    message = "route.contour.move"
    verb = "route contour move"
    to: Position

    def changed(self, contours: tuple[RouteContour, ...], now: EditedPathway, fit: Lumen) -> tuple[RouteContour, ...]:
        return self.of_nearest(contours, now, fit, lambda one: replace(one, centre=self.to))


class RemoveContour(ContourEdit, frozen=True):
    """Remove the contour nearest to a place along the way, whether it was fitted or placed by hand."""

    title = "Remove contour"
    rest = "POST /routes/{id}/contours/remove"
    message = "route.contour.remove"
    verb = "route contour remove"

    def changed(self, contours: tuple[RouteContour, ...], now: EditedPathway, fit: Lumen) -> tuple[RouteContour, ...]:
        def gone(one: RouteContour) -> RouteContour | None:
            return replace(one, radii_mm=(), centre=None) if one.of_fit else None

        return self.of_nearest(contours, now, fit, gone)


class ClearContours(Edit, frozen=True):
    """Take back everything that was done to the contours by hand; the fitted ones are there again."""

    title = "Fitted contours again"
    rest = "DELETE /routes/{id}/contours"
    message = "route.contour.clear"
    of_open = True
    verb = "route contour clear"

    def apply(self, content: Route, context: Context[Any, Any]) -> Route:
        return replace(content, contours=())


def _knots(fit: Lumen) -> Array:
    assert fit.pathway.knots is not None
    return fit.pathway.knots


OPERATIONS = (AddContour, MoveContour, ResizeContour, RemoveContour, ClearContours)
