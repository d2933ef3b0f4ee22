"""Trials on the workers of a Dask scheduler: the results of one process, also after a worker was killed."""

import os
import pickle
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from vfix_engine.errors import ControlError, InputError
from vfix_engine.study import cluster
from vfix_engine.study.endoscopy import label_run, polyp_run
from vfix_engine.study.experiment import kwok2013_1, kwok2013_2
from vfix_engine.study.experiment.arms import ArmKey, seed_of, subject_of
from vfix_engine.study.experiment.cavity import cavity_of
from vfix_engine.study.experiment.colon import colon_of
from vfix_engine.study.farm import run_all
from vfix_engine.worlds.snake.settings import ARMS

distributed = pytest.importorskip("distributed")
pytestmark = pytest.mark.filterwarnings("ignore")  # of the cluster's own processes and sockets


class Killed:
    """Squares numbers; the worker that comes to number 3 is killed, the first time only or each time."""

    def __init__(self, mark: Path, always: bool) -> None:
        self.mark, self.always = mark, always

    def __call__(self, key: int) -> int:
        if key == 3 and (self.always or not self.mark.exists()):
            self.mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return key * key


class Begun:
    """The first moments of a trial of a study of Kwok 2013; keys are (study, its key). The worker that comes first to
    the certified arm of study II is killed, if a mark is named that tells that it was.
    """

    def __init__(self, mark: Path | None = None) -> None:
        self.mark = mark

    def __call__(self, key: tuple[int, ArmKey]) -> Any:
        study, one = key
        if self.mark is not None and study == 2 and one.arm == "certified" and not self.mark.exists():
            self.mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        who, seed = subject_of(one), seed_of(one)
        if study == 1:
            return polyp_run.run_trial(colon_of(one.arm), who, seed, 0.5)
        return label_run.run_trial(cavity_of(one.arm), who, seed, 0.5)


def refuses(key: int) -> int:
    raise InputError(f"no trial {key}")


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A cluster of two processes on this machine."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None, protocol="tcp://"
    ) as made:
        yield made.scheduler_address


def test_results_are_those_of_one_process_in_the_order_of_their_keys(address: str) -> None:
    keys, came = [*range(12, 0, -1)], list[int]()
    found = run_all(abs, keys, keep=lambda key, value: came.append(key), scheduler=address)
    assert list(found.items()) == list(run_all(abs, keys).items())
    assert sorted(came) == sorted(keys)


def test_what_a_killed_worker_had_not_finished_runs_again(address: str, tmp_path: Path) -> None:
    found = run_all(Killed(tmp_path / "killed", False), list(range(20)), scheduler=address)
    assert (tmp_path / "killed").exists()
    assert found == {key: key * key for key in range(20)}


def test_trials_of_kwok_are_equal_here_in_processes_and_on_a_cluster_that_lose_a_worker(
    address: str, tmp_path: Path
) -> None:
    """To the last bit."""
    keys = [(study, ArmKey(4, 1, arm)) for study in (1, 2) for arm in ARMS]
    here = run_all(Begun(), keys)
    pool = run_all(Begun(tmp_path / "pool"), keys, workers=2)
    there = run_all(Begun(tmp_path / "cluster"), keys, scheduler=address)
    assert (tmp_path / "pool").exists()
    assert (tmp_path / "cluster").exists()
    assert here[2, ArmKey(4, 1, "guided")].task.travel_mm > 0.0
    assert repr(here) == repr(pool) == repr(there)
    for record in (kwok2013_1.record, kwok2013_2.record):
        assert pickle.loads(pickle.dumps(record)) is record


def test_a_trial_that_always_kills_its_worker_ends_it(address: str, tmp_path: Path) -> None:
    with pytest.raises(ControlError, match="lost their worker each time"):
        run_all(Killed(tmp_path / "killed", True), [3], scheduler=address)


def test_what_a_trial_raises_is_raised_and_a_user_can_cancel(address: str) -> None:
    with pytest.raises(InputError, match="no trial 4"):
        run_all(refuses, [4], scheduler=address)

    def cancel(key: int, value: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_all(abs, list(range(50)), keep=cancel, scheduler=address)
    assert run_all(abs, [-1], scheduler=address) == {-1: 1}


def test_a_scheduler_that_is_none_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="begins with tcp://"):
        run_all(abs, [1], scheduler="somewhere")
    monkeypatch.setattr(cluster, "CONNECT_S", 0.5)
    with pytest.raises(InputError, match="no Dask scheduler answers"):
        run_all(abs, [1], scheduler="tcp://127.0.0.1:1")
