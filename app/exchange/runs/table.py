"""A run as a table: one row a step, one column for everything that was recorded of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from app import __version__
from app.plans.model import FRAME, NOTICE
from vfix_engine.arrays import Array
from vfix_engine.runtime.command import COMMAND_SIZE
from vfix_engine.runtime.run import Run
from vfix_engine.runtime.system import Column
from vfix_engine.study.lumen.task_rows import task_told
from vfix_engine.worlds.registry import arm_of, codes_of, is_certified
from vfix_engine.worlds.rigid.scene_parts import tool_from

if TYPE_CHECKING:  # a folder is exported without a store
    from app.drives.live_comments import RunComment

CERTIFIED_COLUMN = "certified"  # 1 in every row of a run in which every motion was certified, else 0
NOTICE_COLUMN = "not_for_clinical_use"  # all ones, so that copies of the table have the notice
UNCERTIFIED = "driven without the certificate: {} does not stop the {}"


@dataclass(frozen=True, eq=False)
class RunTable:
    """columns: names and units; rows: (n, columns) float64."""

    columns: tuple[Column, ...]
    rows: Array

    @property
    def headings(self) -> list[str]:
        """Names with units, such as 'tip_x [mm]'."""
        return [f"{name} [{unit}]" if unit else name for name, unit in self.columns]


def table_of(run: Run) -> RunTable:
    """All steps of a run: the command, whose columns begin with `command_`, then the system's row.

    A rigid tool adds the radius of each part, `s0_r`; a head with a CT `sideways`; last the columns of the certificate
    and of the notice, which copies of the table keep.
    """
    command = [Column(f"command_{name}", unit) for name, unit in run.manifest["columns"][:COMMAND_SIZE]]
    columns, parts = [*command, *run.columns], [run.ticks]
    for part, radius in enumerate(radii_of(run)):
        columns.append(Column(f"s{part}_r", "mm"))
        parts.append(np.full((len(run.ticks), 1), radius))
    if run.sideways_mm is not None:
        columns.append(Column("sideways", "mm"))
        parts.append(run.sideways_mm[:, None])
    for name, value in ((CERTIFIED_COLUMN, float(is_certified(run.manifest))), (NOTICE_COLUMN, 1.0)):
        columns.append(Column(name, ""))
        parts.append(np.full((len(run.ticks), 1), value))
    return RunTable(tuple(columns), np.hstack(parts))


def radii_of(run: Run) -> Array:
    """Radii of the tool's parts in mm, from the tip on; none of a snake, or where the run does not hold its tool."""
    tool = run.manifest["spec"].get("tool")
    return np.array([]) if tool is None else np.asarray(tool_from(tool).radius)


def about(run: Run, run_id: str | None, comments: Sequence[RunComment] = ()) -> dict[str, Any]:
    """What an export says of itself. run_id, comments: of a stored run.

    The names of the numbers in a column are those of the run's world, under the column's name with an s. A run in a
    lumen has its arm, and its task with the polyps or labels, null without one.

    Raises InputError for a run of an unknown world, and for a task that is damaged.
    """
    manifest, arm = run.manifest, arm_of(run.manifest)
    certified = is_certified(manifest)
    uncertified = UNCERTIFIED.format(*(("bone", "tool") if arm is None else ("its bound", "robot")))
    of_lumen = {} if arm is None else {"arm": arm, "task": task_told(run)}
    return {
        "notice": NOTICE,
        "frame": FRAME,
        "schema": manifest["schema"],
        "run": run_id,
        "world": manifest["world"],
        "mode": run.mode,
        "device": manifest.get("device"),
        "preset": manifest.get("preset"),
        "certified": certified,
        "certificate": "every motion was certified" if certified else uncertified,
        "seed": manifest["seed"],
        "whole": run.whole,
        "lost": run.lost,
        "exported_by": f"vfix {__version__}",
        "recorded_by": manifest["versions"],
        **{f"{column}s": list(names) for column, names in codes_of(run).items()},
        **of_lumen,
        "comments": [vars(one) for one in comments],
    }
