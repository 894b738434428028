"""A fit computes with one thread of BLAS, wherever numpy was loaded, and gives the others back."""

from pathlib import Path

from threadpoolctl import threadpool_info, threadpool_limits

import addon
from addon import pipeline
from addon.threads import on_one_thread

SKETCH = Path(addon.__file__).parent / "sketches" / "smiling_woman.png"


def threads() -> set[int]:
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def test_work_has_one_thread_and_the_others_come_back():
    with threadpool_limits(limits=2, user_api="blas"):
        assert threads() == {2}
        assert on_one_thread(threads)() == {1}
        assert threads() == {2}


def test_a_fit_has_one_thread(monkeypatch):
    seen = []
    load_rig = pipeline.load_rig

    def watched():
        seen.append(threads())
        return load_rig()

    monkeypatch.setattr(pipeline, "load_rig", watched)
    with threadpool_limits(limits=2, user_api="blas"):
        pipeline.fit(SKETCH)
        assert threads() == {2}
    assert seen == [{1}]
