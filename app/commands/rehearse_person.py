"""`--operator person` of `vfix rehearse`: a simulated person leads the robot along the path."""

from __future__ import annotations

from vfix_engine.errors import ControlError
from vfix_engine.runtime.command import no_command
from vfix_engine.runtime.operator import Act
from vfix_engine.study.operator import Guide, PursuitOperator, as_operator
from vfix_engine.study.person import Person
from vfix_engine.worlds.rigid.dry_run import dry_run
from vfix_engine.worlds.rigid.operators import RigidOperator
from vfix_engine.worlds.rigid.rehearsal import Rehearsal
from vfix_engine.worlds.rigid.system import NO_PATH


def led_by_person(rehearsal: Rehearsal, seed: int) -> RigidOperator:
    """A person who pursues the path of a scene. Raises ControlError where there is none."""
    scene, settings = rehearsal.scene, rehearsal.settings
    if scene.path is None:
        raise ControlError(NO_PATH)
    guide = Guide.of(scene.path, dry_run(scene, settings))
    person = as_operator(PursuitOperator(guide, Person(), scene.tool, settings, seed))
    return lambda system, state: person(system, state) or Act(no_command())
