"""What can be done to a registration's calibrations; tables of poses have routes of their own."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from app.operations.fields import Name
from app.operations.operation import Change, Option, Verb
from app.registration.calibration import (
    LONGEST_PIVOT_S,
    PIVOT_S,
    SHORTEST_PIVOT_S,
    simulated_pointer,
    simulated_robot,
    with_pointer,
    with_robot,
)
from app.registration.document import RegistrationContent, StoredRegistration
from app.registration.operation_base import Noise, RegistrationEdit, Registrations, Seed
from app.registration.simulated_touch import DEFAULT_NOISE_MM


class TrackPointer(Change, frozen=True):
    """Find the tip of the tracked pointer of `vfix serve --tracker`, which is swung about it for some `seconds`."""

    rest = "POST /registrations/{id}/pointer/track"
    seconds: Annotated[float, Meta(ge=SHORTEST_PIVOT_S, le=LONGEST_PIVOT_S)] = PIVOT_S

    def run(self, context: Registrations, document_id: str) -> StoredRegistration:
        act = context.service.calibrating.track_pointer
        return act(document_id, self.seconds, expected_revision=context.expected)


class _Simulation(RegistrationEdit, frozen=True):
    noise_mm: Noise = DEFAULT_NOISE_MM
    seed: Seed | None = None


class SimulatePointer(_Simulation, frozen=True):
    """Find the tip of a simulated pointer, for practice.

    `noise_mm`: rms length of the error of each tracked point; `seed`: null for a new one.
    """

    rest = "POST /registrations/{id}/pointer/simulate"

    def changed(self, content: RegistrationContent, context: Registrations) -> RegistrationContent:
        return with_pointer(content, simulated_pointer(self.noise_mm, self.seed))


class ClearPointer(RegistrationEdit, frozen=True):
    """Forget the pointer's tip: the tracker tells where the tip is."""

    rest = "DELETE /registrations/{id}/pointer"

    def changed(self, content: RegistrationContent, context: Registrations) -> RegistrationContent:
        return with_pointer(content, None)


class SimulateRobot(_Simulation, frozen=True):
    """Find where a simulated tracker stands beside a simulated robot, for practice; fields as of the pointer."""

    rest = "POST /registrations/{id}/robot/simulate"

    def changed(self, content: RegistrationContent, context: Registrations) -> RegistrationContent:
        return with_robot(content, simulated_robot(context.case_id, self.noise_mm, self.seed))


class ClearRobot(RegistrationEdit, frozen=True):
    """Forget where the tracker stands beside the robot."""

    rest = "DELETE /registrations/{id}/robot"

    def changed(self, content: RegistrationContent, context: Registrations) -> RegistrationContent:
        return with_robot(content, None)


class MakeToBase(Change, frozen=True):
    """Make a new registration to the robot's base: this one's points, taken through its robot's calibration.

    Without a `name` it has that of this one.
    """

    rest = "POST /registrations/{id}/to-base"
    status = 201
    verb = (
        Verb(
            "register base",
            "make a registration to the robot's base from one to the patient",
            options=(Option("--name", "name", "", "of the new registration; else that of the other one"),),
            of_case=True,
        ),
    )
    name: Name | None = None

    def run(self, context: Registrations, document_id: str) -> StoredRegistration:
        return context.service.calibrating.to_base(document_id, self.name, expected_revision=context.expected)


CALIBRATIONS = (TrackPointer, SimulatePointer, ClearPointer, SimulateRobot, ClearRobot, MakeToBase)
