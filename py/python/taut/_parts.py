"""Parts of a case file as objects."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar, TypeAlias, TypeVar

Quantity: TypeAlias = "float | str"
"""A number in SI units, or a text with a unit."""

Own = TypeVar("Own", bound="CasePart")


@dataclass(frozen=True)
class CasePart:
    """A table of a case file: its fields are the keys, with an underscore behind those that are words of Python."""

    _key: ClassVar[str] = ""
    """The key of the table in the one around it, where its class is chosen by that key."""

    _inside: ClassVar[Mapping[str, Callable[[Any], Any]]] = {}
    """By key, how a value becomes an object."""

    def table(self) -> dict[str, Any]:
        """The keys of the table that are given, with their values."""
        values = {field.name.rstrip("_"): getattr(self, field.name) for field in fields(self)}
        return {key: value for key, value in values.items() if value is not None}

    @classmethod
    def _read(cls: type[Own], table: Mapping[str, Any]) -> Own:
        """The object for a table of the case file."""
        names = {field.name.rstrip("_"): field.name for field in fields(cls)}
        return cls(**{names[key]: cls._inside.get(key, lambda same: same)(value) for key, value in table.items()})
