"""What is compiled ahead is what a step then needs: in a process of its own, since kernels stay compiled in one."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

SCRIPT = """
import numpy as np
from tests.engine.control.test_compile_ahead import signatures
from vfix_engine.control import ControlSettings, compile_ahead
from vfix_engine.control import Controller
from vfix_engine.robots import RobotModel, Tool

robot, tool = RobotModel.load("steady_hand"), Tool.load("bent_30")
base = np.eye(4)
base[:3, 3] = -tool.tip_in_flange
placed = robot.placed(base, tool)
compile_ahead.call_motion(placed, tool, ControlSettings())
compile_ahead.call_parts(placed, tool, ControlSettings())
compile_ahead.call_solver(placed, tool, ControlSettings())
compile_ahead.call_requests(placed, tool, ControlSettings())
before = signatures()
names = {"certify_motion", "measure_state", "measure", "prepare", "check_kkt", "solve_dual", "free_request"}
assert names <= set(before), before
controller = Controller(placed, tool, compile_ahead._OneTriangle(), ControlSettings())
controller.warm_up(controller.measure(np.zeros(len(robot.joints))))
twice = {name for name, count in before.items() if signatures()[name] > count}
assert not twice, twice
"""


def signatures() -> dict[str, int]:
    """How many types each kernel of a step is compiled or loaded for."""
    found = {}
    for name, module in list(sys.modules.items()):
        if name.startswith(
            ("vfix_engine.certificate", "vfix_engine.control", "vfix_engine.virtual_fixtures", "vfix_engine.robots")
        ):
            for word, kernel in vars(module).items():
                if hasattr(kernel, "py_func") and kernel.py_func.__module__ == name and kernel.signatures:
                    found[word] = len(kernel.signatures)
    return found


def test_a_step_needs_no_kernel_for_other_types_than_those_compiled_ahead(tmp_path: Path) -> None:
    """From an empty cache: a kernel that is read from there does not tell which others have been put into it."""
    root = str(Path(__file__).parents[3])
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    environment |= {"PYTHONPATH": root, "VFIX_CACHE": str(tmp_path), "NUMBA_OPT": "0"}  # only the types matter
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], env=environment, cwd=root, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
