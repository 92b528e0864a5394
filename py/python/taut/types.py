"""Types of dictionaries and words, for annotations: they check nothing when a program runs."""

from __future__ import annotations

from typing import Literal, TypedDict

Solver = Literal["exact", "general", "table3"]
"""Solvers of ``Case.simulate``."""

Method = Literal["rk4", "dp5"]
"""Methods of the solver ``table3``."""

Hold = Literal["zero", "first", "tustin"]
"""What a discrete-time model takes its input for between samples."""

Criterion = Literal["d", "a"]
"""Criteria of ``Case.design``."""

Excitation = Literal["trapezoid", "sweep", "chirp", "multisine", "prbs"]
"""Inputs that ``Case.design`` chooses among."""

Law = Literal["viscous", "coulomb", "asymmetric", "stribeck", "along", "force-along", "force-by-speed", "lugre"]
"""Friction laws that ``Case.compare`` compares."""

Direction = Literal["x", "y", "z"]
"""Directions of an accelerometer."""

DriveState = Literal["held", "free"]
"""How the motor behaves while the cart vibrates."""

SweepSolver = Literal["lanes", "exact"]
"""Solvers of sweeps: machines side by side, or one by one."""

SweepDesign = Literal["random", "latin-hypercube", "sobol", "grid", "one-at-a-time"]
"""How a sweep draws machines."""

Target = Literal["fmu", "c", "st", "matlab", "python", "json"]
"""Tools that ``export`` writes for."""

Part = Literal["plant", "controller", "both"]
"""What ``export`` writes."""

Real = Literal["float", "double"]
"""Numbers of exported C."""

Firmware = Literal["klipper", "klipper-2025-08"]
"""Whose rules ``shape`` follows."""


class Peak(TypedDict):
    """The value of largest magnitude, with its sign, in the unit that the key of the figure names."""

    value: float
    time_s: float


class Tie(TypedDict):
    """When rounding decided about a body, s."""

    time_s: float
    part: str


class EventCount(TypedDict):
    """How often a body stopped, started and reversed."""

    body: str
    stops: int
    starts: int
    reversals: int


# "from" is a keyword of Python, so that this cannot be a class statement.
Event = TypedDict(
    "Event",
    {"time_s": float, "part": str, "from": str, "to": str, "load": float, "load_unit": str, "by_rounding": bool},
)
"""A change of the motion: a body that sticks, slips or reverses, a limit, a span, the gear or an end stop."""


class Deviation(TypedDict):
    """A difference over time: its largest value with its sign, when, its root mean square, and its last value."""

    peak_m: float
    time_s: float
    rms_m: float
    last_m: float


class SteadySpeed(TypedDict):
    """The speed that a lasting input leads to."""

    cart_speed_m_s: float
    change_m_s: float
    reached: bool
    analytic_m_s: float | None
    input: float
    input_unit: str
    from_s: float
    to_s: float


class LoadOfMove(TypedDict):
    """Figures of what slides in a move."""

    error: Deviation
    overshoot_m: float
    target_m: float


class DriveOfMove(TypedDict):
    """Figures of a drive in a move."""

    following_error: Deviation
    peak_current_A: Peak
    rms_current_A: float
    peak_voltage_V: Peak
    rms_voltage_V: float
    energy_in_J: float
    energy_back_J: float
    limited_s: float
    amplifier_limited_s: float
    command_turns_per_s: float


class Metrics(TypedDict, total=False):
    """The key figures of a run. Which there are depends on the machine: ``bridge`` stands for the bridge of a gantry,
    ``left``, ``right`` and ``cart`` for its drives. Those from ``position_error_m`` on are of moves."""

    end_time_s: float
    event_counts: list[EventCount]
    settled: bool
    stop_time_s: float | None
    steady_speed: SteadySpeed | None
    final_cart_position_m: float
    final_cart_speed_m_s: float
    final_cart_by_drives_m: float
    final_drives_minus_cart_m: float
    final_bridge_position_m: float
    final_bridge_speed_m_s: float
    final_bridge_by_drives_m: float
    final_drives_minus_bridge_m: float
    final_drive_angle_rad: float
    final_drive_travel_m: float
    final_drive_travel_minus_cart_m: float
    final_left_angle_rad: float
    final_right_angle_rad: float
    final_cart_pulley_angle_rad: float
    peak_cart_speed_m_s: Peak
    peak_bridge_speed_m_s: Peak
    peak_drives_minus_cart_m: Peak
    peak_drives_minus_bridge_m: Peak
    peak_drive_speed_m_s: Peak
    peak_drive_travel_minus_cart_m: Peak
    peak_motor_current_A: Peak
    peak_motor_speed_rad_s: Peak
    peak_left_current_A: Peak
    peak_left_speed_rad_s: Peak
    peak_right_current_A: Peak
    peak_right_speed_rad_s: Peak
    peak_cart_current_A: Peak
    peak_cart_drive_speed_rad_s: Peak
    peak_belt_force_N: Peak
    peak_span_force_N: dict[str, Peak]
    peak_span_stretch_m: dict[str, Peak]
    position_error_m: float | None
    position_error_basis: str | None
    is_determined: bool | None
    decided_within_rounding: list[Tie]
    samples: int
    limited_samples: int
    limited_s: float
    amplifier_limited_s: float
    loads: dict[str, LoadOfMove]
    drives: dict[str, DriveOfMove]
    cart_error: Deviation
    following_error: Deviation
    contour_error: Deviation
    overshoot_m: float
    settling_s: float | None
    profile_end_s: float
    target_m: float
    window_m: float
    command_turns_per_s: float
    peak_current_A: Peak
    rms_current_A: float
    peak_voltage_V: Peak
    rms_voltage_V: float
    peak_force_N: list[Peak]
    peak_stretch: list[Peak]
    energy_in_J: float
    energy_back_J: float
