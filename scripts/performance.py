"""Measure every `vfix bench` on this machine, and write the table of docs/performance.md from the results.

    python scripts/performance.py measure [NAME ...]   those benchmarks, or all; stored in docs/performance/
    python scripts/performance.py                      the table from the stored results, without measuring

A stored result is the JSON of the benchmark with the day, the revision and the command. Measure on a quiet machine: the
table has the load beside each benchmark.
"""

from __future__ import annotations

import datetime
import json
import re
import shlex
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
PAGE, RESULTS = ROOT / "docs" / "performance.md", ROOT / "docs" / "performance"
NOT_MEASURED = "not measured"
BLOCK = re.compile(r"<!-- (measured|machine) -->\n.*?<!-- end -->", re.DOTALL)


@dataclass(frozen=True)
class Figure:
    """A row of the table: what it is, where the result has it, its unit, and the goal it is measured against.

    interval: where the result has its 95 % interval; empty if it has none.
    """

    what: str
    key: str
    unit: str = ""
    goal: str = ""
    scale: float = 1.0
    interval: str = ""


@dataclass(frozen=True)
class Measured:
    """A benchmark as it is published: its name in the table and in the store, its command, and its figures."""

    name: str
    command: str
    figures: tuple[Figure, ...]


BENCHMARKS = (
    Measured("step", "step", (
        Figure("Control step against Pinocchio, coal, qpsolvers", "ratio_vs_stack", "times", "≥ 100"),
        Figure("the same in a real head", "cases.head.ratio_vs_stack", "times", "≥ 100"),
        Figure("the same at the 99th percentile", "p99_ratio_vs_stack", "times"),
        Figure("Control step along the path, median", "median_us", "µs"),
        Figure("Whole tick over the step alone, worst of three drives", "whole_over_step", "times", "≤ 3"),
    )),
    Measured("proximity", "proximity", (
        Figure("Closest pair against coal's `distance`", "ratios.closest_vs_coal_distance", "times", "≥ 18"),
        Figure("All pairs within 3 mm against coal's faster tree", "ratios.all_pairs_vs_coal_obb_collide", "times"),
        Figure("the same along a drive", "ratios.coherent_vs_coal_obb_collide", "times"),
        Figure("Building the tree, ours over coal's", "ratios.build_vs_coal", "times"),
        Figure("Memory of the tree, ours over coal's", "ratios.memory_vs_coal", "times"),
    )),
    Measured("certify", "certify --steps 200000", (
        Figure("Violations of the certificate under attack", "violations", "", "0"),
        Figure("attacked steps", "steps"),
    )),
    Measured("lumen", "lumen --no-sweeps --controls", (
        Figure("Query of 14,800 vertices against the paper's loops, compiled", "ratios.vs_literal", "times", "≥ 9"),
        Figure("against numpy", "ratios.vs_numpy", "times", "≥ 150"),
        Figure("20 % of the vertices outside", "us.14800_mixed", "µs", "≤ 1,000"),
        Figure("500 vertices, one of 200 poses", "us.500", "µs", "≤ 30"),
    )),
    Measured("lumen_attack", "lumen --attack 60000", (
        Figure("Snake beyond its bound under attack", "violations", "", "0"),
        Figure("attacked steps", "steps"),
    )),
    Measured("realtime", "realtime --seconds 60", (
        Figure("Overruns of a driven control process", "overruns_share", "%", "≤ 1", 100.0),
    )),
    Measured("realtime_snake", "realtime --world snake --seconds 60", (
        Figure("Overruns of a driven snake", "overruns_share", "%", "≤ 1", 100.0),
    )),
    Measured("cockpit", "cockpit --pairs 10", (
        Figure(
            "Lateness with all views over none, 99th percentile", "ratios.lateness_p99", "times", "≤ 1.2",
            interval="ratio_95",
        ),
    )),
    Measured("cockpit_snake", "cockpit --world snake --watchers 20", (
        Figure("Step of a snake with views and 20 watchers, 99th percentile", "medians.all.step_us_p99", "µs"),
        Figure("the same over nobody watching", "ratios.step_p99", "times", interval="ratio_95"),
    )),
    Measured("start", "start", (
        Figure("First start to the page", "first.answer_s", "s"),
        Figure("to the last kernel", "first.compiled_s", "s", "≤ 60"),
        Figure("Later start to the page", "later.answer_s", "s", "≤ 2"),
    )),
    Measured("first-plan", "first-plan", (
        Figure("From the address to an exported plan", "total_s", "s", "≤ 90"),
    )),
    Measured("import", "import", (
        Figure("CT of 512 × 512 × 400 until bone can be clicked", "seconds", "s", "≤ 30"),
        Figure("memory at its peak", "peak_mib", "MiB", "≤ 3,072"),
    )),
    Measured("piercing", "piercing", (
        Figure("Suggested paths that pierce skin or a wall", "pierce", "", "0"),
        Figure("paths looked at", "ways"),
    )),
    Measured("registration", "registration", (
        Figure("Measured over expected error of beads", "fre_measured_over_expected", "times", "0.99 to 1.01"),
    )),
    Measured("study", "study", (
        Figure("Simulated trials of Li 2007 in one process", "ways.one process.trials_per_s", "/s"),
        Figure("in a pool of processes over one", "ratios.a pool of processes", "times"),
        Figure("on a local Dask cluster over one", "ratios.a local Dask cluster", "times"),
        Figure("100,000 trials", "core_hours_of_100000_trials", "core-hours"),
    )),
    Measured("durability", "durability", (
        Figure("Acknowledged edits lost after `kill -9`", "edits_lost", "", "0"),
        Figure("edits acknowledged", "edits_acknowledged"),
    )),
    Measured("page", "page", (
        Figure("Publishes of the page while a point is dragged", "drags.0.publishes_per_s", "/s"),
        Figure("on a page six times slower", "drags.1.publishes_per_s", "/s"),
        Figure("the longest task there", "drags.1.longest_task_ms", "ms"),
    )),
)  # fmt: skip


def measure(names: Sequence[str]) -> int:
    """Run benchmarks one after another and store what they print; return the first status that is not 0."""
    known = {one.name: one for one in BENCHMARKS}
    if unknown := [name for name in names if name not in known]:
        print(f"no benchmark is called {', '.join(unknown)}; there are {', '.join(known)}", file=sys.stderr)
        return 2
    RESULTS.mkdir(exist_ok=True)
    status = 0
    for one in (known[name] for name in names or known):
        print(f"vfix bench {one.command}", file=sys.stderr, flush=True)
        command = [sys.executable, "-m", "app.cli", "bench", *shlex.split(one.command), "--json"]
        done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False)
        status = status or done.returncode
        if done.returncode:
            print(f"{one.name} failed; its stored result stays as it was", file=sys.stderr)
            continue
        stored = {"day": datetime.date.today().isoformat(), "revision": _revision(), "command": one.command}
        text = json.dumps(stored | {"result": json.loads(done.stdout)}, indent=1, ensure_ascii=False)
        (RESULTS / f"{one.name}.json").write_text(text + "\n", encoding="utf-8")
    return status


def written(page: str, results: Path = RESULTS) -> str:
    """The page with its table and its machine anew."""
    files = {one.name: results / f"{one.name}.json" for one in BENCHMARKS}
    stored = {name: json.loads(file.read_text(encoding="utf-8")) for name, file in files.items() if file.exists()}
    made = {"measured": table(stored), "machine": machines(stored)}
    return BLOCK.sub(lambda found: f"<!-- {found[1]} -->\n{made[found[1]]}\n<!-- end -->", page)


def table(stored: Mapping[str, Mapping[str, Any]]) -> str:
    """Each figure of each benchmark, with its goal, the day, and the load of the machine."""
    rows = ["| Figure | Measured | Goal | Command | Day, load |", "| --- | --- | --- | --- | --- |"]
    for one in BENCHMARKS:
        kept = stored.get(one.name)
        when = "" if kept is None else f"{kept['day']}, {kept['result']['machine']['load']:.1f}"
        command = one.command if kept is None else kept["command"]
        for index, figure in enumerate(one.figures):
            measured = NOT_MEASURED if kept is None else value(kept["result"], figure)
            ends = [f"`vfix bench {command}`", when] if index == 0 else ["", ""]
            rows.append("| " + " | ".join([figure.what, measured, figure.goal, *ends]) + " |")
    return "\n".join(rows)


def machines(stored: Mapping[str, Mapping[str, Any]]) -> str:
    """Processor, cores, system, versions, and the revisions measured. Raises ValueError for two machines."""
    fields = "cpu", "cores", "platform", "python", "numpy", "numba", "pinocchio", "coal", "qpsolvers", "daqp"
    found = {tuple(one["result"]["machine"][name] for name in fields) for one in stored.values()}
    if len(found) > 1:
        raise ValueError("the stored results are of several machines or versions; measure them all on one")
    (one,) = found
    cpu, cores, system, *versions = one
    libraries = ", ".join(f"{name} {version}" for name, version in zip(fields[3:], versions, strict=True))
    revisions = ", ".join(sorted({kept["revision"] for kept in stored.values()}))
    return f"{cpu}, {cores} cores; {system}; {libraries}. Revision {revisions}."


def value(result: Mapping[str, Any], figure: Figure) -> str:
    """A figure as text, with three digits, its unit and its interval."""
    number = _at(result, figure.key)
    if number is None:
        return NOT_MEASURED
    text = f"{_digits(figure.scale * float(number))} {figure.unit}".strip()
    if not figure.interval:
        return text
    low, high = (_digits(figure.scale * float(end)) for end in _at(result, figure.interval))
    return f"{text} (95 %: {low} to {high})"


def _at(result: Any, key: str) -> Any:
    """What the result has at a key with dots."""
    for part in key.split("."):
        result = result[int(part) if isinstance(result, list) else part]
    return result


def _digits(number: float) -> str:
    return f"{number:,.0f}" if number >= 100 or number == int(number) else f"{number:.3g}"


def _revision() -> str:
    words = ["git", "rev-parse", "--short=7", "HEAD"]
    return subprocess.run(words, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout.strip()


def main(arguments: Sequence[str]) -> int:
    if arguments and arguments[0] == "measure":
        return measure(arguments[1:])
    if arguments:
        print(__doc__)
        return 2
    PAGE.write_text(written(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
