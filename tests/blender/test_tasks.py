"""Long work in slices: straight through in a script, a slice a tick from a button, Escape."""

from __future__ import annotations

import threading
import time
from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")

from addon.blender.background import tasks  # noqa: E402
from addon.blender.state.session import session  # noqa: E402
from facs_rig.common.errors import InputError  # noqa: E402


class Window:
    """What `tasks` uses of Blender's window: timers, which a test rings, and what is shown."""

    def __init__(self) -> None:
        self.events, self.alarms, self.shares, self.texts = [], [], [], []
        self.reports: list[tuple[set, str]] = []
        self.app = SimpleNamespace(background=False, timers=self)
        self.context = self
        self.window_manager = self.workspace = self
        self.window, self.windows = "window", []

    def event_timer_add(self, _wait, window):
        assert window == "window"
        self.events.append(object())
        return self.events[-1]

    def event_timer_remove(self, timer) -> None:
        self.events.remove(timer)

    def register(self, alarm, first_interval=0.0) -> None:
        self.alarms.append(alarm)

    def unregister(self, alarm) -> None:
        self.alarms.remove(alarm)

    def is_registered(self, alarm) -> bool:
        return alarm in self.alarms

    def ring(self) -> None:
        """Let the application's timers look once."""
        self.alarms = [alarm for alarm in self.alarms if alarm() is not None]

    def modal_handler_add(self, operator) -> None:
        self.operator = operator

    def progress_begin(self, low, high) -> None:
        self.shares.append("begin")

    def progress_update(self, share) -> None:
        self.shares.append(share)

    def progress_end(self) -> None:
        self.shares.append("end")

    def status_text_set(self, text) -> None:
        self.texts.append(text)


@pytest.fixture
def window(monkeypatch):
    made = Window()
    monkeypatch.setattr(tasks, "bpy", made)
    monkeypatch.setattr(tasks, "SHOWN", 0.0)
    monkeypatch.setattr(tasks, "SLICE", 0.0)
    yield made
    session.doing = session.running = None


def button(steps, window=None):
    """An operator whose steps are `steps`."""

    class Operator(tasks.InSlices):
        bl_label = "Count"

        def steps(self, _context):
            return (yield from steps())

        def report(self, kind, text) -> None:
            window.reports.append((kind, text))

    return Operator()


def event(kind: str) -> SimpleNamespace:
    return SimpleNamespace(type=kind, value="PRESS")


def counting(done: list):
    def steps():
        try:
            for k in range(4):
                done.append(k)
                yield tasks.Tick(f"at {k}", k / 4)
            return {"FINISHED"}
        finally:
            done.append("closed")

    return steps


def test_a_script_runs_it_to_its_end(window):
    done: list = []
    assert button(counting(done), window).execute(window) == {"FINISHED"}
    assert done == [0, 1, 2, 3, "closed"] and session.doing is None
    assert window.shares == [] and window.events == []


def test_a_button_runs_a_slice_a_tick(window):
    done: list = []
    pressed = button(counting(done), window)
    assert pressed.invoke(window, None) == {"RUNNING_MODAL"}
    assert done == [] and len(window.events) == 1
    assert pressed.modal(window, event("TIMER")) == {"RUNNING_MODAL"}
    assert done == [0] and session.doing.text == "at 0"
    assert "at 0" in window.texts[-1] and "Esc" in window.texts[-1]
    answers = [pressed.modal(window, event("TIMER")) for _ in range(4)]
    assert answers == [{"RUNNING_MODAL"}] * 3 + [{"FINISHED"}]
    assert window.events == [] and window.texts[-1] is None and session.doing is None
    assert window.shares == ["begin", 0, 25, 50, 75, "end"]


def test_the_view_may_be_turned_meanwhile_and_nothing_else(window):
    pressed = button(counting([]), window)
    pressed.invoke(window, None)
    assert pressed.modal(window, event("MIDDLEMOUSE")) == {"PASS_THROUGH"}
    assert pressed.modal(window, event("Z")) == {"RUNNING_MODAL"}
    pressed.modal(window, event("ESC"))


def test_escape_closes_the_work_and_puts_everything_away(window):
    done: list = []
    pressed = button(counting(done), window)
    pressed.invoke(window, None)
    pressed.modal(window, event("TIMER"))
    assert pressed.modal(window, event("ESC")) == {"CANCELLED"}
    assert done == [0, "closed"]
    assert window.events == [] and window.alarms == [] and window.shares[-1] == "end"
    assert window.reports == [({"INFO"}, "Count was stopped; nothing has changed")]


def test_a_second_button_waits(window):
    button(counting([]), window).invoke(window, None)
    other = button(counting([]), window)
    assert other.invoke(window, None) == {"CANCELLED"}
    assert window.reports[-1] == ({"WARNING"}, "Still at work: Count")


def test_another_file_or_the_end_of_blender_closes_the_work(window):
    done: list = []
    pressed = button(counting(done), window)
    pressed.invoke(window, None)
    pressed.modal(window, event("TIMER"))
    pressed.cancel(window)
    assert done[-1] == "closed" and window.events == [] and session.doing is None


def test_what_a_button_is_at_ends_when_the_add_on_is_switched_off(window):
    done: list = []
    pressed = button(counting(done), window)
    pressed.invoke(window, None)
    pressed.modal(window, event("TIMER"))
    tasks.detach()
    assert done[-1] == "closed" and window.events == []
    assert session.doing is None and session.running is None
    tasks.detach()  # nothing runs


def test_an_error_is_a_sentence_and_ends_the_work(window):
    def steps():
        yield tasks.Tick("at it", 0.5)
        raise InputError("the pencil broke")

    pressed = button(steps, window)
    pressed.invoke(window, None)
    pressed.modal(window, event("TIMER"))
    assert pressed.modal(window, event("TIMER")) == {"CANCELLED"}
    assert window.reports == [({"ERROR"}, "The pencil broke")]
    assert window.events == [] and session.doing is None


def test_while_a_thread_works_blender_makes_no_events(window):
    gate = threading.Event()

    def steps():
        return (
            yield from tasks.in_background(lambda progress: gate.wait(10) and {"FINISHED"}, "away")
        )

    before = set(threading.enumerate())
    pressed = button(steps, window)
    pressed.invoke(window, None)
    pressed.modal(window, event("TIMER"))
    assert window.events == [] and len(window.alarms) == 1
    assert pressed.modal(window, event("TIMER")) == {"RUNNING_MODAL"}  # another program's timer
    assert len(window.alarms) == 1
    gate.set()
    for thread in set(threading.enumerate()) - before:
        thread.join(10)  # were it still at work after a while, its progress would be an event
    while window.alarms:
        window.ring()
        time.sleep(0.001)
    assert len(window.events) == 1
    assert pressed.modal(window, event("TIMER")) == {"FINISHED"}


def test_what_a_thread_returns_and_raises_arrives(window):
    def adding(progress):
        progress(1, 2)
        return 1 + 1

    assert tasks.run(tasks.in_background(adding, "adding")) == 2

    def failing(_progress):
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        tasks.run(tasks.in_background(failing, "failing"))


def test_a_thread_nobody_waits_for_ends_at_its_next_sign_of_progress(window):
    ended = threading.Event()

    def endless(progress):
        try:
            while True:
                progress(1, 2)
                time.sleep(0.001)
        finally:
            ended.set()

    steps = tasks.in_background(endless, "endless", 0.2, 0.4)
    tick = next(steps)
    assert 0.2 <= tick.share <= 0.4 and tick.waits_for is not None
    steps.close()
    assert ended.wait(5)


def test_ticks_of_plain_steps(window):
    def plain():
        yield
        yield
        yield
        return "done"

    steps = tasks.within(plain(), "plain", 0.5, 1.0, 2)
    shares = []
    try:
        while True:
            shares.append(next(steps).share)
    except StopIteration as end:
        assert end.value == "done"
    assert shares == [0.75, 1.0, 1.0]
