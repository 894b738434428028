"""Generate a data set: tar shards of line drawings with all parameters that made them.

A data set is a folder of WebDataset shards, `shard-000000.tar` and on, of `KEY.json` and `KEY.png`
(8-bit grey, black lines on white), and `manifest.json` with counts and checksums, written last.
On request a sample also holds `KEY.ply`, the posed mesh. The same seed gives the same bytes,
whatever the number of workers, on this computer or on a Dask cluster of the same packages and
processors, and also after an interrupted run that was resumed.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Generator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, nullcontext
from functools import partial
from multiprocessing import get_context
from pathlib import Path

from facs_rig.common.errors import InputError
from facs_rig.common.files import OutputError, reason_of

from . import cluster
from .folder import MANIFEST, UNFINISHED, digest, kept, opened, same_versions, write_manifest
from .hairdo import HAIR as HAIRED
from .samples import ENGINES, SIZE, Recipe, make_sample
from .sampling import DEFAULT
from .shards import read_meshes, read_shards, versions, write_shard
from .workers import deaf_children, end_with

__all__ = ["ENGINES", "SHARD", "SIZE", "generate", "make_sample", "read_meshes", "read_shards"]

SHARD = 250  # samples in each shard but the last
MESHES = 25  # the same with meshes, 2 MB each: a worker of a cluster holds whole shards in memory
MOST_SHARDS = 1_000_000  # that a name's six digits can tell apart
RECYCLED = 4  # shards after which a worker is replaced: a precaution for Blender's memory
Progress = Callable[[int, int], None]


def generate(
    count: int,
    out: Path | str,
    seed: int = 0,
    engine: str = "contours",
    jobs: int = 1,
    resume: bool = False,
    scheme: str = DEFAULT,
    strokes: bool = False,
    meshes: bool = False,
    dask: str | None = None,
    hair: float = HAIRED,
    progress: Progress | None = None,
) -> list[Path]:
    """Write a data set of `count` samples into the folder `out`; returns its shards.

    With `resume`, whole shards of an earlier run with the same seed are kept, each compared with
    its checksum; with `strokes`, the samples keep the coordinates of what was drawn; with `meshes`,
    the posed mesh. `dask` is the address of a scheduler, tcp://HOST:PORT, whose workers make the
    shards instead of `jobs` processes here; `hair` the share of faces that wear a head of hair
    (of the schemes people and felt, not by conventions). Raises InputError for impossible
    arguments, for a folder that holds anything (when resuming: anything else), for damaged shards,
    for a disk that cannot be written, and for a cluster that is not there, differs from this
    computer, or is lost.
    """
    if count < 1:
        raise InputError(f"--count must be at least 1, got {count}")
    each = min(SHARD, MESHES) if meshes else SHARD
    if count > MOST_SHARDS * each:
        raise InputError(f"--count must be at most {MOST_SHARDS * each}, got {count}")
    if jobs < 1:
        raise InputError(f"--jobs must be at least 1, got {jobs}")
    if dask is not None and jobs > 1:
        raise InputError(
            "--jobs are processes of this computer, and with --dask the cluster's workers draw; "
            "leave one of the two out"
        )
    if not os.fspath(out):
        raise InputError("--out needs the name of a folder, got ''")
    recipe = Recipe(seed, scheme, engine, strokes, meshes, hair)
    recipe.check()
    out = Path(out)
    plan = {
        out / f"shard-{k:06d}.tar": range(k * each, min((k + 1) * each, count))
        for k in range(-(-count // each))
    }
    try:
        with (
            nullcontext() if dask is None else cluster.connect(dask, recipe) as client,
            opened(out, resume) as earlier,
        ):
            sums = kept(plan, recipe, earlier)
            todo = {path: indices for path, indices in plan.items() if path not in sums}
            if todo:
                same_versions(earlier, recipe)
            made_with = earlier.versions or versions(recipe)
            told = partial(write_manifest, plan=plan, sums=sums, recipe=recipe, made_with=made_with)
            if any(path.exists() for path in todo):  # what is told of them is true no more
                told(out / UNFINISHED)
            done = count - sum(map(len, todo.values()))
            made = cluster.run(client, todo, recipe) if client else _run(todo, recipe, jobs)
            with closing(made):
                for path in made:
                    sums[path] = digest(path)
                    told(out / UNFINISHED)
                    done += len(plan[path])
                    if progress:
                        progress(done, count)
            told(out / MANIFEST)
            (out / UNFINISHED).unlink(missing_ok=True)
    except (OSError, OutputError) as problem:
        reason = problem.reason if isinstance(problem, OutputError) else reason_of(problem)
        raise InputError(
            f"{out} cannot be written ({reason}); what is whole stays: run again with --resume, "
            "or choose another folder"
        ) from problem
    except BrokenProcessPool:
        raise InputError(
            "a worker was killed, perhaps for want of memory; run again with --resume and "
            "fewer --jobs"
        ) from None
    return list(plan)


def _run(todo: dict[Path, range], recipe: Recipe, jobs: int) -> Generator[Path, None, None]:
    """Make these shards; yields each that is whole. Closed early, it stops within one sample."""
    jobs = min(jobs, len(todo))
    if jobs < 2:
        for path, indices in todo.items():
            write_shard(path, indices, recipe)
            yield path
        return
    context = get_context("spawn")
    stop = context.Event()
    pool = ProcessPoolExecutor(
        jobs,
        mp_context=context,
        initializer=end_with,
        initargs=(os.getpid(), stop),
        max_tasks_per_child=RECYCLED if recipe.engine == "freestyle" else None,
    )
    try:
        with deaf_children():
            futures = {pool.submit(write_shard, p, i, recipe): p for p, i in todo.items()}
        for future in as_completed(futures):
            future.result()
            yield futures[future]
    finally:
        stop.set()
        pool.shutdown(wait=True, cancel_futures=True)
