"""Where everything can be installed, a skipped test is a failed one: pytest plugin.

With SKETCH_TO_FACE_NO_SKIPS in the environment, as .ci/run sets it.
"""

from __future__ import annotations

import os

import pytest

SWITCH = "SKETCH_TO_FACE_NO_SKIPS"


def _refused(report) -> None:
    if os.environ.get(SWITCH) and report.skipped and not hasattr(report, "wasxfail"):
        why = report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)
        report.outcome = "failed"
        report.longrepr = f"{why.removeprefix('Skipped: ')}: nothing may be skipped here ({SWITCH})"


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    """A test, or what it needs, skips."""
    report = yield
    _refused(report)
    return report


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    """A whole file skips, as by importorskip at its top."""
    report = yield
    _refused(report)
    return report
