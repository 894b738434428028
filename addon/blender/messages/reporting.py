"""What the artist hears of an error: one sentence for an expected one, a log for the rest."""

import contextlib
import logging
import os
from logging.handlers import RotatingFileHandler
from pathlib import Path

import bpy

from facs_rig.common.errors import InputError

from . import translation

ADDON = __package__.rpartition(".")[0]  # the name under which Blender knows the add-on
LOG_NAME = "sketch_to_face.log"
RAISE = "SKETCH_TO_FACE_RAISE"  # environment variable: tests and developers want the traceback

_log = logging.getLogger(__name__)


def detach() -> None:
    """Let go of the log file."""
    for handler in list(_log.handlers):
        _log.removeHandler(handler)
        handler.close()


def log_path() -> Path:
    """The log file; its folder is made when it is missing."""
    try:
        folder = bpy.utils.extension_path_user(ADDON, create=True)
    except (AttributeError, ValueError):  # before 4.2, or not installed as an extension
        folder = bpy.utils.user_resource("CONFIG", path="sketch_to_face", create=True)
    return Path(folder) / LOG_NAME


def log(title: str) -> Path:
    """Write the error that is being handled to the log file; returns where that is."""
    path = log_path()
    if not _log.handlers:
        handler = RotatingFileHandler(
            path, maxBytes=1_000_000, backupCount=1, encoding="utf-8", delay=True
        )
        handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
        _log.addHandler(handler)
    _log.exception("%s failed in Blender %s", title, bpy.app.version_string)
    return path


def say(operator: bpy.types.Operator, level: str, message: str, /, **values) -> None:
    """Report in the artist's language. level : "INFO", "WARNING" or "ERROR" """
    operator.report({level}, translation.text(message, **values))


@contextlib.contextmanager
def reported(operator: bpy.types.Operator):
    """Turn errors inside the block into reports of `operator`; `.failed` tells the caller.

    An InputError is what the artist can mend: its sentence is shown as it is; and so is an error of
    the disk, which names the file. Anything else is our fault: it goes whole to the log file, and
    the report names the file.
    """
    outcome = Outcome()
    try:
        yield outcome
    except InputError as error:
        outcome.failed = True
        operator.report({"ERROR"}, _sentence(error))
    except OSError as error:
        outcome.failed = True
        log(operator.bl_label)
        say(operator, "ERROR", "'{path}' cannot be used: {error}",
            path=error.filename or "?", error=error.strerror or error)  # fmt: skip
    except Exception as error:
        outcome.failed = True
        path = log(operator.bl_label)
        if os.environ.get(RAISE):
            raise
        title = translation.label(operator.bl_label, "Operator")
        kind = type(error).__name__
        say(operator, "ERROR", "{title} broke ({kind}); details: {path}",
            title=title, kind=kind, path=path)  # fmt: skip


def _sentence(error: Exception) -> str:
    """The error's words with a capital; the path or name that they may begin with stays."""
    text = str(error)
    return text[:1].upper() + text[1:]


class Outcome:
    """Whether the block under `reported` failed."""

    failed = False
