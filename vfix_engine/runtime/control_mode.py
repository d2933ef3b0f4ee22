"""Control modes: who leads the tool, and by which device; what a run's manifest says of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

from ..errors import InputError

ControlMode = Literal["freehand", "hands-on", "teleoperated"]
Device = Literal["position", "rate"]

FREEHAND: ControlMode = "freehand"
HANDS_ON: ControlMode = "hands-on"
TELEOPERATED: ControlMode = "teleoperated"
MODES: tuple[ControlMode, ...] = get_args(ControlMode)
DEVICES: tuple[Device, ...] = get_args(Device)
MIXED = "mixed"  # of a run whose mode or device was changed on the way

_OF_WORLD: dict[str, ControlMode] = {"rigid": HANDS_ON, "freehand": FREEHAND}


@dataclass(frozen=True)
class Control:
    """A control mode. device: of a teleoperated drive, a master's position or a rate device; else without effect.

    Raises:
        InputError: there is no such mode or device.
    """

    mode: ControlMode = HANDS_ON
    device: Device = "position"

    def __post_init__(self) -> None:
        if self.mode not in MODES:
            raise InputError(f"the control mode {self.mode!r:.40} is not one of {', '.join(MODES)}")
        if self.device not in DEVICES:
            raise InputError(f"the device {self.device!r:.40} is not one of {', '.join(DEVICES)}")

    def labels(self) -> dict[str, str | None]:
        """Mode and device as a manifest has them; the device is None where the mode has none."""
        return {"mode": self.mode, "device": self.device if self.mode == TELEOPERATED else None}


def first_labels(world: str) -> dict[str, str | None]:
    """The labels of a drive in a world that nobody has chosen a mode for."""
    return {"mode": _OF_WORLD.get(world), "device": None}


def first_control(world: str) -> Control:
    """The control of such a drive; of a world without modes the hand's."""
    return Control(_OF_WORLD.get(world, HANDS_ON))


def checked_control(world: str, control: Control) -> Control:
    """The control itself. Raises InputError where a world on a robot is driven in a free hand, or the other way."""
    own = _OF_WORLD.get(world)
    if own is not None and (own == FREEHAND) != (control.mode == FREEHAND):
        raise InputError(f"the world '{world}' is not driven {control.mode}")
    return control


def run_mode(manifest: Mapping[str, Any]) -> str | None:
    """Control mode of a run, or ``MIXED``; of a run before there were modes by its world, None where it has none.

    Raises:
        InputError: the manifest has another mode, or one that its world does not have.
    """
    world = str(manifest.get("world", ""))
    own = _OF_WORLD.get(world)
    mode = manifest.get("mode", own)
    if mode is None:
        return None
    if mode not in (*MODES, MIXED):
        raise InputError(f"the run's mode {mode!r:.40} is not one of {', '.join((*MODES, MIXED))}")
    if own is not None and (own == FREEHAND) != (mode == FREEHAND):
        raise InputError(f"the run's mode is {mode}, in which the world '{world}' is not driven")
    return str(mode)
