"""Registrations for 3D Slicer: a transform, and its pairs as two point lists from which Slicer can fit it again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from app.exchange.markups import markup_node
from app.exchange.slicer.marks import Mark
from app.plans.model import NOTICE, Plan, PlanPoint
from app.registration.document import StoredRegistration
from app.registration.file_metadata import FULL
from app.registration.files import export_text
from app.registration.fit_report import FitReport, report_of
from app.registration.target_errors import error_table

IN_IMAGE, MEASURED = "#facc5c", "#f0857d"
SIMULATED = "Simulated: nothing here is of a real patient."
USED = "used by the plan"


def transforms_of(plan: Plan, registrations: Sequence[StoredRegistration]) -> Iterator[tuple[str, str, str]]:
    """Yield name, description and ITK text of every usable registration."""
    for one in registrations:
        report = report_of(one.content)
        if report.usable:
            yield named(plan, one, report), _words(plan, one, report), export_text(one, "tfm")


def points_of(plan: Plan, registrations: Sequence[StoredRegistration]) -> Iterator[Mark]:
    """Yield the fitted pairs of every registration as two lists in the same order: in the image, and as measured.

    They are hidden, because the measured ones are in another frame than the rest of the scene.
    """
    for one in registrations:
        pairs, there = one.content.used_pairs, FULL[one.content.to]
        if not pairs:
            continue
        report = report_of(one.content)
        words = _words(plan, one, report)
        lists = (
            ("in the image", IN_IMAGE, "Points in the image's frame.", [pair.in_image for pair in pairs]),
            (f"measured, in the frame of {there}", MEASURED,
             f"Points as measured, in the frame of {there}, not of the image: they lie elsewhere than the head here.",
             [pair.measured for pair in pairs]),
        )  # fmt: skip
        for what, colour, frame, places in lists:
            points = [
                PlanPoint("", pair.label, place) for pair, place in zip(pairs, places, strict=True) if place is not None
            ]
            name = f"{named(plan, one, report)}: {what}"
            markup = markup_node("Fiducial", name, points) | {"description": f"{frame} {words}"}
            yield Mark("Fiducial", name, colour, markup, visible=False)


def named(plan: Plan, one: StoredRegistration, report: FitReport) -> str:
    """Return the registration's name with its marks: simulated, and used by the plan."""
    found = (("simulated", report.simulated), (USED, plan.content.registration == one.id))
    marks = [word for word, applies in found if applies]
    return f"{one.name} ({', '.join(marks)})" if marks else one.name


def _words(plan: Plan, one: StoredRegistration, report: FitReport) -> str:
    """Describe a registration in sentences."""
    fre = (
        f" FRE {report.fre_mm:.2f} mm is how well they fit, not the target error."
        if report.usable and report.fre_mm is not None
        else ""
    )
    sentences = [
        f"{NOTICE}. From the image to {FULL[one.content.to]}.",
        f"{report.words}{fre}",
        *([SIMULATED] if report.simulated else ["Not marked as simulated."]),
        "The plan goes by this registration." if plan.content.registration == one.id else "The plan does not go by it.",
        error_table(one.content, plan).short if report.usable else "",
        *report.doubts,
    ]
    return " ".join(filter(None, sentences))
