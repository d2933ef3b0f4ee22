"""Benchmarks of the engine against its peers, each in one run on one machine; `vfix bench` runs them.

A module of a benchmark offers `SUMMARY`, one line for people, `add_arguments(parser)` and `run(args) -> dict`:
plain values for JSON, with the keys `ratios` and `correct` where it has any, and the machine it ran on
(`report.machine`). What was not measured is None, never left out. A result that is not `correct` fails the run.
Nothing here is imported by the engine or by the planner; coal is part of the extra `test` only.
"""

BENCHMARKS: tuple[str, ...] = (
    "certify",
    "cockpit",
    "drag",
    "durability",
    "first-plan",
    "import",
    "lumen",
    "page",
    "piercing",
    "proximity",
    "realtime",
    "registration",
    "start",
    "step",
    "study",
)
MODULES = {
    "first-plan": "first_plan",
    "import": "import_head",
}  # of benchmarks whose modules are not called as they are
