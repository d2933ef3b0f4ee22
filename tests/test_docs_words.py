"""What the project's own files must not say."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = (".ci", "app", "assets", "benchmarks", "docs", "scripts", "tests", "vfix_engine")
TEXT = {"", ".cfg", ".css", ".csv", ".html", ".ini", ".js", ".json", ".lock", ".mako", ".md", ".py", ".svg", ".toml"}
# Put together here, so that this file does not hold them.
HOSTS = tuple(
    f"{name}.{end}"
    for name, end in (
        ("py" + "pi", "org"),
        ("python" + "hosted", "org"),
        ("npm" + "js", "org"),
        ("npm" + "js", "com"),
        ("yarn" + "pkg", "com"),
        ("ana" + "conda", "org"),
        ("js" + "delivr", "net"),
        ("un" + "pkg", "com"),
        ("cr" + "ates", "io"),
    )
)


def text_files() -> list[Path]:
    files = [file for file in ROOT.iterdir() if file.is_file()]
    for folder in FOLDERS:
        files += [file for file in (ROOT / folder).rglob("*") if file.is_file() and "__pycache__" not in file.parts]
    return [file for file in files if file.suffix in TEXT]


def test_they_are_seen() -> None:
    names = {file.name for file in text_files()}
    assert {"README.md", "LICENSE", "requirements.lock", "run", "main.js", Path(__file__).name} <= names


@pytest.mark.parametrize("host", HOSTS)
def test_no_file_names_a_package_registry(host: str) -> None:
    naming = [file.name for file in text_files() if host in file.read_text(encoding="utf-8", errors="replace").lower()]
    assert not naming
