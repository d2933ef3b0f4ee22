"""Input of the operator for one control period, common to all worlds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..errors import InputError

BUTTON_STRAIGHTEN = 1  # bit of ``Command.buttons``
BUTTON_CUT = 2  # the tool is on; moves nothing, and is recorded for tasks
NO_AXES = (0.0, 0.0, 0.0)
_MOST_BUTTONS = 2.0**53  # beyond it a float has no lowest bit


@dataclass(frozen=True, eq=False)
class Master:
    """Motion of the master device in teleoperation since the last step.

    increment: (3,) in mm, in the patient frame; for a master aligned with the robot's base, as in Li 2007,
        transform_base_to_patient[:3, :3] @ increment.
    clutch: True while the master is coupled to the tool.
    """

    increment: Array
    clutch: bool = True


@dataclass(frozen=True)
class Command:
    """Input of the operator for one step, attenuated by the dead man's switch; a world uses the fields that it needs.

    Args:
        force: (3,) in N at the grip, patient frame.
        drive: along the path or towards the target, from -1 to +1 of full force.
        twist: about the tool's shaft, from -1 to +1 of full force.
        master: if given, the step is teleoperated: its motion replaces force and drive.
        axes: camera x (right in the picture), camera y (down) and insertion (forwards), from -1 to +1 of full speed;
            of a rate device its turns about the patient's axes.
        buttons: bit mask of the buttons held down; ``BUTTON_STRAIGHTEN``, ``BUTTON_CUT``.
        rate: the step is teleoperated by a rate device: ``force`` is its deflection τ as a force, and nobody holds the
            grip.

    A system clips values that are out of range and replaces non-finite ones by 0.
    """

    force: Array
    drive: float = 0
    twist: float = 0
    master: Master | None = None
    axes: tuple[float, float, float] = NO_AXES
    buttons: int = 0
    rate: bool = False


POSITION, RATE = 1.0, 2.0  # column ``master`` of a teleoperated step, by its device; else 0


def no_command() -> Command:
    """Return the command of a step without operator input."""
    return Command(np.zeros(3))


COMMAND_COLUMNS = (
    ("force_x", "N"), ("force_y", "N"), ("force_z", "N"), ("drive", ""), ("twist", ""),
    ("master", ""), ("master_x", "mm"), ("master_y", "mm"), ("master_z", "mm"), ("clutch", ""),
    ("camera_x", ""), ("camera_y", ""), ("insert", ""), ("buttons", ""),
)  # fmt: skip
COMMAND_SIZE = len(COMMAND_COLUMNS)


def command_to_row(command: Command, out: Array) -> None:
    """Write a command into the first ``COMMAND_SIZE`` numbers of ``out``; ``command_from_row`` inverts it exactly."""
    out[:3] = command.force
    out[3], out[4] = command.drive, command.twist
    if command.master is None:
        out[5], out[6:10] = RATE if command.rate else 0.0, 0.0
    else:
        out[5], out[6:9], out[9] = POSITION, command.master.increment, command.master.clutch
    if command.axes is NO_AXES:
        out[10:13] = 0.0
    else:
        out[10:13] = command.axes
    out[13] = command.buttons


def command_from_row(row: Array) -> Command:
    """Return the command that ``command_to_row`` wrote. Raises InputError for buttons that are no bit mask."""
    if not (row[13] >= 0 and row[13] == np.floor(row[13]) and row[13] < _MOST_BUTTONS):
        raise InputError(f"a recorded command has the buttons {float(row[13])!r}, which are no bit mask")
    master = Master(np.array(row[6:9]), bool(row[9])) if row[5] == POSITION else None
    x, y, insert = (float(value) for value in row[10:13])
    rate = bool(row[5] == RATE)
    return Command(np.array(row[:3]), float(row[3]), float(row[4]), master, (x, y, insert), int(row[13]), rate)
