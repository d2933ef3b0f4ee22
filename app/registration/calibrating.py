"""Calibrations of a registration: its pointer and the robot beside its tracker, each kept as one edit."""

from __future__ import annotations

from typing import TYPE_CHECKING

from app.documents import Documents
from app.kit.names import MAX_NAME
from app.kit.values import number
from app.registration.calibration import (
    LONGEST_PIVOT_S,
    PIVOT_S,
    SHORTEST_PIVOT_S,
    pointer_of,
    registered_to,
    robot_of,
    simulated_pointer,
    simulated_robot,
    taken_to_base,
    with_pointer,
    with_robot,
)
from app.registration.calibration_records import PointerTip, RobotToTracker
from app.registration.document import RegistrationContent
from app.registration.editor import RegistrationEditor, StoredRegistration
from app.registration.pose_tables import paired, read_poses
from vfix_engine.errors import InputError
from vfix_engine.frames import RegisteredTo

if TYPE_CHECKING:
    from app.link import TrackerClient

NO_TRACKER = "the planner listens to no tracker; start it with `vfix serve --tracker HOST:PORT/NAME`."


class Calibrating:
    """Pointers and robots of registrations; may be used from any thread.

    Each method returns the registration after it; `expected_revision` is the revision the caller saw. All raise
    NotFound, and InputError where poses leave the result open or were used by points that were measured already.
    """

    def __init__(self, documents: Documents[RegistrationContent], tracker: TrackerClient | None = None) -> None:
        self._documents, self._tracker = documents, tracker

    def read_pointer(
        self, registration_id: str, data: bytes, *, expected_revision: int | None = None
    ) -> StoredRegistration:
        """Find the pointer's tip from a table of its poses while it was swung about the tip."""
        tip = pointer_of(read_poses(data, "pointer_to_tracker").poses, "file")
        return self.set_pointer(registration_id, tip, expected_revision=expected_revision)

    def track_pointer(
        self, registration_id: str, seconds: float = PIVOT_S, *, expected_revision: int | None = None
    ) -> StoredRegistration:
        """Find the tip of the tracked pointer, which is swung about it over the next seconds.

        Raises LinkFault where the pointer is not tracked meanwhile.
        """
        if self._tracker is None:
            raise InputError(NO_TRACKER)
        duration = number(seconds, "the time")
        if not SHORTEST_PIVOT_S <= duration <= LONGEST_PIVOT_S:
            raise InputError(f"the pointer is swung for {SHORTEST_PIVOT_S:g} to {LONGEST_PIVOT_S:g} seconds.")
        self._check_open(registration_id)
        tip = pointer_of(self._tracker.poses(duration), "tracker")
        return self.set_pointer(registration_id, tip, expected_revision=expected_revision)

    def simulate_pointer(
        self, registration_id: str, noise_mm: float, seed: int | None = None, *, expected_revision: int | None = None
    ) -> StoredRegistration:
        """Find the tip of a simulated pointer, for practice. noise_mm: rms length of the error of a point it has."""
        tip = simulated_pointer(noise_mm, seed)
        return self.set_pointer(registration_id, tip, expected_revision=expected_revision)

    def set_pointer(
        self, registration_id: str, pointer: PointerTip | None, *, expected_revision: int | None = None
    ) -> StoredRegistration:
        """Keep a pointer's tip; None forgets it."""
        editor = self._editor(registration_id)
        return editor.changed(lambda content: with_pointer(content, pointer), expected_revision=expected_revision)

    def read_robot(
        self, registration_id: str, robot: bytes, tracker: bytes, *, expected_revision: int | None = None
    ) -> StoredRegistration:
        """Find the tracker's place beside the robot from two tables: of the flange, and of the marker on it."""
        found = robot_of(*paired(read_poses(robot, "flange_to_base"), read_poses(tracker, "marker_to_tracker")), "file")
        return self.set_robot(registration_id, found, expected_revision=expected_revision)

    def simulate_robot(
        self, registration_id: str, noise_mm: float, seed: int | None = None, *, expected_revision: int | None = None
    ) -> StoredRegistration:
        """Find the simulated tracker's place beside the simulated robot, for practice; noise_mm as above."""
        found = simulated_robot(self._documents.get(registration_id).case_id, noise_mm, seed)
        return self.set_robot(registration_id, found, expected_revision=expected_revision)

    def set_robot(
        self, registration_id: str, robot: RobotToTracker | None, *, expected_revision: int | None = None
    ) -> StoredRegistration:
        """Keep a robot's calibration; None forgets it."""
        editor = self._editor(registration_id)
        return editor.changed(lambda content: with_robot(content, robot), expected_revision=expected_revision)

    def register_to(
        self, registration_id: str, to: RegisteredTo, *, expected_revision: int | None = None
    ) -> StoredRegistration:
        """Choose what a registration is to, while nothing was measured."""
        editor = self._editor(registration_id)
        return editor.changed(lambda content: registered_to(content, to), expected_revision=expected_revision)

    def to_base(
        self, registration_id: str, name: str | None = None, *, expected_revision: int | None = None
    ) -> StoredRegistration:
        """Make a new registration to the robot's base from one to the patient; the other one stays as it is."""
        document = self._documents.get(registration_id)
        if expected_revision is not None and document.revision != expected_revision:
            raise self._documents.kind.errors.conflict(
                f"the registration is at revision {document.revision}, not {expected_revision}: somebody changed it. "
                "Read it again."
            )
        self._documents.kind.check_editable(document, even_locked=True)
        chosen = name or f"{document.name[: MAX_NAME - 16]} (robot's base)"
        content = taken_to_base(document.content)
        return self._documents.create(document.case_id, chosen, content, numbered=name is None)

    def _check_open(self, registration_id: str) -> None:
        """Before somebody swings a pointer in vain."""
        document = self._documents.get(registration_id)
        self._documents.kind.check_editable(document)
        with_pointer(document.content, None)

    def _editor(self, registration_id: str) -> RegistrationEditor:
        return RegistrationEditor(registration_id, self._documents.editor(registration_id))
