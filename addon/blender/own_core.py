"""The core that came with this shell, and no other of the same names.

In Blender all extensions share one place for wheels, the last that Python looks in; others may have
an `addon` or a `snakes` there, or before it. So our packages are loaded from the folder that they
were installed to, and a stranger in the way is named in one sentence (ImportError).
"""

import base64
import csv
import hashlib
import sys
from importlib.machinery import PathFinder
from importlib.util import module_from_spec
from pathlib import Path

PACKAGES = ("facs_rig", "dataset_gen", "snakes", "classifiers", "addon")  # each needs those before
HERE = Path(__file__).resolve().parent
BUNDLED = HERE / "core"  # before Blender 4.2, which knows no wheels: all of them, unpacked
WHEELS = HERE / "wheels"


def home() -> Path:
    """The folder that our packages lie in: the zip's own, Blender's for wheels, or a checkout."""
    if BUNDLED.is_dir():
        return BUNDLED
    for wheel in WHEELS.glob("sketch_to_face-*.whl"):
        name, version = wheel.name.split("-")[:2]
        info = f"{name}-{version}.dist-info"
        for folder in map(Path, sys.path):
            if (folder / info).is_dir():
                _check_untouched(folder, folder / info / "RECORD")
                return folder
    if HERE.parts[-2:] == ("addon", "blender"):
        return HERE.parents[1]
    raise _refusal(
        "it cannot find its own core: install the zip file that `make addon` builds instead of "
        "this folder."
    )


def _check_untouched(folder: Path, record: Path) -> None:
    """Whether our packages are those of the wheel. Blender unpacks wheels over one another."""
    with record.open(encoding="utf-8", newline="") as lines:
        sums = {row[0]: row[1] for row in csv.reader(lines) if row}
    for package in PACKAGES:
        name = f"{package}/__init__.py"
        file = folder / name
        if not file.is_file() or f"sha256={_sum(file.read_bytes())}" != sums[name]:
            raise _refusal(
                f"{file} is missing or not its own: another extension brings a package of that "
                "name. Remove that extension and Sketch to Face, then install the zip again."
            )


def _sum(data: bytes) -> str:
    """As wheels write it."""
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()


def add_bundled() -> None:
    """Let Python find the third-party packages that lie beside the core before Blender 4.2.

    At the end of the path: what Blender or the artist has installed wins.
    """
    if BUNDLED.is_dir() and str(BUNDLED) not in sys.path:
        sys.path.append(str(BUNDLED))


def take_bundled_away() -> None:
    """The reverse of add_bundled."""
    if str(BUNDLED) in sys.path:
        sys.path.remove(str(BUNDLED))


def forget(folder: Path) -> bool:
    """Drop the core's modules that an installation has loaded which this one has just replaced.

    Blender itself forgets an extension's own modules, but not its wheels. True if there were any.
    """
    ours = [name for name in PACKAGES if name in sys.modules and _is_ours(name, folder)]
    old = [name for name in sys.modules if name.partition(".")[0] in ours]
    for name in old:
        del sys.modules[name]
    return bool(old)


def load(folder: Path) -> None:
    """Import our packages from `folder`, whatever else of their names Python would find."""
    for name in PACKAGES:
        if name in sys.modules and not _is_ours(name, folder):
            raise _refusal(
                f"'{_origin(name)}' is loaded as '{name}', the name of a package of its own. "
                "Remove or rename it, or switch off the add-on that uses it, and start Blender "
                "again."
            )
    add_bundled()
    for name in PACKAGES:
        if name in sys.modules:
            continue
        spec = PathFinder.find_spec(name, [str(folder)])
        if spec is None or spec.loader is None:
            raise _refusal(f"there is no '{name}' in {folder}: install the zip again.")
        sys.modules[name] = module_from_spec(spec)
        try:
            spec.loader.exec_module(sys.modules[name])
        except BaseException:
            del sys.modules[name]
            raise


def _is_ours(name: str, folder: Path) -> bool:
    return Path(_origin(name)).resolve() == (folder / name / "__init__.py").resolve()


def _origin(name: str) -> str:
    """Where a loaded package comes from."""
    module = sys.modules[name]
    return getattr(module, "__file__", None) or next(iter(getattr(module, "__path__", ())), "?")


def _refusal(why: str) -> ImportError:
    # Blender shows the sentence alone if the error has the name of the add-on.
    return ImportError(f"Sketch to Face cannot start: {why}", name=__package__)
