"""The build hook: fetches the libraries that the page is served with, of an editable install as of the wheel.

They lie in `app/web/lib`, which is in the wheel and not in the repository; the names of their files are in
`pyproject.toml`, their versions and hashes in `package-lock.json`. Each brings its licence along. Where they are there
already nothing is fetched, so that a build needs the network only once.
"""

import json
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

sys.path.insert(0, str(Path(__file__).resolve().parent))

from environment import SetUpFailed
from npm import FAILED, find_node, install

INSTALLED_FROM = ("package.json", "package-lock.json", ".npmrc")
ALWAYS = ("LICENSE", "package.json")  # the latter says which version it is


class PageLibraries(BuildHookInterface[Any]):
    """Fills `app/web/lib` before the files of the wheel are collected."""

    def initialize(self, version: str, build_data: "dict[str, Any]") -> None:
        """Called by hatchling at the begin of every build, `version` being 'standard' or 'editable'."""
        fetch(Path(self.root), self.config["libraries"])


def fetch(root: Path, libraries: "dict[str, list[str]]") -> None:
    """Lay the libraries' files into `app/web/lib` of a checkout. Raises SetUpFailed where they cannot be had."""
    served = root / "app" / "web" / "lib"
    locked = json.loads((root / "package-lock.json").read_text(encoding="utf-8"))["packages"]
    wanted = {name: (locked[f"node_modules/{name}"]["version"], [*files, *ALWAYS]) for name, files in libraries.items()}
    if all(_is_there(served / name, *what) for name, what in wanted.items()):
        return
    with tempfile.TemporaryDirectory(dir=root, prefix=".page-libraries-") as folder:
        made = Path(folder)
        for name in INSTALLED_FROM:
            shutil.copy(root / name, made)
        if not install(*find_node(Path(sys.executable)), made, "--omit=dev", "--ignore-scripts"):
            raise SetUpFailed(f"The page's libraries could not be fetched; {FAILED}")
        for name, (_, files) in wanted.items():
            for file in files:
                target = made / "lib" / name / file
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(made / "node_modules" / name / file, target)
        shutil.rmtree(served, ignore_errors=True)
        (made / "lib").rename(served)


def _is_there(library: Path, version: str, files: "list[str]") -> bool:
    if not all((library / file).is_file() for file in files):
        return False
    return bool(json.loads((library / "package.json").read_text(encoding="utf-8"))["version"] == version)
