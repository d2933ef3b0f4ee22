"""The set-up scripts: they need nothing but Python, install once, and say in words what went wrong."""

import ast
import importlib
import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parent.parent
SCRIPTS = ROOT / "scripts"


@pytest.fixture
def environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> ModuleType:
    """scripts/environment.py over an empty checkout in which making and filling `.venv` is only noted down."""
    monkeypatch.syspath_prepend(str(SCRIPTS))
    module = importlib.reload(importlib.import_module("environment"))
    for name in ("requirements.lock", "requirements-test.lock", "pyproject.toml"):
        (tmp_path / name).write_text(name, encoding="utf-8")
    monkeypatch.setattr(module, "ROOT", tmp_path)
    monkeypatch.setattr(module, "VENV", tmp_path / ".venv")
    monkeypatch.setattr(module, "LOCK", tmp_path / "requirements.lock")
    monkeypatch.setattr(module, "TEST_LOCK", tmp_path / "requirements-test.lock")
    module.done = []

    def make() -> None:
        module.done.append("venv")
        module.python_of_venv().parent.mkdir(parents=True)
        module.python_of_venv().write_text("", encoding="utf-8")

    monkeypatch.setattr(module, "_make_venv", make)
    monkeypatch.setattr(module, "_runs", lambda python: python.is_file())
    monkeypatch.setattr(module, "_pip", lambda *arguments: module.done.append(Path(arguments[-1]).name))
    return module


def test_the_first_start_installs_and_the_second_does_not(environment: ModuleType, tmp_path: Path) -> None:
    environment.ensure_environment(with_tests=False)
    assert environment.done == ["venv", "requirements.lock", tmp_path.name]
    environment.ensure_environment(with_tests=False)
    assert len(environment.done) == 3


def test_the_tests_environment_serves_the_planner_as_well(environment: ModuleType) -> None:
    environment.ensure_environment(with_tests=True)
    count = len(environment.done)
    environment.ensure_environment(with_tests=False)
    assert len(environment.done) == count


def test_the_planner_s_environment_is_not_enough_for_the_tests(environment: ModuleType) -> None:
    environment.ensure_environment(with_tests=False)
    environment.ensure_environment(with_tests=True)
    assert "requirements-test.lock" in environment.done
    assert environment.done.count("venv") == 1


@pytest.mark.parametrize("changed", ["requirements.lock", "pyproject.toml"])
def test_a_change_of_what_is_asked_for_installs_again(environment: ModuleType, tmp_path: Path, changed: str) -> None:
    environment.ensure_environment(with_tests=False)
    (tmp_path / changed).write_text("changed", encoding="utf-8")
    environment.ensure_environment(with_tests=False)
    assert environment.done.count("requirements.lock") == 2


def test_an_interrupted_installation_is_taken_up_again(
    environment: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: str) -> None:
        raise environment.SetUpFailed("no network")

    with monkeypatch.context() as broken:
        broken.setattr(environment, "_pip", fail)
        with pytest.raises(environment.SetUpFailed):
            environment.ensure_environment(with_tests=False)
    environment.ensure_environment(with_tests=False)
    assert "requirements.lock" in environment.done


def test_a_full_disk_is_named(environment: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(environment, "NEEDED_DISK_BYTES", 2**80)
    with pytest.raises(environment.SetUpFailed, match="GiB free"):
        environment.ensure_environment(with_tests=False)


def test_an_old_python_looks_for_a_newer_one_and_says_so(
    environment: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(environment, "NEEDED_PYTHON", (3, 99))
    monkeypatch.setattr(environment.shutil, "which", lambda _: None)
    with pytest.raises(environment.SetUpFailed, match=r"needs Python 3\.11"):
        environment.use_new_enough_python()


@pytest.mark.parametrize("name", ["environment.py", "start.py", "test.py", "lock.py"])
def test_the_scripts_need_the_standard_library_only(name: str) -> None:
    tree = ast.parse((SCRIPTS / name).read_text(encoding="utf-8"), feature_version=(3, 8))
    imported = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    imported |= {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    ours = {"environment", "app.browsers"}
    assert {module.split(".")[0] for module in imported - ours} <= sys.stdlib_module_names


@pytest.mark.parametrize("failing", ["preparation", "ruff", "pytest"])
def test_whatever_fails_is_the_status_of_the_whole(
    environment: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], failing: str
) -> None:
    """The preparation of the kernels too: without it the tests would measure something else."""
    spec = importlib.util.spec_from_file_location("the_test_script", SCRIPTS / "test.py")
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    monkeypatch.setenv("VFIX_BROWSER", "")
    monkeypatch.setattr(script, "ensure_environment", lambda with_tests: Path("python"))
    monkeypatch.setattr(script, "ensure_browser", lambda python: "browser")
    monkeypatch.setattr(script, "run_in_environment", lambda python, *words: 3 if failing in " ".join(words) else 0)
    assert script.main(["tests/one.py"]) == 3
    assert "FAILED (3)" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["start.py", "test.py"])
def test_help_installs_nothing(name: str, tmp_path: Path) -> None:
    for script in (name, "environment.py"):
        (tmp_path / script).write_bytes((SCRIPTS / script).read_bytes())
    command = [sys.executable, str(tmp_path / name), "--help"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=30)
    assert f"scripts/{name}" in done.stdout
    assert not (tmp_path.parent / ".venv").exists()


def test_the_last_line_counts_the_tests_of_all_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Skipped ones too: without the trial data the attacks on them are missing, and the last line says how many."""
    (tmp_path / "test_few.py").write_text(
        "import pytest\ndef test_one(): pass\ndef test_two(): pytest.skip('no data')\ndef test_three(): assert 0\n",
        encoding="utf-8",
    )
    reports = [tmp_path / "a.xml", tmp_path / "b.xml"]
    for report in reports:
        command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", f"--junitxml={report}", str(tmp_path)]
        subprocess.run(command, cwd=tmp_path, capture_output=True, check=False, timeout=60)
    monkeypatch.syspath_prepend(str(SCRIPTS))
    specification = importlib.util.spec_from_file_location("test_script", SCRIPTS / "test.py")
    assert specification is not None
    assert specification.loader is not None
    script = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(script)
    assert script.counts(reports) == "2 passed, 2 failed, 2 skipped"


def test_the_continuous_integration_runs_the_test_script_and_nothing_else() -> None:
    run = ROOT / ".ci" / "run"
    commands = [line for line in run.read_text(encoding="utf-8").splitlines() if line and not line.startswith("#")]
    assert commands == ["set -euo pipefail", 'cd "$(dirname "$0")/.."', "exec python3 scripts/test.py"]
    assert os.access(run, os.X_OK)
