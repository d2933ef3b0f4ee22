"""The row of a pose that the endoscope's picture follows: of a robot's tool and of a free hand's alike."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from app.tabs.rehearse.routes import COLUMNS
from tests.engine.scenes import straight_scene, wall
from vfix_engine.control import ControlSettings
from vfix_engine.worlds.freehand.system import FreehandSystem
from vfix_engine.worlds.rigid.system import RigidSystem


@pytest.mark.parametrize(("world", "unknown"), [(RigidSystem, set()), (FreehandSystem, {"margin_mm"})])
def test_a_row_has_all_but_what_its_world_does_not_know(world: Any, unknown: set[str]) -> None:
    system = world(straight_scene(wall(4.0)), ControlSettings())
    snapshot = system.snapshot(system.start())
    row = dict(zip(COLUMNS.names(snapshot), COLUMNS.row(snapshot), strict=True))
    assert {name for name, value in row.items() if np.isnan(value)} == unknown | {"target_error_mm"}
    assert [row[f"tip_{axis}"] for axis in "xyz"] == snapshot.tip.tolist()
