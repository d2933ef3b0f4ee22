"""Imports point down only: the engine knows nothing of the application, and a room knows only the rooms below it."""

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent

# A room may import itself and every room of a lower number; rooms of one number do not know each other.
ENGINE_ROOMS = {
    "arrays": 0,
    "errors": 0,
    "error_places": 0,
    "json_text": 0,
    "moved": 0,
    "progress": 0,
    "resources": 0,
    "validate": 1,
    "kernels": 1,
    "frames": 2,
    "geometry": 2,
    "files": 3,
    "proximity": 3,
    "robots": 3,
    "anatomy": 4,
    "registration": 4,
    "virtual_fixtures": 4,
    "certificate": 5,
    "pathway": 5,
    "control": 6,
    "runtime": 7,
    "snake": 7,
    "worlds": 8,
    "study": 9,
    "suggestion": 9,
    "": 9,  # what a script may import from the top
}
ANATOMY_ROOMS = {"": 0, "labels": 1, "lumen": 1, "endoscopy": 2, "lumen_import": 2}
PATHWAY_ROOMS = {"": 0, "query": 1, "limits": 2}
SNAKE_ROOMS = {"": 0, "bending": 0, "control": 1, "haptics": 1, "conform": 2}
WORLD_ROOMS = {"rigid": 1, "snake": 1, "freehand": 2, "registry": 3, "": 4}
APP_ROOMS = {
    "": 0,
    "browsers": 0,
    "clock": 0,
    "error_shape": 0,
    "extras": 0,
    "settings": 1,
    "kit": 2,
    "link": 2,
    "messages": 2,
    "scene": 3,
    "store": 2,
    "cases": 3,
    "documents": 3,
    "operations": 4,
    "imaging": 5,
    "lumen": 5,
    "plans": 5,
    "registration": 6,
    "live": 7,
    "planning": 7,
    "drives": 8,
    "assignments": 9,
    "studies": 9,
    "exchange": 9,
    "services": 10,
    "api": 11,
    "workspace": 11,
    "tabs": 12,
    "session": 13,
    "gateway": 14,
    "main": 15,
    "commands": 16,
    "cli": 17,
}
TAB_ROOMS = {"": 0, "spec": 0, "base": 1, "drive_tab": 2, "registry": 3} | {
    folder.name: 3 for folder in (ROOT / "app" / "tabs").iterdir() if (folder / "tab.py").is_file()
}
NOT_IN_THE_ENGINE = {
    "app", "benchmarks", "alembic", "fastapi", "pydantic", "sqlalchemy", "starlette", "uvicorn", "viser", "websockets",
}  # fmt: skip


def modules(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


# Every module at the top of these has a floor by name.
TOPS = ("vfix_engine", "app")
PACKAGES = [
    ("vfix_engine", ENGINE_ROOMS),
    ("vfix_engine.anatomy", ANATOMY_ROOMS),
    ("vfix_engine.pathway", PATHWAY_ROOMS),
    ("vfix_engine.snake", SNAKE_ROOMS),
    ("vfix_engine.worlds", WORLD_ROOMS),
    ("app", APP_ROOMS),
    ("app.tabs", TAB_ROOMS),
]


def room_of(name: str, package: str) -> str:
    """The part of a dotted name behind its package: 'vfix_engine.geometry.mesh' lies in 'geometry' of 'vfix_engine'."""
    return [*name.removeprefix(package).split("."), ""][1]


def imported_names(file: Path) -> Iterator[str]:
    """Absolute names of everything that a module imports, wherever in it the import stands."""
    parents = list(file.relative_to(ROOT).parts[:-1])
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = parents[: len(parents) - node.level + 1] if node.level else []
            module = ".".join([*base, *([node.module] if node.module else [])])
            # `from app import settings` names a room only in its list of names.
            named = "." not in module or module in dict(PACKAGES)
            yield from ([f"{module}.{alias.name}" for alias in node.names] if named else [module])


@pytest.mark.parametrize("file", modules("vfix_engine"), ids=lambda file: str(file.relative_to(ROOT)))
def test_the_engine_does_not_know_the_application(file: Path) -> None:
    assert not {name.split(".")[0] for name in imported_names(file)} & NOT_IN_THE_ENGINE


def files_of(package: str, rooms: dict[str, int]) -> Iterator[tuple[Path, str]]:
    """The modules of a package, each with the room that it lies in; '' is the package's own floor."""
    folder = ROOT.joinpath(*package.split("."))
    for file in sorted(folder.rglob("*.py")):
        first = file.relative_to(folder).parts[0]
        own_floor = first.endswith(".py") and first.removesuffix(".py") not in rooms and package not in TOPS
        yield file, "" if own_floor else first.removesuffix(".py").replace("__init__", "")


@pytest.mark.parametrize(("package", "rooms"), PACKAGES)
def test_every_room_has_its_place(package: str, rooms: dict[str, int]) -> None:
    assert {room for _, room in files_of(package, rooms)} <= set(rooms)


@pytest.mark.parametrize(("package", "rooms"), PACKAGES)
def test_rooms_import_downwards(package: str, rooms: dict[str, int]) -> None:
    wrong = []
    for file, own in files_of(package, rooms):
        for name in imported_names(file):
            if not f"{name}.".startswith(f"{package}."):
                continue
            other = room_of(name, package) if room_of(name, package) in rooms else ""
            if other not in ("", own) and rooms[other] >= rooms[own]:
                wrong.append(f"{file.relative_to(ROOT)} imports {name}")
    assert not wrong, "\n".join(wrong)


def test_no_public_class_has_two_meanings() -> None:
    """A name of a class is found once in engine and application together."""
    found: dict[str, set[str]] = defaultdict(set)
    for file in (file for top in TOPS for file in modules(top)):
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found[node.name].add(str(file.relative_to(ROOT)))
    assert len(found) > 500
    assert {name: sorted(files) for name, files in found.items() if len(files) > 1} == {}


def test_only_the_command_knows_the_benchmarks() -> None:
    """They compare with libraries that a user need not have, so nothing else may load them."""
    knowing = {
        str(file.relative_to(ROOT))
        for file in modules("app")
        if any(name.split(".")[0] == "benchmarks" for name in imported_names(file))
    }
    assert knowing == {str(Path("app", "commands", "bench.py"))}


def test_no_benchmark_needs_coal_to_be_loaded() -> None:
    """coal is asked for when a benchmark runs, so that it can say what to install."""
    for file in modules("benchmarks"):
        top = ast.parse(file.read_text(encoding="utf-8")).body
        loaded = {alias.name for node in top if isinstance(node, ast.Import) for alias in node.names}
        loaded |= {node.module or "" for node in top if isinstance(node, ast.ImportFrom)}
        assert "coal" not in {name.split(".")[0] for name in loaded}, file.name
