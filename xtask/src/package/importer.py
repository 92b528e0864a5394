"""Simulates the first experiment of `taut init`, 5 V for a quarter of a second, and prints where the cart ends, m."""

import sys

import numpy as np
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu

unit = sys.argv[1]
found = validate_fmu(unit)
assert not found, found
points = [(0.0, 5.0, 0.0), (0.25, 5.0, 0.0), (0.25, 0.0, 0.0), (1.0, 0.0, 0.0)]
pulse = np.array(points, dtype=[(name, np.float64) for name in ("time", "command", "cart_force")])
result = simulate_fmu(
    unit, fmi_type="CoSimulation", stop_time=1.0, output_interval=0.25, input=pulse, output=["cart_position"]
)
assert result["time"][-1] == 1.0, result["time"]
print(repr(float(result["cart_position"][-1])))
