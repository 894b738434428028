"""The buttons, by what they are about."""

from . import detect, export, expression, hair, help, pencil, people, pins, retarget, sketch

MODULES = (help, sketch, pencil, detect, pins, people, hair, expression, export, retarget)
