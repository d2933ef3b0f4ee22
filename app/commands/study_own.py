"""`vfix study run`, `order`, `attach`, `collect`, `new` and `power`: a user's own study."""

from __future__ import annotations

import argparse
import csv
import io
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.commands.counts import positive
from app.commands.found_runs import FoundRun, find_run, optional_services
from app.commands.head_options import say_notes
from app.commands.study_template import TEMPLATE
from app.exchange.plan_files import write_export
from app.exchange.study_report import report_lines, write_report
from app.extras import need_app
from vfix_engine.errors import InputError
from vfix_engine.runtime.run import digest
from vfix_engine.study.farm import run_all
from vfix_engine.study.own.evaluation import evaluate
from vfix_engine.study.own.file import StudyFile, TrialName, conditions, is_simulated, labels, nearest, read_study
from vfix_engine.study.own.kinds import kind_of
from vfix_engine.study.own.order import Turn, order_of
from vfix_engine.study.own.questionnaire import AnsweredTlx
from vfix_engine.study.own.recorded import recorded_trial
from vfix_engine.study.own.results import StudyResults, TrialRecord, done_of
from vfix_engine.study.own.simulated import SimulatedTrials
from vfix_engine.study.statistics import least_subjects, power
from vfix_engine.worlds.registry import spec_of

if TYPE_CHECKING:
    from app.services import Services

NOTICE = "Not for clinical use."
Progress = Callable[[float], object]


def add_parsers(studies: argparse._SubParsersAction[argparse.ArgumentParser], workers: int) -> None:
    """Add the actions of a user's own study beside those of the papers."""
    new = studies.add_parser("new", help="write a file of a study to begin with")
    run = studies.add_parser("run", help="run the simulated trials of a study, and evaluate all that there are")
    order = studies.add_parser("order", help="who is next with which trial")
    attach = studies.add_parser("attach", help="make a recorded run the trial of a subject")
    for each in (new, run, order, attach):
        each.add_argument("file", metavar="STUDY", type=Path, help="a .toml file")
    for each in (run, order, attach):
        each.add_argument("--results", metavar="FOLDER", type=Path, help="of the results (else STUDY.results)")
    run.add_argument("--workers", type=positive, default=workers, help="processes (all cores)")
    run.add_argument("--scheduler", metavar="tcp://…", help="a Dask scheduler, whose workers run the trials instead")
    order.add_argument("--subject", metavar="CODE", help="of this subject only")
    order.add_argument("--csv", metavar="FILE", dest="table", type=Path, help="write the whole order to a file")
    attach.add_argument("run", metavar="RUN", help="id of a stored run, or folder of a recorded one")
    attach.add_argument("--subject", metavar="CODE", required=True, help="who drove it")
    attach.add_argument("--position", type=positive, help="which trial of the subject's order (else the next one)")
    collect = studies.add_parser("collect", help="bring what was led on the page into the results")
    collect.add_argument("file", metavar="STUDY", type=Path, help="the .toml file that was opened on the page")
    collect.add_argument("--results", metavar="FOLDER", type=Path, help="of the results (else STUDY.results)")
    collect.add_argument("--session", metavar="ID", help="of the stored study, where several are of this file")
    strength = studies.add_parser("power", help="power of a paired t test with a planned number of subjects")
    strength.add_argument("--subjects", type=positive, required=True, help="the planned number")
    strength.add_argument("--effect", type=float, required=True, help="d_z: mean difference over its SD")
    strength.add_argument("--comparisons", type=positive, default=1, help="corrected after Holm (default 1)")
    strength.add_argument("--level", type=float, default=0.05, help="of significance (default 0.05)")
    for each in (new, run, order, attach, collect, strength):
        each.add_argument("--json", action="store_true", help="one JSON object on stdout")


def new(args: argparse.Namespace, progress: Progress) -> int:
    """Write the template. Raises InputError where there is a file."""
    if args.file.exists():
        raise InputError(f"{args.file.name} exists already; choose another name")
    write_export(args.file, TEMPLATE)
    _say(args, {"file": str(args.file)}, [f"{args.file} written. {NOTICE}"])
    return 0


def run(args: argparse.Namespace, progress: Progress) -> int:
    """Run the simulated trials that are missing, and write tables, plots and report."""
    study, results = _opened(args)
    names = [turn.name for order in order_of(study).values() for turn in order]
    done = results.read(names)
    if study.subjects.simulated:
        kind_of(study).operator(study.operator)
        from app.commands.study_scenes import settings_of  # needs what the extra `app` brings

        trials = SimulatedTrials(study, settings_of(optional_services(), study, conditions(study)))
        done = done_of(study, done, trials.fingerprints)
        wanted = [name for name in names if is_simulated(name.subject) and name not in done]
        done |= _simulate(trials, wanted, results, args, progress)
    done = done_of(study, done)
    answers, reasons = _answers(study, results), results.read_reasons(names)
    told = evaluate(study, done, answers, reasons)
    files = write_report(results.folder, told, study, [done[name] for name in names if name in done], answers)
    _say(args, told | {"files": files}, [*report_lines(told), f"{results.folder}: {', '.join(files)}. {NOTICE}"])
    return 0


def _simulate(
    trials: SimulatedTrials,
    wanted: list[TrialName],
    results: StudyResults,
    args: argparse.Namespace,
    progress: Progress,
) -> dict[TrialName, TrialRecord]:
    """Run trials; each is written as it comes, so that what is done stays where the others are cancelled."""
    count = 0

    def keep(name: TrialName, record: TrialRecord) -> None:
        nonlocal count
        results.write(record)
        count += 1
        progress(count / len(wanted))

    try:
        return run_all(trials, wanted, min(args.workers, max(len(wanted), 1)), keep, args.scheduler)
    except KeyboardInterrupt:
        say_notes([f"{count} of {len(wanted)} trials are done and stay; the same command goes on from there"])
        raise


def order(args: argparse.Namespace, progress: Progress) -> int:
    """Print whose turn is next, of real people, and how far everybody is."""
    study, results = _opened(args)
    every = _of_people(study, args.subject)
    done = _done(study, results, every)
    names = labels(conditions(study))
    rows = [
        {"subject": code, "position": turn.position, "condition": names[turn.name.condition],
         "trial": turn.name.trial + 1, "done": turn.name in done}
        for code, turns in every.items() for turn in turns
    ]  # fmt: skip
    left = [row for row in rows if not row["done"]]
    following = {code: next((row for row in left if row["subject"] == code), None) for code in every}
    if args.table is not None:
        out = io.StringIO()
        writer = csv.DictWriter(out, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
        write_export(args.table, out.getvalue())
    _say(args, {"name": study.name, "next": following, "order": rows}, [
        *(f"{code}: {'complete' if row is None else _turn_words(row)}" for code, row in following.items()),
        f"{len(rows) - len(left)} of {len(rows)} trials of people are there. {NOTICE}",
    ])  # fmt: skip
    return 0


def attach(args: argparse.Namespace, progress: Progress) -> int:
    """Score a recorded run, and make it the trial of a subject. Raises InputError for a run of another condition."""
    study, results = _opened(args)
    turns = _of_people(study, args.subject)[args.subject]
    done = _done(study, results, _of_people(study, None))
    if args.position is None:
        turn = next((one for one in turns if one.name not in done), None)
        if turn is None:
            raise InputError(f"{args.subject} has done every trial; say --position to replace one")
    elif args.position > len(turns):
        raise InputError(f"{args.subject} has {len(turns)} trials, and none at position {args.position}")
    else:
        turn = turns[args.position - 1]
    services = optional_services()
    found = find_run(services, args.run)
    for name, record in done.items():
        if record.run == _known_as(found) and name != turn.name:
            raise InputError(f"the run {found.name!r:.80} is trial {name.trial + 1} of {name.subject} already")
    from app.commands.study_scenes import settings_of  # needs what the extra `app` brings

    expected = settings_of(services, study, [turn.name.condition])[turn.name.condition]
    record = _record_of(services, study, turn.name, found, expected)
    results.write(record)
    words = labels(conditions(study))[turn.name.condition]
    _say(args, {"subject": args.subject, "position": turn.position, "condition": words, "trial": turn.name.trial + 1,
                "run": record.run, "metrics": record.metrics},
         [f"{args.subject}: {words}, trial {turn.name.trial + 1} is the run {record.run}. {NOTICE}"])  # fmt: skip
    return 0


def collect(args: argparse.Namespace, progress: Progress) -> int:
    """Score the runs of a study that was led on the page, and bring them, answers and reasons into the results."""
    study, results = _opened(args)
    services = optional_services()
    if services is None:
        raise need_app("A stored study")
    document = services.studies.stored(study, args.session)
    notes = services.studies.collect(document.content, study, results, progress)
    say_notes(notes)
    every = _of_people(study, None)
    done, answers = _done(study, results, every), _answers(study, results)
    counts = {"study": document.id, "trials": len(done), "answers": len(answers), "not_collected": notes}
    _say(args, counts, [f"{len(done)} trials and {len(answers)} questionnaires of people are in the results. {NOTICE}"])
    return 0


def _answers(study: StudyFile, results: StudyResults) -> list[AnsweredTlx]:
    return results.read_answers(study.subjects.codes, conditions(study))


def _record_of(
    services: Services | None, study: StudyFile, name: TrialName, found: FoundRun, expected: Any
) -> TrialRecord:
    """The record of a run that was driven as a condition says. Raises InputError."""
    spec = spec_of(found.run)
    if wrong := kind_of(study).unlike(found.run, spec, name.condition, expected):
        raise InputError(f"the run {found.name!r:.80} is not of this trial: {'; '.join(wrong)}")
    case_id = None if found.stored is None else found.stored.case_id
    wall = None if services is None else services.lumen_routes.tasks.known_wall(case_id)
    if wall is None:  # of a run that is not stored; a head has none
        wall = getattr(expected, "mesh", None)
    return recorded_trial(study, name, found.run, spec, _known_as(found), wall)


def _known_as(found: FoundRun) -> str:
    """A run as the results know it: by its id, or by a hash, as the name of a folder may be that of a person."""
    return digest(found.run.ticks)[:16] if found.stored is None else found.stored.id


def strength(args: argparse.Namespace, progress: Progress) -> int:
    """Print the power, and how many subjects 80 and 90 % need."""
    level = args.level / args.comparisons  # of Holm's first step
    told = {
        "subjects": args.subjects,
        "effect": args.effect,
        "level": args.level,
        "comparisons": args.comparisons,
        "power": power(args.effect, args.subjects, level),
        "needed": {f"{wanted:.0%}": least_subjects(args.effect, wanted, level) for wanted in (0.8, 0.9)},
    }
    needed = ", ".join(f"{wanted} need {count}" for wanted, count in told["needed"].items())
    first = "" if args.comparisons == 1 else f", the first of {args.comparisons} comparisons after Holm"
    _say(args, told, [
        f"{args.subjects} subjects: a difference of {args.effect:g} of its SD is significant at {args.level:g} with "
        f"probability {told['power']:.3f}{first}.", f"{needed} subjects.",
    ])  # fmt: skip
    return 0


ACTIONS: Mapping[str, Callable[[argparse.Namespace, Progress], int]] = {
    "new": new, "run": run, "order": order, "attach": attach, "collect": collect, "power": strength,
}  # fmt: skip


def _opened(args: argparse.Namespace) -> tuple[StudyFile, StudyResults]:
    """The study, and the folder of its results. Raises InputError."""
    study = read_study(args.file)
    kind_of(study).check(study)
    return study, StudyResults(args.results or args.file.with_suffix(".results"))


def _of_people(study: StudyFile, code: str | None) -> dict[str, list[Turn]]:
    """The order of the real people, or of one of them. Raises InputError where there are none."""
    every = {one: turns for one, turns in order_of(study).items() if not is_simulated(one)}
    if not every:
        raise InputError("the study has no codes of people; give [subjects] codes")
    if code is not None and code not in every:
        raise InputError(f"the study has no subject {code!r:.40}{nearest(code, list(every))}")
    return every if code is None else {code: every[code]}


def _done(study: StudyFile, results: StudyResults, every: dict[str, list[Turn]]) -> dict[TrialName, TrialRecord]:
    return done_of(study, results.read(turn.name for turns in every.values() for turn in turns))


def _turn_words(row: Mapping[str, Any]) -> str:
    return f"next is {row['position']}, {row['condition']}, trial {row['trial']}"


def _say(args: argparse.Namespace, told: dict[str, Any], lines: list[str]) -> None:
    print(json.dumps(told | {"notice": NOTICE}, allow_nan=False) if args.json else "\n".join(lines))
