"""`vfix lumen task kwok2`: study II of Kwok 2013, six lines that are traced in a cavity from a fixed base."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from time import perf_counter
from typing import Any

from app.commands.run_recording import RunRecording
from vfix_engine.anatomy.lumen.wall import Wall
from vfix_engine.pathway.fit import containment
from vfix_engine.study.diathermy.bend_map import BendMap
from vfix_engine.study.diathermy.placing import LABELS, PlacedLabels, placed_labels
from vfix_engine.study.diathermy.trial import STEP_S, LabelOperator, trial
from vfix_engine.study.endoscopy.cavity_picture import LabelEye
from vfix_engine.study.endoscopy.own_hand import KNOWS, SCRIPTED, HandMaker, OwnLabelOperator, hand_named
from vfix_engine.worlds.snake.cavity import BOUND_MM, LINKS, TIP_BOUND_MM, CavityCase, cavity_case

_STEERS = "the labels and the bends that trace them; it pulls the camera in its picture"
_KNOWS = {
    "manual": "the labels and the joints' angles; it turns one universal joint at a time",
    "guided": _STEERS,
    "certified": _STEERS,
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that only this task has."""
    parser.add_argument(
        "--labels", type=int, choices=range(1, LABELS + 1), default=LABELS, metavar="N", help="the first N of six"
    )


def run(args: argparse.Namespace, say: Callable[[str], None]) -> dict[str, Any]:
    """Do the task; see docs/lumen_cavity.md for the keys."""
    began = perf_counter()
    hand = None if args.operator == SCRIPTED else hand_named(args.operator)  # before what takes long
    case = cavity_case()
    bends = BendMap(case.script().build())
    say(f"drawing {args.labels} labels whose lines can be traced")
    placed = placed_labels(case, bends, args.seed, args.labels)
    ready = perf_counter()
    outside = containment(case.mesh, case.pathway)
    own = None if hand is None else _own(args, hand, case, placed)
    recording = RunRecording(args.seed)
    try:
        found = trial(case, bends, placed, args.arm, recording.begin, say, own)
    except BaseException:
        recording.drop()
        raise
    places = [{"place": label.place, "centre_mm": label.centre.tolist()} for label in placed.labels]
    rows = [place | row for place, row in zip(places, found.to_dict()["labels"], strict=True)]
    return {
        "completed": found.task.done, "operator": "oracle" if own is None else args.operator,
        "operator_knows": _KNOWS[args.arm] if own is None else KNOWS,
        "arm": args.arm, "seed": args.seed,
        **found.to_dict(), "labels": rows, "placing": placed.to_dict(),
        "untraceable": placed.untraceable, "bound_mm": BOUND_MM, "tip_bound_mm": TIP_BOUND_MM,
        "pathway_outside": {"share": outside.outside, "depth_mm": list(outside.depth_mm)},
        "run": recording.keep(),
        "seconds": {"labels": ready - began, "drive": perf_counter() - ready},
    }  # fmt: skip


def _own(args: argparse.Namespace, hand: HandMaker, case: CavityCase, placed: PlacedLabels) -> LabelOperator:
    """The hand of an installed package."""
    eye = LabelEye(placed.labels, Wall(case.mesh))
    return OwnLabelOperator(args.operator, hand, eye, args.arm, LINKS, STEP_S, args.seed)
