"""Migrations of earlier databases: nothing is lost, and a killed migration leaves the database unchanged."""

import json
import os
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from alembic import command
from alembic.config import Config
from plan_editor import PlanEditor
from sqlalchemy import create_engine

from app.kit.errors import PlanLocked
from app.plans.operations.document import LockPlan, RedoPlan, SetPlanSettings, UndoPlan
from app.plans.operations.points import AddPoint
from app.plans.service import PlanService
from app.settings import Settings
from app.store import Store, schema
from app.store.private import private_folder
from vfix_engine.errors import PlanError

ROOT = Path(__file__).resolve().parents[3]
HASH = "ab" * 32
SETTINGS = {"margin_mm": 0.1 + 0.2, "k_d": 0.3}


def state(count: int) -> dict[str, Any]:
    points = [{"id": f"p-{n}", "label": f"P{n}", "position": [n + 1 / 3, 0.0, -0.1]} for n in range(count)]
    return {
        "points": points,
        "targets": [{"id": "t", "label": "ostium", "position": [1.0, 2.0, 3.0]}],
        "tool": "straight",
        "robot": {"name": "steady_hand", "base": None, "q_start": None},
        "settings": SETTINGS,
    }


# By plan: locked, deleted, cursor, the texts of its states by position.
PLANS: dict[str, tuple[bool, str | None, int, dict[int, str]]] = {
    "plan-edited": (False, None, 1, {0: json.dumps(state(0)), 1: json.dumps(state(1)), 2: json.dumps(state(2))}),
    "plan-locked": (True, None, 7, {6: json.dumps(state(6)), 7: json.dumps(state(7))}),
    "plan-deleted": (False, "2026-01-03T00:00:00.000+00:00", 0, {0: json.dumps(state(3))}),
    "plan-no-json": (False, None, 1, {0: json.dumps(state(4)), 1: "no json"}),
    "plan-null": (False, None, 1, {0: json.dumps(state(4)), 1: "null"}),
    "plan-stateless": (False, None, 0, {}),
}


@pytest.fixture
def old(settings: Settings) -> Settings:
    """A home as the first version left it."""
    private_folder(settings.home)
    engine = create_engine(f"sqlite:///{settings.database_path}")
    config = Config()
    config.set_main_option("script_location", str(schema._MIGRATIONS))
    config.set_main_option("path_separator", "os")
    with engine.begin() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, "0001")
    engine.dispose()
    with closing(sqlite3.connect(settings.database_path)) as connection:
        head = ("case-1", "Head", "2026-01-01T00:00:00.000+00:00", None, HASH, _case())
        connection.execute("insert into cases values (?, ?, ?, ?, ?, ?)", head)
        for number, (plan, (locked, deleted, cursor, states)) in enumerate(PLANS.items()):
            made = (f"2026-01-02T00:00:0{number}.000+00:00", "2026-01-02T01:00:00.000+00:00")
            row = (plan, "case-1", HASH, f"<b>{plan}</b>", *made, deleted, locked, 40 + number, cursor)
            connection.execute("insert into plans values (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)", row)
            rows = [(plan, position, text) for position, text in states.items()]
            connection.executemany("insert into plan_states values (?, ?, ?)", rows)
        connection.commit()
    return settings


def _case() -> str:
    bounds = [[0, 0, 0], [1, 1, 1]]
    surface = {"name": "bone", "triangles": 4, "bounds_lps_mm": bounds, "source": f"sha256:{HASH}", "report": None}
    frame = {"name": "LPS", "assumed": False}
    return json.dumps({"frame": frame, "surfaces": [surface], "volumes": [], "beads": [], "notes": []})


def test_plans_become_documents_and_nothing_is_lost(old: Settings) -> None:
    store = Store(old)
    plans = PlanService(store)
    assert [plan.id for plan in plans.list(include_deleted=True)] == list(PLANS)
    for number, (name, (locked, deleted, _, _)) in enumerate(PLANS.items()):
        listed = next(plan for plan in plans.list(include_deleted=True) if plan.id == name)
        assert (listed.name, listed.locked, listed.deleted_at) == (f"<b>{name}</b>", locked, deleted)
        assert (listed.case_id, listed.case_hash, listed.revision) == ("case-1", HASH, 40 + number)
        assert listed.created == f"2026-01-02T00:00:0{number}.000+00:00"
        assert listed.modified == "2026-01-02T01:00:00.000+00:00"
        broken = name in ("plan-no-json", "plan-null", "plan-stateless")
        assert bool(listed.unreadable) == broken
        assert listed.content.settings == ({} if broken else SETTINGS)
    with closing(sqlite3.connect(old.database_path)) as connection:
        rows = connection.execute("select document_id, position, content from document_states").fetchall()
        tables = {row[0] for row in connection.execute("select name from sqlite_master where type = 'table'")}
        assert connection.execute("pragma foreign_key_check").fetchall() == []
    assert {(plan, at): text for plan, at, text in rows} == {
        (plan, at): text for plan, (*_, states) in PLANS.items() for at, text in states.items()
    }
    assert not tables & {"plans", "plan_states"}
    store.close()


def test_the_history_of_a_migrated_plan_goes_on(old: Settings) -> None:
    store = Store(old)
    plans = PlanService(store)
    editor = PlanEditor(plans, "plan-edited")
    assert editor.history() == (True, True)
    assert [point.position for point in editor.do(RedoPlan()).content.points] == [
        (1 / 3, 0.0, -0.1),
        (4 / 3, 0.0, -0.1),
    ]
    editor.do(SetPlanSettings(settings={"margin_mm": 0.7}))
    assert editor.do(UndoPlan()).content.settings == {**SETTINGS, "margin_mm": 0.7}
    assert editor.do(UndoPlan()).content.points == ()
    editor.do(AddPoint(position=(9, 9, 9)))
    assert editor.history() == (True, False)
    with pytest.raises(PlanLocked):
        plans.do("plan-locked", UndoPlan())
    plans.do("plan-locked", LockPlan(locked=False))
    assert len(plans.do("plan-locked", UndoPlan()).content.points) == 6
    assert len(plans.documents.restore("plan-deleted").content.points) == 3
    for broken in ("plan-no-json", "plan-null"):
        with pytest.raises(PlanError, match="cannot be read"):
            plans.get(broken)
        assert len(plans.do(broken, UndoPlan()).content.points) == 4
    store.close()


def test_a_copy_of_the_older_database_stays_beside(old: Settings) -> None:
    before = _content(old.database_path)
    Store(old).close()
    assert _content(old.home / "vfix-0001.sqlite3") == before


@pytest.mark.skipif(os.name == "nt", reason="there is no kill -9 here")
def test_a_migration_that_is_killed_is_as_if_it_had_not_begun(old: Settings) -> None:
    """HAZ-24: killed after each of its steps, before the commit."""
    before = _content(old.database_path)
    program = """if True:
        import os, signal, sys
        from pathlib import Path
        from alembic.operations import Operations
        from app.settings import Settings
        from app.store import Store
        left = int(sys.argv[2])
        def counted(name):
            real = getattr(Operations, name)
            def act(*args, **options):
                global left
                real(*args, **options)
                left -= 1
                if left == 0:
                    os.kill(os.getpid(), signal.SIGKILL)
            setattr(Operations, name, act)
        for name in ("create_table", "create_index", "execute", "drop_table"):
            counted(name)
        # Alembic's module of functions is a proxy of an object of this class.
        import alembic.op as proxy
        for name in ("create_table", "create_index", "execute", "drop_table"):
            setattr(proxy, name, lambda *a, _n=name, **k: getattr(proxy._proxy, _n)(*a, **k))
        Store(Settings(home=Path(sys.argv[1]), port=0)).close()
    """
    killed = 0
    for step in (1, 5, 6, 7, 8, 11):
        ended = subprocess.run([sys.executable, "-c", program, old.home, str(step)], cwd=ROOT, check=False)
        killed += ended.returncode == -9
        assert _content(old.database_path) == before
    assert killed == 6
    Store(old).close()
    assert _content(old.database_path) != before


def _content(path: Path) -> list[str]:
    with closing(sqlite3.connect(path)) as connection:
        assert connection.execute("pragma integrity_check").fetchone() == ("ok",)
        return sorted(connection.iterdump())
