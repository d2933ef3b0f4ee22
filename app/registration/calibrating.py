"""Calibrations of a registration: its pointer and the robot beside its tracker, each kept as one edit."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from app.documents.documents import Documents
from app.kit.names import MAX_NAME
from app.registration.calibration import PIVOT_S, pointer_of, robot_of, taken_to_base, with_pointer, with_robot
from app.registration.document import RegistrationContent, StoredRegistration
from app.registration.edits import edit
from app.registration.pose_tables import paired, read_poses
from vfix_engine.errors import InputError

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
        return edit(
            self._documents, registration_id, partial(with_pointer, pointer=tip), expected_revision=expected_revision
        )

    def track_pointer(
        self, registration_id: str, seconds: float = PIVOT_S, *, expected_revision: int | None = None
    ) -> StoredRegistration:
        """Find the tip of the tracked pointer, which is swung about it over the next seconds.

        Raises LinkFault where the pointer is not tracked meanwhile.
        """
        if self._tracker is None:
            raise InputError(NO_TRACKER)
        self._check_open(registration_id)
        tip = pointer_of(self._tracker.poses(seconds), "tracker")
        return edit(
            self._documents, registration_id, partial(with_pointer, pointer=tip), expected_revision=expected_revision
        )

    def read_robot(
        self, registration_id: str, robot: bytes, tracker: bytes, *, expected_revision: int | None = None
    ) -> StoredRegistration:
        """Find the tracker's place beside the robot from two tables: of the flange, and of the marker on it."""
        found = robot_of(*paired(read_poses(robot, "flange_to_base"), read_poses(tracker, "marker_to_tracker")), "file")
        return edit(
            self._documents, registration_id, partial(with_robot, robot=found), expected_revision=expected_revision
        )

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
