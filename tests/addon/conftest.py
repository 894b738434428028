"""What the tests of the commands share."""

from __future__ import annotations

import pytest

from addon import cli


@pytest.fixture
def refused(capsys):
    """A function: the one line that a refused command line says on stderr."""

    def said(*arguments) -> str:
        status = cli.main([str(argument) for argument in arguments])
        told = capsys.readouterr()
        assert status == 2, told.err
        assert told.out == ""
        assert told.err.startswith("sketch2face") and told.err.count("\n") == 1
        return told.err

    return said


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty current folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
