"""The add-on in the artist's language.

Blender itself looks up what it is given whole: labels, tooltips, names of properties and of their
items, `text=` of layout calls. It only has to know the table. A sentence that is put together
here goes through `text`, `label` or `tip` as a template, and is filled in after it was looked up.

The core speaks English alone: what an InputError of a fit or of the rig says reaches
the artist as it is, and so does what goes to the log.
"""

import bpy
from bpy.props import EnumProperty

from . import german

# The language alone: Blender tries it after language and country, and some versions call German
# de_DE and others de.
TABLES = {"de": german.TABLE}

OWN = "Sketch to Face"
"""Our context, for words that Blender itself translates into another meaning, or too long."""
# Properties take a context in newer Blenders alone.
OWN_CONTEXT = {"translation_context": OWN} if "translation_context" in EnumProperty.__doc__ else {}


def text(message: str, /, **values) -> str:
    """A report or a status text in the artist's language, filled in with `values`."""
    translations = bpy.app.translations
    # Before Blender 4.1 reports went with the tooltips.
    look_up = getattr(translations, "pgettext_rpt", translations.pgettext_tip)
    return _filled(look_up(message), values)


def tip(message: str, /, **values) -> str:
    """A tooltip, or a part of one."""
    return _filled(bpy.app.translations.pgettext_tip(message), values)


def label(message: str, /, context: str = "*", **values) -> str:
    """What stands in a panel. context : "Operator" for what stands on a button"""
    return _filled(bpy.app.translations.pgettext_iface(message, context), values)


def _filled(template: str, values: dict) -> str:
    return template.format(**values) if values else template


def _rows(table: dict[str, dict[str, str]]) -> dict[tuple[str, str], str]:
    """A table as Blender wants it. Where properties have no context of their own, their words are
    looked up in the common one."""
    found = {} if OWN_CONTEXT else {("*", message): said for message, said in table[OWN].items()}
    for context, entries in table.items():
        found |= {(context, message): said for message, said in entries.items()}
    return found


def attach() -> None:
    """Hand the tables to Blender."""
    tables = {language: _rows(table) for language, table in TABLES.items()}
    bpy.app.translations.register(__package__, tables)


def detach() -> None:
    """The reverse of attach."""
    bpy.app.translations.unregister(__package__)
