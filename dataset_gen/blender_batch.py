"""Generate a data set inside Blender, which needs no window for it:

    blender -b -P dataset_gen/blender_batch.py -- --count 1000 --out data --seed 1

The same as `sketch2face generate --engine freestyle`. Blender's Python has to find numpy, scipy and
Pillow that go together. They are looked for in PYTHONPATH, in an activated environment, in the
.venv that `make` builds, where `sketch2face` is installed, and in Blender itself. --meshes also
needs trimesh.

Exit status 0 done, 1 a fault of ours, 2 the arguments, the folder or this Blender cannot be used,
130 stopped.
"""

from __future__ import annotations

import argparse
import atexit
import os
import shutil
import signal
import sys
import traceback
from collections.abc import Iterator
from importlib import import_module
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
OLDEST = (3, 11)
ABSENT = "not there"
# module -> its package, and the parts of it that drawing uses
NEEDED = {
    "numpy": ("numpy", ()),
    "scipy": ("scipy", ("scipy.sparse", "scipy.spatial", "scipy.ndimage")),
    "PIL": ("pillow", ("PIL.Image", "PIL.ImageDraw")),
}


def main(arguments: list[str] | None = None) -> int:
    """Run with the command line's arguments, those after `--`; returns the exit status."""
    options = parser().parse_args(own(sys.argv) if arguments is None else arguments)
    missing = find_packages(options.meshes)
    if missing:
        print(missing, file=sys.stderr)
        return 2
    from dataset_gen.generate import generate
    from facs_rig.common.errors import InputError

    try:
        if options.jobs > 1 and started_by_blender():
            workers_are_blenders()
        shards = generate(
            options.count, options.out, seed=options.seed, engine=options.engine,
            jobs=options.jobs, resume=options.resume, scheme=options.scheme,
            strokes=options.strokes, meshes=options.meshes, hair=options.hair, progress=Line(),
        )  # fmt: skip
    except (InputError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(f"{options.count} samples in {len(shards)} shards in {options.out}")
    return 0


def own(argv: list[str]) -> list[str]:
    """What stands after `--`: the rest is Blender's. Started by Python, all but the program."""
    if "--" in argv:
        return argv[argv.index("--") + 1 :]
    return [] if started_by_blender() else argv[1:]


def started_by_blender() -> bool:
    """Whether this runs in the program Blender, not in Python with Blender as a module."""
    bpy = sys.modules.get("bpy")
    return bpy is not None and bool(bpy.app.binary_path)


def parser() -> argparse.ArgumentParser:
    """The options of `sketch2face generate`."""
    out = argparse.ArgumentParser(
        prog="blender -b -P dataset_gen/blender_batch.py --",
        description="Generate a data set with lines found by Blender's Freestyle.",
    )
    out.add_argument("--count", type=int, required=True, help="how many samples")
    out.add_argument("--out", metavar="DIR", required=True, help="folder of the shards")
    out.add_argument("--seed", type=int, default=0, help="the same seed gives the same bytes")
    engines = "freestyle (default), contours or conventions"
    out.add_argument("--engine", default="freestyle", help=engines)
    out.add_argument("--scheme", default="people", help="how faces are sampled (default people)")
    out.add_argument("--hair", type=float, default=0.75, help="share of faces that wear hair")
    out.add_argument("--jobs", type=int, default=1, help="how many processes (default 1)")
    out.add_argument("--resume", action="store_true", help="go on with an interrupted run")
    out.add_argument("--strokes", action="store_true", help="keep the coordinates of the lines")
    out.add_argument("--meshes", action="store_true", help="keep the posed mesh, KEY.ply")
    return out


def find_packages(meshes: bool = False) -> str | None:
    """Make this repository and what it needs importable; one sentence if that cannot be done.

    Packages that were installed together go together, so a place that has numpy and all the rest
    comes before Blender's own numpy, which may be too old for them. Places that lack numpy come
    behind it.
    """
    # Started by Python, the folder of this file comes first, whose freestyle.py is not Blender's.
    own_folder = str(Path(__file__).resolve().parent)
    sys.path[:] = [str(ROOT), *(p for p in sys.path if p not in (own_folder, str(ROOT)))]
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    if sys.version_info < OLDEST:
        return (
            f"error: this Blender brings Python {version}, and {OLDEST[0]}.{OLDEST[1]} or newer is "
            "needed; use Blender 4.1 or newer"
        )
    needed = NEEDED | ({"trimesh": ("trimesh", ())} if meshes else {})
    found = [place for place in dict.fromkeys(places()) if place.is_dir()]
    together = [place for place in found if all((place / name).is_dir() for name in needed)]
    together = [place for place in together if built_for_this(place)][:1]
    if "numpy" in sys.modules:  # loaded by another add-on: too late for another one
        together = []
    sys.path[1:1] = [str(place) for place in together]
    if not together:
        sys.path += [str(place) for place in found if str(place) not in sys.path]
    wrong = {name: problem for name in needed if (problem := trouble(name, needed[name][1]))}
    if not wrong:
        return None
    packages = " ".join(package for package, _ in needed.values())
    absent = [needed[name][0] for name, problem in wrong.items() if problem == ABSENT]
    if absent:
        said = f"does not find {', '.join(absent)}"
    else:
        name, problem = next(iter(wrong.items()))
        said = f"cannot use the {needed[name][0]} that it finds ({problem})"
    return (
        f"error: Blender's Python {version} {said}; install what goes together for Python "
        f"{version} (python{version} -m pip install --target DIR {packages}) and set PYTHONPATH=DIR"
    )


def places() -> Iterator[Path]:
    """Folders that may hold packages for this Python, the most deliberate first."""
    yield from (Path(p) for p in os.environ.get("PYTHONPATH", "").split(os.pathsep) if p)
    program = shutil.which("sketch2face")
    homes = [Path(os.environ["VIRTUAL_ENV"])] if os.environ.get("VIRTUAL_ENV") else []
    homes += [ROOT / ".venv"]
    homes += [Path(program).resolve().parents[1]] if program else []
    library = f"python{sys.version_info.major}.{sys.version_info.minor}"
    for home in homes:
        yield home / "lib" / library / "site-packages"
        if library == f"python{version_of(home)}":
            yield home / "Lib" / "site-packages"  # on Windows


def version_of(home: Path) -> str:
    """The Python, e.g. "3.11", of a virtual environment; "" where that is not written down."""
    try:
        lines = (home / "pyvenv.cfg").read_text(encoding="utf-8").splitlines()
    except OSError:
        return ""
    told = [line.split("=")[1].strip() for line in lines if line.startswith("version")]
    return ".".join(told[0].split(".")[:2]) if told else ""


def built_for_this(place: Path) -> bool:
    """Whether the compiled part of a folder's numpy is for this Python."""
    compiled = place.glob("numpy/*core/_multiarray_umath.*")
    return any("." + path.name.partition(".")[2] in EXTENSION_SUFFIXES for path in compiled)


def trouble(name: str, parts: tuple[str, ...]) -> str:
    """Why a package cannot be used: ABSENT, or what it said; "" if all that we use of it loads.

    A package for another Python, or for another numpy, is found but breaks, some when a part of
    it is loaded.
    """
    try:
        for part in (name, *parts):
            import_module(part)
    except ModuleNotFoundError as error:
        if error.name == name:
            return ABSENT
        return str(error)
    except BaseException as error:  # a compiled module may raise anything
        return (str(error).strip().splitlines() or [type(error).__name__])[0]
    return ""


def workers_are_blenders() -> None:
    """Let multiprocessing start this Blender for its workers, where it would start Python.

    A Python that runs inside a program has no bpy outside of it. What multiprocessing calls is a
    small script that hands its code on to `blender --python-expr`; open pipes go with it.
    """
    import multiprocessing
    import shlex
    import tempfile

    import bpy

    from facs_rig.common.errors import InputError

    if os.name != "posix":
        raise InputError("--jobs inside Blender needs Linux or macOS; leave it out")
    folder = Path(tempfile.mkdtemp(prefix="sketch2face-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    script = folder / "python"
    script.write_text(
        f"""#!/bin/sh
while [ "$1" != -c ]; do shift; done
exec {shlex.quote(bpy.app.binary_path)} -b --factory-startup --python-exit-code 1 --python-expr \\
    "import sys; sys.argv = ['-c', '--multiprocessing-fork']
$2" >/dev/null
"""
    )
    script.chmod(0o700)
    multiprocessing.set_executable(str(script))


class Line:
    """How far it is: one line that writes over itself on a terminal, nothing elsewhere."""

    def __call__(self, done: int, count: int) -> None:
        if sys.stderr.isatty():
            end = "\n" if done == count else ""
            print(f"\r{done} of {count} samples", end=end, file=sys.stderr, flush=True)


def stoppable() -> None:
    """Let Ctrl-C and a polite kill end this as an exception, so that nothing half-made stays."""

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    for number in (signal.SIGINT, signal.SIGTERM):  # Blender has handlers of its own
        signal.signal(number, stop)


if __name__ == "__main__":
    try:
        stoppable()
        status = main()
    except KeyboardInterrupt:
        print("stopped; whole shards stay: go on with --resume", file=sys.stderr)
        status = 130
    except SystemExit as leave:
        status = leave.code if isinstance(leave.code, int) else 1
    except BaseException:
        traceback.print_exc()
        status = 1
    # multiprocessing gives the main module a second name, over which older Blenders fall when
    # they leave: they have freed it by then.
    sys.modules.pop("__mp_main__", None)
    if status:
        sys.exit(status)
