"""What the pairs of a registration say: the fit, how well they fit, which one does not, and what is in doubt."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from app.registration.calibration_records import pointer_cautions, robot_cautions
from app.registration.document import IDENTITY, FiducialPair, RegistrationContent
from vfix_engine.arrays import Array
from vfix_engine.errors import VfixError
from vfix_engine.registration import Registration, find_outlier, register_points
from vfix_engine.registration.outlier import Certainty

FEWEST = 3  # pairs of a fit
OUTLIER_FROM = 4  # pairs, of which one can be told to be wrong
NO_FIT_MM = 5.0  # beyond that FRE the points are not each other's, whatever the pointer
SAME = 1e-6  # between a stored transform and the fit of its points, mm and components of the rotation
SLID_MM, SLID_TIMES = 2.0, 3.0  # a refinement under which the points are off by more, and so often by their own fit

FitState = Literal["waiting", "degenerate", "misfit", "inconsistent", "fitted", "given", "refined"]
FleSource = Literal["stated", "estimated", "none"]


@dataclass(frozen=True)
class WrongPair:
    """The pair that does not fit the others. certainty: 'outlier' where that is clear, else 'suspect'."""

    pair: str
    label: str
    certainty: Certainty
    words: str


@dataclass(frozen=True)
class FitReport:
    """How a registration stands; lengths in mm.

    state: 'waiting' for more pairs; 'degenerate' where the pairs' layout leaves a motion open; 'misfit' where the fit
    means nothing, since the points are not each other's; 'inconsistent' where the stored transform is not that of what
    it says it is made of, see `inconsistency`; 'fitted'; 'given' where the transform came from elsewhere,
    'refined' where it was refined on a surface: the pairs only judge these two. words: the same in sentences.
    used: pairs of the fit. fre_mm: root mean square of their residuals; mean_residual_mm: their mean; None while there
    is no transform or no pair. residuals_mm: of every complete pair by its id, of those that are left out too.
    fle_mm: rms length of the localisation error of one fiducial, stated or estimated from the FRE, also where the fit
    contradicts what was stated; None for neither.
    simulated: points of the fit were measured by a simulated pointer, or went through a simulated robot's calibration,
    or the file of the transform says so.
    cautions: sentences. few: the one of them that says that too few points are fitted to notice a wrong one, or ''.
    """

    state: FitState
    words: str
    used: int
    fre_mm: float | None
    mean_residual_mm: float | None
    residuals_mm: Mapping[str, float]
    wrong: WrongPair | None
    fle_mm: float | None
    fle_source: FleSource
    simulated: bool
    cautions: tuple[str, ...]
    few: str = ""

    @property
    def usable(self) -> bool:
        """Whether there is a transform that a plan may use."""
        return self.state in ("fitted", "given", "refined")

    @property
    def doubts(self) -> tuple[str, ...]:
        """What whoever uses the registration has to know: the cautions, and the point that does not fit the others."""
        wrong = self.wrong
        return self.cautions if wrong is None or wrong.certainty != "outlier" else (*self.cautions, wrong.words)


def image_and_measured(pairs: Sequence[FiducialPair]) -> tuple[Array, Array]:
    """The places (n, 3) of complete pairs in the image and as measured."""
    return np.array([pair.in_image for pair in pairs], float), np.array([pair.measured for pair in pairs], float)


def fitted(pairs: Sequence[FiducialPair]) -> Registration:
    """The fit of complete pairs, from the image to where they were measured. Raises VfixError where there is none."""
    image, measured = image_and_measured(pairs)
    return register_points(measured, image, _weights(pairs))


def _weights(pairs: Sequence[FiducialPair]) -> Array | None:
    weights = [pair.weight for pair in pairs]
    return None if len(set(weights)) == 1 else np.array(weights)


def in_our_words(error: VfixError) -> str:
    """A message of the engine, which knows a fixed and a moving side, not the patient and the image."""
    return str(error).replace("fixed points", "measured points").replace("moving points", "points in the image")


def refitted(content: RegistrationContent) -> RegistrationContent:
    """The content with the transform of its pairs; one that was given or refined on a surface stays."""
    if content.made_from in ("given", "surface"):
        return content
    content = replace(content, said=None)
    if len(content.used_pairs) < FEWEST:
        return replace(content, transform=IDENTITY, made_from="none")
    try:
        transform = fitted(content.used_pairs).transform
    except VfixError:  # `report_of` says why
        return replace(content, transform=IDENTITY, made_from="none")
    return replace(content, transform=tuple(float(value) for value in np.ravel(transform)), made_from="pairs")


def inconsistency(content: RegistrationContent) -> str:
    """Why a stored transform is not that of what it says it is made of; '' where it is.

    Edits fit anew, so that theirs always is; what came from outside may say anything. A transform that was read from a
    file is made of nothing else.
    """
    if content.made_from == "given":
        return ""
    if content.made_from == "surface":
        return _NO_SURFACE if content.surface is None else ""
    again = refitted(content)
    if again.made_from != content.made_from:
        return _NO_FIT if again.made_from == "none" else _NOT_FITTED
    off = np.abs(np.subtract(again.transform, content.transform)).max() if again.made_from == "pairs" else 0.0
    return _OTHER_FIT if off > SAME else ""


_NO_SURFACE = (
    "Refined on a surface, but no points were touched there. Fit the points, or touch the surface and refine it anew."
)
_NO_FIT = "The transform's points cannot be fitted. Measure them again."
_NOT_FITTED = "These points can be fitted, and no transform is stored. Change one to fit anew."
_OTHER_FIT = "The stored transform is not that of its points. Nothing goes by it; change a point to fit anew."


def report_of(content: RegistrationContent) -> FitReport:
    """How a registration stands."""
    pairs = content.used_pairs
    state, words, fit = _state(content)
    known = state in ("misfit", "fitted", "given", "refined")
    complete = tuple(pair for pair in content.pairs if pair.complete)
    residuals = dict(zip([p.id for p in complete], content.residuals_mm(complete), strict=True)) if known else {}
    own = [residuals[pair.id] for pair in pairs] if known else []
    fle, source = _fle(content, state, fit)
    few = _few(complete, residuals) if state == "fitted" and len(pairs) == FEWEST else ""
    return FitReport(
        state=state,
        words=words,
        used=len(pairs),
        fre_mm=float(np.sqrt(np.mean(np.square(own)))) if own else None,
        mean_residual_mm=float(np.mean(own)) if own else None,
        residuals_mm=residuals,
        wrong=_wrong(pairs) if state in ("misfit", "fitted") else None,
        fle_mm=fle,
        fle_source=source,
        simulated="simulated" in _sources(content) or _simulated_robot(content) or content.said_simulated,
        cautions=(*_cautions(content, state, own, fit), *([few] if few else [])),
        few=few,
    )


def _simulated_robot(content: RegistrationContent) -> bool:
    robot = content.robot
    return content.to == "base" and robot is not None and robot.measured_from == "simulated"


def _state(content: RegistrationContent) -> tuple[FitState, str, Registration | None]:
    pairs = content.used_pairs
    if why := inconsistency(content):
        return "inconsistent", why, None
    if content.made_from == "given":
        judged = "The pairs do not change it; they show how far each is off." if pairs else ""
        said = "" if content.said is None else content.said.words
        return "given", " ".join(filter(None, ("This transform was read from a file.", said, judged))), None
    if content.made_from == "surface":
        return "refined", _refined_words(content), None
    missing = FEWEST - len(pairs)
    if missing > 0:
        more = "One more point" if missing == 1 else f"{_count(missing)} more points"
        verb = "has" if missing == 1 else "have"
        return "waiting", f"{more} {verb} to be seen in the image and measured: a fit needs three at least.", None
    try:
        fit = fitted(pairs)
    except VfixError as error:
        return "degenerate", f"These points cannot be fitted: {in_our_words(error).rstrip('.')}.", None
    if why := _misfit(pairs, fit):
        return "misfit", why, None
    return "fitted", f"{_count(len(pairs))} points are fitted.", fit


def _mixed(pairs: Sequence[FiducialPair]) -> bool:
    """Whether the pairs were measured in frames that have nothing to do with each other.

    A typed point may be either's: somebody corrects one that was simulated, or types what a tracker shows.
    """
    sources = {pair.measured_from for pair in pairs}
    return "simulated" in sources and not sources.isdisjoint(("file", "tracker"))


def _misfit(pairs: Sequence[FiducialPair], fit: Registration) -> str:
    """Why a fit means nothing, whatever its figures; '' where it may mean something."""
    if _mixed(pairs):
        return (
            "Simulated and real points are mixed. They lie in different frames, "
            "and their fit means nothing. Measure all of them in one way."
        )
    if fit.fre_mm > NO_FIT_MM:
        return (
            f"These points do not fit: they are {fit.fre_mm:.1f} mm apart, rms, under the best fit. Their order "
            "may be another one, or one or more of them were measured wrongly: match their order, or "
            "measure them again."
        )
    return ""


def _refined_words(content: RegistrationContent) -> str:
    surface = content.surface
    done = None if surface is None else surface.refinement
    if surface is None or done is None:
        words = "Refine anew: other surface points were touched since."
    else:
        words = (
            f"Refined on a surface: {done.kept} of the {len(surface.points)} touched points lie within "
            f"{done.residual_mm:.2f} mm rms of it. That residual is not the accuracy, which may be millimetres worse."
        )
    judged = "The points above took no part; they show how far each is off." if content.used_pairs else ""
    return f"{words} {judged}".rstrip()


def _count(number: int) -> str:
    names = ("No", "One", "Two", "Three", "Four", "Five", "Six", "Seven", "Eight", "Nine", "Ten")
    return names[number] if number < len(names) else str(number)


def counted_fle(content: RegistrationContent, fit: Registration) -> float | None:
    """The stated localisation error of one fiducial, mm, where it counts; None where that of the fit is taken instead.

    It does not count where none is stated, and where the fit leaves more than it explains. Whoever computes an error
    from a registration asks here.
    """
    stated = content.fle_mm
    return stated if stated is not None and fit.explained_by(stated) else None


def _fle(content: RegistrationContent, state: FitState, fit: Registration | None) -> tuple[float | None, FleSource]:
    if fit is None:
        stated = None if state in ("misfit", "inconsistent") else content.fle_mm
        return stated, "none" if stated is None else "stated"
    counted = counted_fle(content, fit)
    return (float(fit.fle_mm), "estimated") if counted is None else (counted, "stated")


def _wrong(pairs: Sequence[FiducialPair]) -> WrongPair | None:
    if len(pairs) < OUTLIER_FROM:
        return None
    image, measured = image_and_measured(pairs)
    try:
        found = find_outlier(measured, image, _weights(pairs))
    except VfixError:  # without one of them the others cannot be fitted
        return None
    if found is None or found.without.fre_mm > NO_FIT_MM:  # where nothing fits, no single pair is to blame
        return None
    pair = pairs[found.index]
    name = pair.label or f"Point {found.index + 1}"
    if found.certainty == "outlier":
        words = (
            f"‘{name}’ is {found.off_mm:.1f} mm from where the others put it. It was measured wrongly, or is another "
            "bead: measure it again, or leave it out."
        )
    else:
        words = (
            f"‘{name}’ is {found.off_mm:.1f} mm off: measure it again. It may be chance; the others put it elsewhere."
        )
    return WrongPair(pair.id, name, found.certainty, words)


def _cautions(
    content: RegistrationContent, state: FitState, residuals: Sequence[float], fit: Registration | None
) -> tuple[str, ...]:
    pairs, found, sources = content.used_pairs, list[str](), _sources(content)
    if "simulated" in sources and len(sources) > 1:
        if state != "misfit":  # which says so
            found.append(
                "Some points are of a simulated pointer. So nothing here is of a real patient; measure all of them in "
                "one way."
            )
    elif "simulated" in sources:
        found.append("Measured by a simulated pointer: nothing is of a real patient.")
    elif content.said_simulated:
        found.append("The file is simulated: nothing here is of a real patient.")
    elif _simulated_robot(content):
        found.append("The robot's calibration is simulated: nothing here is of a real robot.")
    if content.robot is not None and content.to == "base":
        found += robot_cautions(content.robot)
    if content.pointer is not None and "tracker" in sources:
        found += pointer_cautions(content.pointer)
    if fit is not None and len({pair.weight for pair in pairs}) > 1:
        found.append(
            "The points have different weights; the expected error is rough. It is computed as if all were measured "
            "equally well."
        )
    if fit is not None and content.fle_mm is not None and counted_fle(content, fit) is None:
        found.append(
            f"The points are farther off than the stated {content.fle_mm:g} mm explains; the error is computed from "
            f"{fit.fle_mm:.2f} mm, estimated from the fit."
        )
    if state == "refined":
        found += _slid(pairs, residuals)
    return tuple(found)


def _few(complete: Sequence[FiducialPair], residuals: Mapping[str, float]) -> str:
    """What three points do not tell, and what to do: points that were left out make the others fit better."""
    words = "Three points: a wrong one may go unnoticed. They fit almost always, and the error may be too small."
    left = [pair for pair in complete if not pair.enabled]
    if not left:
        return f"{words} Measure a fourth."
    names = ", ".join(f"‘{pair.label}’" if pair.label else "a point without a name" for pair in left)
    farthest = max(residuals[pair.id] for pair in left)
    return f"{words} Left out, and up to {farthest:.1f} mm off: {names}. Measure one of them again, or another point."


def _sources(content: RegistrationContent) -> set[str]:
    """By what the points were measured that the transform was made of or is judged by."""
    sources: set[str] = {pair.measured_from for pair in content.used_pairs}
    if content.made_from == "surface" and content.surface is not None:
        sources.add(content.surface.measured_from)
    return sources


def _slid(pairs: Sequence[FiducialPair], residuals: Sequence[float]) -> list[str]:
    """A caution where the pairs contradict a refinement."""
    try:
        own = fitted(pairs).fre_mm if len(pairs) >= FEWEST else 0.0
    except VfixError:  # in a line, such as; they still show how far they are off
        own = 0.0
    rms = float(np.sqrt(np.mean(np.square(residuals)))) if residuals else 0.0
    if rms <= max(SLID_MM, SLID_TIMES * own):
        return []
    return [
        f"The points are {rms:.1f} mm off (rms) under the refined transform."
        + (f" Under their own fit it is {own:.1f} mm." if own else "")
        + " The touched points may have slid along the surface. Fit the points instead, or touch more of the surface."
    ]
