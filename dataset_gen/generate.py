"""Generate a data set: tar shards of line drawings with all parameters that made them.

A data set is a folder of WebDataset shards, `shard-000000.tar` and on, of `KEY.json` and `KEY.png`
(8-bit grey, black lines on white). The same seed gives the same bytes, whatever the number of
workers, and also after an interrupted run that was resumed.
"""

from __future__ import annotations

import io
import json
import math
import os
import tarfile
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from PIL import Image

from facs_rig import CONTROL_NAMES, LANDMARKS, load_rig

from .ink import ink, loosen
from .lines import draw_strokes
from .sampling import SCHEMES, sample_face, sample_rng

SHARD = 250  # samples in each shard but the last
SIZE = 256
ENGINES = ("contours", "freestyle")
RECYCLED = 4  # shards after which a worker is replaced: Blender does not give all memory back
Progress = Callable[[int, int], None]


def make_sample(
    seed: int, index: int, size: int = SIZE, scheme: str = "sparse", engine: str = "contours"
) -> tuple:
    """Picture (size, size) uint8 and the dictionary of everything that made sample `index`."""
    rig = load_rig()
    rng = sample_rng(seed, index)
    sample = sample_face(rig, rng, size, scheme)
    vertices = rig.pose(sample.parameters)
    draw, told = _engine(engine)
    strokes = draw(rig, vertices, sample.camera, sample.detail, sample.style.layers)
    picture = ink(loosen(strokes, sample.style, rng), size, size, sample.style)
    places = sample.camera.project(vertices[rig.landmarks])
    parameters = sample.parameters.to_json()
    aus = {name: round(parameters["aus"].get(name, 0.0), 4) for name in CONTROL_NAMES}
    camera = sample.camera
    meta = {
        **parameters,
        "aus": aus,
        "camera": {
            "width": camera.width,
            "height": camera.height,
            "scale": list(camera.scale),
            "centre": list(camera.centre),
            "distance": None if math.isinf(camera.distance) else camera.distance,
        },
        "seed": seed,
        "index": index,
        **told,
        "scheme": scheme,
        "detail": sample.detail,
        "style": sample.style.to_json(),
        "landmarks": {
            name: [round(float(u), 2), round(float(v), 2)]
            for name, (u, v) in zip(LANDMARKS, places, strict=True)
        },
    }
    return picture, meta


def _engine(name: str) -> tuple[Callable, dict[str, str]]:
    """The function that draws, and what a sample tells of it; ValueError if it cannot draw here."""
    if name == "freestyle":
        from .freestyle import freestyle_strokes, version

        return freestyle_strokes, {"engine": name, "blender": version()}
    return draw_strokes, {"engine": name}


def write_shard(path: Path, seed: int, indices: range, scheme: str, engine: str) -> int:
    """Write one shard whole (beside, then renamed); returns the number of its samples."""
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with tarfile.open(beside, "w", format=tarfile.USTAR_FORMAT) as tar:
            for index in indices:
                picture, meta = make_sample(seed, index, SIZE, scheme, engine)
                buffer = io.BytesIO()
                Image.fromarray(picture).save(buffer, format="PNG")
                _add(tar, f"{index:08d}.json", json.dumps(meta).encode())
                _add(tar, f"{index:08d}.png", buffer.getvalue())
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)
    return len(indices)


def _add(tar: tarfile.TarFile, name: str, data: bytes) -> None:
    info = tarfile.TarInfo(name)
    info.size = len(data)
    tar.addfile(info, io.BytesIO(data))


def generate(
    count: int,
    out: Path | str,
    seed: int = 0,
    engine: str = "contours",
    jobs: int = 1,
    resume: bool = False,
    scheme: str = "sparse",
    progress: Progress | None = None,
) -> list[Path]:
    """Write a data set of `count` samples into the folder `out`; returns its shards.

    With `resume`, whole shards of an earlier run with the same seed are kept. Raises ValueError
    for impossible arguments, and for a folder that already holds shards when not resuming.
    """
    if count < 1:
        raise ValueError(f"--count must be at least 1, got {count}")
    if jobs < 1:
        raise ValueError(f"--jobs must be at least 1, got {jobs}")
    if engine not in ENGINES:
        raise ValueError(f"there is no engine '{engine}'; choose from: {', '.join(ENGINES)}")
    if scheme not in SCHEMES:
        raise ValueError(f"there is no scheme '{scheme}'; choose from: {', '.join(SCHEMES)}")
    _engine(engine)
    out = Path(out)
    if out.exists() and not out.is_dir():
        raise ValueError(f"{out} is a file; --out needs a folder")
    if not resume and any(out.glob("shard-*.tar")):
        raise ValueError(f"{out} already holds shards; choose another folder or add --resume")
    out.mkdir(parents=True, exist_ok=True)
    plan = {
        out / f"shard-{k:06d}.tar": range(k * SHARD, min((k + 1) * SHARD, count))
        for k in range(-(-count // SHARD))
    }
    todo = {
        path: indices
        for path, indices in plan.items()
        if not (path.exists() and _holds(path, seed, indices, scheme, engine))
    }
    done = count - sum(map(len, todo.values()))
    for finished in _run(todo, seed, scheme, engine, jobs):
        done += finished
        if progress:
            progress(done, count)
    return list(plan)


def _run(
    todo: dict[Path, range], seed: int, scheme: str, engine: str, jobs: int
) -> Iterator[int]:
    if jobs == 1 or len(todo) < 2:
        for path, indices in todo.items():
            yield write_shard(path, seed, indices, scheme, engine)
        return
    recycled = RECYCLED if engine == "freestyle" else None
    context = get_context("spawn")
    with ProcessPoolExecutor(jobs, mp_context=context, max_tasks_per_child=recycled) as pool:
        futures = [pool.submit(write_shard, p, seed, i, scheme, engine) for p, i in todo.items()]
        for future in as_completed(futures):
            yield future.result()


def _holds(path: Path, seed: int, indices: range, scheme: str, engine: str) -> bool:
    """Whether a shard holds just these samples; ValueError for another seed, scheme or engine."""
    with tarfile.open(path) as tar:
        names = tar.getnames()
        first = json.loads(tar.extractfile(names[0]).read())  # type: ignore[union-attr]
    if (first["seed"], first["scheme"], first["engine"]) != (seed, scheme, engine):
        raise ValueError(
            f"{path} was made with seed {first['seed']}, scheme {first['scheme']} and engine "
            f"{first['engine']}; resume with the same ones or choose another folder"
        )
    return [int(n.split(".")[0]) for n in names[::2]] == list(indices)


def read_shards(folder: Path | str) -> Iterator[tuple[np.ndarray, dict]]:
    """All samples of a data set in order: picture (h, w) uint8 and its dictionary."""
    for path in sorted(Path(folder).glob("shard-*.tar")):
        with tarfile.open(path) as tar:
            meta: dict = {}
            for member in tar:
                data = tar.extractfile(member).read()  # type: ignore[union-attr]
                if member.name.endswith(".json"):
                    meta = json.loads(data)
                elif member.name.endswith(".png"):
                    yield np.asarray(Image.open(io.BytesIO(data))), meta
