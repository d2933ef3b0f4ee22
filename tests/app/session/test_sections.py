"""Sections of the page are built only when their keys differ, and are never old for that."""

from __future__ import annotations

import contextlib
import json
import random
from collections.abc import Callable, Iterator

import pytest
from session_doubles import HEAD, SAMPLE, Later, Now, other_case, put_in_place, rehearse_tab
from session_doubles import Robot as RobotDouble

from app.kit.kept import Kept, Same
from app.messages.sections import Section
from app.planning.previews import Preview
from app.plans.operations.document import LockPlan, UndoPlan
from app.plans.operations.points import RenamePoint
from app.plans.service import PlanService
from app.services import Services
from app.session.client_session import ClientSession, make_shared
from app.session.commands import parse_command
from app.session.view_model import ViewModel
from app.settings import Settings
from app.store import Store
from app.tabs.registry import specs
from vfix_engine.errors import VfixError

STEPS = 200
OPTIONS = ("soft_tissue", "remote_centre", "speed_limit")


def test_a_section_is_built_again_only_for_another_key() -> None:
    model, built = ViewModel(), list[int]()
    for key in (1, 1, 2, 2, 1):
        model.publish("plan", Section(key, lambda key=key: built.append(key)))  # type: ignore[misc]
        model.commit()
    assert built == [1, 2, 1]


def test_an_object_in_a_key_is_only_itself() -> None:
    one, equal = [1], [1]
    assert Same(one) == Same(one) != Same(equal)
    kept, made = Kept[int](), iter(range(9))
    assert [kept.get(Same(of), lambda: next(made)) for of in (one, one, equal, one)] == [0, 0, 1, 2]
    with pytest.raises(StopIteration):
        kept.get("new", lambda: next(iter(())))
    assert kept.get("new", lambda: 7) == 7, "what could not be made is not kept"


class Pages:
    """Two clients of one planner and a program of another process, which do what comes into their heads."""

    def __init__(self, services: Services, seed: int) -> None:
        self.services, self.random, self.work = services, random.Random(seed), Later()
        self.shared = make_shared(services)
        self.case = other_case(services).id
        self.plans = [services.plans.documents.duplicate(SAMPLE, f"Plan {n}").id for n in range(2)]
        self.elsewhere = Store(Settings(home=services.store.home, port=0))
        self.sessions = [self._session(f"tab-number-{n}") for n in range(2)]

    def _session(self, name: str) -> ClientSession:
        executor = Now()
        session = ClientSession(name, self.services, self.shared, executor, lambda: "")
        executor.submit = self.work.submit  # type: ignore[method-assign]
        session.greet("holds")
        session._open_first({"case": HEAD, "plan": self.plans[0]})
        return session

    def end(self) -> None:
        for session in self.sessions:
            for tab in session.tabs.values():
                tab.close()
        for shared in self.shared.values():
            if shared is not None:
                shared.close()
        self.services.cases.restore(HEAD)
        for plan_id in self.plans:
            self.services.plans.documents.restore(plan_id)
            self.services.plans.do(plan_id, LockPlan(locked=False))
            self.services.plans.documents.delete(plan_id)
        self.services.cases.delete(self.case)
        for title in self.services.registrations.titles(HEAD):
            self.services.registrations.editor(title.id).set_locked(False)
            self.services.registrations.delete(title.id)
        self.elsewhere.close()

    def command(self, command: str, **fields: object) -> None:
        self.random.choice(self.sessions)._do(parse_command(json.dumps({"type": command, **fields})))

    def step(self) -> None:
        """One act of somebody, which may be refused."""
        pick, place = self.random.choice, [round(self.random.uniform(-40.0, 40.0), 3) for _ in range(3)]
        shown = self.random.choice(self.sessions).tabs["plan"]
        items = [item.id for item in shown.items()] or ["none"]  # type: ignore[attr-defined]
        opened = self.random.choice(self.plans)
        registrations = [title.id for title in self.services.registrations.titles(HEAD)] or ["none"]
        acts: list[Callable[[], object]] = [
            lambda: self.command("step.set", name=pick([spec.name for spec in specs()])),
            lambda: self.command("item.select", item_id=pick(items)),
            lambda: self.command("item.drag", item_id=pick(items), position=place),
            lambda: self.command("item.drop", item_id=pick(items)),
            lambda: self.command("item.delete", item_id=pick(items)),
            lambda: self.command("item.rename", item_id=pick(items), label=pick(["A", "B"])),
            lambda: self.command("add.mode", kind=pick(["point", "target", "none"])),
            lambda: self.command("pick.slice", position=place),
            lambda: self.command(pick(["undo", "redo", "ghost.confirm", "ghost.cancel"])),
            lambda: self.command("lock", locked=self.random.random() < 0.3),
            lambda: self.command(pick(["plan.open", "plan.delete", "plan.restore"]), plan_id=opened),
            lambda: self.command("plan.rename", plan_id=opened, name=pick(["One", "Two"])),
            lambda: self.command("region.draw", purpose=pick(["spare", "remove"]), kind="sphere", sizes_mm=[2.0]),
            lambda: self.command("region.cancel"),
            lambda: self.command("version.save", name=pick(["v1", "v2"])),
            lambda: self.command("version.compare", version_id=pick(self._versions(opened))),
            lambda: self.command("shaft.aim", item_id=pick(items)),
            lambda: self.command("slice.cross", position=place),
            lambda: self.command("view.set", opacity=pick([0.2, 0.9]), slices=pick(["none", "all"])),
            lambda: self.command("registration.new"),
            lambda: self.command("registration.open", registration_id=pick(registrations)),
            lambda: self.command("registration.delete", registration_id=pick(registrations)),
            lambda: self.command("registration.use", used=self.random.random() < 0.7),
            lambda: self.command("pair.add", in_image=place),
            lambda: self.command("pair.select", pair_id=pick(self._pairs())),
            lambda: self.command("pair.change", pair_id=pick(self._pairs()), measured=place),
            lambda: self.command("pair.change", pair_id=pick(self._pairs()), enabled=pick([True, False])),
            lambda: self.command(pick(["registration.undo", "registration.redo", "pair.clear_measured"])),
            lambda: self.command("registration.lock", locked=self.random.random() < 0.3),
            lambda: self.command("rehearsal.options", **{name: pick([True, False]) for name in OPTIONS}),
            lambda: self.command("case.rename", case_id=self.case, name=pick(["Other 1", "Other 2"])),
            lambda: self.command("case.open", case_id=pick([HEAD, HEAD, self.case])),
            lambda: self.services.plans.do(opened, RenamePoint(point_id=pick(items), label=pick(["C", "D"]))),
            lambda: self.services.plans.documents.rename(opened, pick(["Three", "Four"])),
            lambda: PlanService(self.elsewhere).documents.rename(opened, pick(["Elsewhere 1", "Elsewhere 2"])),
            lambda: PlanService(self.elsewhere).do(opened, UndoPlan()),
            lambda: pick([self.services.cases.delete, self.services.cases.restore])(HEAD),
            self._robot,
            lambda: self.work.work and self.work.work.pop(0)(),
        ]  # fmt: skip
        with contextlib.suppress(VfixError):  # refused, with a reason for the user
            pick(acts)()

    def _versions(self, plan_id: str) -> list[str]:
        return [one.id for one in self.services.versions.list(plan_id)] or ["none"]

    def _pairs(self) -> list[str]:
        opened = [session.tabs["register"]._open for session in self.sessions]  # type: ignore[attr-defined]
        return [pair.id for one in opened if one is not None for pair in one.document.content.pairs] or ["none"]

    def _robot(self) -> None:
        tab = rehearse_tab(self.random.choice(self.sessions))
        plan = tab.workspace.plan.current
        if tab.drive is not None and plan is not None and len(plan.content.points) > 1:
            put_in_place(tab.drive, RobotDouble(), plan)


@pytest.fixture(params=[1, 2])
def pages(
    request: pytest.FixtureRequest, phantom_services: Services, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Pages]:
    """Whatever is simulated of a plan is what was simulated of the sample, which is quick."""
    plan, planning = phantom_services.plans.get(SAMPLE), phantom_services.planning
    evaluation, cones = planning.evaluate(plan), planning.cones(plan)
    monkeypatch.setattr(phantom_services.dry_runs, "evaluate", lambda *of, **options: evaluation)
    monkeypatch.setattr(phantom_services.previews, "of", lambda *of, **options: Preview(evaluation))
    monkeypatch.setattr(planning, "cones", lambda *of, **options: cones)
    pages = Pages(phantom_services, request.param)
    yield pages
    pages.end()


def test_what_is_shown_is_what_would_be_built_anew_after_each_of_many_acts(pages: Pages) -> None:
    for number in range(STEPS):
        pages.step()
        pages.services.store.look()  # what another process has stored
        for session in pages.sessions:
            while session._inbox._queue.qsize():
                request = session._inbox.get()
                assert request is not None
                session._guarded(request)
            session._display.publish()
            sources = [session.workspace.case, *(view.tab for view in session._display._active_last())]
            wanted = {name: section for one in sources for name, section in one.sections().items()}
            for name, section in {**wanted, **session._display.own_sections()}.items():
                assert session.view_model.read(name) == section.build(), (number, name)
