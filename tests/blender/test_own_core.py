"""The shell loads the packages that came with it, and says which stranger is in the way."""

from __future__ import annotations

import base64
import hashlib
import sys
from pathlib import Path

import pytest

pytest.importorskip("bpy")

from addon.blender import own_core  # noqa: E402

from .conftest import ROOT  # noqa: E402

FIRST, SECOND = "first_of_ours", "second_of_ours"


@pytest.fixture(autouse=True)
def packages(monkeypatch):
    """Two packages instead of our own, which these tests could not load twice."""
    monkeypatch.setattr(own_core, "PACKAGES", (FIRST, SECOND))
    yield
    for name in (FIRST, SECOND):
        sys.modules.pop(name, None)


def unpack(folder: Path, text: str) -> Path:
    """Both packages in a folder; the second needs the first."""
    for name, source in ((FIRST, text), (SECOND, f"from {FIRST} import WHOSE")):
        (folder / name).mkdir(parents=True)
        (folder / name / "__init__.py").write_text(source)
    return folder


def wheel(shell: Path, site: Path) -> None:
    """As Blender has it: the wheel with the shell, and what was in it in its place for wheels."""
    (shell / "wheels").mkdir(parents=True)
    (shell / "wheels" / "sketch_to_face-1.0+abc-py3-none-any.whl").touch()
    unpack(site, "WHOSE = 'ours'")
    info = site / "sketch_to_face-1.0+abc.dist-info"
    info.mkdir()
    rows = []
    for name in (FIRST, SECOND):
        data = (site / name / "__init__.py").read_bytes()
        text = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        rows.append(f"{name}/__init__.py,sha256={text},{len(data)}\n")
    (info / "RECORD").write_text("".join(rows))


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """The place for wheels, last on the path, behind strangers."""
    site, others = tmp_path / "site", unpack(tmp_path / "others", "WHOSE = 'a stranger'")
    wheel(tmp_path / "shell", site)
    monkeypatch.setattr(own_core, "HERE", tmp_path / "shell")
    monkeypatch.setattr(own_core, "BUNDLED", tmp_path / "shell" / "core")
    monkeypatch.setattr(own_core, "WHEELS", tmp_path / "shell" / "wheels")
    monkeypatch.setattr(sys, "path", [str(others), *sys.path, str(site)])
    return site


def test_ours_are_loaded_although_a_stranger_comes_first_on_the_path(installed):
    own_core.load(own_core.home())
    assert sys.modules[SECOND].WHOSE == "ours"
    assert Path(sys.modules[FIRST].__file__).is_relative_to(installed)
    own_core.load(own_core.home())  # nothing to do


def test_a_stranger_that_is_loaded_is_named_and_stays(installed):
    stranger = __import__(SECOND)
    assert stranger.WHOSE == "a stranger"
    del sys.modules[FIRST]
    with pytest.raises(ImportError, match=f"others.{SECOND}.* is loaded as '{SECOND}'") as caught:
        own_core.load(own_core.home())
    assert caught.value.name == "addon.blender"  # so that Blender shows the sentence alone
    assert sys.modules[SECOND] is stranger and FIRST not in sys.modules


def test_what_a_replaced_installation_loaded_is_forgotten_and_no_stranger(installed):
    own_core.load(installed)
    sys.modules[SECOND].__file__ = "/elsewhere/__init__.py"
    assert own_core.forget(installed)
    assert FIRST not in sys.modules and SECOND in sys.modules
    assert not own_core.forget(installed)


@pytest.mark.parametrize("harm", [lambda file: file.write_text("WHOSE = 1"), Path.unlink])
def test_a_wheel_that_another_extension_has_written_over_is_named(installed, harm):
    file = installed / SECOND / "__init__.py"
    harm(file)
    with pytest.raises(ImportError, match=f"{SECOND}.__init__.py is missing or not its own"):
        own_core.home()


def test_a_package_that_breaks_is_not_left_half_loaded(tmp_path):
    unpack(tmp_path, "raise OSError('no disk')")
    with pytest.raises(OSError, match="no disk"):
        own_core.load(tmp_path)
    assert FIRST not in sys.modules


def test_the_core_is_in_the_zip_s_folder_the_checkout_or_nowhere(tmp_path, monkeypatch):
    assert own_core.home() == ROOT
    monkeypatch.setattr(own_core, "HERE", tmp_path)
    with pytest.raises(ImportError, match="cannot find its own core"):
        own_core.home()
    (tmp_path / "core").mkdir()
    monkeypatch.setattr(own_core, "BUNDLED", tmp_path / "core")
    assert own_core.home() == tmp_path / "core"
