"""The folder of a data set: for one run at a time, nothing foreign touched, every shard checked.

`manifest.json` is written last and tells the checksum of each shard. Until then `unfinished.json`
tells those of the shards that are there already, so that a resumed run knows them for whole.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from PIL import Image

from dataset_gen.tars import ShardError, files_of, record_of, samples_of, size_of
from facs_rig.common.errors import InputError
from facs_rig.common.files import clear, is_work, write_text

from .samples import SIZE, Recipe
from .shards import versions

MANIFEST, UNFINISHED, PREVIEW = "manifest.json", "unfinished.json", "preview.png"
FORMAT = 1
MARK = "sketch2face generate"  # the Software of our previews

_NAMES = re.compile(r"shard-\d{6}\.tar|(manifest|unfinished)\.json|preview\.png")
_TORN = re.compile(r"\.(shard-\d{6}\.tar|manifest\.json)\.\d+")  # older versions left them


@dataclass(frozen=True)
class Earlier:
    """What an earlier run tells of its shards.

    source : the file that tells it, or None;  sums : shard -> SHA-256;  versions : of what made
    them, None if nobody tells
    """

    source: Path | None
    sums: dict[str, str]
    versions: dict[str, str | None] | None


@contextmanager
def opened(out: Path, resume: bool) -> Iterator[Earlier]:
    """The folder, made or seen to be ours, for this run alone; half-written files are cleared.

    Raises ValueError if it holds anything else, shards without `resume`, or another run's work.
    """
    if out.exists() and not out.is_dir():
        raise InputError(f"{out} is a file; --out needs a folder")
    out.mkdir(parents=True, exist_ok=True)
    with _alone(out):
        _clear(out)
        names = sorted(path.name for path in out.iterdir() if not is_work(path.name))
        if not resume and any(name.startswith("shard-") for name in names):
            raise InputError(f"{out} already holds shards; choose another folder or add --resume")
        foreign = [name for name in names if not (resume and _NAMES.fullmatch(name))]
        if foreign:
            raise InputError(
                f"{out} holds something else ('{foreign[0]}'); choose a new or an empty folder"
            )
        try:
            yield _earlier(out)
        finally:
            _clear(out)


@contextmanager
def _alone(out: Path) -> Iterator[None]:
    """Keep other runs out of the folder, where the system can (not on Windows)."""
    try:
        import fcntl
    except ImportError:
        yield
        return
    handle = os.open(out, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(
                f"another run is writing into {out}; wait until it ends, or choose another folder"
            ) from None
        except OSError:  # a network's disk that knows no locks
            pass
        yield
    finally:
        os.close(handle)


def _clear(out: Path) -> None:
    """Remove what was left half-written."""
    with suppress(OSError):
        clear(out)
        for path in out.iterdir():
            if _TORN.fullmatch(path.name):
                path.unlink(missing_ok=True)


def _earlier(out: Path) -> Earlier:
    """What is told by an unfinished run, else by the manifest; ValueError if that is not ours."""
    for name in (MANIFEST, UNFINISHED):
        path = out / name
        if path.exists():
            _told(path)
    for name in (UNFINISHED, MANIFEST):
        path = out / name
        if path.exists():
            manifest = _told(path)
            sums = {shard["name"]: shard["sha256"] for shard in manifest["shards"]}
            return Earlier(path, sums, manifest.get("versions"))
    return Earlier(None, {}, None)


def _told(path: Path) -> dict:
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
        ours = manifest["format"] == FORMAT and isinstance(manifest["recipe"], dict)
        ours &= all({"name", "sha256"} <= set(shard) for shard in manifest["shards"])
    except (ValueError, LookupError, TypeError):
        ours = False
    if not ours:
        raise InputError(
            f"{path} is not what this version writes there, or damaged; move it away or choose "
            "another folder"
        )
    return manifest


# --- the shards that are there -------------------------------------------------------------------


def kept(plan: dict[Path, range], recipe: Recipe, earlier: Earlier) -> dict[Path, str]:
    """The shards of the plan that are there and whole, with their checksums.

    Those that hold fewer samples than planned are left out: they are made again. Raises InputError
    for damaged ones, for those of another recipe, and for more samples than are planned.
    """
    sums, damaged = {}, []
    for path, indices in plan.items():
        if not path.exists():
            continue
        try:
            if _holds(path, indices, recipe):
                sums[path] = digest(path)
                if path.name not in earlier.sums:
                    _look_through(path, recipe)
                elif sums[path] != earlier.sums[path.name]:
                    raise ShardError("not the bytes that were written")
        except ShardError:
            damaged.append(path)
    if damaged:
        names = [str(damaged[0]), *(path.name for path in damaged[1:])]
        are, them = ("is", "it") if len(names) == 1 else ("are", "them")
        raise InputError(f"{', '.join(names)} {are} damaged; delete {them} to make {them} anew")
    more = sorted(path for path in next(iter(plan)).parent.glob("shard-*.tar") if path not in plan)
    if more:
        raise InputError(
            f"{more[0]} is of a longer data set; resume with its --count or a larger one"
        )
    return sums


def _holds(path: Path, indices: range, recipe: Recipe) -> bool:
    """Whether a shard holds all these samples, and not only the first of them."""
    files = list(files_of(path))
    names = [name for name, _ in files]
    meshes = any(name.endswith(".ply") for name in names)
    if not names or not names[0].endswith(".json"):
        raise ShardError("no samples")
    first = record_of(path, names[0], files[0][1])
    try:
        made = Recipe(
            first["seed"], first["scheme"], first["engine"], "strokes" in first, meshes,
            first.get("haired", 0.0),
        )  # fmt: skip
    except KeyError:
        raise ShardError("not a sample of ours") from None
    if made != recipe:
        raise InputError(
            f"{path} was made with {_named(made)}; resume with the same ones or choose another "
            "folder"
        )
    endings = ("json", "png", "ply") if meshes else ("json", "png")
    wanted = [f"{index:08d}.{ending}" for index in indices for ending in endings]
    if len(names) > len(wanted) and names[: len(wanted)] == wanted:
        raise InputError(
            f"{path} holds more samples than --count asks for; resume with as many or more"
        )
    if names != wanted[: len(names)]:
        raise ShardError("other files")
    return len(names) == len(wanted)


def _look_through(path: Path, recipe: Recipe) -> None:
    """ShardError unless every sample of a shard whose checksum nobody knows can be read."""
    for key, parts in samples_of(path):
        record = record_of(path, key, parts["json"])
        if (record.get("seed"), record.get("index")) != (recipe.seed, int(key)):
            raise ShardError("another sample's record")
        if size_of(path, key, parts["png"]) != (SIZE, SIZE):
            raise ShardError("a picture of another size")


def _named(recipe: Recipe) -> str:
    strokes, meshes = ("with" if kept else "without" for kept in (recipe.strokes, recipe.meshes))
    return (
        f"seed {recipe.seed}, scheme {recipe.scheme}, engine {recipe.engine}, "
        f"hair {recipe.hair:g}, {strokes} strokes, {meshes} meshes"
    )


def same_versions(earlier: Earlier, recipe: Recipe) -> None:
    """ValueError if what is to be made would be made by other packages than what is there."""
    for name, here in versions(recipe).items():
        there = (earlier.versions or {}).get(name, here)
        if there != here:
            raise InputError(
                f"{earlier.source} tells of {name} {there or '(none)'} and here is "
                f"{here or 'none'}, which may show in the bytes; install the same, or choose "
                "another folder"
            )


# --- what is told of them ------------------------------------------------------------------------


def write_manifest(
    path: Path, plan: dict[Path, range], sums: dict[Path, str], recipe: Recipe,
    made_with: dict[str, str | None],
) -> None:  # fmt: skip
    """Write how many samples of which recipe there are, the shards and their checksums."""
    there = [shard for shard in plan if shard in sums]
    manifest = {
        "format": FORMAT,
        "samples": sum(len(plan[shard]) for shard in there),
        "size": SIZE,
        "recipe": asdict(recipe),
        "shards": [
            {"name": shard.name, "samples": len(plan[shard]), "sha256": sums[shard]}
            for shard in there
        ],
        "versions": made_with,
    }
    write_text(path, json.dumps(manifest, indent=1) + "\n")


def digest(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def check_preview(folder: Path) -> None:
    """ValueError if the folder holds a preview.png that we did not draw and would replace."""
    path = folder / PREVIEW
    if not path.exists():
        return
    try:
        with Image.open(path) as picture:
            ours = picture.info.get("Software") == MARK
    except (OSError, ValueError, SyntaxError):
        ours = False
    if not ours:
        raise InputError(
            f"{path} was not drawn by --preview and would be replaced; move it away or leave "
            "--preview out"
        )
