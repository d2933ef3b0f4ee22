"""What can be done to a registration's calibrations; tables of poses have routes of their own."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from app.operations.fields import Name
from app.operations.operation import Change, Context
from app.registration.calibration import LONGEST_PIVOT_S, PIVOT_S, SHORTEST_PIVOT_S
from app.registration.document import RegistrationContent
from app.registration.editor import StoredRegistration
from app.registration.service import Registering
from app.registration.simulated_touch import DEFAULT_NOISE_MM

Registrations = Context[RegistrationContent, Registering]
Noise = Annotated[float, Meta(ge=-1e6, le=1e6)]  # what may be, the simulated pointer says
Seed = Annotated[int, Meta(ge=0, le=2**63 - 1)]


class TrackPointer(Change, frozen=True):
    """Find the tip of the tracked pointer of `vfix serve --tracker`, which is swung about it for some `seconds`."""

    rest = "POST /registrations/{id}/pointer/track"
    seconds: Annotated[float, Meta(ge=SHORTEST_PIVOT_S, le=LONGEST_PIVOT_S)] = PIVOT_S

    def run(self, context: Registrations, document_id: str) -> StoredRegistration:
        act = context.service.calibrating.track_pointer
        return act(document_id, self.seconds, expected_revision=context.expected)


class SimulatePointer(Change, frozen=True):
    """Find the tip of a simulated pointer, for practice.

    `noise_mm`: rms length of the error of each tracked point; `seed`: null for a new one.
    """

    rest = "POST /registrations/{id}/pointer/simulate"
    noise_mm: Noise = DEFAULT_NOISE_MM
    seed: Seed | None = None

    def run(self, context: Registrations, document_id: str) -> StoredRegistration:
        act = context.service.calibrating.simulate_pointer
        return act(document_id, self.noise_mm, self.seed, expected_revision=context.expected)


class ClearPointer(Change, frozen=True):
    """Forget the pointer's tip: the tracker tells where the tip is."""

    rest = "DELETE /registrations/{id}/pointer"

    def run(self, context: Registrations, document_id: str) -> StoredRegistration:
        return context.service.calibrating.set_pointer(document_id, None, expected_revision=context.expected)


class SimulateRobot(SimulatePointer, frozen=True):
    """Find where a simulated tracker stands beside a simulated robot, for practice; fields as of the pointer."""

    rest = "POST /registrations/{id}/robot/simulate"

    def run(self, context: Registrations, document_id: str) -> StoredRegistration:
        act = context.service.calibrating.simulate_robot
        return act(document_id, self.noise_mm, self.seed, expected_revision=context.expected)


class ClearRobot(Change, frozen=True):
    """Forget where the tracker stands beside the robot."""

    rest = "DELETE /registrations/{id}/robot"

    def run(self, context: Registrations, document_id: str) -> StoredRegistration:
        return context.service.calibrating.set_robot(document_id, None, expected_revision=context.expected)


class MakeToBase(Change, frozen=True):
    """Make a new registration to the robot's base: this one's points, taken through its robot's calibration.

    Without a `name` it has that of this one.
    """

    rest = "POST /registrations/{id}/to-base"
    status = 201
    name: Name | None = None

    def run(self, context: Registrations, document_id: str) -> StoredRegistration:
        return context.service.calibrating.to_base(document_id, self.name, expected_revision=context.expected)


CALIBRATIONS = (TrackPointer, SimulatePointer, ClearPointer, SimulateRobot, ClearRobot, MakeToBase)
