"""Generate a data set: tar shards of line drawings with all parameters that made them.

A data set is a folder of WebDataset shards, `shard-000000.tar` and on, of `KEY.json` and `KEY.png`
(8-bit grey, black lines on white), and `manifest.json` with counts and checksums, written last.
On request a sample also holds `KEY.ply`, the posed mesh. The same seed gives the same bytes,
whatever the number of workers, on this computer or on a Dask cluster of the same packages and
processors, and also after an interrupted run that was resumed.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import nullcontext
from multiprocessing import get_context
from pathlib import Path

from . import cluster
from .samples import ENGINES, SIZE, Recipe, make_sample
from .shards import MANIFEST, holds, read_meshes, read_shards, write_manifest, write_shard
from .workers import end_with

__all__ = ["ENGINES", "SHARD", "SIZE", "generate", "make_sample", "read_meshes", "read_shards"]

SHARD = 250  # samples in each shard but the last
MESHES = 25  # the same with meshes, 2 MB each: a worker of a cluster holds whole shards in memory
RECYCLED = 4  # shards after which a worker is replaced: a precaution for Blender's memory
Progress = Callable[[int, int], None]

_OURS = re.compile(rf"shard-\d{{6}}\.tar|{re.escape(MANIFEST)}|preview\.png")
_TORN = re.compile(rf"\.(shard-\d{{6}}\.tar|{re.escape(MANIFEST)})\.\d+")  # a killed run's


def generate(
    count: int,
    out: Path | str,
    seed: int = 0,
    engine: str = "contours",
    jobs: int = 1,
    resume: bool = False,
    scheme: str = "sparse",
    strokes: bool = False,
    meshes: bool = False,
    dask: str | None = None,
    progress: Progress | None = None,
) -> list[Path]:
    """Write a data set of `count` samples into the folder `out`; returns its shards.

    With `resume`, whole shards of an earlier run with the same seed are kept; with `strokes`, the
    samples keep the coordinates of what was drawn; with `meshes`, the posed mesh. `dask` is the
    address of a scheduler, tcp://HOST:PORT, whose workers make the shards instead of `jobs`
    processes here. Raises ValueError for impossible arguments, for a folder that holds shards
    already (when not resuming) or other files, for a disk that cannot be written, and for a
    cluster that is not there, differs from this computer, or is lost.
    """
    if count < 1:
        raise ValueError(f"--count must be at least 1, got {count}")
    if jobs < 1:
        raise ValueError(f"--jobs must be at least 1, got {jobs}")
    if dask is not None and jobs > 1:
        raise ValueError(
            "--jobs are processes of this computer, and with --dask the cluster's workers draw; "
            "leave one of the two out"
        )
    recipe = Recipe(seed, scheme, engine, strokes, meshes)
    recipe.check()
    out = Path(out)
    each = min(SHARD, MESHES) if meshes else SHARD
    try:
        with nullcontext() if dask is None else cluster.connect(dask, recipe) as client:
            _open_folder(out, resume)
            plan = {
                out / f"shard-{k:06d}.tar": range(k * each, min((k + 1) * each, count))
                for k in range(-(-count // each))
            }
            todo = {
                path: indices
                for path, indices in plan.items()
                if not (path.exists() and holds(path, indices, recipe))
            }
            done = count - sum(map(len, todo.values()))
            made = cluster.run(client, todo, recipe) if client else _run(todo, recipe, jobs)
            for finished in made:
                done += finished
                if progress:
                    progress(done, count)
        write_manifest(out, plan, recipe)
    except OSError as problem:
        raise ValueError(
            f"{out} cannot be written ({problem.strerror or problem}); what is whole stays: "
            "make room or choose another disk, and run again with --resume"
        ) from problem
    except BrokenProcessPool:
        raise ValueError(
            "a worker was killed, perhaps for want of memory; run again with --resume and "
            "fewer --jobs"
        ) from None
    return list(plan)


def _open_folder(out: Path, resume: bool) -> None:
    """Make the folder, or see that it is ours; clear what a killed run left half-written."""
    if out.exists() and not out.is_dir():
        raise ValueError(f"{out} is a file; --out needs a folder")
    out.mkdir(parents=True, exist_ok=True)
    names = {path.name: path for path in out.iterdir()}
    if not resume and any(name.startswith("shard-") for name in names):
        raise ValueError(f"{out} already holds shards; choose another folder or add --resume")
    foreign = sorted(n for n in names if not _OURS.fullmatch(n) and not _TORN.fullmatch(n))
    if foreign:
        raise ValueError(
            f"{out} holds something else ('{foreign[0]}'); choose a new or an empty folder"
        )
    for name, path in names.items():
        if _TORN.fullmatch(name):
            path.unlink(missing_ok=True)


def _run(todo: dict[Path, range], recipe: Recipe, jobs: int) -> Iterator[int]:
    if jobs == 1 or len(todo) < 2:
        for path, indices in todo.items():
            yield write_shard(path, indices, recipe)
        return
    recycled = RECYCLED if recipe.engine == "freestyle" else None
    context = get_context("spawn")
    with ProcessPoolExecutor(
        jobs,
        mp_context=context,
        initializer=end_with,
        initargs=(os.getpid(),),
        max_tasks_per_child=recycled,
    ) as pool:
        futures = [pool.submit(write_shard, path, i, recipe) for path, i in todo.items()]
        try:
            for future in as_completed(futures):
                yield future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
