"""The buttons, by what they are about."""

from . import beard, detect, export, expression, hair, help, pencil, people, pins, retarget, sketch

MODULES = (help, sketch, pencil, detect, pins, people, hair, beard, expression, export, retarget)
