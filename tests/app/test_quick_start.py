"""A planner that was started before is there within two seconds: what it needs later is not imported first."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

from alembic.script import ScriptDirectory

import app.store
from app.settings import Settings
from app.store.schema import NEWEST

SLOW = {
    "alembic", "coal", "cv2", "PIL", "pinocchio", "pydicom", "qpsolvers", "scipy.interpolate", "scipy.ndimage",
    "scipy.sparse", "scipy.spatial", "skimage", "trimesh",
}  # fmt: skip
# Of our own: FastAPI analyses each route, and a world has as many modules as the rest of the engine.
OWN = {"app.api.routes", "app.session.client_session", "vfix_engine.worlds.snake.spec"}

SCRIPT = """
import sys
from pathlib import Path
from app.commands import serve
from app.main import build
from app.settings import Settings

build(Settings(home=Path(sys.argv[1]), port=1))
print(*sys.modules)
"""


def test_a_later_start_imports_nothing_that_the_address_does_not_need(settings: Settings) -> None:
    _start(settings)  # the first one makes the home and its case
    imported = _start(settings)
    assert {"fastapi", "numba"} < imported
    assert imported & (SLOW | OWN) == set()


def test_what_a_start_does_not_import_is_there() -> None:
    """A module of another name would never be imported."""
    assert {name for name in SLOW | OWN if importlib.util.find_spec(name) is None} == set()


def test_the_newest_schema_is_that_of_the_last_migration() -> None:
    migrations = Path(app.store.__file__).parent / "migrations"
    assert ScriptDirectory(str(migrations)).get_current_head() == NEWEST


def _start(settings: Settings) -> set[str]:
    """The modules that are imported once the planner is built."""
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(settings.home)],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=True,
    )
    return set(done.stdout.splitlines()[0].split())
