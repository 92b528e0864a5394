"""The fixtures of all tests."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

import taut

# What a shell starts in the background ignores Ctrl-C, which some tests press: they would wait for runs of days.
signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def case() -> taut.Case:
    """The case that ``taut init`` writes."""
    return taut.Case(taut.template(), "axis.toml")


@pytest.fixture
def root() -> Path:
    """The repository."""
    return ROOT
