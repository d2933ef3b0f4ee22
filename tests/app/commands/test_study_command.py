"""`vfix study`: a small study as its user runs it, and what is refused."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from app.cli import main

WITHOUT_APP = """
import sys
sys.modules |= dict.fromkeys(("sqlalchemy", "fastapi", "pydantic", "alembic", "starlette", "viser"))
from pathlib import Path
import app.commands.report, app.commands.study
from app.exchange.plan_files import write_export
write_export(Path(sys.argv[1]), "written")
"""


def test_reports_are_written_where_page_and_store_are_not_installed(tmp_path: Path) -> None:
    """`pip install vfix` has `vfix report` and `vfix study`, and none of these libraries."""
    subprocess.run([sys.executable, "-c", WITHOUT_APP, str(tmp_path / "report")], check=True)
    assert (tmp_path / "report").read_text(encoding="utf-8") == "written"


def test_one_trial_of_the_user_of_li_2004(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "report.json"
    assert main(["study", "li2004", "--trials", "1", "--workers", "1", "--seed", "7", "-o", str(file), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert json.loads(file.read_text(encoding="utf-8")) == said
    assert (said["schema"], said["study"], said["seed"]) == ("vfix-evidence/1", "li2004", 7)
    assert [cell["paper"] for cell in said["cells"]] == [1.82, 26.61, 0.76, 17.24, 0.425]
    assert said["cpu_s"] > 0.0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["li2007", "--subjects", "1"], "two subjects"),
        (["li2008"], "invalid choice"),
        (["li2004", "--workers", "0"], "--workers"),
    ],
)
def test_what_cannot_be_run_is_refused(arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["study", *arguments])
    assert ended.value.code == 2
    assert words in capsys.readouterr().err
