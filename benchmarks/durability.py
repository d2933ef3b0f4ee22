"""`vfix bench durability`: repeatedly kills a planner while it writes, and checks what is stored (HAZ-24)."""

from __future__ import annotations

import argparse
import gc
import hashlib
import json
import os
import random
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from app.extras import has_app, need_app
from app.plans.model import PlanContent, content_to_json
from app.settings import Settings
from benchmarks import report
from vfix_engine.geometry.mesh import TriangleMesh

if TYPE_CHECKING:
    from app.operations import Change
    from app.plans.service import PlanService
    from app.store import Store

SUMMARY = "kill -9 a planner that writes: edits acknowledged, edits lost, and the database's own check"
MAX_KILLS = 100_000
_MOST_POINTS = 40  # of the edited plan
_MOST_EDITS = 200  # of one writer; fewer than the capacity of a plan's history
_LONGEST_S = 0.05  # longest time from the start of a writer, or from one of its edits, until it is killed
# After how many edits a writer is killed, and at most which fraction of that time later: 0 is while it opens the store.
_MOMENTS = ((0, 0.1), (0, 1.0), (1, 1.0), (5, 1.0))
_ANY = ""  # a digest that matches every content


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options: the number of kills, and the seed."""
    parser.add_argument("--kills", type=int, default=100, metavar="N", help="writers that are killed (default 100)")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of the edits and of the moments of killing")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Return the figures of `--kills` kills in a separate home.

    Raises:
        BenchmarkRefused: the system has no SIGKILL and fork, or the number makes no sense.
        AppMissing: the store is not installed.
    """
    if not has_app():
        raise need_app("vfix bench durability")
    if not 1 <= args.kills <= MAX_KILLS:
        raise report.BenchmarkRefused(f"--kills {args.kills} is not between 1 and {MAX_KILLS:,}")
    if not hasattr(os, "fork"):
        raise report.BenchmarkRefused("this benchmark needs a system with kill -9, such as Linux or macOS")
    return campaign(args.kills, args.seed) | {"seed": args.seed, "machine": report.machine().to_dict()}


def campaign(kills: int, seed: int, early: bool = False) -> dict[str, Any]:
    """Run `_fight` in a separate process, which has one thread and can therefore be forked for each writer.

    early: writers acknowledge an edit before it is stored, which is an error that the campaign has to find.
    """
    with tempfile.TemporaryDirectory(prefix="vfix-durability-") as folder:
        command = [sys.executable, "-m", "benchmarks.durability", folder, str(kills), str(seed), str(int(early))]
        root = str(Path(__file__).resolve().parents[1])
        path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
        done = subprocess.run(command, env={**os.environ, "PYTHONPATH": path}, stdout=subprocess.PIPE, check=True)
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer


@dataclass
class _Tally:
    """The findings so far."""

    kills: int = 0
    kills_before_an_edit: int = 0
    edits_acknowledged: int = 0
    edits_lost: int = 0
    edits_stored_unacknowledged: int = 0
    failed_checks: list[str] = field(default_factory=list)


def _fight(settings: Settings, kills: int, seed: int, early: bool) -> dict[str, Any]:
    from app.cases.service import CaseFrame, CaseService
    from app.plans.service import PlanService

    chance = random.Random(seed)
    begin = time.perf_counter()
    with _opened(settings) as store:
        corners = np.array([[0.0, 0, 0], [9, 0, 0], [0, 9, 0], [0, 0, 9]])
        bone = TriangleMesh(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
        case = CaseService(store).create("Killed", frame=CaseFrame("LPS", assumed=False), surfaces={"bone": bone})
        plan = PlanService(store).create(case.id, "Killed").id
    gc.freeze()  # garbage collection in a writer would copy all memory shared with this process
    tally, stored = _Tally(), 0
    for _ in range(kills):
        acknowledged, status = _writer_that_is_killed(settings, plan, chance, early)
        if not os.WIFSIGNALED(status):
            tally.failed_checks.append("a writer could not go on with what it found")
        tally.kills += 1
        tally.kills_before_an_edit += not acknowledged
        tally.edits_acknowledged += len(acknowledged)
        stored = _look(settings, plan, acknowledged, stored, tally)
    with _opened(settings) as store:  # the planner goes on with it
        PlanService(store).get(plan)
    return {
        **vars(tally),
        "failed_checks": tally.failed_checks[:10],
        "correct": tally.edits_acknowledged > 0 and not tally.edits_lost and not tally.failed_checks,
        "seconds": time.perf_counter() - begin,
    }


def _look(settings: Settings, plan: str, acknowledged: dict[int, str], before: int, tally: _Tally) -> int:
    """Check the closed database; return the number of the newest state.

    acknowledged: digests of the contents by the number of the state that an edit made. before: number of the newest
    state before the writer started.
    """
    with closing(sqlite3.connect(settings.database_path)) as database:  # repairs what the kill left
        for check, good in (("integrity_check", [("ok",)]), ("foreign_key_check", [])):
            found = database.execute(f"pragma {check}").fetchall()
            if found != good:
                tally.failed_checks.append(f"{check}: {found[0][0]}")
        query = "select position, content from document_states where document_id = ?"
        rows = database.execute(query, (plan,)).fetchall()
        (cursor,) = database.execute("select cursor from documents where id = ?", (plan,)).fetchone()
    states = {position: _digest(json.loads(document)) for position, document in rows}
    tally.edits_lost += sum(
        number > cursor or number not in states or digest not in (_ANY, states[number])
        for number, digest in acknowledged.items()
    )
    newest = max(acknowledged, default=before)
    tally.edits_stored_unacknowledged += max(cursor - newest, 0)
    if cursor - newest > 1:
        tally.failed_checks.append(f"{cursor - newest} edits of one writer were stored and not acknowledged")
    return int(cursor)


def _writer_that_is_killed(
    settings: Settings, plan: str, chance: random.Random, early: bool
) -> tuple[dict[int, str], int]:
    """Start a writer and kill it at a random time, also while it opens the store.

    Returns the edits that it acknowledged and its exit status.
    """
    ours, theirs = os.pipe()
    after, share = chance.choice(_MOMENTS)
    seed, patience = chance.random(), share * _LONGEST_S * chance.random()
    writer = os.fork()
    if writer == 0:
        os.close(ours)
        _write(settings, plan, random.Random(seed), theirs, early)
    os.close(theirs)
    with os.fdopen(ours, "rb") as pipe:
        told = b"".join(pipe.readline() for _ in range(after))
        time.sleep(patience)
        os.kill(writer, signal.SIGKILL)
        told += pipe.read()
    status = os.waitpid(writer, 0)[1]
    whole = told[: told.rfind(b"\n") + 1]  # of the last one a part may be there
    lines = [line.partition(" ") for line in whole.decode().splitlines()]
    return {int(number): digest for number, _, digest in lines}, status


def _write(settings: Settings, plan: str, chance: random.Random, pipe: int, early: bool) -> NoReturn:
    """Edit a plan, and report after each edit which state it made."""
    from app.plans.service import PlanService
    from app.store import Store

    try:
        plans = PlanService(Store(settings))
        with closing(sqlite3.connect(settings.database_path)) as database:
            (number,) = database.execute("select cursor from documents where id = ?", (plan,)).fetchone()
        for _ in range(_MOST_EDITS):
            number += 1
            if early:
                os.write(pipe, f"{number} {_ANY}\n".encode())
            content = _edited(plans, plan, chance)
            if not early:
                os.write(pipe, f"{number} {_digest(_state(content))}\n".encode())
        time.sleep(60.0)  # until it is killed
    finally:
        os._exit(1)


def _edited(plans: PlanService, plan: str, chance: random.Random) -> PlanContent:
    """Make one random edit and return the plan's content after it."""
    from app.plans.operations.points import AddPoint, DeletePoint, MovePoint, RenamePoint

    place = (chance.uniform(-99, 99), chance.uniform(-99, 99), chance.uniform(-99, 99))
    points = [point.id for point in plans.get(plan).content.points]
    kinds: list[Change] = [AddPoint(position=place)]
    if points:
        one = chance.choice(points)
        change = [MovePoint(point_id=one, position=place), RenamePoint(point_id=one, label=f"{place[0]:.3f}")]
        kinds = [*change, DeletePoint(point_id=one)] if len(points) > _MOST_POINTS else [*kinds, *change]
    return plans.do(plan, chance.choice(kinds)).content


def _state(content: PlanContent) -> dict[str, Any]:
    """Return the content of a state of the history: everything except the settings."""
    return {name: value for name, value in content_to_json(content).items() if name != "settings"}


def _digest(document: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()


@contextmanager
def _opened(settings: Settings) -> Iterator[Store]:
    from app.store import Store

    store = Store(settings)
    try:
        yield store
    finally:
        store.close()


if __name__ == "__main__":
    home, times, start, unsafe = sys.argv[1:]
    print(json.dumps(_fight(Settings(home=Path(home) / "home"), int(times), int(start), unsafe == "1")))
