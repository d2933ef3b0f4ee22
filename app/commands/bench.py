"""`vfix bench`: measure the engine on this machine, and compare it with peers."""

from __future__ import annotations

import argparse
import importlib
import json
import math
import sys
from collections.abc import Iterator, Mapping
from typing import Any, Protocol, cast

from benchmarks import BENCHMARKS, MODULES

_WIDTH = 34  # columns of a name
_COLUMN = 13  # columns of a figure in a table


class Benchmark(Protocol):
    """Interface of a benchmark's module."""

    SUMMARY: str

    def add_arguments(self, parser: argparse.ArgumentParser) -> None: ...

    def run(self, args: argparse.Namespace) -> dict[str, Any]: ...


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = subparsers.add_parser("bench", help="measure the engine on this machine", description=__doc__)
    benchmarks = parser.add_subparsers(dest="benchmark", metavar="BENCHMARK", required=True)
    for name in BENCHMARKS:
        module = _module(name)
        one = benchmarks.add_parser(name, help=module.SUMMARY, description=module.SUMMARY)
        module.add_arguments(one)
        one.add_argument("--json", action="store_true", help="one JSON object on stdout")
    return parser


def run(args: argparse.Namespace) -> int:
    """Exit status 0, or 1 where the benchmark found a wrong result of the engine."""
    result = {"benchmark": args.benchmark} | _module(args.benchmark).run(args)
    print(json.dumps(result, allow_nan=False) if args.json else "\n".join(table(result)))
    if result.get("correct") is False:
        print("vfix: the results are not correct; the figures mean nothing", file=sys.stderr)
        return 1
    return 0


def table(result: Mapping[str, Any], depth: int = 0) -> Iterator[str]:
    """The result as text: names and values, nested values indented, equal rows as tables."""
    margin = "  " * depth
    for name, value in result.items():
        words = str(name).replace("_", " ")
        if isinstance(value, Mapping) and value:
            yield f"{margin}{words}"
            yield from table(value, depth + 1)
        elif _is_rows(value):
            yield f"{margin}{words}"
            yield from _rows(value, depth + 1)
        else:
            yield f"{margin}{words:<{max(_WIDTH - len(margin), len(words) + 1)}}{figure(value)}"


def figure(value: Any) -> str:
    """A value as text: four digits of a number, 'not measured' for None."""
    if value is None:
        return "not measured"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:,.0f}" if abs(value) >= 1000 and math.isfinite(value) else f"{value:.4g}"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, (list, tuple)):
        return ", ".join(figure(item) for item in value) or "none"
    return "none" if value == {} else str(value)


def _is_rows(value: Any) -> bool:
    return isinstance(value, (list, tuple)) and bool(value) and all(isinstance(row, Mapping) for row in value)


def _rows(rows: list[dict[str, Any]], depth: int) -> Iterator[str]:
    margin, names = "  " * depth, list(rows[0])
    heads = [name.replace("_", " ") for name in names]
    widths = [
        max([_COLUMN, len(head), *(len(figure(row.get(name))) for row in rows)])
        for name, head in zip(names, heads, strict=True)
    ]
    yield margin + "  ".join(head.rjust(width) for head, width in zip(heads, widths, strict=True))
    for row in rows:
        cells = (figure(row.get(name)).rjust(width) for name, width in zip(names, widths, strict=True))
        yield margin + "  ".join(cells)


def _module(name: str) -> Benchmark:
    return cast(Benchmark, importlib.import_module(f"benchmarks.{MODULES.get(name, name)}"))
