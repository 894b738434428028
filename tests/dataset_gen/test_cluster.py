"""Data sets made by a Dask cluster: nothing is lost and nothing twice, whoever is killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import warnings
from importlib.util import find_spec
from pathlib import Path

import pytest

distributed = pytest.importorskip(
    "distributed", reason="Dask is missing: pip install 'sketch-to-face[cluster]'"
)

from dataset_gen import cluster  # noqa: E402
from dataset_gen import generate as module  # noqa: E402
from dataset_gen.generate import generate  # noqa: E402
from dataset_gen.linework import arrays  # noqa: E402

COUNT, SEED = 24, 9


@pytest.fixture(autouse=True)
def small_shards(monkeypatch):
    monkeypatch.setattr(module, "SHARD", 2)


@pytest.fixture(scope="module")
def dask():
    """A scheduler in this process and two worker processes, each watched by a nanny."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=":0"
    ) as started:
        yield started


def small_cluster(workers: int):
    """A scheduler and workers that are threads of this process, to be ended at once."""
    return distributed.LocalCluster(
        n_workers=workers, threads_per_worker=1, processes=False, protocol="tcp",
        dashboard_address=":0",
    )  # fmt: skip


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory) -> dict[str, bytes]:
    """The data set as this process alone makes it."""
    folder = tmp_path_factory.mktemp("undisturbed") / "data"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "SHARD", 2)
        generate(COUNT, folder, seed=SEED)
    return contents(folder)


@pytest.fixture
def fresh_versions():
    """What is installed is asked once in each process; here it is made up."""
    cluster.installed.cache_clear()
    yield
    cluster.installed.cache_clear()


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def soon(condition, seconds=30):
    """Whether a condition comes true before patience ends."""
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
    return condition()


# --- whoever is killed ----------------------------------------------------------------------------


def test_a_worker_is_killed_and_nothing_is_missing(tmp_path, dask, undisturbed):
    with distributed.Client(dask, set_as_default=False) as client:
        processes = client.run(os.getpid)
    at_work, killed = [], []

    def kill(done: int, total: int) -> None:
        at_work.append(len(dask.scheduler.tasks))
        if not killed:
            workers = dask.scheduler.workers
            busy = [address for address in processes if workers[address].processing]
            os.kill(processes[busy[0]], signal.SIGKILL)
            killed.append(processes[busy[0]])

    folder = tmp_path / "data"
    shards = generate(COUNT, folder, seed=SEED, dask=dask.scheduler_address, progress=kill)
    assert contents(folder) == undisturbed
    assert len(shards) == COUNT // 2 == len(at_work)
    assert max(at_work) <= cluster.AHEAD * 2  # what is held does not grow with the data set
    assert soon(lambda: not dask.scheduler.tasks)
    with distributed.Client(dask, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=60)
        assert not set(killed) & set(client.run(os.getpid).values())


def test_the_client_is_killed_and_goes_on_with_other_workers(tmp_path, dask, undisturbed):
    folder = tmp_path / "data"
    program = (
        "from dataset_gen import generate as g; g.SHARD = 2\n"
        f"g.generate({COUNT}, {str(folder)!r}, seed={SEED}, dask={dask.scheduler_address!r})"
    )
    run = subprocess.Popen([sys.executable, "-c", program], cwd=Path(module.__file__).parents[1])
    while not (folder / "shard-000001.tar").exists():
        assert run.poll() is None
        time.sleep(0.01)
    run.kill()
    run.wait()
    assert len(list(folder.glob("shard-*.tar"))) < COUNT // 2
    (folder / ".shard-000011.tar.99").write_bytes(b"torn")
    assert soon(lambda: not dask.scheduler.tasks)  # its work is dropped
    generate(COUNT, folder, seed=SEED, dask=dask.scheduler_address, resume=True)
    assert contents(folder) == undisturbed


def test_an_interrupt_drops_what_is_pending(tmp_path, dask, undisturbed):
    def interrupt(done: int, total: int) -> None:
        assert dask.scheduler.tasks
        raise KeyboardInterrupt

    folder = tmp_path / "data"
    with pytest.raises(KeyboardInterrupt):
        generate(COUNT, folder, seed=SEED, dask=dask.scheduler_address, progress=interrupt)
    left = contents(folder)
    del left["unfinished.json"]  # the checksum of the one shard
    assert len(left) == 1
    assert left.items() <= undisturbed.items()
    assert soon(lambda: not dask.scheduler.tasks)
    generate(COUNT, folder, seed=SEED, resume=True)  # now without the cluster
    assert contents(folder) == undisturbed


def test_a_shard_that_kills_its_workers_is_named(tmp_path, dask, monkeypatch):
    monkeypatch.setattr(dask.scheduler, "allowed_failures", 0)
    monkeypatch.setattr(cluster, "make", lambda *_: os.kill(os.getpid(), signal.SIGKILL))
    with pytest.raises(ValueError, match=r"every worker that made shard-00000\d.tar was killed"):
        generate(3, tmp_path, seed=SEED, dask=dask.scheduler_address)
    assert not contents(tmp_path)


def test_a_fault_on_a_worker_is_a_fault_of_the_program(tmp_path, dask, monkeypatch):
    monkeypatch.setattr(cluster, "make", lambda *_: open("/nowhere/at/all"))
    with pytest.raises(RuntimeError, match="shard-000000.tar failed on a worker") as caught:
        generate(1, tmp_path, seed=SEED, dask=dask.scheduler_address)
    assert isinstance(caught.value.__cause__, FileNotFoundError)


@pytest.mark.nightly  # Freestyle in several processes, and its Blender that fails, are in each run
@pytest.mark.slow
@pytest.mark.skipif(find_spec("bpy") is None, reason="Blender as a module is missing")
def test_freestyle_draws_on_workers(tmp_path, dask, monkeypatch):
    monkeypatch.setattr(module, "SHARD", 1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # bpy's own start-up scripts are not ours to mend
        generate(2, tmp_path / "one", seed=3, engine="freestyle")
    generate(2, tmp_path / "two", seed=3, engine="freestyle", dask=dask.scheduler_address)
    assert contents(tmp_path / "one") == contents(tmp_path / "two")


def test_blender_that_fails_on_a_worker_is_quoted():
    with pytest.raises(RuntimeError, match="Blender ended with 1: (?s:.*)non-negative"):
        cluster._by_blender(range(1), cluster.Recipe(seed=-1))


# --- a cluster that is not there, or another ------------------------------------------------------


@pytest.mark.parametrize("address", ["", "localhost:8786", "tcp://localhost", "two words"])
def test_what_is_no_address(tmp_path, address):
    with pytest.raises(ValueError, match="an address such as tcp://HOST:8786"):
        generate(1, tmp_path / "d", dask=address)
    assert not (tmp_path / "d").exists()


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "tcp://nobody.invalid:8786"])
def test_no_scheduler(tmp_path, monkeypatch, address):
    monkeypatch.setattr(cluster, "PATIENCE", 0.5)
    with pytest.raises(ValueError, match=f"answers at {address}; start one with `dask scheduler`"):
        generate(1, tmp_path / "d", dask=address)
    assert not (tmp_path / "d").exists()


def test_no_workers_and_workers_that_leave(tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "PATIENCE", 0.5)
    with small_cluster(0) as small:
        with pytest.raises(ValueError, match="no workers; start some with `dask worker tcp:"):
            generate(1, tmp_path / "d", dask=small.scheduler_address)
        assert not (tmp_path / "d").exists()
        small.scale(1)
        with pytest.raises(ValueError, match="has no workers"):
            generate(
                COUNT, tmp_path / "d", dask=small.scheduler_address, seed=SEED,
                progress=lambda done, total: small.scale(0),
            )  # fmt: skip
        assert not list(tmp_path.glob("d/.*"))
        assert list(tmp_path.glob("d/shard-*.tar"))


def test_a_scheduler_that_ends(tmp_path, monkeypatch, caplog):
    monkeypatch.setattr(cluster, "PATIENCE", 2.0)
    with small_cluster(1) as small:
        with pytest.raises(ValueError, match="was lost.*--resume"):
            generate(
                COUNT, tmp_path, dask=small.scheduler_address, seed=SEED,
                progress=lambda done, total: small.close(),
            )  # fmt: skip
    assert not list(tmp_path.glob(".*"))
    assert "distributed.client" not in {record.name for record in caplog.records}


def test_other_packages_on_a_worker(tmp_path, dask, monkeypatch, fresh_versions):
    real = cluster.versions
    monkeypatch.setattr(cluster, "versions", lambda recipe: real(recipe) | {"numpy": "0.5"})
    with pytest.raises(ValueError, match=r"worker tcp://\S+ has numpy \S+ and .*numpy 0.5, which"):
        generate(1, tmp_path / "d", dask=dask.scheduler_address)
    assert not (tmp_path / "d").exists()


def test_numba_on_the_workers_alone(tmp_path, dask, monkeypatch, fresh_versions):
    pytest.importorskip("numba")
    monkeypatch.setattr(cluster, "kernels", lambda: arrays)
    with pytest.raises(ValueError, match=r"has numba \S+ and this computer no numba"):
        generate(1, tmp_path / "d", dask=dask.scheduler_address)


def test_other_sources_on_a_worker(tmp_path, dask, monkeypatch, fresh_versions):
    monkeypatch.setattr(cluster, "__file__", str(tmp_path / "cluster.py"))
    with pytest.raises(ValueError, match=r"has sketch-to-face .*\(\w{8}\) and .*\(\w{8}\)"):
        generate(1, tmp_path / "d", dask=dask.scheduler_address)


def test_a_worker_with_other_packages_that_joins_later(tmp_path, dask, monkeypatch):
    def another(done: int, total: int) -> None:
        monkeypatch.setattr(cluster, "installed", lambda recipe: {"numpy": "0.5"})

    with pytest.raises(ValueError, match="numpy 0.5"):
        generate(COUNT, tmp_path, seed=SEED, dask=dask.scheduler_address, progress=another)
    assert len(list(tmp_path.glob("shard-*.tar"))) == 1


def test_a_worker_without_our_package(tmp_path, dask):
    def block():
        sys.modules["dataset_gen.cluster"], kept = None, sys.modules.get("dataset_gen.cluster")
        sys.modules["dataset_gen.kept"] = kept

    def unblock():
        del sys.modules["dataset_gen.cluster"]
        kept = sys.modules.pop("dataset_gen.kept")
        if kept:
            sys.modules["dataset_gen.cluster"] = kept

    with distributed.Client(dask, set_as_default=False) as client:
        client.run(block)
        try:
            with pytest.raises(ValueError, match="cannot import sketch-to-face.*install it there"):
                generate(1, tmp_path / "d", dask=dask.scheduler_address)
        finally:
            client.run(unblock)
    assert not (tmp_path / "d").exists()


def test_without_dask(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ValueError, match=r"pip install 'sketch-to-face\[cluster\]'"):
        generate(1, tmp_path / "d", dask="tcp://127.0.0.1:8786")
    assert not (tmp_path / "d").exists()


def test_jobs_and_dask_exclude_each_other(tmp_path):
    with pytest.raises(ValueError, match="--jobs are processes of this computer"):
        generate(1, tmp_path / "d", dask="tcp://127.0.0.1:8786", jobs=2)
    assert not (tmp_path / "d").exists()
