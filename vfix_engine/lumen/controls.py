"""The controls of the distal links by name."""

from __future__ import annotations

from .drive_state import DriveSettings
from .parameterised import ParameterisedControl
from .qp_drive import QpControl
from .tip_control import TipControl


def make_control(settings: DriveSettings) -> TipControl:
    """The control of the distal links that the settings name."""
    if settings.control == "qp":
        return QpControl()
    return ParameterisedControl(settings.bends, settings.r_max)
