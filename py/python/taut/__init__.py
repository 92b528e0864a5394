"""Belt-driven axes: described in a file, simulated exactly, identified from logs.

    >>> import taut
    >>> case = taut.Case(taut.template())
    >>> run = case.simulate("5 V pulse")
    >>> float(run["cart_position"][-1])  # m
    0.05382078557945904

Numbers are in SI units everywhere; names of columns and keys of dictionaries say which where they hold bare numbers.
Mistakes are :class:`taut.Error`, a ``ValueError`` with the text that the command line shows.
"""

from ._native import Bug, Error, Observation, __version__
from . import controllers, moves, types
from .case import Case, export, read, show, template
from .results import Check, Comparison, Designed, Drift, Estimate, Fit, FitLog, ForceMap, FrequencyResponses, Learned, LinearModel, Modes, Plans, Shown, Tuned
from .runs import Run, Runs
from .shapers import Shape, shape
from .sweeps import sweep, sweep_tables
from .table import Table

__all__ = [
    "Bug",
    "Case",
    "Check",
    "Comparison",
    "Designed",
    "Drift",
    "Error",
    "Estimate",
    "Fit",
    "FitLog",
    "ForceMap",
    "FrequencyResponses",
    "Learned",
    "LinearModel",
    "Modes",
    "Observation",
    "Plans",
    "Run",
    "Runs",
    "Shape",
    "Shown",
    "Table",
    "Tuned",
    "__version__",
    "controllers",
    "export",
    "moves",
    "read",
    "shape",
    "show",
    "sweep",
    "sweep_tables",
    "template",
    "types",
]
