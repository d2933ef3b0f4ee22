"""`--errors` of `vfix rehearse` and `vfix score`: where the tool truly was, beside where the robot has it."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from app.commands.head_options import say_notes
from app.plans.model import Plan
from app.services import Services
from vfix_engine.anatomy.phantom import load_landmarks
from vfix_engine.arrays import Array
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError
from vfix_engine.runtime.control_mode import FREEHAND, HANDS_ON
from vfix_engine.study.error_chain import PAPERS, ErrorChain, RegistrationError, TruthTally
from vfix_engine.worlds.rigid.scene import Scene

if TYPE_CHECKING:
    from app.registration.document import RegistrationContent

NONE, OF_PAPERS = "none", "papers"
LEAST_FIDUCIALS = 3


def add_error_arguments(parser: argparse.ArgumentParser) -> None:
    """`--errors`, of a drive and of a score."""
    parser.add_argument(
        "--errors", metavar="FILE", default=NONE, help="what really happens: a file of errors, 'papers', or 'none'"
    )


def add_compensation(parser: argparse.ArgumentParser) -> None:
    """`--compensate`, of a drive alone."""
    words = "the robot compensates the deflection under the hand that --errors has"
    parser.add_argument("--compensate", action="store_true", help=words)


def compensating(settings: ControlSettings, args: argparse.Namespace) -> ControlSettings:
    """The settings with `--compensate`: they know the compliance of `--errors`.

    Raises InputError where there is none, or none that a setting can have.
    """
    if not args.compensate:
        return settings
    # The compliance depends on neither seed nor fiducials.
    known = chain_of(args.errors, 0, None).compliance
    if known is None or args.mode != HANDS_ON:
        raise InputError("--compensate goes with the compliance of --errors, and with a hand on the robot")
    return replace(settings, compliance_mm_per_n=known.mm_per_n)


def chain_of(
    named: str, seed: int, path: Array | None, registered: RegistrationContent | None = None, case_id: str = ""
) -> ErrorChain:
    """The chain that `--errors` names.

    seed: of the papers' errors. path: (n, 3) points of the plan's path, at whose middle the registration's error is
    told. registered: the plan's registration; where it was measured with the simulated pointer, its error is known.

    Raises InputError for a file that is no error chain.
    """
    if named == NONE:
        return ErrorChain()
    if named != OF_PAPERS:
        return ErrorChain.read(Path(named))
    middle = None if path is None else path.mean(axis=0)
    chain = ErrorChain.papers(_fiducials(middle, registered), seed, middle)
    known = None if registered is None else _known_error(registered, case_id)
    if known is None:
        return chain
    return replace(chain, registration=RegistrationError.of(known, np.zeros(3) if middle is None else middle))


def _known_error(registered: RegistrationContent, case_id: str) -> Array | None:
    """As `simulated_error`."""
    from app.registration.simulated_error import simulated_error  # not in an installation without the app

    return simulated_error(registered, case_id)


def _fiducials(middle: Array | None, registered: RegistrationContent | None) -> Array:
    """Those of the plan's registration, else five that lie about the path as those of the shipped head about its."""
    used = () if registered is None else registered.used_pairs
    if len(used) >= LEAST_FIDUCIALS:
        return np.array([pair.in_image for pair in used])
    shipped = load_landmarks()
    beads = np.array([bead.centroid for bead in shipped.beads])
    about = np.mean([point.position for point in shipped.corridor], axis=0)
    moved: Array = beads - about + (about if middle is None else middle)
    return moved


class Truths:
    """The figures of one drive in the true frame."""

    def __init__(
        self, args: argparse.Namespace, services: Services | None, plan: Plan, driven: Scene, margin_mm: float
    ):
        """Raises InputError for a file that is no error chain."""
        path = None if driven.path is None else driven.path.points
        chain = chain_of(args.errors, args.seed, path, registered_content(services, plan.id), plan.case_id)
        self._named, on_robot = args.errors, args.mode != FREEHAND
        self._tally = TruthTally(chain, driven, margin_mm, on_robot)
        self._dropped = not on_robot and chain != chain.for_free_hand()

    def add(self, snapshot: Any) -> None:
        """Count one snapshot."""
        self._tally.add(snapshot)

    def report(self) -> dict[str, Any]:
        """Keys of the printed report; what the certificate does not cover is told on stderr, too."""
        found = self._tally.report()
        if self._named == NONE:
            found.pop("truth")
            return found
        if self._dropped:
            say_notes(["a free hand has no robot: encoders, servo and compliance of --errors do nothing"])
        below, inside = found["truth"]["steps_below_margin"], found["truth"]["steps_in_bone"]
        if below:
            say_notes([f"the true tool was nearer to bone than the margin at {below} steps, and in it at {inside}"])
        return found | ({"error_sources": dict(PAPERS)} if self._named == OF_PAPERS else {})


def registered_content(services: Services | None, plan_id: str | None) -> RegistrationContent | None:
    """The registration that a stored plan goes by; None where it goes by none that is here."""
    if services is None or all(one.id != plan_id for one in services.plans.titles()):
        return None
    document = services.registering.registration_of(services.plans.get(plan_id or "")).document
    return None if document is None else document.content
