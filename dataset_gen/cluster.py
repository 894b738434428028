"""Shards made by the workers of a Dask cluster, on as many computers as there are.

A worker sends the bytes of its shard back and the client writes them, so that no disk need be
shared. The client hands out a few shards at a time: what is finished, held and not yet written
stays small however large the data set is. Dask gives the shards of a worker that died to another.
"""

from __future__ import annotations

import hashlib
import io
import logging
import os
import pickle
import queue
import re
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import CancelledError
from contextlib import closing, contextmanager
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import facs_rig
from facs_rig.common.errors import InputError
from facs_rig.common.files import Outputs

from .linework import arrays
from .linework.kernels import kernels
from .samples import Recipe
from .shards import fill, versions

if TYPE_CHECKING:
    from distributed import Client, Future

AHEAD = 2  # shards for each thread: one that it makes and one that waits for it
RETRIES = 2  # of a shard that failed without killing its worker
PATIENCE = 20.0  # seconds without an answer after which it is asked whether anybody is there
T = TypeVar("T")


# --- the client -----------------------------------------------------------------------------------


@contextmanager
def connect(address: str, recipe: Recipe) -> Iterator[Client]:
    """A connection to the scheduler at `address`, whose workers are fit to make these shards.

    Leaving it drops whatever was not finished. Raises InputError where there is no scheduler or no
    worker, and if a worker's packages would give other bytes than those of this computer.
    """
    try:
        from distributed import Client
    except ImportError:
        raise InputError(
            "--dask needs the package distributed: pip install 'sketch-to-face[cluster]'"
        ) from None
    if not re.fullmatch(r"\w+://[^\s/]+:\d+", address):
        raise InputError(f"--dask needs an address such as tcp://HOST:8786, got '{address}'")
    with _quiet():
        try:
            client = Client(address, timeout=PATIENCE, set_as_default=False, name="sketch2face")
        except (OSError, ValueError):
            raise InputError(
                f"no Dask scheduler answers at {address}; start one with `dask scheduler`, and "
                f"workers with {_how(address)}"
            ) from None
        with closing(client):
            with _connection(address):
                try:
                    client.wait_for_workers(1, timeout=PATIENCE)
                except TimeoutError:
                    raise _no_workers(address) from None
                answers = client.run(installed, recipe, on_error="return")
            for worker, told in answers.items():
                if not isinstance(told, OSError):  # it has just left
                    _check(worker, told, recipe)
            yield client


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep Dask's client from logging what is raised here as a sentence."""
    logger = logging.getLogger("distributed.client")
    level = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(level)


def run(client: Client, todo: dict[Path, range], recipe: Recipe) -> Generator[Path, None, None]:
    """Have the shards made and write each as it arrives; yields each that is whole.

    Raises InputError when the cluster is lost or a shard kills its workers; OSError of the disk.
    """
    address = client.scheduler.address  # a lost one forgets it
    waiting = iter(todo.items())
    places: dict[Future, tuple[Path, range]] = {}
    finished: queue.SimpleQueue[Future] = queue.SimpleQueue()
    while True:
        with _connection(address):
            room = AHEAD * max(1, sum(client.nthreads().values())) - len(places)
            for path, indices in islice(waiting, max(0, room)):
                future = client.submit(make, indices, recipe, pure=False, retries=RETRIES)
                places[future] = path, indices
                future.add_done_callback(finished.put)
            if not places:
                return
            future = _patiently(client, lambda: finished.get(timeout=PATIENCE))
            path, indices = places.pop(future)
            worker, told, data = _result(client, future, path)
        _check(worker, told, recipe)  # it may have joined later
        with Outputs() as outputs:
            outputs.beside(path).write_bytes(data)
        future.release()
        del future, data
        yield path


def _result(client: Client, future: Future, path: Path) -> tuple[str, dict, bytes]:
    """What `make` returned. A fault of ours on a worker is raised here as a RuntimeError."""
    from distributed import KilledWorker

    if future.status == "error":
        problem = future.exception()
        if isinstance(problem, KilledWorker):
            raise InputError(
                f"every worker that made {path.name} was killed, perhaps for want of memory; "
                "give each more (dask worker --memory-limit), and run again with --resume"
            )
        raise RuntimeError(f"{path.name} failed on a worker") from problem
    # Bytes may be lost with their worker after all: then they are made again.
    return _patiently(client, lambda: future.result(timeout=10 * PATIENCE))


def _patiently(client: Client, ask: Callable[[], T]) -> T:
    """The answer, however long it takes, while there are workers."""
    while True:
        try:
            return ask()
        except (queue.Empty, TimeoutError):
            if not client.nthreads():
                raise _no_workers(client.scheduler.address) from None


@contextmanager
def _connection(address: str) -> Iterator[None]:
    """Say in a sentence that the cluster is lost."""
    try:
        yield
    except (CancelledError, OSError):
        raise InputError(
            f"the Dask scheduler at {address} was lost; what is whole stays: start it again "
            "(`dask scheduler`) and run with --resume"
        ) from None


def _no_workers(address: str) -> ValueError:
    return ValueError(
        f"the Dask scheduler at {address} has no workers; start some with {_how(address)}, and "
        "run again (with --resume, if shards are there)"
    )


def _how(address: str) -> str:
    return f"`dask worker {address} --nworkers -1 --nthreads 1`"


def _check(worker: str, told: object, recipe: Recipe) -> None:
    """InputError unless a worker has what this computer has."""
    if not isinstance(told, dict):
        raise InputError(
            f"the worker {worker} cannot import sketch-to-face ({told}); install it there"
        )
    for name, here in installed(recipe).items():
        there = told.get(name)
        if there != here:
            raise InputError(
                f"the worker {worker} has {_named(name, there)} and this computer "
                f"{_named(name, here)}, which may show in the files; install the same on both"
            )


def _named(name: str, version: str | None) -> str:
    return f"{name} {version}" if version else f"no {name}"


# --- the workers ----------------------------------------------------------------------------------


@lru_cache(maxsize=8)
def installed(recipe: Recipe) -> dict[str, str | None]:
    """Package -> version, of all that may show in the bytes; None for what does no work here.

    Our own sources and the head count by their content: two checkouts may have one version.
    """
    told = versions(recipe)
    if kernels() is arrays:
        told["numba"] = None
    digest = hashlib.sha256()
    for package in (Path(__file__).parent, Path(facs_rig.__file__).parent):
        for path in sorted([*package.rglob("*.py"), *package.glob("data/*.npz")]):
            data = path.read_bytes()
            digest.update(data.replace(b"\r\n", b"\n") if path.suffix == ".py" else data)
    told["sketch-to-face"] = f"{told['sketch-to-face'] or ''} ({digest.hexdigest()[:8]})".strip()
    return told


def make(indices: range, recipe: Recipe) -> tuple[str, dict[str, str | None], bytes]:
    """One shard, on a worker: the worker's address, what is `installed` there, and the tar."""
    from distributed import get_worker

    data = _by_blender(indices, recipe) if recipe.engine == "freestyle" else _tar(indices, recipe)
    return get_worker().address, installed(recipe), data


def _tar(indices: range, recipe: Recipe) -> bytes:
    buffer = io.BytesIO()
    fill(buffer, indices, recipe)
    return buffer.getvalue()


def _by_blender(indices: range, recipe: Recipe) -> bytes:
    """The same by a process of its own: Blender wants a first thread, which no task is given."""
    child = subprocess.run(
        [sys.executable, "-c", "from dataset_gen.cluster import child; child()"],
        input=pickle.dumps((os.getpid(), indices, recipe)),
        capture_output=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        check=False,
    )
    if child.returncode:
        said = child.stderr.decode(errors="replace").strip()
        raise RuntimeError(f"Blender ended with {child.returncode}: {said[-2000:]}")
    return child.stdout


def child() -> None:
    """What that process does: it reads its task from stdin and writes the tar to stdout."""
    from .workers import end_with

    out = os.dup(1)
    os.dup2(2, 1)  # Blender talks
    parent, indices, recipe = pickle.load(sys.stdin.buffer)
    end_with(parent)
    with os.fdopen(out, "wb") as file:
        file.write(_tar(indices, recipe))
