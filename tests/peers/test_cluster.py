"""`monte_carlo` on a dask.distributed cluster: a scheduler and two workers, processes on loopback."""

import signal
import time
from functools import partial
from pathlib import Path

import cluster_tasks
import numpy as np
import pytest
from cluster import on_loopback
from distributed import Client

import tmalib as tma

RUNS = 3000  # six chunks


@pytest.fixture
def cluster(tmp_path):
    """Address of the scheduler, and the workers' processes."""
    with on_loopback(tmp_path / "workers", paths=[Path(__file__).parent]) as found:
        yield found


def connect(address):
    client = Client(address, timeout=60)
    client.wait_for_workers(2, timeout=60)
    return client


def test_the_same_bits_as_alone(cluster):
    with connect(cluster[0]) as client, client.get_executor() as executor:
        found = tma.monte_carlo(cluster_tasks.table, RUNS, "cluster", executor=executor)
    wanted = tma.monte_carlo(cluster_tasks.table, RUNS, "cluster")
    for key, values in wanted.items():
        np.testing.assert_array_equal(found[key], values)


def test_a_worker_that_is_killed_is_replaced_by_the_other(cluster, tmp_path):
    """What the lost worker had begun the other one does; what it had finished is kept."""
    address, workers = cluster
    (notes := tmp_path / "notes").mkdir()
    task = partial(cluster_tasks.slow, str(notes))
    wanted = tma.monte_carlo(cluster_tasks.draw, RUNS, "cluster")
    heard = []

    def kill_one(finished, total):
        heard.append(finished)
        if len(heard) == 1:
            workers[0].send_signal(signal.SIGKILL)

    with connect(address) as client, client.get_executor(retries=3) as executor:
        found = tma.monte_carlo(
            task, RUNS, "cluster", executor=executor, progress=kill_one, keep=tmp_path / "kept"
        )
    np.testing.assert_array_equal(found["x"], wanted["x"])
    assert heard == [500, 1000, 1500, 2000, 2500, 3000]
    assert workers[0].wait(30) == -signal.SIGKILL
    assert len(list((tmp_path / "kept").glob("*.npz"))) == 6


def test_after_an_interrupt_a_rerun_goes_on(cluster, tmp_path):
    (notes := tmp_path / "notes").mkdir()
    task, keep = partial(cluster_tasks.slow, str(notes)), tmp_path / "kept"

    def stop(finished, total):
        raise KeyboardInterrupt

    with connect(cluster[0]) as client:
        with client.get_executor() as executor, pytest.raises(KeyboardInterrupt):
            tma.monte_carlo(task, RUNS, "cluster", executor=executor, progress=stop, keep=keep)
        time.sleep(1)
        before = {path.name for path in keep.glob("*.npz")}
        assert before
        with client.get_executor() as executor:
            found = tma.monte_carlo(task, RUNS, "cluster", executor=executor, keep=keep)
    np.testing.assert_array_equal(found["x"], tma.monte_carlo(cluster_tasks.draw, RUNS, "cluster")["x"])
    times = [sum(path.name.startswith(f"{k}-") for path in notes.iterdir()) for k in range(6)]
    assert all(times[int(name.split("-")[1])] == 1 for name in before), "kept chunks only once"
