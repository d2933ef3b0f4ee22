"""One scene under attack: episodes of changing settings, modes, solvers and hands."""

from __future__ import annotations

import time
import zlib
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np

from vfix_engine.arrays import Array
from vfix_engine.control import Controller, ControlSettings
from vfix_engine.errors import ControlError, StartRefused
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.worlds.rigid.rehearsal import Rehearsal, RehearsalState
from vfix_engine.worlds.rigid.scene import Scene

from .arenas import BUILDERS
from .assaults import ASSAULTS, lying_solver
from .bodies import Judges
from .hands import Memory
from .watch import Ledger, Tally, Watch

EPISODE = (60, 240)  # steps
PLACES_TRIED = 60
CHOSEN = (*ASSAULTS, "past the program", "past the program")  # with frequencies by their number of occurrences
LIES = 0.06  # fraction of the episodes with a lying solver
EXTREME = 0.1  # fraction of the settings, except for the chosen ones, at an end of their range
CHOSEN_SETTINGS = {
    "dt_s", "margin_mm", "threshold_mm", "gain_mm_per_s_per_n", "force_cap_n",
    "rotation_gain_rad_per_s_per_nmm", "k_tau", "k_d", "target_tolerance_mm",
}  # fmt: skip
CHANGES = 0.01  # fraction of the steps that change the mode
MOVES = 0.03  # the same in scenes with moving anatomy, which then moves
RUSHED = 1  # fast episodes at the start
RUSH = {"dt_s": 5e-3, "gain_mm_per_s_per_n": 10.0, "force_cap_n": 20.0}
OTHER_SOLVERS = (None,) * 17 + ("daqp", "daqp", "osqp")  # None: the default


class Campaign:
    """Attacks one scene for a number of steps; a function of scene, seed and steps alone (HAZ-13)."""

    def __init__(
        self,
        name: str,
        seed: int,
        steps: int,
        coal: ModuleType | None,
        share: float = 0.1,
        replays: int = 40,
        sabotage: Callable[[Controller], None] | None = None,
        assaults: Sequence[str] = CHOSEN,
    ):
        """Prepare the campaign.

        share: fraction of the steps whose pose coal measures again. replays: number of finer replays measured by coal.
        sabotage: modifies every controller, to prove that the judges detect it. assaults: names, repeated by frequency.
        """
        self._name, self._steps, self._coal = name, steps, coal
        self._sabotage, self._assaults = sabotage, list(assaults)
        self._random = np.random.default_rng([seed, zlib.crc32(name.encode())])
        self.tally = Tally()
        self._ledger = Ledger(self.tally, share, replays)

    def run(self) -> dict[str, Any]:
        """Run the campaign and return its figures; ``skipped`` states the reason if there are none."""
        begin = time.perf_counter()
        arena = BUILDERS[self._name](self._random)
        if isinstance(arena, str):
            return {"name": self._name, "skipped": arena}
        self._arena, self._judges = arena, Judges(arena.scene, self._coal)
        q = np.array(arena.scene.q_start)
        while self.tally.steps < self._steps:
            q = self._episode(q)
        return {
            "name": self._name,
            "triangles": len(arena.scene.tree.mesh.faces),
            "zones": len(arena.scene.zones),
            **self.tally.counts(),
            "deepest_mm": self.tally.deepest_mm,
            "least_room_mm": self.tally.least_room_mm if np.isfinite(self.tally.least_room_mm) else None,
            "used": dict(sorted(self.tally.used.items())),
            "failures": self.tally.failures,
            "hash": self._ledger.digest.hexdigest(),
            "seconds": time.perf_counter() - begin,
        }

    def _settings(self) -> ControlSettings:
        """Return random settings, most often usual values, and sometimes extreme ones."""
        pick = self._random.choice
        fast = self._random.random() < 0.3
        ends = {
            name: (bound.low, bound.high)[int(self._random.integers(2))]
            for name, bound in ControlSettings.bounds().items()
            if name not in CHOSEN_SETTINGS and self._random.random() < EXTREME
        }
        return ControlSettings(
            **ends,
            dt_s=float(pick((1e-4, 1e-3, 1e-3, 1e-3, 5e-3, 2e-2))),
            margin_mm=float(pick(self._arena.margins)),
            threshold_mm=float(pick((0.5, 1.0, 3.0, 3.0, 5.0))),
            gain_mm_per_s_per_n=10.0 if fast else 2.0,
            force_cap_n=20.0 if fast else 5.0,
            rotation_gain_rad_per_s_per_nmm=float(pick((4e-4, 4e-4, 5e-3))),
            k_tau=float(pick((0.0, 0.0, 1.0))),
            k_d=float(pick((0.2, 0.0, 0.9))),
            target_tolerance_mm=float(pick((0.015, 0.2))),
        )

    def _episode(self, q: Array) -> Array:
        """Run one episode of one assault, and return the joints at its end."""
        tally = self.tally
        # The first episode moves quickly into contact, where the other assaults begin.
        rushing = tally.episodes < RUSHED
        settings = replace(self._settings(), **RUSH) if rushing else self._settings()
        lies = not rushing and self._random.random() < LIES
        begun = self._begin(q, settings, lies)
        if begun is None:
            tally.refused_starts += 1
            return np.array(self._arena.scene.q_start)
        rehearsal, state = begun
        name = "hand: to the nearest bone" if rushing else str(self._random.choice(self._assaults))
        if not rushing:
            state = self._in_some_mode(rehearsal, state)
        tally.used.update((name, f"mode: {state.mode}"))
        tally.episodes += 1
        memory = Memory(np.random.default_rng(self._random.integers(2**63)))
        limits = name != "past the program"
        watch = Watch(self._ledger, self._judges, settings, rehearsal.scene.robot, state, limits)
        self._ledger.doing = f"{name}, lying solver" if lies else name
        tally.used.update(["lying solver"] * lies)
        length = min(int(self._random.integers(*EPISODE)), self._steps - tally.steps)
        with lying_solver(memory.random) if lies else nullcontext():
            for _ in range(length):
                try:
                    after, snapshot = ASSAULTS[name](memory, rehearsal, state)
                except Exception as error:  # of any type, since a step must never raise
                    tally.exceptions += 1
                    tally.fail("exception", assault=name, error=repr(error))
                    tally.steps += 1
                    break
                watch.judge(state, after, snapshot)
                memory.held, memory.count = snapshot.held, memory.count + 1
                state = after
                if self._random.random() < (CHANGES if self._arena.moves == 0.0 else MOVES):
                    state = self._in_some_mode(rehearsal, state)
                    if self._arena.moves > 0.0:
                        rehearsal = self._moved(rehearsal, state)
                        watch = Watch(self._ledger, self._judges, settings, rehearsal.scene.robot, state, limits)
        return state.tool.q

    def _begin(self, q: Array, settings: ControlSettings, lies: bool) -> tuple[Rehearsal, RehearsalState] | None:
        """Return a rehearsal that continues at q, or begins at or near the start."""
        scene = self._arena.scene
        robot, rehearsal = scene.robot, self._rehearsal(scene, settings, lies)
        for attempt in range(PLACES_TRIED):
            if attempt == 1 or (attempt == 0 and self._random.random() < 0.3):
                q = np.array(scene.q_start)
            elif attempt > 1:
                spread = np.where(robot.revolute, 0.1, 8.0) * self._random.uniform(-1, 1, len(q))
                q = np.clip(scene.q_start + spread, robot.lower, robot.upper)
            rehearsal.scene = replace(scene, q_start=q)
            try:
                return rehearsal, rehearsal.start("free")
            except StartRefused:
                continue
        return None

    def _moved(self, rehearsal: Rehearsal, state: RehearsalState) -> Rehearsal:
        """Move the anatomy but not the tool, which may then be inside the margin (HAZ-04)."""
        mesh = self._judges.mesh
        shift = self._random.normal(size=3) * self._arena.moves
        tree = ProximityTree(TriangleMesh(np.asarray(mesh.vertices) + shift, mesh.faces))
        self._arena = replace(self._arena, scene=replace(self._arena.scene, tree=tree))
        self._judges = Judges(self._arena.scene, self._coal)
        moved = rehearsal.with_anatomy(tree)
        if self._sabotage is not None:
            self._sabotage(moved.controller)
        if moved.controller.measure(state.tool.q).clearance < rehearsal.settings.margin_mm:
            self.tally.inside_starts += 1
        return moved

    def _rehearsal(self, scene: Scene, settings: ControlSettings, lies: bool) -> Rehearsal:
        rehearsal = Rehearsal(scene, settings)
        solver = OTHER_SOLVERS[int(self._random.integers(len(OTHER_SOLVERS)))]
        solver = "daqp" if lies else solver  # the solver that the lying one replaces
        if solver is not None:
            rehearsal.controller = Controller(
                scene.placed_robot(), scene.tool, scene.tree, settings, solver, scene.zones, scene.fixtures
            )
        if self._sabotage is not None:
            self._sabotage(rehearsal.controller)
        return rehearsal

    def _in_some_mode(self, rehearsal: Rehearsal, state: RehearsalState) -> RehearsalState:
        mode = str(self._random.choice(self._arena.modes))
        target = int(self._random.integers(max(len(self._arena.scene.targets), 1)))
        try:
            return rehearsal.with_mode(state, mode, target)
        except ControlError:
            return state
