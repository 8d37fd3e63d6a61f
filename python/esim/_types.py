"""Layouts of arrays."""

import numpy as np

#: Events: `t` ns, `x` and `y` px, `p` +1 for rising and -1 for falling brightness.
EVENT_DTYPE = np.dtype(
    {"names": ["t", "x", "y", "p"], "formats": ["<i8", "<u2", "<u2", "i1"], "offsets": [0, 8, 10, 12], "itemsize": 16}
)

#: The motion of a body: `t` ns, `position` m and `orientation` (Hamilton, x y z w) of T_world_body, `velocity` m/s and
#: `acceleration` m/s² in the world frame, `angular_velocity` rad/s and `angular_acceleration` rad/s² in the body frame.
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

#: Measurements of the IMU in its frame: `t` ns, `angular_rate` rad/s, `specific_force` m/s², and the biases in them.
IMU_DTYPE = np.dtype(
    [
        ("t", "<i8"),
        ("angular_rate", "<f8", 3),
        ("specific_force", "<f8", 3),
        ("angular_rate_bias", "<f8", 3),
        ("specific_force_bias", "<f8", 3),
    ]
)
