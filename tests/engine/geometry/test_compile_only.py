"""A process that only compiles: other work, the same kernels."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any, cast

import numba
import numpy as np
import pytest
from numba.core.compiler import Flags, run_frontend
from numba.core.postproc import PostProcessor
from numba.core.targetconfig import TargetConfig

from vfix_engine.geometry import compile_only

ROOT = Path(__file__).resolve().parents[3]
# A kernel that calls two others, and one of those from Python afterwards.
CALLS = """
import json, sys
import numpy as np
from numba.core.errors import TypingError
from vfix_engine.fixtures.joint_limits import step_box
from vfix_engine.fixtures.stopping import stoppable_step
from vfix_engine.geometry.compile_only import compile_only
from vfix_engine.geometry.kernel_cache import cache_folder
def kept():
    return sorted(file.name.split("-")[0] for file in cache_folder().glob("*.nbi"))
if sys.argv[1] == "compile":
    assert compile_only()
for _ in range(2):
    try:
        stoppable_step("a word", 1.0)
    except TypingError:
        pass
    else:
        raise AssertionError("a word was taken for a number")
given = [np.linspace(low, high, 5) for low, high in ((-1, 1), (-2, 0.3), (-1.5, -1.1), (1.1, 1.5), (1, 9), (5, 40))]
bounds = np.empty((2, 5))
box = [step_box(*given, 1e-3, *bounds), bounds.tolist()]
first = kept()
step = [stoppable_step(room, 0.25) for room in (-1.0, 0.1, 7.0)]
hits = sum(sum(kernel.stats.cache_hits.values()) for kernel in (step_box, stoppable_step))
print(json.dumps({"box": box, "step": step, "first": first, "then": kept(), "hits": hits}))
"""

# One piece under three sets of options: only in the first are multiplication and addition one operation.
PIECES = """
from vfix_engine.geometry.compiled import borrowing, compiled, shared, vectorised
@shared
def piece(a, b):
    total = 0.0
    for i in range(len(a)):
        total = a[i] * b[i] - total * 1.0000001
    return total
@vectorised
def fused(a, b):
    return piece(a, b)
@compiled
def plain(a, b):
    return piece(a, b)
@borrowing
def borrowed(a, b):
    return piece(a, b)
@compiled
def fused_first(a, b):
    return fused(a, b), plain(a, b), borrowed(a, b)
@compiled
def fused_last(a, b):
    return borrowed(a, b), plain(a, b), fused(a, b)
"""
CALL_PIECES = """
import json, sys
import numpy as np
import pieces
from vfix_engine.geometry.compile_only import compile_only
if sys.argv[1] == "compile":
    assert compile_only()
given = np.random.default_rng(1).normal(size=(2, 257))
print(json.dumps({name: getattr(pieces, name)(*given) for name in sys.argv[2].split(",")}))
"""


def run_calls(process: str, cache: Path, script: str = CALLS, *arguments: str) -> dict[str, Any]:
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    environment |= {"VFIX_CACHE": str(cache), "PYTHONPATH": os.pathsep.join([str(ROOT), str(cache.parent)])}
    command = [sys.executable, "-c", script, process, *arguments]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    return cast(dict[str, Any], json.loads(done.stdout))


def test_what_it_keeps_is_what_any_process_would_compile(tmp_path: Path) -> None:
    made = run_calls("compile", tmp_path / "made")
    used = run_calls("use", tmp_path / "made")
    usual = run_calls("use", tmp_path / "usual")
    assert made["box"] == used["box"] == usual["box"]
    assert made["step"] == used["step"] == usual["step"]
    assert np.ptp(made["box"][1]) > 0.0
    # What is put into its callers only is not kept; where Python calls it, it is compiled as a whole.
    assert made["first"] == ["joint_limits.step_box"]
    assert made["then"] == ["joint_limits.step_box", "stopping.stoppable_step"]
    assert made["hits"] == usual["hits"] == 0
    assert used["hits"] == 2


def test_options_of_one_kernel_do_not_come_into_another(tmp_path: Path) -> None:
    """The types of a call are remembered for the options under which they were found."""
    (tmp_path / "pieces.py").write_text(PIECES)
    orders = ("fused_first,fused_last,plain", "plain,borrowed,fused,fused_last,fused_first")
    made = [run_calls("compile", tmp_path / f"made {i}", CALL_PIECES, order) for i, order in enumerate(orders)]
    used = run_calls("use", tmp_path / "made 0", CALL_PIECES, orders[0])
    fused, plain, borrowed = made[0]["fused_first"]
    assert fused != plain == borrowed == made[0]["plain"] == made[1]["plain"] == made[1]["borrowed"]
    assert made[0]["fused_last"] == [borrowed, plain, fused] == made[1]["fused_last"]
    assert made[1]["fused"] == fused
    assert made[0] == used
    a, b = np.random.default_rng(1).normal(size=(2, 257))
    total = 0.0
    for one, other in zip(a, b, strict=True):
        total = one * other - total * 1.0000001
    assert plain == total


def test_a_numba_that_was_not_tried_is_left_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba, "__version__", "7.0.0")
    equal = TargetConfig.__eq__
    assert not compile_only.compile_only()
    assert TargetConfig.__eq__ is equal


def test_the_numba_that_is_installed_was_tried() -> None:
    assert numba.__version__ in compile_only.TRIED


def test_options_are_the_same_or_not_as_numba_has_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def flags(**options: object) -> Flags:
        made = Flags()  # type: ignore[no-untyped-call]
        for name, value in options.items():
            setattr(made, name, value)
        return made

    some = [flags(), flags(nrt=True), flags(nrt=False), flags(fastmath={"nsz"}), flags(fastmath={"nsz", "contract"})]
    some += [flags(nrt=True, fastmath={"nsz"}), flags(error_model="numpy"), flags(error_model="python")]
    before = [one == other for one in some for other in some]
    monkeypatch.setattr(TargetConfig, "__eq__", TargetConfig.__eq__)  # both as they are again afterwards
    monkeypatch.setattr(TargetConfig, "__hash__", TargetConfig.__hash__)
    compile_only._compare_options_quickly()
    assert [one == other for one in some for other in some] == before
    assert any(before)
    assert not all(before)
    assert flags() != "flags"
    assert all(hash(one) == hash(other) for one in some for other in some if one == other)
    assert len({hash(one) for one in some}) > 2


def test_live_variables_are_found_when_somebody_asks(monkeypatch: pytest.MonkeyPatch) -> None:
    def function(count, step):  # type: ignore[no-untyped-def]
        total = 0.0
        for i in range(count):
            if i % 3:
                total += step
            else:
                step = step * 0.5
        return total, step

    def live_variables() -> list[set[str]]:
        code = cast(Any, run_frontend)(function)
        PostProcessor(code).run()  # type: ignore[no-untyped-call]
        return [set(code.get_block_entry_vars(block)) for block in code.blocks.values()]

    usual = live_variables()
    monkeypatch.setattr(PostProcessor, "run", PostProcessor.run)
    compile_only._find_live_variables_when_asked()
    assert live_variables() == usual
    assert any(len(names) > 3 for names in usual)
