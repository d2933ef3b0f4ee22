"""Python that sets up the scene of a run in the library, and replays it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from app.exchange.scene_code import SceneUse, scene_code
from vfix_engine.errors import InputError
from vfix_engine.runtime.run import Run
from vfix_engine.worlds.freehand.spec import FreehandSpec
from vfix_engine.worlds.registry import spec_of
from vfix_engine.worlds.rigid.spec import SceneSpec

STORE = ("from app.services import build_services", "from app.settings import Settings")


def run_python(run: Run, source: str | Path) -> str:
    """The script of a run of a rigid tool: its head from the run, all else in its lines; it replays the run.

    source: what the script reads the run from, the id of a stored one or the folder of another.

    Raises InputError for a run of another world.
    """
    spec: Any = spec_of(run)
    if getattr(spec, "scene", None) is None:
        raise InputError(f"a run of '{spec.world}' has no scene of a rigid tool")
    kind, more = type(spec).__name__, ""
    if isinstance(spec, FreehandSpec):
        more = f", {spec.contact_stiffness_n_per_mm!r}"
    solver = "" if spec.scene.solver == SceneSpec.solver else f", {spec.scene.solver!r}"
    use = SceneUse(
        title=f"A {run.mode} run" if isinstance(source, Path) else f"The {run.mode} run {source}",
        imports=(
            "from pathlib import Path",
            *STORE,
            "from vfix_engine.runtime.replay import replay",
            "from vfix_engine.runtime.run import Run",
            "from vfix_engine.worlds.registry import spec_of",
            f"from {type(spec).__module__} import {kind}",
            "from vfix_engine.worlds.rigid.spec import SceneSpec",
        ),
        head=(*_read(source), "recorded = spec_of(run).scene", "tree = recorded.build().tree"),
        drive=(
            f"again = replay(run, {kind}(SceneSpec.of(scene{solver}), settings{more}), keep_states=False)",
            'print(f"{len(run.ticks)} steps, bit by bit the recorded ones: {again.same}")',
        ),
        known="recorded",
    )
    return scene_code(use, spec.scene, spec.control)


def _read(source: str | Path) -> tuple[str, ...]:
    """Lines that read the run."""
    if isinstance(source, Path):
        return (f"run = Run.read(Path({str(source.resolve())!r}))",)
    return (
        "services = build_services(Settings.from_environment())",
        f"with services.runs.laid_out({source!r}) as folder:",
        "    run = Run.read(folder)",
    )
