"""A dask.distributed cluster on loopback: a scheduler and workers, each a process of its own."""

import os
import socket
import subprocess
import sys
from contextlib import contextmanager

WORKER = ("--nworkers", "1", "--nthreads", "1", "--no-nanny", "--no-dashboard")


def free_port():
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def commands(address, workers, folder):
    """What starts the scheduler and the workers, after ``python -m``."""
    scheduler = ["dask", "scheduler", "--host", address, "--no-dashboard"]
    worker = ["dask", "worker", address, *WORKER, "--local-directory", str(folder)]
    return [scheduler] + [worker] * workers


@contextmanager
def on_loopback(folder, workers=2, paths=()):
    """The scheduler's address, and the workers' processes; all are stopped at the end.

    ``paths`` are folders from which workers import tasks, besides those of this process.
    """
    address = f"tcp://127.0.0.1:{free_port()}"
    known = os.pathsep.join([*map(str, paths), os.environ.get("PYTHONPATH", "")])
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": known}
    started = []
    try:
        for command in commands(address, workers, folder):
            started.append(
                subprocess.Popen(
                    [sys.executable, "-m", *command],
                    env=environment,
                    start_new_session=True,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                )
            )
        yield address, started[1:]
    finally:
        for process in reversed(started):  # the scheduler last: a worker waits for one that has gone
            process.terminate()
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait(10)
