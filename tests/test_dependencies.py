"""Every dependency is declared, explained, locked with hashes, and free of the GPL."""

import ast
import importlib.metadata
import json
import re
import sys
import tomllib
from pathlib import Path

import pytest

from app import extras
from app.commands.doctor import dependencies

ROOT = Path(__file__).resolve().parent.parent
LOCKS = ("requirements.lock", "requirements-test.lock")
PAGE = (ROOT / "docs" / "dependencies.md").read_text(encoding="utf-8")
PACKAGE = json.loads((ROOT / "package.json").read_text(encoding="utf-8"))
PAGE_LIBRARIES, PAGE_TOOLS = PACKAGE["dependencies"], PACKAGE["devDependencies"]
# Copyleft of single files: run unmodified in tests, part of nothing that is shipped.
ONLY_RUN = {"axe-core": "MPL-2.0"}
PERMISSIVE = {"Apache-2.0", "BSD-2-Clause", "BSD-3-Clause", "BlueOak-1.0.0", "ISC", "MIT"}
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT, BUILDING = SETTINGS["project"], SETTINGS["build-system"]["requires"]
# Import names that differ from the package's.
PACKAGE_OF = {
    "cv2": "opencv-python-headless",
    "fast_simplification": "fast-simplification",
    "foxglove_schemas_protobuf": "foxglove-schemas-protobuf",
    "google": "protobuf",
    "python_multipart": "python-multipart",
    "pinocchio": "pin",
    "SimpleITK": "simpleitk",
    "skimage": "scikit-image",
}


def name_of(requirement: str) -> str:
    return re.split(r"[<>=!~;\[ ]", requirement)[0]


EXTRAS = PROJECT["optional-dependencies"]


def installed() -> list[str]:
    """What both commands of the README install: the engine's dependencies and those of the page."""
    return [name_of(text) for text in [*PROJECT["dependencies"], *EXTRAS["app"]]]


def extras_of_tests() -> list[str]:
    """What the extras for exports of runs and for a cluster declare; the tests use all of them."""
    return [name_of(text) for extra in ("cluster", "mcap", "tables") for text in EXTRAS[extra]]


def declared() -> list[str]:
    return [*installed(), *extras_of_tests(), *(name_of(text) for text in EXTRAS["test"])]


def of_a_gpu() -> list[str]:
    """What the extra for a GPU declares; it is not locked, since it needs a driver that pip does not bring."""
    return [name_of(text) for text in EXTRAS["gpu"]]


def locked(lock: str) -> dict[str, str]:
    text = (ROOT / lock).read_text(encoding="utf-8")
    return dict(re.findall(r"^([a-z0-9-]+)==([^ ;\\]+)", text, re.MULTILINE))


def test_every_dependency_has_its_licence_and_reason() -> None:
    rows = dict(re.findall(r"^\| (@?[a-z][a-z0-9/-]*) \| (.+) \| .+ \|$", PAGE, re.MULTILINE))
    of_the_page = {*PAGE_LIBRARIES, *PAGE_TOOLS}
    assert set(declared()) | set(of_a_gpu()) | of_the_page | {"hatchling", "editables"} == set(rows)
    assert not [name for name, licence in rows.items() if is_gpl(licence)]


def test_dependencies_are_sorted_and_stated_once() -> None:
    assert set(EXTRAS) == {"app", "cluster", "gpu", "mcap", "tables", "test"}
    for group in (PROJECT["dependencies"], *EXTRAS.values()):
        names = [name_of(text) for text in group]
        assert names == sorted(set(names))


@pytest.mark.parametrize(("package", "brought_by"), [("vfix_engine", ("cluster",)), ("app", ("app", "mcap", "tables"))])
def test_every_import_is_declared(package: str, brought_by: tuple[str, ...]) -> None:
    """Those of the engine without the extra `app`; that of a cluster is imported where a scheduler is asked for."""
    imported = set()
    for file in (ROOT / package).rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                imported |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                imported.add((node.module or "").split(".")[0])
    own = {"app", "benchmarks", "vfix_engine"}
    foreign = {PACKAGE_OF.get(name, name) for name in imported - sys.stdlib_module_names - own}
    allowed = [*PROJECT["dependencies"], *(text for extra in brought_by for text in EXTRAS[extra])]
    assert foreign <= {name_of(text) for text in allowed}


def test_the_extra_of_the_page_is_what_the_command_line_looks_for() -> None:
    assert [name_of(text) for text in EXTRAS["app"]] == [name.replace("_", "-") for name in extras.APP_MODULES]


def test_doctor_looks_for_what_is_declared() -> None:
    requirements = importlib.metadata.requires("vfix")
    assert requirements is not None
    assert dependencies(requirements) == [name_of(text) for text in PROJECT["dependencies"]]
    for extra, declared_ones in EXTRAS.items():
        assert dependencies(requirements, extra) == [name_of(text) for text in declared_ones]
    written = ["one", "two[more]>=1; python_version < '3.14'", 'three (>=2) ; (os_name == "nt") and extra == "app"']
    assert (dependencies(written), dependencies(written, "app")) == (["one", "two"], ["three"])


@pytest.mark.parametrize("lock", LOCKS)
def test_the_lock_is_exact_and_names_no_registry(lock: str) -> None:
    text = (ROOT / lock).read_text(encoding="utf-8")
    assert "://" not in text
    assert "index-url" not in text
    for block in re.split(r"\n(?=[a-z0-9])", text)[1:]:
        assert re.match(r"[a-z0-9-]+==\S+", block), block[:80]
        assert "--hash=sha256:" in block, block[:80]


def test_the_locks_hold_what_is_declared_and_agree() -> None:
    run, test = locked(LOCKS[0]), locked(LOCKS[1])
    assert set(installed()) | {"editables", *(name_of(text) for text in BUILDING)} <= set(run)
    assert set(declared()) <= set(test)
    assert run.items() <= test.items()
    assert not set(of_a_gpu()) & set(test)


def test_the_lock_installs_nothing_under_the_gpl() -> None:
    looked_at = 0
    for name in locked(LOCKS[1]):
        try:
            metadata = importlib.metadata.metadata(name)
        except importlib.metadata.PackageNotFoundError:
            continue  # for another platform or version of Python
        looked_at += 1
        classifiers = [text for text in metadata.get_all("Classifier") or [] if text.startswith("License")]
        stated = metadata.get("License-Expression") or (metadata.get("License") or "").split("\n")[0]
        assert not is_gpl(" ".join([stated, *classifiers])), (name, stated, classifiers)
    assert looked_at > 60


def test_the_page_s_libraries_and_tools_are_locked_by_hash_and_name_no_registry() -> None:
    text = (ROOT / "package-lock.json").read_text(encoding="utf-8")
    packages = json.loads(text)["packages"]
    pinned = PAGE_LIBRARIES | PAGE_TOOLS
    root = packages.pop("")
    assert (root["dependencies"], root["devDependencies"]) == (PAGE_LIBRARIES, PAGE_TOOLS)
    assert all(re.fullmatch(r"\d+\.\d+\.\d+", version) for version in pinned.values()), "pinned exactly"
    assert '"resolved"' not in text
    for name, package in packages.items():
        assert package["integrity"].startswith("sha512-"), name
        assert package["license"] == ONLY_RUN.get(name.rpartition("/")[2]) or package["license"] in PERMISSIVE, name
    of_users = {name.removeprefix("node_modules/") for name, package in packages.items() if not package.get("dev")}
    assert of_users == {*PAGE_LIBRARIES, "@types/trusted-types"}, "which is types, and not served"
    for name, version in pinned.items():
        assert packages[f"node_modules/{name}"]["version"] == version


def test_every_module_of_the_page_loads_what_is_served_with_it_and_nothing_else() -> None:
    """There is no step between a module and the browser, and its policy allows no import by name alone."""
    served = SETTINGS["tool"]["hatch"]["build"]["targets"]["wheel"]["hooks"]["custom"]["libraries"]
    files = {f"/static/lib/{name}/{file}" for name, of_it in served.items() for file in of_it}
    modules = [*(ROOT / "app").rglob("*.js")]
    assert {ROOT / f"app/web/{file.removeprefix('/static/')}" for file in files if file.endswith(".js")} <= set(modules)
    for module in modules:
        text = module.read_text(encoding="utf-8")
        found = re.findall(r'(?:^|[;}])(?:import|export)\b[^"\';]*?from ?"([^"]+)"', text, re.MULTILINE)
        assert all(name.startswith(("./", "../", "/static/", "/tabs/")) for name in found), module
        assert {name for name in found if name.startswith("/static/lib/")} <= files, module
        for name in found if ROOT / "app/web/lib" in module.parents else ():
            assert f"/static/{(module.parent / name).resolve().relative_to(ROOT / 'app/web')}" in files, module


def is_gpl(licence: str) -> bool:
    """GPL or AGPL; the Lesser GPL lets a library be used unchanged and does not count."""
    without_lesser = re.sub(r"LGPL\S*|GNU Lesser General Public License \S+ \(LGPL\S*\)", "", licence)
    return re.search(r"\bA?GPL|General Public License", without_lesser) is not None


@pytest.mark.parametrize(
    ("licence", "expected"),
    [("LGPL-3.0", False), ("GPL-3.0", True), ("GNU Lesser General Public License v3 (LGPLv3)", False),
     ("GNU General Public License v2 (GPLv2)", True), ("AGPL-3.0", True), ("MIT", False)],
)  # fmt: skip
def test_the_gpl_is_told_from_others(licence: str, expected: bool) -> None:
    assert is_gpl(licence) is expected
