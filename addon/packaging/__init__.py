"""Builds the zip that Blender installs: ``python -m addon.packaging``, or ``make addon``."""
