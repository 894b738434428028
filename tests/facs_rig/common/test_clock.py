"""Seconds of each stage."""

from facs_rig.common import clock as module


def test_stages_are_timed_and_told(monkeypatch):
    times = iter([10.0, 11.5, 14.0, 14.25])
    monkeypatch.setattr(module, "perf_counter", lambda: next(times))
    told: list[int] = []
    clock = module.Clock(told.append)
    clock.lap("read")
    clock.skip()  # two and a half seconds that nobody counts
    clock.lap("fit")
    assert clock.laps == {"read": 1.5, "fit": 0.25}
    assert told == [1, 2]
