"""Clients of one drive that come, go, take hold and push in any order."""

from __future__ import annotations

from typing import Any

from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule
from test_shared_drive import ONE, THREE, TWO, Process

from app.drives.shared_drives import DriveKey, SharedDrives
from app.messages.client import Client

PLAN = DriveKey("case", "plan")


class DriveMachine(RuleBasedStateMachine):
    """HAZ-12: whatever clients do, there are never two holders, and nobody else's hand reaches the robot."""

    clients = st.sampled_from([ONE, TWO, THREE, Client("seer", "watches"), Client("guru", "instructs")])

    def __init__(self) -> None:
        super().__init__()
        self.drives: SharedDrives[Any, Any] = SharedDrives()
        self.believed: Client | None = None
        self.drive, self.process = self.drives.enter(PLAN, ONE), Process()
        self._stand()

    def _stand(self) -> None:
        self.drive._process, self.drive._state = self.process, "ready"  # type: ignore[assignment]

    @rule(client=clients)
    def takes(self, client: Client) -> None:
        if self.drive.lease.take(client):
            assert self.believed in (None, client)
            assert client.role == "holds"
            self.believed = client

    @rule(client=clients)
    def lets_go(self, client: Client) -> None:
        self.drive.leave(client)  # as one that is away for seconds
        self.believed = None if self.believed == client else self.believed

    @rule(client=clients)
    def comes_back(self, client: Client) -> None:
        assert self.drives.enter(PLAN, client) is self.drive

    @rule(client=clients)
    def is_abandoned(self, client: Client) -> None:
        self.lets_go(client)
        self.drives.leave(self.drive, client)
        if not self.drive.watchers:
            assert not self.process.alive
            assert not self.drives.has(self.drive)
            self.drive, self.process, self.believed = self.drives.enter(PLAN, client), Process(), None
            self._stand()

    @rule(client=clients, takes_hold=st.booleans())
    def pushes(self, client: Client, takes_hold: bool) -> None:
        before = len(self.process.told)
        self.drive.set_grip(client, (1.0, 2.0, 3.0), takes_hold)
        self.drive.drive(client, 1)
        self.drive.heartbeat(client)
        self.drive.run(client)
        assert (len(self.process.told) > before) is (client == self.believed)

    @invariant()
    def one_holder_at_most(self) -> None:
        records = [self.drive.read(client) for client in (ONE, TWO, THREE)]
        assert [record.mine for record in records] == [client == self.believed for client in (ONE, TWO, THREE)]
        assert {record.holder for record in records} == {self.believed}


DriveMachine.TestCase.settings = hypothesis_settings(max_examples=40, stateful_step_count=30, deadline=None)
TestDrive = DriveMachine.TestCase
