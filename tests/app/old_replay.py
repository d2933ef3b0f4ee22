"""Drives every run of a data folder again: `python old_replay.py HOME`, one JSON object by world on stdout.

In a process of its own, which finds its kernels compiled: one that compiles them runs other machine code, and the last
bits differ.
"""

import json
import sys
from pathlib import Path

from app.services import build_services
from app.settings import Settings
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.run import Run
from vfix_engine.worlds.registry import spec_of


def main() -> int:
    services, found = build_services(Settings(home=Path(sys.argv[1]), port=0)), {}
    for stored in services.runs.list():
        with services.runs.laid_out(stored.id) as folder:
            run = Run.read(folder)
        again = replay(run, spec_of(run), keep_states=False)
        wrong = (again.rows[:, : run.rows.shape[1]] != run.rows).any(axis=0)
        found[stored.world] = {
            "steps": len(run.ticks),
            "first_difference": again.first_difference,
            "largest_difference": again.largest_difference,
            "columns": [column.name for column, one in zip(run.columns, wrong, strict=True) if one],
            "other_arithmetic": sorted(again.other_arithmetic),
        }
    services.close()
    print(json.dumps(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
