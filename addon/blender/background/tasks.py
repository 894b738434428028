"""Long work in slices: modal from a button, so that Blender stays awake, else straight through.

An operator's work is a generator, `steps`, that yields a Tick now and then. What needs no Blender
goes to a thread (`in_background`): bpy is never touched from there. A button runs the generator for
a few milliseconds at every tick of a timer and hears Escape; a script, a redo and Blender without a
window run it to its end in one go.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any

import bpy

from ..messages import translation
from ..messages.reporting import reported, say
from ..state.session import session

SLICE = 0.12  # seconds of work between two looks at mouse and keyboard
SHOWN = 0.5  # seconds between two signs of how far it is: drawing the window takes time, too
EVERY = 0.03  # seconds between looks whether a thread is done; every look costs that thread time
# The view may be turned while work goes on; all else waits, so that the scene stays as it is.
LOOKING = {
    "MOUSEMOVE", "INBETWEEN_MOUSEMOVE", "MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE",
    "TRACKPADPAN", "TRACKPADZOOM",
}  # fmt: skip

Progress = Callable[[int, int], None]


class Stopped(Exception):
    """Nobody waits for this work any more."""


@dataclass
class Tick:
    """How far work is: what it is at, which share (0..1) is done, and whom it waits for."""

    text: str
    share: float = 0.0
    waits_for: threading.Event | None = None


Steps = Generator[Tick, None, Any]


class BackgroundTask:
    """A function that runs in a thread of its own.

    work : gets a function (done, total) to call now and then. Once `stop` was called that function
    raises Stopped, so that work nobody waits for comes to its end.
    """

    def __init__(self, work: Callable[[Progress], Any]) -> None:
        self.done = threading.Event()
        self.share = 0.0
        self._work, self._wanted = work, True
        self._result: Any = None
        self._error: BaseException | None = None
        threading.Thread(target=self._run, name="Sketch to Face", daemon=True).start()

    def _run(self) -> None:
        try:
            self._result = self._work(self._progress)
        except BaseException as error:  # also Stopped: whoever asks for the result hears of it
            self._error = error
        finally:
            self.done.set()

    def _progress(self, done: int, total: int) -> None:
        if not self._wanted:
            raise Stopped
        self.share = done / max(total, 1)

    def stop(self) -> None:
        """Let it end at its next sign of progress."""
        self._wanted = False

    def result(self) -> Any:
        """What `work` returned; raises what it raised."""
        if self._error is not None:
            raise self._error
        return self._result


def in_background(
    work: Callable[[Progress], Any], text: str, start: float = 0.0, end: float = 1.0
) -> Steps:
    """Steps that wait for `work`, done in a thread, and return its result.

    start, end : the share of the whole before and after it
    """
    task = BackgroundTask(work)
    try:
        while True:  # at least once, so that what is over at once is named, too
            yield Tick(text, start + (end - start) * task.share, task.done)
            if task.done.is_set():
                break
    finally:
        task.stop()
    return task.result()


def within(
    steps: Generator[Any, None, Any], text: str, start: float, end: float, count: int
) -> Steps:
    """Steps of something that yields about `count` times, as ticks from `start` to `end`; return
    what it returns."""
    done = 0
    try:
        while True:
            try:
                next(steps)
            except StopIteration as last:
                return last.value
            done += 1
            yield Tick(text, start + (end - start) * min(done / count, 1.0))
    finally:
        steps.close()


class InSlices:
    """An operator whose work is `steps(context)`: a generator that returns what `execute` does."""

    _steps: Any = None  # a generator, while a button runs it
    _timer = None
    _alarm: Any = None  # a function, while it waits to be called
    _shown = 0.0

    def steps(self, context) -> Steps:
        """The work itself."""
        raise NotImplementedError

    def stopped(self, context) -> set[str]:
        """What to say and to return after Escape; what was done of it has been taken back."""
        say(self, "INFO", "{title} was stopped; nothing has changed", title=_title(self))
        return {"CANCELLED"}

    def execute(self, context):
        """All steps in one go."""
        result = {"CANCELLED"}
        with reported(self):
            result = run(self.steps(context))
        return result

    def invoke(self, context, event):
        """One slice for every tick of a timer."""
        if bpy.app.background:
            return self.execute(context)
        if session.doing is not None:
            say(self, "WARNING", "Still at work: {doing}", doing=session.doing.text)
            return {"CANCELLED"}
        session.doing, session.running = Tick(_title(self)), self
        self._steps = self.steps(context)
        manager = context.window_manager
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        self._wake(context)
        self._shown = time.perf_counter()  # what is over before SHOWN needs no sign
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Work, hear Escape, let the view be turned."""
        if event.type == "ESC" and event.value == "PRESS":
            with reported(self):
                self._steps.close()
            self._put_away(context)
            return self.stopped(context)
        if event.type != "TIMER" or self._alarm is not None:  # other timers make such events, too
            return {"PASS_THROUGH"} if event.type in LOOKING else {"RUNNING_MODAL"}
        result: set[str] | None = None
        with reported(self) as outcome:
            result = self._advance(context)
        if outcome.failed:
            result = {"CANCELLED"}
        if result is None:
            return {"RUNNING_MODAL"}
        self._put_away(context)
        return result

    def cancel(self, context):
        """Blender opens another file or closes: what is half done is taken back."""
        if self._steps is not None:
            self._steps.close()
        self._put_away(context)

    def _advance(self, context) -> set[str] | None:
        """A slice of work; what the operator returns once it is over."""
        end = time.perf_counter() + SLICE
        while True:
            try:
                tick = session.doing = next(self._steps)
            except StopIteration as last:
                return last.value
            if time.perf_counter() > end or tick.waits_for is not None:
                if time.perf_counter() > self._shown + SHOWN:
                    self._shown = time.perf_counter()
                    _show(context, _title(self))
                if tick.waits_for is not None:
                    self._sleep(context, tick.waits_for)
                return None

    def _wake(self, context) -> None:
        """Have `modal` called again and again."""
        if self._timer is None:
            self._timer = context.window_manager.event_timer_add(EVERY, window=context.window)

    def _rest(self, context) -> None:
        """Have it called no more, but for what the mouse and the keyboard do."""
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None

    def _sleep(self, context, done: threading.Event) -> None:
        """Rest until a thread is done, or it is time to show how far it is.

        Blender draws the sidebar after every event of a modal operator, and a timer of a window
        makes events. Timers of the application do not.
        """
        self._rest(context)
        window, end = context.window, time.perf_counter() + SHOWN

        def look() -> float | None:
            if not done.is_set() and time.perf_counter() < end:
                return EVERY
            self._alarm = None
            if self._steps is not None:
                self._timer = bpy.context.window_manager.event_timer_add(EVERY, window=window)
            return None

        self._alarm = look
        bpy.app.timers.register(look, first_interval=0.0)

    def _put_away(self, context) -> None:
        if session.doing is None:
            return
        session.doing = session.running = self._steps = None
        self._rest(context)
        if self._alarm is not None and bpy.app.timers.is_registered(self._alarm):
            bpy.app.timers.unregister(self._alarm)
        context.window_manager.progress_end()
        if context.workspace is not None:
            context.workspace.status_text_set(None)
        redraw_sidebars(context)


def _title(operator: bpy.types.Operator) -> str:
    """The operator's label in the artist's language."""
    return translation.label(operator.bl_label, "Operator")


def run(steps: Steps) -> Any:
    """Steps to their end; what they return."""
    while True:
        try:
            tick = next(steps)
        except StopIteration as last:
            return last.value
        if tick.waits_for is not None:
            tick.waits_for.wait()


def _show(context, title: str) -> None:
    """Tell the status bar, the mouse pointer and the sidebar how far it is."""
    tick = session.doing
    if tick is None:
        return
    context.window_manager.progress_update(round(100 * tick.share))
    if context.workspace is not None:
        said = translation.text("{title}: {doing}    Esc: stop", title=title, doing=tick.text)
        context.workspace.status_text_set(said)
    redraw_sidebars(context)


def redraw_sidebars(context) -> None:
    """Draw the sidebars of all 3D views anew, without the views themselves."""
    redraw(context, {"UI"})


def redraw(context, kinds: set[str]) -> None:
    """Draw regions of these kinds in all 3D views anew."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type in kinds:
                        region.tag_redraw()


def detach() -> None:
    """The add-on is switched off: Blender forgets the operator that runs without a word to it."""
    if session.running is not None:
        session.running.cancel(bpy.context)
