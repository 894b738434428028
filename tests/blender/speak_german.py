"""Runs in an installed Blender: switches it to German, says how the add-on's strings are shown.

blender -b --factory-startup --python-exit-code 1 -P speak_german.py -- RESULT.json
"""

import json
import sys
from pathlib import Path

import bpy

LANGUAGES = bpy.app.translations.locales


def german() -> str:
    """What this Blender calls German; empty if it does not have it."""
    return next((name for name in LANGUAGES if name.split("_")[0] == "de"), "")


def tell() -> dict:
    """What is shown with the add-on, without it again, and in English."""
    import addon.blender
    from addon.blender.messages import translation
    from addon.blender.messages.german import TABLE

    view, translations = bpy.context.preferences.view, bpy.app.translations
    view.language = german()
    for name in ("interface", "tooltips", "reports"):  # reports: from Blender 4.1 on
        if hasattr(view, f"use_translate_{name}"):
            setattr(view, f"use_translate_{name}", True)

    keys = [(context, english) for context, entries in TABLE.items() for english in entries]

    def shown() -> list:
        return [[c, text, translations.pgettext_iface(text, c)] for c, text in keys]

    without = shown()
    for _ in range(2):  # what the first turn leaves would be in the way of the second
        addon.blender.register()
        labels = shown()
        tips = [translations.pgettext_tip(text) for context, text in keys if context == "*"]
        error = ""
        try:
            bpy.ops.sketch_to_face.fit()
        except RuntimeError as caught:
            error = str(caught)
        title = translation.label("Sketch to Face", "Operator")
        button = translation.text("{title} was stopped; nothing has changed", title=title)
        item = bpy.ops.sketch_to_face.reset_sliders.get_rna_type().properties["to"]
        drawn = translations.pgettext_iface("As Drawn", item.translation_context)
        view.language = "en_US"
        english = [text for _, text, said in shown() if said != text]
        view.language = german()
        addon.blender.unregister()
    left = [now for now, before in zip(shown(), without, strict=True) if now != before]
    return {"labels": labels, "tips": tips, "error": error, "button": button,
            "drawn": drawn, "english": english, "left": left}  # fmt: skip


result = Path(sys.argv[-1])
own = "this Blender has no German" if not german() else ""
if sys.version_info[:2] != (3, 11):
    own = "the installed Blender has another Python than this one"
told = {"skip": own} if own else tell()
result.write_text(json.dumps(told, ensure_ascii=False), encoding="utf-8")
