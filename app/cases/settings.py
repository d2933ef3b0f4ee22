"""The controller's settings of a plan in its case: the error of the case's surface is added to the margin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from vfix_engine.anatomy.surface_uncertainty import SurfaceUncertainty
from vfix_engine.control import ControlSettings


def settings_in_case(settings: Mapping[str, float], uncertainty: SurfaceUncertainty) -> ControlSettings:
    """The settings of a plan, with what the case's surface may be off; a larger error that the plan states stays.

    Raises InputError for settings that are unknown or out of range, and for a surface whose error is.
    """
    asked = ControlSettings.from_dict(dict(settings))
    return replace(asked, surface_error_mm=max(asked.surface_error_mm, uncertainty.added_mm))
