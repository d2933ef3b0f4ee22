"""`vfix bench start`: from an installation that has compiled nothing to a later start."""

from __future__ import annotations

import argparse
import json
import os
import shutil
import tempfile
from pathlib import Path

import pytest

from app.cli import main
from benchmarks import start
from benchmarks.report import BenchmarkRefused
from vfix_engine.kernels.kernel_cache import cache_folder
from vfix_engine.worlds import registry as worlds


class Handed(tempfile.TemporaryDirectory[str]):
    """A folder of the benchmark: the kernels that were compiled in it are then this installation's.

    Compiling them is the longest piece of work of all tests, which is to be done once.
    """

    def cleanup(self) -> None:
        own = cache_folder()
        if own is not None and os.access(own, os.W_OK):
            found = Path(self.name).glob(f"cache/kernels/{own.name}/*")
            done = {world.preparation.done for world in worlds.WORLDS.values() if world.preparation}
            for file in sorted(found, key=lambda file: file.name in done):  # what says that all is there comes last
                part = own / f"{file.name}.{os.getpid()}"
                shutil.copyfile(file, part)
                part.replace(own / file.name)
        super().cleanup()


def test_a_first_start_keeps_what_a_later_one_needs(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "TemporaryDirectory", Handed)
    assert main(["bench", "start", "--starts", "1", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    first, later = told["first"], told["later"]
    assert told["correct"]
    numbers = worlds.RIGID.kernels, worlds.SNAKE.kernels  # which the bars count to
    assert (first["of_page"], first["of_snake"]) == pytest.approx(numbers, rel=0.02)
    assert max(numbers) < first["kernels"] < sum(numbers)
    assert 0 < first["address_s"] < first["answer_s"] < first["compiled_s"] < first["snake_compiled_s"]
    assert 0 < later["address_s"] <= later["slowest_address_s"] < first["compiled_s"]
    assert told["meets"]["first_within_30_s"] == (first["compiled_s"] <= start.FIRST_S)
    assert told["meets"]["first_within_60_s"] == (first["compiled_s"] <= start.FIRST_MOST_S)
    assert told["meets"]["later_within_2_s"] == (later["slowest_address_s"] <= start.LATER_S)


@pytest.mark.parametrize("starts", [0, 101])
def test_too_few_or_many_starts_are_refused(starts: int) -> None:
    with pytest.raises(BenchmarkRefused, match="--starts"):
        start.run(argparse.Namespace(starts=starts))
