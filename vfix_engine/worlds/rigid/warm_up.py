"""A few steps that lead nowhere: their kernels are loaded before the first tick needs them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...runtime.command import Command

if TYPE_CHECKING:
    from .rigid import RigidSystem


def warm_up(system: RigidSystem) -> None:
    """Every mode that the scene has, with the row and the snapshot of a step."""
    scene, row = system.scene, np.zeros(len(system.row_layout))
    modes = ["free"] + ["path"] * (scene.path is not None) + ["inspect"] * bool(len(scene.targets))
    for mode in modes:
        state = system.start(mode)
        for force in (np.zeros(3), np.ones(3), -np.ones(3)):
            state = system.step(state, Command(force, drive=1))
        system.row(state, row)
        system.snapshot(state)
        system.controller.warm_up(state.tool)
