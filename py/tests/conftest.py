"""What the tests share."""

from __future__ import annotations

from pathlib import Path

import pytest

import taut

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def case() -> taut.Case:
    """The case that ``taut init`` writes."""
    return taut.Case(taut.template(), "axis.toml")


@pytest.fixture
def root() -> Path:
    """The repository."""
    return ROOT
