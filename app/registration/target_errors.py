"""The error that a registration has to be expected to have where the tool works: at targets and along the path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from app.kit.values import Position, rounded_up
from app.plans.model import Plan
from app.registration.calibration import motion_covariance
from app.registration.document import RegistrationContent
from app.registration.fit_report import FitReport, FleSource, counted_fle, fitted, report_of
from vfix_engine.arrays import Array
from vfix_engine.errors import PlanError
from vfix_engine.geometry.path import SplinePath
from vfix_engine.registration import target_errors_mm

STEP_MM = 1.0  # between places along the path


@dataclass(frozen=True)
class ExpectedError:
    """At one place, LPS: the rms error, and the radius within which it is in 95 of 100 cases; both in mm."""

    position: Position
    rms_mm: float
    within_95_mm: float


@dataclass(frozen=True)
class ErrorAtTarget:
    """The expected error at a target of the plan."""

    id: str
    label: str
    error: ExpectedError


@dataclass(frozen=True)
class ErrorAlongPath:
    """Along the chosen path, one place for every millimetre and its end. worst_mm: arc length of the worst place."""

    s_mm: tuple[float, ...]
    within_95_mm: tuple[float, ...]
    worst_mm: float
    worst: ExpectedError


@dataclass(frozen=True)
class ErrorTable:
    """What has to be expected of a registration for a plan.

    fle_mm: rms length of the localisation error of one fiducial that it is computed from. words: what the figures mean,
    or why there are none; targets and path are empty then. short: the words without what FRE is.
    """

    fle_mm: float | None
    fle_source: FleSource
    targets: tuple[ErrorAtTarget, ...]
    path: ErrorAlongPath | None
    words: str
    short: str


def expected_errors(content: RegistrationContent, points: npt.ArrayLike) -> tuple[Array, Array] | None:
    """The rms error and the radius of 95 % (n,), mm, at places (n, 3) of the image; None where nothing can be said.

    By the layout of the fitted pairs and the error of one fiducial, as stated or estimated from the fit; the radius is
    larger where it is estimated, since the estimate of a few pairs is rough. The errors of the pointer's tip and of the
    robot's calibration are in it, where the points went through them.
    """
    if content.made_from != "pairs":
        return None
    fit, places = fitted(content.used_pairs), np.asarray(points, dtype=np.float64).reshape(-1, 3)
    return target_errors_mm(fit, places, counted_fle(content, fit), motion_covariance=motion_covariance(content))


def error_table(content: RegistrationContent, plan: Plan | None) -> ErrorTable:
    """The expected errors at a plan's targets and along its chosen path; without a plan there are no places."""
    report = report_of(content)
    why = _why_not(content, report)
    if why or plan is None:
        words = why or "Open a plan to see the error in it."
        return ErrorTable(report.fle_mm, report.fle_source, (), None, words, words)
    targets = _at_targets(content, plan)
    path = _along(content, plan)
    short = _words(targets, path)
    if content.to == "base" and content.robot is not None:
        short += " The error of the robot's calibration is in it."
    fre = report.fre_mm
    fit = "" if fre is None else f" FRE, {fre:.2f} mm, is how well the points fit, not the error."
    return ErrorTable(report.fle_mm, report.fle_source, targets, path, f"{short}{fit}", short)


def _why_not(content: RegistrationContent, report: FitReport) -> str:
    if report.state == "misfit":
        return "No error is told: the points do not fit, and what would be computed from them means nothing."
    if report.state == "inconsistent":
        return f"No error is told. {report.words}"
    if content.made_from == "given":
        return "The error of a transform from a file is not known."
    if content.made_from == "surface":
        return (
            "The error of a refined transform is not known. Its residual does not tell it; known is "
            "only how far off the measured points are, which took no part, and that only near them."
        )
    if content.made_from == "none":
        return "The error is known once the points are fitted."
    if report.fle_mm is None:
        return "These points alone do not tell how exactly each was measured: say the localisation error in mm."
    return ""


def _errors_at(content: RegistrationContent, places: Array) -> list[ExpectedError]:
    found = expected_errors(content, places)
    assert found is not None  # `_why_not` has said otherwise
    rows = zip(places.tolist(), found[0].tolist(), found[1].tolist(), strict=True)
    return [ExpectedError((p[0], p[1], p[2]), rms, radius) for p, rms, radius in rows]


def _at_targets(content: RegistrationContent, plan: Plan) -> tuple[ErrorAtTarget, ...]:
    if not plan.content.targets:
        return ()
    errors = _errors_at(content, np.array([target.position for target in plan.content.targets], float))
    return tuple(ErrorAtTarget(t.id, t.label, error) for t, error in zip(plan.content.targets, errors, strict=True))


def _along(content: RegistrationContent, plan: Plan) -> ErrorAlongPath | None:
    if len(plan.content.points) < 2:
        return None
    try:
        path = SplinePath(np.array([point.position for point in plan.content.points]))
    except PlanError:  # two points on one spot; the Plan tab says so
        return None
    s = np.append(np.arange(0.0, path.length, STEP_MM), path.length)
    errors = _errors_at(content, np.asarray(path.position(s)))
    radii = tuple(error.within_95_mm for error in errors)
    worst = int(np.argmax(radii))
    return ErrorAlongPath(tuple(s.tolist()), radii, float(s[worst]), errors[worst])


def _words(targets: tuple[ErrorAtTarget, ...], path: ErrorAlongPath | None) -> str:
    places = [(one.error.within_95_mm, f"at ‘{one.label}’" if one.label else "at the target") for one in targets]
    if path is not None:
        places.append((path.worst.within_95_mm, f"on the path, at {path.worst_mm:.0f} mm"))
    if not places:
        return "The plan has no target and no path yet."
    radius, where = max(places)
    told = f"Registration error below {rounded_up(radius):.2f} mm in 95 % of cases"
    return f"{told} (most {where}); tool and tracking errors come on top."
