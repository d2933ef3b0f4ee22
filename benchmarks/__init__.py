"""Benchmarks of the engine against its peers, each in one run on one machine; `vfix bench` runs them.

A module of a benchmark offers `SUMMARY`, one line for people, `add_arguments(parser)` and `run(args) -> dict`:
plain values for JSON, with the keys `ratios` and `correct` where it has any, and the machine it ran on
(`report.machine`). What was not measured is None, never left out. A result that is not `correct` fails the run.
Nothing here is imported by the engine or by the planner; coal is part of the extra `test` only.
"""

BENCHMARKS: tuple[str, ...] = (
    "certify",
    "drag",
    "durability",
    "import",
    "lumen",
    "page",
    "piercing",
    "proximity",
    "realtime",
    "registration",
    "start",
    "step",
)
MODULES = {"import": "import_head"}  # of a benchmark whose module is not called as it is
