"""The buttons, by what they are about."""

from . import detect, export, expression, help, pencil, people, pins, retarget, sketch

MODULES = (help, sketch, pencil, detect, pins, people, expression, export, retarget)
