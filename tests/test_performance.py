"""The table of docs/performance.md is that of the stored results, whose commands and figures the benchmarks have."""

import argparse
import copy
import json
from pathlib import Path

import pytest

from app.commands import bench
from scripts import performance

STORED = {file.stem: json.loads(file.read_text(encoding="utf-8")) for file in performance.RESULTS.glob("*.json")}


def test_the_table_is_that_of_the_stored_results() -> None:
    page = performance.PAGE.read_text(encoding="utf-8")
    assert performance.written(page) == page


def test_a_stored_result_is_of_the_published_command_and_was_correct() -> None:
    commands = {one.name: one.command for one in performance.BENCHMARKS}
    for name, kept in STORED.items():
        assert kept["command"] == commands[name], name
        assert kept["result"].get("correct", True) is True, name


def test_every_command_is_one_of_vfix_bench() -> None:
    parser = argparse.ArgumentParser()
    bench.add_parser(parser.add_subparsers())
    for one in performance.BENCHMARKS:
        words = one.command.split()
        assert parser.parse_args(["bench", *words]).benchmark == words[0]


def test_a_changed_result_changes_the_table(tmp_path: Path) -> None:
    page = performance.PAGE.read_text(encoding="utf-8")
    for name, kept in STORED.items():
        changed = copy.deepcopy(kept)
        if name == "step":
            changed["result"]["ratio_vs_stack"] *= 2.0
        (tmp_path / f"{name}.json").write_text(json.dumps(changed), encoding="utf-8")
    assert performance.written(page, tmp_path) != page


def test_results_of_two_machines_are_not_put_in_one_table() -> None:
    two = {name: copy.deepcopy(STORED["step"]) for name in ("step", "proximity")}
    two["proximity"]["result"]["machine"]["cpu"] = "another"
    with pytest.raises(ValueError, match="several machines"):
        performance.machines(two)


def test_a_ratio_has_its_interval_and_a_missing_figure_is_said_to_be_missing() -> None:
    ratio = performance.Figure("", "a.0", "times", interval="within")
    assert performance.value({"a": [1.25], "within": [0.5, 140.0]}, ratio) == "1.25 times (95 %: 0.5 to 140)"
    assert performance.value({"a": [None], "within": None}, ratio) == performance.NOT_MEASURED
