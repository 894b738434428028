"""The one error of ours that is not a fault of ours."""

from __future__ import annotations

__all__ = ["InputError"]


class InputError(ValueError):
    """What was given cannot be used; the text is one sentence that says how to mend it.

    Raised for files, drawings, options and values that come from outside. A command then ends with
    status 2 and this sentence, and Blender shows it. Whatever else is raised, a ValueError of numpy
    or of our own included, is a fault of the program: status 1, and a traceback in the log.
    """
