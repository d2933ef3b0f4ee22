"""`vfix study`: a paper's experiment with simulated people, or a user's own study. Not for clinical use."""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from app.commands import study_own
from app.commands.counts import natural, positive
from app.exchange.plan_files import write_export
from app.exchange.runs.export import check_folder
from vfix_engine.study.experiment import beyond, kwok2013_1, kwok2013_2, li2004, li2007
from vfix_engine.study.experiment.arms import QUICK_SUBJECTS
from vfix_engine.study.experiment.kwok_figures import SUBJECTS as KWOK_SUBJECTS
from vfix_engine.study.experiment.options import LABORATORIES, SUBJECTS, TRIALS, Options
from vfix_engine.study.experiment.papers_program import measured_times
from vfix_engine.study.kept_trials import KeptTrials

NOTICE = "Not for clinical use."
STUDIES: Mapping[str, Callable[[Options], dict[str, Any]]] = {
    "li2004": li2004.run,
    "li2007": li2007.run,
    "kwok2013-1": kwok2013_1.run,
    "kwok2013-2": kwok2013_2.run,
}
_TITLES = {"li2004": "Li & Taylor 2004, section V", "li2007": "Li, Ishii & Taylor 2007, section V"}
_KWOK = {
    "kwok2013-1": "Kwok 2013, section IV.C.1, study I: polyps in a colon",
    "kwok2013-2": "Kwok 2013, section IV.C.2, study II: lines in a cavity",
}


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    parser = subparsers.add_parser("study", help="run a paper's experiment, or one's own study", description=__doc__)
    studies = parser.add_subparsers(dest="study", metavar="STUDY", required=True)
    for name, title in _TITLES.items():
        one = studies.add_parser(name, help=title, description=f"The experiments of {title}.")
        one.add_argument("--quick", action="store_true", help="one set of trials for all laboratories, no sweeps")
        one.add_argument("--trials", type=positive, default=TRIALS, help=f"of each mode (default {TRIALS})")
        if name == "li2007":
            one.add_argument("--subjects", type=_several, default=SUBJECTS, help=f"default {SUBJECTS}; 2 at least")
            one.add_argument("--laboratories", type=positive, default=LABORATORIES, help="for the order's share")
            one.add_argument("--beyond", action="store_true", help="our own parameters and other anatomies instead")
            one.add_argument("--head", metavar="FOLDER", type=Path, help="of the real head's files, with --beyond")
        _add_common(one)
    for name, title in _KWOK.items():
        one = studies.add_parser(name, help=title, description=f"{title}, in three arms.")
        one.add_argument("--quick", action="store_true", help=f"the first {QUICK_SUBJECTS} subjects")
        one.add_argument("--subjects", type=_several, default=KWOK_SUBJECTS, help=f"default {KWOK_SUBJECTS}")
        one.add_argument("--scheduler", metavar="tcp://…", help="a Dask scheduler, whose workers run the trials")
        _add_common(one)
    study_own.add_parsers(studies, os.cpu_count() or 1)
    return parser


def _add_common(one: argparse.ArgumentParser) -> None:
    """Add the options that every paper's study has."""
    one.add_argument("--seed", type=natural, default=0, help="of people, trials and laboratory (default 0)")
    one.add_argument("--workers", type=positive, default=os.cpu_count() or 1, help="processes (all cores)")
    one.add_argument("-o", "--output", metavar="FILE", type=Path, help="write the report there as well")
    one.add_argument("--keep", metavar="FOLDER", type=Path, help="keep results there, and go on with those that are")
    one.add_argument("--json", action="store_true", help="one JSON object on stdout")


def run(args: argparse.Namespace) -> int:
    """Run a study and print its cells, or what is asked of a user's own. Raises VfixError."""
    if args.study in study_own.ACTIONS:
        return study_own.ACTIONS[args.study](args, _told(args.json))
    return _run_paper(args)


def _run_paper(args: argparse.Namespace) -> int:
    begin, cpu = time.monotonic(), os.times()
    if args.output is not None:
        check_folder(args.output)
    beyond_paper = getattr(args, "beyond", False)
    options = Options(
        seed=args.seed,
        quick=args.quick,
        subjects=getattr(args, "subjects", SUBJECTS),
        trials=getattr(args, "trials", TRIALS),
        laboratories=getattr(args, "laboratories", LABORATORIES),
        workers=args.workers,
        head=getattr(args, "head", None),
        scheduler=getattr(args, "scheduler", None),
        progress=_told(args.json),
        kept=None if args.keep is None else KeptTrials(args.keep, _asked(args)),
    )
    found = beyond.run(options) if beyond_paper else STUDIES[args.study](options)
    if args.study == "li2007" and not beyond_paper:  # beside the cells, which are the same for every run with a seed
        found["times"] = measured_times(args.seed)
    now = os.times()
    used = sum(now[:4]) - sum(cpu[:4])
    found |= {"cpu_s": round(used, 1), "wall_s": round(time.monotonic() - begin, 1), "notice": NOTICE}
    print(json.dumps(found, allow_nan=False)) if args.json else _print_for_people(found)
    if args.output is not None:
        write_export(args.output, json.dumps(found, allow_nan=False, indent=1) + "\n")
    return 0


def _asked(args: argparse.Namespace) -> dict[str, Any]:
    """What the results of a study depend on."""
    names = ("study", "seed", "quick", "subjects", "trials", "laboratories", "beyond", "head")
    return {name: str(getattr(args, name, "")) for name in names}


def _told(silent: bool) -> Callable[[float], object]:
    """Progress as a line on a terminal, which is renewed."""
    if silent or not sys.stderr.isatty():
        return bool
    begin = time.monotonic()

    def tell(share: float) -> None:
        left = (time.monotonic() - begin) * (1.0 - share) / max(share, 1e-9)
        print(
            f"\r{share:6.1%}, about {left:.0f} s left   ", end="" if share < 1.0 else "\n", file=sys.stderr, flush=True
        )

    return tell


def _print_for_people(found: Mapping[str, Any]) -> None:
    print(f"{'':36}{'paper':>18}{'ours':>20}  kind")
    for cell in found["cells"]:
        name = f"{cell['table']} {cell['row']}, {cell['column']}"
        print(f"{name:<36.60}{_with(cell['paper'], cell['paper_sd']):>18}{_with(cell['ours'], cell['sd_subjects']):>20}"
              f"  {cell['kind']}{': ' + cell['note'] if cell['note'] else ''}")  # fmt: skip
    for name, why in found.get("skipped", {}).items():
        print(f"{name} is left out: {why}")
    for name, share in found["order_share"].items():
        if isinstance(share, dict):
            low, high = share["ci95"]
            print(f"{name}: {share['count']} of {share['of']} laboratories, 95 % {low:.2f} to {high:.2f}")
    print(f"{found['cpu_s']:.0f} s of processor, {found['wall_s']:.0f} s. {NOTICE}")


def _with(value: float | None, spread: float | None) -> str:
    if value is None:
        return "not printed"
    return f"{value:.3f}" if spread is None else f"{value:.3f} ± {spread:.3f}"


def _several(text: str) -> int:
    """Subjects: two at least, of which pairs can be made."""
    count = positive(text)
    if count < 2:
        raise argparse.ArgumentTypeError("a comparison needs two subjects at least")
    return count
