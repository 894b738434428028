"""What has to ship: found by following imports, wherever they stand."""

from __future__ import annotations

import textwrap
import zipfile
from pathlib import Path

import pytest

from addon.packaging import needs
from addon.packaging.wheel import core_files
from addon.packaging.wheels import BuildError, shipped

ROOT = Path(__file__).resolve().parents[2]


def checkout(root: Path, files: dict[str, str]) -> Path:
    """A project of these modules, with the packages around them."""
    for name in ("addon/__init__.py", "addon/blender/__init__.py", *files):
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(textwrap.dedent(files.get(name, "")))
        for folder in list(path.parents)[: len(Path(name).parents) - 1]:
            (folder / "__init__.py").touch()
    return root


def wheel_of(folder: Path, name: str, files: dict[str, str]) -> Path:
    path = folder / f"{name}-1.0-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        for file, text in files.items():
            archive.writestr(file, textwrap.dedent(text))
    return path


@pytest.mark.parametrize("text", [
    "import other",
    "import other.inner as o",
    "from other.inner import thing",
    "def button():\n    from other import thing",
    "class Button:\n    def execute(self):\n        import other",
    "try:\n    import other\nexcept ImportError:\n    other = None",
    "import importlib\ndef load():\n    return importlib.import_module('other.inner')",
    "read = lambda: __import__('other')",
])  # fmt: skip
def test_an_import_counts_wherever_it_stands(tmp_path, text):
    root = checkout(tmp_path, {"addon/blender/panel.py": "from addon import core",
                               "addon/core.py": text})  # fmt: skip
    assert needs.reached(root).foreign == {"other": {"addon.core"}}


def test_what_only_type_checkers_see_does_not_count(tmp_path):
    text = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import other"
    root = checkout(tmp_path, {"addon/blender/panel.py": text})
    assert not needs.reached(root).foreign


def test_relative_and_lazy_imports_are_followed(tmp_path):
    root = checkout(tmp_path, {
        "addon/blender/panel.py": "from snakes import fit\nfrom ..deep import down",
        "addon/deep/down.py": "from . import further",
        "addon/deep/further.py": "from .last import x",
        "addon/deep/last.py": "x = 1",
        "addon/train.py": "import torch",
        "snakes/__init__.py": "from lazy_loader import attach_stub\n"
                              "__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)",
        "snakes/__init__.pyi": "from .lines import fit",
        "snakes/lines.py": "import scipy.ndimage",
    })  # fmt: skip
    told = needs.reached(root)
    assert {"addon.deep.down", "addon.deep.further", "addon.deep.last", "snakes.lines"} <= set(
        told.modules
    )
    assert told.foreign == {"lazy_loader": {"snakes"}, "scipy": {"snakes.lines"}}
    assert "addon/train.py" not in core_files(root)


def test_a_computed_name_is_refused(tmp_path):
    text = "from importlib import import_module\ndef load(name):\n    return import_module(name)"
    root = checkout(tmp_path, {"addon/blender/panel.py": text})
    with pytest.raises(needs.UnknownImport, match=r"addon.blender.panel .*import_module\(name\)"):
        needs.reached(root)


def test_a_wheel_ships_if_it_is_imported_from_and_only_then(tmp_path):
    root = checkout(tmp_path / "root", {
        "addon/blender/panel.py": "def press():\n    from big.part import thing\n    import numpy",
    })  # fmt: skip
    big = wheel_of(tmp_path, "big", {
        "big/__init__.py": "from lazy_loader import attach_stub\n__getattr__ = attach_stub()",
        "big/part/__init__.py": "from lazy_loader import attach_stub\n__getattr__ = attach_stub()",
        "big/part/__init__.pyi": "from ._thing import thing\nfrom ._other import other",
        "big/part/_thing.py": "import small\ntry:\n    import maybe\nexcept ImportError:\n    pass",
        "big/part/_other.py": "import huge",
        "big/tests/test_big.py": "import pytest",
    })  # fmt: skip
    small = wheel_of(tmp_path, "small", {"small.py": "def later():\n    import optional"})
    huge = wheel_of(tmp_path, "huge", {"huge.py": ""})
    lazy = wheel_of(tmp_path, "lazy_loader", {"lazy_loader/__init__.py": ""})
    assert needs.needed(root, [big, small, huge, lazy]) == ([big, small, lazy], {})
    assert needs.needed(root, [big, huge, lazy]) == ([big, lazy], {"small": {"big.part._thing"}})
    assert needs.needed(root, []) == ([], {"big": {"addon.blender.panel"}})


def test_what_no_wheel_has_stops_the_build_with_who_wants_it(tmp_path, monkeypatch):
    root = checkout(tmp_path, {"addon/blender/panel.py": "def press():\n    import trimesh"})
    monkeypatch.setattr("addon.packaging.wheels.third_party", lambda *_: [])
    with pytest.raises(BuildError, match="not bring: trimesh, imported by addon.blender.panel"):
        shipped("linux-x64", "3.11", tmp_path, root)


def test_of_our_own_what_an_artist_needs_ships_and_nothing_for_makers():
    files = core_files(ROOT)
    assert {"facs_rig/data/head.npz", "facs_rig/data/README.md", "classifiers/weights/model.json",
            "classifiers/weights/detector.onnx", "addon/pipeline.py", "addon/export.py",
            "snakes/__init__.pyi", "addon/sketches/smiling_woman.png"} <= files.keys()  # fmt: skip
    makers = ("training", "train_command", "evaluate_command", "cluster", "generate", "freestyle",
              "blender_batch", "baking", "packaging", "commands", "cli")  # fmt: skip
    assert not [n for n in files for part in makers if f"/{part}.py" in n or f"/{part}/" in n]
    assert not [n for n in files if n.endswith(".svg") or n.startswith("addon/blender/")]


def test_every_optional_package_is_still_asked_for_and_says_why_it_is_optional():
    foreign = needs.reached(ROOT).foreign
    assert needs.OPTIONAL.keys() <= foreign.keys()
    assert all(needs.OPTIONAL.values())
    assert not {"torch", "onnx", "distributed"} & foreign.keys()
