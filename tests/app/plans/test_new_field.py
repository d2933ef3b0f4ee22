"""A field of a plan with its edit on page, REST and command line is added by opening four files.

They are opened in a copy of the application, which another process then uses.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from npm import find_node

ROOT = Path(__file__).resolve().parents[3]
LIBRARIES = ROOT / "node_modules"
COMPILER = LIBRARIES / "typescript" / "bin" / "tsc"
TYPES = "app/web/js/types.d.ts"
CONTENT, OPERATION, SECTION, PANEL = (
    "app/plans/model.py", "app/plans/operations/document.py", "app/tabs/plan/paths.py", "app/tabs/plan/notes.js",
)  # fmt: skip
COPIED = ("plans", "tabs", "web/js")  # the folders of `app` that they are in, and the page's; the others are linked

# In each file what is found, and what is written after it. Where nothing is found in a file, it has changed.
ADDED: dict[str, dict[str, str]] = {
    CONTENT: {
        r"    registration: str \| None = None\n": "    urgency: int | None = None\n",
    },
    OPERATION: {
        r"(?=OPERATIONS = \()": '''class SetUrgency(PlanEdit, frozen=True):
    """Say how urgent it is. From 0 to 3; null says nothing."""

    rest = "PUT /plans/{id}/urgency"
    message = "plan.urgency"
    verb = "plan urgency"
    urgency: Annotated[int, Meta(ge=0, le=3)] | None

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        return replace(content, urgency=self.urgency)


''',
        r"OPERATIONS = \(": "SetUrgency, ",
    },
    SECTION: {
        r"    notes: str\n": "    urgency: int | None\n",
        r'        "notes": [\w.]+\.notes,\n': '        "urgency": PLAN.urgency,\n',
    },
    PANEL: {
        r"  update\(\{ paths \}\) \{\n": """    const ask = (/** @type {Event} */ { currentTarget }) => {
      const { value } = /** @type {HTMLInputElement} */ (currentTarget);
      this.connection.send("plan.urgency", { urgency: Number(value) });
    };
""",
        r"</textarea>": """<input type="number" data-operation="plan.urgency"
      .value=${unlessFocused(String(paths?.urgency ?? ""))} @change=${ask}>""",
    },
}


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The application with the field."""
    folder = tmp_path_factory.mktemp("copy")
    for part in (*(ROOT / "app").iterdir(), *(ROOT / "app" / "web").iterdir()):
        target = folder / part.relative_to(ROOT)
        if (name := part.relative_to(ROOT / "app").as_posix()) in COPIED:
            shutil.copytree(part, target, ignore=shutil.ignore_patterns("__pycache__"))
        elif name != "web":
            target.parent.mkdir(parents=True, exist_ok=True)
            target.symlink_to(part)
    for name, lines in ADDED.items():
        file = folder / name
        text = file.read_text(encoding="utf-8")
        for place, line in lines.items():
            found = list(re.finditer(place, text))
            assert found, f"{name}: {place}"
            for one in reversed(found):
                source = re.search(r"[\w.]+(?=\.notes,)", one[0])
                text = text[: one.end()] + line.replace("PLAN", source[0] if source else "") + text[one.end() :]
        file.write_text(text, encoding="utf-8")
    return folder


USED = """
import os, sys
from pathlib import Path
home = Path(sys.argv[1])
os.environ["VFIX_HOME"] = str(home)
import app.plans.model
assert Path(app.plans.model.__file__).is_relative_to(Path.cwd())
from app.cli import main
from app.cases.model import HEAD_PHANTOM
from app.plans.operations.document import UndoPlan
from app.services import build_services
from app.settings import Settings
from rest_client import opened_client
from session_doubles import open_sample, sections_of, send
import declarations

services = build_services(Settings(home=home, port=0))
plan = services.plans.create(HEAD_PHANTOM, "Urgent").id
client = opened_client(services)
address = f"/api/v1/plans/{plan}"
assert client.get(address).json()["urgency"] is None
answer = client.request("PUT", address + "/urgency", json={"urgency": 2, "revision": 1})
assert (answer.status_code, answer.json()["urgency"], answer.headers["ETag"]) == (200, 2, '"2"'), answer.text
assert client.request("PUT", address + "/urgency", json={"urgency": 7}).status_code == 422
assert client.request("PUT", address + "/urgency", json={"urgency": 1, "revision": 1}).status_code == 409
tab = open_sample(services, plan)
send(tab, "plan.urgency", urgency=3)
assert sections_of(tab)["paths"]["urgency"] == 3
send(tab, "undo")
assert sections_of(tab)["paths"]["urgency"] == 2
client.close(), services.close()
assert main(["plan", "urgency", "Urgent", "1"]) == 0
services = build_services(Settings(home=home, port=0))
assert services.plans.documents.get(plan).content.urgency == 1
assert services.plans.do(plan, UndoPlan()).told.startswith("Undone")
services.close()
Path("app/web/js/types.d.ts").write_text(declarations.declarations(), encoding="utf-8")
"""


@pytest.fixture(scope="module")
def used(copy: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The copy after its field was used, with the types of the page."""
    paths = [copy, ROOT, ROOT / "scripts", ROOT / "tests" / "app"]
    done = subprocess.run(
        [sys.executable, "-c", USED, str(tmp_path_factory.mktemp("home"))],
        cwd=copy,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, paths))},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return copy


def test_a_field_is_had_over_rest_as_a_message_and_as_a_verb(used: Path) -> None:
    assert len(ADDED) == 4
    assert '"plan.urgency": {' in (used / TYPES).read_text(encoding="utf-8")


@pytest.mark.skipif(not COMPILER.is_file(), reason="TypeScript is installed with the checks of the page")
def test_the_panel_reads_and_sends_what_the_types_say(used: Path) -> None:
    paths = {
        "/static/lib/uplot/dist/uPlot.esm.js": [str(LIBRARIES / "uplot" / "dist" / "uPlot.d.ts")],
        "/static/lib/*": [f"{LIBRARIES}/*"],
        "/static/*": [f"{used}/app/web/*"],
    }
    base = str(ROOT / "tsconfig.json")
    config = {"extends": base, "compilerOptions": {"paths": paths}, "include": [], "files": [PANEL]}
    (used / "tsconfig.json").write_text(json.dumps(config), encoding="utf-8")
    node, _ = find_node(Path(sys.executable))
    done = subprocess.run([node, COMPILER, "--project", used], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "")
