"""Packages that are used if they are there."""

from __future__ import annotations

import importlib
from types import ModuleType


def needed(module: str, package: str, what: str) -> ModuleType:
    """The module, or what to install."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise ImportError(f"{what} needs {package}; install it with: pip install {package}") from error
