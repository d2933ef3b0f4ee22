"""The one error tree.

    VfixError
    ├── InputError              something that came from outside is wrong
    │   ├── FrameError          frame or unit missing, unknown or contradictory
    │   ├── ImageError          a CT volume cannot be used
    │   ├── MeshError           a surface cannot be used
    │   ├── PlanError           a plan cannot be used
    │   ├── RobotError          a robot or tool description cannot be used
    │   └── PathwayError        a lumen, centreline or constraint pathway cannot be used
    └── ControlError            the controller refuses
        └── StartRefused        the start pose violates a limit or the margin

A message says what was wrong, with the values, and what to do about it.
It never contains patient data.
"""


class VfixError(Exception):
    """Base of every error that vfix raises on purpose."""


class InputError(VfixError):
    """Something that came from outside is wrong."""


class FrameError(InputError):
    """Frame or unit is missing, unknown or contradictory.

    missing: what the file does not name and the user has to say: 'frame', 'unit', both or nothing.
    """

    def __init__(self, message: str, missing: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.missing = missing


class ImageError(InputError):
    """A CT volume cannot be used."""


class MeshError(InputError):
    """A surface cannot be used."""


class PlanError(InputError):
    """A plan cannot be used."""


class RobotError(InputError):
    """A robot or tool description cannot be used."""


class PathwayError(InputError):
    """A lumen, centreline or constraint pathway cannot be used."""


class ControlError(VfixError):
    """The controller refuses."""


class StartRefused(ControlError):
    """The start pose violates a limit or the margin."""
