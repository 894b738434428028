"""Live faces: their sketches are watched, and what changed is fitted again.

A timer looks every half second. Reading goes on in a thread; only the new shape is written here.
No undo step is added: undoing a pen stroke takes the face back to where it was before that stroke.
"""

from __future__ import annotations

import time

import bpy

from facs_rig.blender.pose import check_face, is_face
from facs_rig.blender.worn import worn_by
from facs_rig.common.errors import InputError

from ..messages import reporting, translation
from ..state import sources
from ..state.session import session
from . import sketching, tasks

EVERY = 0.5  # seconds between looks
AT_MOST = 0.1  # share of the time that looking may take
BUSY = 0.02  # seconds between looks at a fit that goes on


def live_faces() -> list[bpy.types.Object]:
    """The faces of this file whose sketch is watched; not those that are linked into it."""
    faces = (o for o in bpy.data.objects if is_face(o) and o.library is None)
    return [face for face in faces if face.sketch_to_face.live]


def watch() -> float:
    """Look once; returns seconds until the next look."""
    if session.refit is not None:
        return _go_on()
    if session.doing is not None:  # a button's work comes first
        return EVERY
    begin, faces = time.perf_counter(), live_faces()
    _forget((session.refused.keys() | session.troubles) - {face.name for face in faces})
    for face in faces:
        if changed(face):
            session.refit = refit(face.name)
            return _go_on()
    return max(EVERY, (time.perf_counter() - begin) / AT_MOST)


def changed(face: bpy.types.Object) -> bool:
    """Whether the face's sketch is another than the one it was fitted to, and worth a try."""
    try:
        check_face(face)
        mark = sources.source_of(face.sketch_to_face).mark
    except InputError as error:
        session.troubles[face.name] = str(error)
        return False
    if mark == face.sketch_to_face.mark:  # what was wrong was undone, or mended by the button
        _forget({face.name})
        return False
    tried, why = session.refused.get(face.name, ("", ""))
    if tried == mark:
        session.troubles[face.name] = why
    modes = {thing.mode for thing in (face, *worn_by(face))}
    return tried != mark and modes == {"OBJECT"}  # in another, keys and vertices stay unwritten


def _forget(names: set[str]) -> None:
    """Nothing is wrong with the sketches of these faces any more."""
    for name in names:
        session.refused.pop(name, None)
        session.troubles.pop(name, None)


def refit(name: str) -> tasks.Steps:
    """Steps that fit a face again; what is wrong with its sketch goes to `session.troubles`."""
    context, face = bpy.context, bpy.data.objects[name]
    mark = sources.source_of(face.sketch_to_face).mark
    session.troubles.pop(name, None)
    try:
        reading = sketching.reading(context, face.sketch_to_face, face)
        yield from tasks.in_background(sketching.warm_up, "")
        found = yield from tasks.in_background(reading, "")
        face = bpy.data.objects.get(name)  # deleted, renamed or undone meanwhile
        if face is not None and is_face(face) and face.sketch_to_face.live:
            yield from sketching.put_on(face, found)
    except ReferenceError:  # an undo took the face away in between: the next look tries again
        pass
    except Exception as error:
        why = str(error)
        if not isinstance(error, InputError):
            path = reporting.log("Live")
            why = translation.text("{title} broke ({kind}); details: {path}", title="Live",
                                   kind=type(error).__name__, path=path)  # fmt: skip
        session.refused[name], session.troubles[name] = (mark, why), why


def _go_on() -> float:
    """A slice of the fit that goes on."""
    if session.refit_waits_for is not None and not session.refit_waits_for.is_set():
        return BUSY
    tick = next(session.refit, None) if session.refit is not None else None
    if tick is None:
        session.refit = session.refit_waits_for = None
        tasks.redraw(bpy.context, {"UI", "WINDOW"})
        return EVERY
    session.refit_waits_for = tick.waits_for
    return BUSY if tick.waits_for is not None else 0.0


def wait(seconds: float = 60.0) -> None:
    """Let the fit that goes on end where no timer runs: in scripts, and without a window."""
    end = time.monotonic() + seconds
    while session.refit is not None and time.monotonic() < end:
        if session.refit_waits_for is not None:
            session.refit_waits_for.wait(1.0)
        watch()


def attach() -> None:
    """Begin to watch."""
    bpy.app.timers.register(watch, first_interval=EVERY, persistent=True)


def detach() -> None:
    """The reverse of attach."""
    if bpy.app.timers.is_registered(watch):
        bpy.app.timers.unregister(watch)
    if session.refit is not None:
        session.refit.close()
