"""A drive that clients share: one control process per plan, and the lease of its handle."""

from __future__ import annotations

from app.kit.prompt_threads import PROMPT_THREADS
from app.kit.values import Position
from app.messages.client import Client
from app.tabs.rehearse.drive_process import DriveProcess
from app.tabs.rehearse.drive_record import DriveRecord
from app.tabs.rehearse.lease import Lease
from vfix_engine.worlds.rigid.realtime import RehearsalProcess


class SharedDrive(DriveProcess):
    """The drive of one plan. What a client's role or the lease does not allow, its methods do not do. Thread-safe."""

    def __init__(self) -> None:
        super().__init__()
        self.lease = Lease()
        self.watchers: set[str] = set()

    def _held(self, client: Client) -> RehearsalProcess | None:
        return self._live() if self.lease.held_by(client) else None

    def _instructed(self, client: Client) -> RehearsalProcess | None:
        return self._live() if self.lease.held_by(client) or client.role == "instructs" else None

    def read(self, client: Client, take_words: bool = False) -> DriveRecord:
        """The drive as it is now; take_words: with what the process has said to the holder, which is said once."""
        with self._lock:
            process, holder = self._process, self.lease.holder
            mine = holder is not None and holder.id == client.id
            instructs = mine or client.role == "instructs"
            words = tuple(self._words_for_holder) if mine and take_words else ()
            if words:
                self._words_for_holder.clear()
            return DriveRecord(
                state=self._state,
                words=self._words,
                snapshot=None if process is None else process.snapshot(),
                prepared=self._prepared,
                robot=self._robot,
                plan_key=self._plan_key,
                target_id=self._target_id,
                settings=self._talk.in_force,
                answered=self._talk.answered,
                refusal=self._talk.refusal,
                holder=holder,
                mine=mine,
                hand_lost=mine and process is not None and process.hand_lost,
                may_instruct=instructs,
                may_switch=instructs or (holder is None and client.may_hold),
                words_for_holder=words,
                accepted=self._talk.accepted if mine else {},
                unrecorded=self._unrecorded,
            )

    # -- the hand; quick and from any thread

    def set_grip(self, client: Client, position: Position, takes_hold: bool = True) -> None:
        """The hand is at (3,) [mm]; a hand that only moves on and was let go of has to take hold again first."""
        process = self._process  # one read, of which no lock makes more
        if process is None or not (takes_hold or self._hand == client.id) or not self.lease.held_by(client):
            return
        self._hand = client.id
        process.set_grip(position)
        PROMPT_THREADS.hear()

    def heartbeat(self, client: Client) -> None:
        """The button or key is still down. It never takes hold: a hand that was lost has to press or to move."""
        if (process := self._held(client)) is not None:
            process.heartbeat()
            PROMPT_THREADS.hear()

    def release(self, client: Client) -> None:
        """The hand lets go of everything, keys included; it is forgotten also when there is no process just now."""
        if self._hand == client.id:
            self._hand = None
        if (process := self._held(client)) is not None:
            process.release()

    def release_grip(self, client: Client) -> None:
        """The pointer is up; keys that are down go on when there was no hand on the grip."""
        if self._hand == client.id:
            self.release(client)

    def drive(self, client: Client, direction: int) -> None:
        if (process := self._held(client)) is not None:
            process.drive(direction)
            PROMPT_THREADS.hear()

    def twist(self, client: Client, direction: int) -> None:
        if (process := self._held(client)) is not None:
            process.twist(direction)
            PROMPT_THREADS.hear()

    # -- the wishes of the holder

    def run(self, client: Client) -> None:
        if (process := self._held(client)) is not None:
            process.run()

    def halt(self) -> None:
        """Whoever watches may stop the robot where it is; only the holder of the handle lets it go on."""
        if (process := self._live()) is not None:
            process.pause()

    def pause(self, client: Client) -> None:
        if (process := self._held(client)) is not None:
            process.pause()

    def reset(self, client: Client) -> None:
        if (process := self._held(client)) is not None:
            process.reset()

    def set_mode(self, client: Client, mode: str, target_id: str | None) -> None:
        """Another mode; target_id: what to inspect, a target of the scene that is driven. Raises PlanError."""
        process = self._instructed(client)
        with self._lock:
            prepared = self._prepared
        if process is None or prepared is None:
            return
        index = None if target_id is None else prepared.target_index(target_id)
        process.set_mode(mode, index)
        self._target_id = target_id or self._target_id

    def change_settings(self, client: Client, values: dict[str, float]) -> None:
        """Ask the process for other settings, clamped; raises InputError for an unknown name."""
        process = self._instructed(client)
        if process is None:
            return
        with self._lock:
            settings = self._talk.wish(values)
        if settings is not None:
            self._ask(process, settings)

    def leave(self, client: Client) -> None:
        """The client is gone: whatever it held is let go of at once (HAZ-11)."""
        self.release(client)
        self.lease.let_go(client)

    def kept(self, values: dict[str, float]) -> None:
        """The plan has kept these settings, or never will."""
        with self._lock:
            self._talk.kept(values)
