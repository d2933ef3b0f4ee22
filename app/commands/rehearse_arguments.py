"""Arguments of `vfix rehearse`."""

from __future__ import annotations

import argparse
from pathlib import Path

from app.commands.counts import natural, positive
from app.commands.head_options import add_file_options
from app.commands.rehearse_errors import add_compensation, add_error_arguments
from app.commands.rehearse_freehand import check_options
from app.exchange.runs.export import WRITERS, check_target
from vfix_engine.errors import InputError
from vfix_engine.runtime.control_mode import DEVICES, MODES
from vfix_engine.worlds.rigid.presets import PRESETS

RECORDED = "recorded"  # the operator of --hand
OPERATORS = ("scripted", "person", "pushing", RECORDED)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add every argument."""
    parser.add_argument("--case", required=True, help="a case's id or name, or a surface or CT file")
    add_file_options(parser)
    parser.add_argument("--plan", required=True, help="a plan's id or name, or a .json, .mrk.json or .csv file")
    parser.add_argument(
        "--path", metavar="NAME", help="one of the plan's paths by name or id, instead of the chosen one"
    )
    parser.add_argument("--operator", choices=OPERATORS, default="scripted", help="whose hand it is")
    parser.add_argument("--hand", metavar="RUN", help="the run whose hand drives, with --operator recorded")
    parser.add_argument(
        "--mode", choices=MODES, default="hands-on", help="a free hand, a hand on the robot, or a device far from it"
    )
    parser.add_argument("--device", choices=DEVICES, help="teleoperated: a master that moves, or a rate device")
    parser.add_argument("--steady", action="store_true", help="freehand: no delay, no tremor, and eyes without error")
    parser.add_argument("--task", choices=("path", "inspect"), default="path", help="follow the path, or inspect")
    parser.add_argument("--targets", type=Path, help="a Markups file with targets, instead of the plan's own")
    parser.add_argument("--tool", help="a shipped tool's name or a tool file, instead of the plan's")
    parser.add_argument("--robot", help="a shipped robot's name, its configuration or a URDF, instead of the plan's")
    parser.add_argument("--tool-frame", metavar="LINK", help="link of the robot that holds the tool")
    parser.add_argument("--margin", type=float, help="safety margin in mm, instead of the plan's")
    parser.add_argument("--zones", type=Path, metavar="FILE", help="zones and envelopes, beside the plan's own")
    parser.add_argument(
        "--soft-tissue", action="store_true", help="skin and mucosa, as the CT shows them, yield up to a bound"
    )
    parser.add_argument(
        "--remote-centre",
        nargs="?",
        const="entry",
        metavar="PLACE",
        help="the tool passes a place of the path: mm from its start, or a point's label; by default its entry",
    )
    parser.add_argument("--preset", choices=tuple(PRESETS), help="a paper's printed parameters")
    parser.add_argument("--approach", type=float, metavar="MM", help="the path's point that is approached first")
    parser.add_argument("--tube", type=float, metavar="MM", help="the tip stays within this distance of the path")
    parser.add_argument("--speed-limit", action="store_true", help="the tip's speed and turn are limited")
    parser.add_argument("--view-distance", type=float, help="r in mm: how far ahead of the tip the view's point is")
    parser.add_argument("--steps", type=positive, help="steps of pushing, or of swinging in inspection")
    parser.add_argument("--free", action="store_true", help="pushing: no path fixture, k_tau = 1")
    parser.add_argument("--seed", type=natural, default=0, help="of the hand's and the errors' random numbers")
    add_error_arguments(parser)
    add_compensation(parser)
    parser.add_argument("--record", type=Path, metavar="FILE", help=f"export every step: {', '.join(WRITERS)}")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")


def check_arguments(args: argparse.Namespace) -> None:
    """Refuse arguments that do not go together. Raises InputError."""
    if args.operator == "person" and args.task != "path":
        raise InputError("--operator person goes with --task path")
    if args.free and (args.operator != "pushing" or args.task != "path"):
        raise InputError("--free goes with --operator pushing: the other jobs need the path")
    if args.preset is not None and (args.soft_tissue or args.speed_limit):
        raise InputError("--preset goes without --soft-tissue and --speed-limit, which the papers do not have")
    if args.preset is not None and (args.free or args.view_distance is not None):
        raise InputError("--preset goes without --free and --view-distance, which would change its parameters")
    if (args.operator == RECORDED) != (args.hand is not None):
        raise InputError("--operator recorded and --hand RUN go together")
    if args.hand is not None and args.task != "path":
        raise InputError("--operator recorded goes with --task path: its hand has no other targets")
    if args.record is not None:
        check_target(args.record)
    check_options(args)
