"""Layouts of arrays."""

import numpy as np

EVENT_DTYPE = np.dtype(
    {"names": ["t", "x", "y", "p"], "formats": ["<i8", "<u2", "<u2", "i1"], "offsets": [0, 8, 10, 12], "itemsize": 16}
)
"""Events: `t` ns, `x` and `y` px, `p` +1 for rising and -1 for falling brightness."""

LABEL_DTYPE = np.dtype(
    {
        "names": ["t_ideal", "signal", "flicker", "noise", "leak", "object", "semantic_class", "cause", "hot"],
        "formats": ["<i8", "<f4", "<f4", "<f4", "<f4", "<u2", "<u2", "u1", "?"],
        "offsets": [0, 8, 12, 16, 20, 24, 26, 28, 29],
        "itemsize": 32,
    }
)
"""Labels of events: `t_ideal` ns, before latency and readout; the parts of the change, `signal`, `flicker`, `noise` and
`leak`, ln, whose sum is the threshold of the pixel; what the pixel saw, `object` (i + 1 for object i, 0 for none) and
`semantic_class` (0 for none); `cause`, an index into esim.CAUSES; and whether the pixel is `hot`."""

CAUSES = ("signal", "flicker", "noise", "leak")
"""The causes of events, by their numbers in labels."""

STATE_DTYPE = np.dtype(
    [
        ("t", "<i8"),
        ("position", "<f8", 3),
        ("orientation", "<f8", 4),
        ("velocity", "<f8", 3),
        ("acceleration", "<f8", 3),
        ("angular_velocity", "<f8", 3),
        ("angular_acceleration", "<f8", 3),
    ]
)
"""The motion of a body: `t` ns, `position` m and `orientation` (Hamilton, x y z w) of T_world_body, `velocity` m/s and
`acceleration` m/s² in the world frame, `angular_velocity` rad/s and `angular_acceleration` rad/s² in the body frame."""

IMU_DTYPE = np.dtype(
    [
        ("t", "<i8"),
        ("angular_rate", "<f8", 3),
        ("specific_force", "<f8", 3),
        ("angular_rate_bias", "<f8", 3),
        ("specific_force_bias", "<f8", 3),
    ]
)
"""Measurements of the IMU in its frame: `t` ns, `angular_rate` rad/s, `specific_force` m/s², and the biases in them."""
