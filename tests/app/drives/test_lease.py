"""The lease of a handle."""

from __future__ import annotations

from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from app.drives.lease import Lease
from app.messages.client import Client

HOLDERS = [Client(name, "holds") for name in ("client-one-0", "client-two-0", "client-three")]
CLIENTS = [*HOLDERS, Client("client-seer", "watches"), Client("client-guru", "instructs")]


class LeaseMachine(RuleBasedStateMachine):
    """HAZ-12: whatever clients do, there are never two holders."""

    def __init__(self) -> None:
        super().__init__()
        self.lease, self.believed = Lease(), None  # type: Lease, Client | None

    @rule(client=st.sampled_from(CLIENTS))
    def take(self, client: Client) -> None:
        taken = self.lease.take(client)
        assert taken == (client.may_hold and self.believed in (None, client))
        if taken:
            self.believed = client

    @rule(client=st.sampled_from(CLIENTS))
    def let_go(self, client: Client) -> None:
        assert self.lease.let_go(client) == (self.believed == client)
        if self.believed == client:
            self.believed = None

    @invariant()
    def one_holder_at_most(self) -> None:
        assert [client for client in CLIENTS if self.lease.held_by(client)] == (
            [self.believed] if self.believed else []
        )
        assert self.lease.holder == self.believed


LeaseMachine.TestCase.settings = hypothesis_settings(max_examples=60, stateful_step_count=30, deadline=None)
TestLease = LeaseMachine.TestCase
