"""A process of its own for the snake's kernels or for a replay: `python snake_replay.py [RUN]`, JSON on stdout.

A process that compiles a kernel runs other machine code than one that finds it kept: multiplications and additions may
be fused in other pairs, and the last bits of a depth differ. So the kernels are compiled by one process, and the
recorded process and the replay, which is told here, both load them.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from snake_runs import judged, wall_that_gives_way

from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.run import Run


def replayed(folder: Path) -> dict[str, object]:
    """What a replay of the run came to, and what another measure says of its states."""
    run = Run.read(folder)
    spec = wall_that_gives_way()
    again = replay(run, spec)
    different = (again.rows != run.rows).any(axis=0)
    found = judged(spec.build(), again.states[0], again.states[1:])
    return {
        "first_difference": again.first_difference,
        "columns": [column.name for column, one in zip(run.columns, different, strict=True) if one],
        "violations": found.violations,
        "disagreements": found.disagreements,
        "deepest_mm": found.deepest_mm,
    }


if __name__ == "__main__":
    if len(sys.argv) > 1:
        print(json.dumps(replayed(Path(sys.argv[1]))))
    else:
        wall_that_gives_way().build().prepare()
