"""The command line: quick to help, one line for an error, one JSON object for `--json`."""

import argparse
import json
import os
import socket
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from app import cli
from app.exchange.resolve import is_file
from vfix_engine.errors import FrameError

ROOT = Path(__file__).resolve().parents[3]


def refusing(args: argparse.Namespace) -> int:
    raise FrameError("the file names no frame; say --frame LPS or --frame RAS.")


@pytest.fixture
def refusing_verb(monkeypatch: pytest.MonkeyPatch) -> None:
    def add_parser(subparsers: argparse._SubParsersAction) -> argparse.ArgumentParser:
        parser = subparsers.add_parser("doctor")
        parser.add_argument("--json", action="store_true")
        return parser

    module = SimpleNamespace(add_parser=add_parser, run=refusing)
    monkeypatch.setattr(cli.importlib, "import_module", lambda name: module)


def test_help_imports_no_verb() -> None:
    code = (
        "import sys\nfrom app.cli import main\n"
        "try: main(['--help'])\nexcept SystemExit: pass\n"
        "heavy = {'numpy', 'viser', 'fastapi', 'numba', 'sqlalchemy'} & set(sys.modules)\nassert not heavy, heavy"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    for verb in cli.VERBS:
        assert verb.name in done.stdout


@pytest.mark.parametrize("verb", cli.VERBS, ids=lambda verb: verb.name)
def test_every_verb_has_help(verb: cli.CliVerb, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        cli.main([verb.name, "--help"])
    assert ended.value.code == 0
    assert f"vfix {verb.name}" in capsys.readouterr().out


@pytest.mark.usefixtures("refusing_verb")
def test_a_refusal_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["doctor"]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err == "vfix: the file names no frame; say --frame LPS or --frame RAS.\n"


@pytest.mark.usefixtures("refusing_verb")
def test_a_refusal_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["doctor", "--json"]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    assert error["code"] == "frame_error"
    assert "--frame LPS" in error["message"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["import"], "required: PATH"),
        (["import", "x.ply", "--frame", "MNI"], "MNI"),
        (["rehearse", "--case", "x", "--plan", "y", "--steps", "0"], "1 is the least"),
        (["plan", "burn"], "burn"),
        (["fly"], "fly"),
    ],
)
def test_a_wrong_command_line_is_told_as_json_too(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for asked in ([], ["--json"]):
        with pytest.raises(SystemExit) as ended:
            cli.main([*words, *asked])
        assert ended.value.code == 2
        out, err = capsys.readouterr()
        assert err.startswith("usage: vfix")
        assert said in err
        if not asked:
            assert out == ""
            continue
        error = json.loads(out)["error"]
        assert error["code"] == "usage_error"
        assert said in error["message"]


LONG = """
import sys
from types import SimpleNamespace
from app import cli
from app.exchange.resolve import is_file
def say(args):
    for _ in range({lines}):
        print("x" * 100)
verb = SimpleNamespace(add_parser=lambda sub: sub.add_parser("doctor"), run=say)
cli.importlib.import_module = lambda name: verb
sys.exit(cli.main({words}))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="a closed pipe has another error there")
@pytest.mark.parametrize(
    ("lines", "words", "unbuffered"),
    [(1, ["doctor"], ""), (100_000, ["doctor"], ""), (0, ["--help"], ""), (1, ["doctor"], "1")],
)
def test_output_that_nobody_reads_ends_quietly(lines: int, words: list[str], unbuffered: str) -> None:
    """Less than a buffer, more than one, the help, and without a buffer."""
    process = subprocess.Popen(
        [sys.executable, "-c", LONG.format(lines=lines, words=words)],
        cwd=ROOT,
        env=os.environ | {"PYTHONUNBUFFERED": unbuffered},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert process.stdout is not None
    process.stdout.close()
    assert process.stderr is not None
    assert process.stderr.read() == b""
    process.stderr.close()
    assert process.wait() == 141


def test_another_broken_pipe_is_not_hidden(refusing_verb: None, monkeypatch: pytest.MonkeyPatch) -> None:
    def break_pipe(args: argparse.Namespace) -> int:
        raise BrokenPipeError

    monkeypatch.setattr(cli.importlib.import_module("any"), "run", break_pipe)
    with pytest.raises(BrokenPipeError):
        cli.main(["doctor"])


def test_no_verb_shows_the_verbs(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main([]) == 2
    assert "rehearse" in capsys.readouterr().err


def test_doctor_says_what_it_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    assert cli.main(["doctor", "--json"]) == 0
    health = json.loads(capsys.readouterr().out)
    assert health["home"] == str(tmp_path / "home")
    assert health["home_writable"] is True
    assert health["packages"]["viser"] == "1.1.1"
    assert health["cores"] >= 1
    assert health["problems"] == []
    assert health["real_time_priority"] is (health["without_priority_because"] == "")
    assert isinstance(health["compiled_kernels"], int)
    kept = {"network", "other_files", "writing_elsewhere", "other_processes", "large_files"}
    assert set(health["worker_is_kept_from"]) == kept
    assert health["worker_is_kept_from"]["large_files"] is (os.name == "posix")
    assert not (tmp_path / "home").exists()


def test_doctor_says_what_a_rehearsal_must_do_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """HAZ-10: no real-time priority, and no place for compiled kernels, are no problem and are said."""
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    monkeypatch.setattr("app.commands.doctor.why_not", lambda: "the system does not allow one to this user")
    monkeypatch.setattr("app.commands.doctor._kernel_folder", lambda: None)
    assert cli.main(["doctor"]) == 0
    said = capsys.readouterr().out
    assert "real-time priority while somebody drives: the system does not allow one to this user" in said
    assert "VFIX_CACHE names another folder" in said
    assert cli.main(["doctor", "--json"]) == 0
    health = json.loads(capsys.readouterr().out)
    assert health["real_time_priority"] is False
    assert health["kernel_cache"] is None


def test_doctor_names_a_data_folder_that_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("app.commands.doctor._is_writable", lambda folder: False)
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    assert cli.main(["doctor"]) == 1
    assert "set VFIX_HOME" in capsys.readouterr().err


def test_what_cannot_be_the_name_of_a_file_is_none(tmp_path: Path) -> None:
    assert not is_file(tmp_path / ("a" * 300))
    assert not is_file(Path("a\0b"))
    (tmp_path / "plan.json").touch()
    assert is_file(tmp_path / "plan.json")


def test_the_page_and_openigtlink_cannot_share_a_port(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = str(free.getsockname()[1])
    assert cli.main(["serve", "--port", port, "--igtl", port, "--no-browser"]) == 2
    assert f"the page has port {port} already" in capsys.readouterr().err


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "latin-1", "utf-8", "ascii:surrogateescape"])
def test_a_console_that_lacks_a_character_shows_its_code(encoding: str) -> None:
    """And a name of a file that is no text at all."""
    code = (
        "import sys\nfrom types import SimpleNamespace\nfrom app import cli\n"
        "def add_parser(subparsers): return subparsers.add_parser('doctor')\n"
        "def run(args):\n    print('Mu\\u0308ller \\u9f3b \\udce9')\n    print('\\u9f3b', file=sys.stderr)\n"
        "cli.importlib.import_module = lambda name: SimpleNamespace(add_parser=add_parser, run=run)\n"
        "sys.exit(cli.main(['doctor']))"
    )
    told = {**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"}
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, env=told, check=False)
    assert (done.returncode, b"Traceback" in done.stderr) == (0, False)
    shown = done.stdout.decode("utf-8" if encoding == "utf-8" else "ascii")
    assert shown.strip().endswith("\\udce9")
    assert ("\\u9f3b" in shown) == (encoding != "utf-8")
