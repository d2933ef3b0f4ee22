"""Episodes of the rigid tool under attack: changing settings, tasks, solvers and operators, and anatomy that moves."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np

from benchmarks.attack import campaign
from benchmarks.report import need
from vfix_engine.arrays import Array
from vfix_engine.control import Controller, ControlSettings
from vfix_engine.control.qp import DUAL
from vfix_engine.errors import ControlError, StartRefused
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.runtime.requests import SetTask
from vfix_engine.worlds.rigid.scene import Scene
from vfix_engine.worlds.rigid.state import RehearsalState
from vfix_engine.worlds.rigid.system import RigidSystem

from .arenas import BUILDERS, Arena
from .assaults import ASSAULTS, lying_solver
from .bodies import Judges
from .operators import Memory
from .watch import RigidTally, Watch

EPISODE = (60, 240)  # steps
PLACES_TRIED = 60
PAST = "past the program"
CHOSEN = (*ASSAULTS, PAST, PAST)  # with frequencies by their number of occurrences
LIES = 0.06  # fraction of the episodes with a lying solver
EXTREME = 0.1  # fraction of the settings, except for the chosen ones, at an end of their range
CHOSEN_SETTINGS = {
    "dt_s", "margin_mm", "threshold_mm", "gain_mm_per_s_per_n", "force_cap_n",
    "rotation_gain_rad_per_s_per_nmm", "k_tau", "k_d", "target_tolerance_mm", "compliance_mm_per_n",
}  # fmt: skip
COMPLIANCES = (0.0,) * 9 + (0.02,)  # mm/N; a larger one refuses most starts, as the margin grows by it
CHANGES = 0.01  # fraction of the steps that change the mode
MOVES = 0.03  # the same in scenes with moving anatomy, which then moves
RUSHED = 1  # fast episodes at the start
RUSH = {"dt_s": 5e-3, "gain_mm_per_s_per_n": 10.0, "force_cap_n": 20.0}
OTHER_SOLVERS = (None,) * 17 + ("daqp", "daqp", "osqp")  # None: the default

Episode = campaign.Episode[Memory, RigidSystem, RehearsalState]


class RigidCampaign(campaign.Campaign[Arena, RigidTally, Memory, RigidSystem, RehearsalState]):
    """Attacks the rigid tool in one scene.

    with_coal: whether coal measures again: the poses of a fraction ``share`` of the steps, and ``replays`` replays.
    sabotage: modifies every controller, to prove that the judges detect it. assaults: names, repeated by frequency.
    """

    scenes, tally_type, input_key = BUILDERS, RigidTally, "assault"

    def __init__(
        self,
        name: str,
        seed: int,
        steps: int,
        with_coal: bool = True,
        share: float = 0.1,
        replays: int = 40,
        sabotage: Callable[[Controller], None] | None = None,
        assaults: Sequence[str] = CHOSEN,
    ):
        super().__init__(name, seed, steps)
        self._coal: ModuleType | None = need("coal") if with_coal else None
        self._share, self._replays = share, replays
        self._sabotage, self._assaults = sabotage, list(assaults)
        self._compliances = np.random.default_rng([seed, zlib.crc32(name.encode()), 1])
        self._judges: Judges | None = None
        self._last: Episode | None = None

    @staticmethod
    def shares(total: dict[str, Any]) -> dict[str, float]:
        """Return the shares of the steps that had to keep the joint limits, and of emergencies among these."""
        return {
            "limits_judged_share": total["limits_judged"] / max(total["steps"], 1),
            "emergency_share": total["emergencies"] / max(total["limits_judged"], 1),
        }

    def size(self) -> dict[str, int]:
        """Return the number of triangles and zones."""
        return {"triangles": len(self.arena.scene.tree.mesh.faces), "zones": len(self.arena.scene.zones)}

    def begin(self) -> Episode | None:
        """Return an episode of one assault that continues where the last one ended, or begins at or near the start."""
        # The first episode moves quickly into contact, where the other assaults begin.
        rushing = self.tally.episodes < RUSHED
        settings = replace(self._settings(), **RUSH) if rushing else self._settings()
        lies = not rushing and self.random.random() < LIES
        begun, self._last = self._begun(self._last, settings, lies), None
        if begun is None:
            return None
        system, state = begun
        name = "hand: to the nearest bone" if rushing else str(self.random.choice(self._assaults))
        if not rushing:
            state = self._in_some_mode(system, state)
        self.tally.episodes += 1
        memory = Memory(np.random.default_rng(self.random.integers(2**63)))
        doing = (name, *["lying solver"] * lies)
        self._last = campaign.Episode(
            system,
            state,
            ASSAULTS[name](memory),
            memory,
            self._watch(system, state, doing).judge,
            int(self.random.integers(*EPISODE)),
            (*doing, f"mode: {state.mode}"),
            lying_solver(memory.random) if lies else nullcontext(),
        )
        return self._last

    def between(self, episode: Episode) -> None:
        """Change the mode now and then, and move anatomy that moves."""
        if self.random.random() >= (CHANGES if self.arena.moves == 0.0 else MOVES):
            return
        state = episode.state = self._in_some_mode(episode.system, episode.state)
        if self.arena.moves > 0.0:
            episode.system = self._moved(state)
            episode.judge = self._watch(episode.system, state, episode.doing[:-1]).judge

    def _watch(self, system: RigidSystem, state: RehearsalState, doing: Sequence[str]) -> Watch:
        if self._judges is None:
            self._judges = Judges(self.arena.scene, self._coal)
        coal = self._share, self._replays
        return Watch(self.tally, self._judges, system, state, *coal, ", ".join(doing), limits=doing[0] != PAST)

    def _settings(self) -> ControlSettings:
        """Return random settings, most often usual values, and sometimes extreme ones."""
        pick = self.random.choice
        fast = self.random.random() < 0.3
        ends = {
            name: (bound.low, bound.high)[int(self.random.integers(2))]
            for name, bound in ControlSettings.bounds().items()
            if name not in CHOSEN_SETTINGS and self.random.random() < EXTREME
        }
        return ControlSettings(
            **ends,
            dt_s=float(pick((1e-4, 1e-3, 1e-3, 1e-3, 5e-3, 2e-2))),
            margin_mm=float(pick(self.arena.margins)),
            threshold_mm=float(pick((0.5, 1.0, 3.0, 3.0, 5.0))),
            gain_mm_per_s_per_n=10.0 if fast else 2.0,
            force_cap_n=20.0 if fast else 5.0,
            rotation_gain_rad_per_s_per_nmm=float(pick((4e-4, 4e-4, 5e-3))),
            k_tau=float(pick((0.0, 0.0, 1.0))),
            k_d=float(pick((0.2, 0.0, 0.9))),
            target_tolerance_mm=float(pick((0.015, 0.2))),
            compliance_mm_per_n=float(self._compliances.choice(COMPLIANCES)),
        )

    def _begun(
        self, last: Episode | None, settings: ControlSettings, lies: bool
    ) -> tuple[RigidSystem, RehearsalState] | None:
        scene = self.arena.scene
        q: Array = np.array(scene.q_start) if last is None else last.state.tool.q
        robot, system = scene.robot, self._system(scene, settings, lies)
        for attempt in range(PLACES_TRIED):
            if attempt == 1 or (attempt == 0 and self.random.random() < 0.3):
                q = np.array(scene.q_start)
            elif attempt > 1:
                spread = np.where(robot.revolute, 0.1, 8.0) * self.random.uniform(-1, 1, len(q))
                q = np.clip(scene.q_start + spread, robot.lower, robot.upper)
            system.scene = replace(scene, q_start=q)
            try:
                return system, system.start("free")
            except StartRefused:
                continue
        return None

    def _system(self, scene: Scene, settings: ControlSettings, lies: bool) -> RigidSystem:
        solver = OTHER_SOLVERS[int(self.random.integers(len(OTHER_SOLVERS)))]
        solver = "daqp" if lies else solver  # the solver that the lying one replaces
        return self._sabotaged(RigidSystem(scene, settings, solver or DUAL))

    def _sabotaged(self, system: RigidSystem) -> RigidSystem:
        if self._sabotage is not None:
            self._sabotage(system.controller)
        return system

    def _moved(self, state: RehearsalState) -> RigidSystem:
        """Move the anatomy but not the tool, which may then be inside the margin (HAZ-04)."""
        mesh = self.arena.scene.tree.mesh
        shift = self.random.normal(size=3) * self.arena.moves
        tree = ProximityTree(TriangleMesh(np.asarray(mesh.vertices) + shift, mesh.faces))
        self.arena = replace(self.arena, scene=replace(self.arena.scene, tree=tree))
        self._judges = None
        moved = self._sabotaged(RigidSystem(self.arena.scene, state.settings))
        if moved.controller.measure(state.tool.q).clearance < state.settings.margin_mm:
            self.tally.inside_starts += 1
        return moved

    def _in_some_mode(self, system: RigidSystem, state: RehearsalState) -> RehearsalState:
        mode = str(self.random.choice(self.arena.modes))
        target = int(self.random.integers(max(len(self.arena.scene.targets), 1)))
        try:
            return system.apply(state, SetTask(mode, target))
        except ControlError:
            return state
