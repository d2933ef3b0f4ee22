"""A field of a plan with its edit on page, REST and command line is added by opening four files.

They are opened in a copy of the application, which another process then uses.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
CONTENT, OPERATION, SECTION, PANEL = (
    "app/plans/model.py", "app/plans/operations/document.py", "app/tabs/plan/paths.py", "app/tabs/plan/paths.js",
)  # fmt: skip
COPIED = ("plans", "tabs")  # the folders of `app` that they are in; of the others there are links

# In each file what is found, and what is written after it. Where nothing is found in a file, it has changed.
ADDED: dict[str, dict[str, str]] = {
    CONTENT: {
        r"    registration: str \| None = None\n": "    urgency: int | None = None\n",
        r"        \"registration\": content\.registration,\n": "        \"urgency\": content.urgency,\n",
        r"            check_registration_id\(data\.get\(\"registration\"\)\),\n": "            data.get(\"urgency\"),\n",
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
        r"    this\.sideCaution = [^\n]*\n": """    /** @type {HTMLInputElement} */
    this.urgency = h("input", { type: "number", min: 0, max: 3, onchange: () => connection.send("plan.urgency", { urgency: Number(this.urgency.value) }) });
""",
        r"(?=    if \(document\.activeElement !== this\.notes\))": """    this.urgency.value = String(paths?.urgency ?? "");
""",
    },
}


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The application with the field."""
    folder = tmp_path_factory.mktemp("copy")
    (folder / "app").mkdir()
    for part in (ROOT / "app").iterdir():
        if part.name not in COPIED:
            (folder / "app" / part.name).symlink_to(part)
            continue
        for file in part.rglob("*"):
            if file.is_file() and "__pycache__" not in file.parts:
                target = folder / file.relative_to(ROOT)
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(file.read_bytes())
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
text = declarations.declarations()
assert '"plan.urgency": {' in text and "urgency: number | null;" in text
Path("types.d.ts").write_text(text, encoding="utf-8")
"""


def test_a_field_is_had_over_rest_as_a_message_and_as_a_verb(copy: Path, tmp_path: Path) -> None:
    assert len(ADDED) <= 4
    paths = [copy, ROOT, ROOT / "scripts", ROOT / "tests" / "app"]
    done = subprocess.run(
        [sys.executable, "-c", USED, str(tmp_path / "home")],
        cwd=copy,
        env={"PYTHONPATH": ":".join(map(str, paths)), "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
