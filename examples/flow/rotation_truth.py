"""Optical flow of a rotating camera from its gyroscope, for the rotation sequences of the Event Camera Dataset.

If the camera rotates about its optical centre, the image motion of a static scene does not depend on depth: a point on
the bearing b = (x, y, 1) of camera frame C at t0 is on R_C1_C0 b at t1, and at every instant

    db/dt = -omega x b + (omega x b)_z b,       pixel velocity = (d pixel / d b) db/dt

(the motion field of the ESIM paper's Eq. 4 without translation). Frames: C is x right, y down, z forward; I is the IMU.
Pixel centres are at integer coordinates. Needs NumPy and the package esim.
"""

import functools
import pathlib
from dataclasses import dataclass

import numpy as np

import esim

AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


def rows_of(path, columns, meaning):
    """The numbers of a text file, float64 (N, columns), and their lines (N,); skips empty lines and comments."""
    try:
        text = pathlib.Path(path).read_text(encoding="ascii", errors="replace")
    except OSError as problem:
        raise esim.Error(f"cannot read {path}: {problem.strerror}; the evaluation needs it") from None
    rows, lines = [], []
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        try:
            row = [float(word) for word in words]
        except ValueError:
            raise esim.Error(f"{path}:{number}: expected numbers: {meaning}") from None
        if len(row) != columns:
            raise esim.Error(f"{path}:{number}: {len(row)} columns instead of {columns}: {meaning}")
        if not np.isfinite(row).all():
            raise esim.Error(f"{path}:{number}: not a finite number")
        rows.append(row)
        lines.append(number)
    if not rows:
        raise esim.Error(f"{path}: is empty; expected {meaning}")
    return np.array(rows), np.array(lines)


@dataclass(frozen=True)
class Calibration:
    """A pinhole with radial-tangential distortion (OpenCV's and Kalibr's), px.

        u = fx x' + cx,  v = fy y' + cy,
        (x', y') = (x, y) (1 + k1 r² + k2 r⁴ + k3 r⁶) + (2 p1 x y + p2 (r² + 2 x²), p1 (r² + 2 y²) + 2 p2 x y)
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0

    @staticmethod
    def read(path, width, height):
        """From the Event Camera Dataset's calib.txt, `fx fy cx cy k1 k2 p1 p2 k3`, of a sensor of width x height px.

        Raises esim.Error where it is damaged, or of a sensor of another size.
        """
        rows, _ = rows_of(path, 9, "fx fy cx cy k1 k2 p1 p2 k3")
        if len(rows) != 1:
            raise esim.Error(f"{path}: {len(rows)} lines of numbers instead of one: fx fy cx cy k1 k2 p1 p2 k3")
        calibration = Calibration(width, height, *rows[0].tolist())
        if min(calibration.fx, calibration.fy) <= 0:
            raise esim.Error(f"{path}:1: focal lengths must be above 0")
        # Principal points of real lenses are near the middle.
        for name, centre, size in (("cx", calibration.cx, width), ("cy", calibration.cy, height)):
            if not 0.2 * size < centre < 0.8 * size:
                raise esim.Error(f"{path}:1: {name} = {centre:g} px cannot belong to a sensor of {width} x {height} px; "
                                 "is the calibration of another size?")
        try:
            _ = calibration.bearings  # may not exist
        except esim.Error as problem:
            raise esim.Error(f"{path}:1: {problem}") from None
        return calibration

    def _distort(self, x, y):
        """Distorted image points, and their derivatives with respect to x and y (xx, xy, yy: it is symmetric)."""
        r2 = x * x + y * y
        radial = 1 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        slope = 2 * (self.k1 + r2 * (2 * self.k2 + 3 * r2 * self.k3))  # d radial / d r2, times 2
        point = (x * radial + 2 * self.p1 * x * y + self.p2 * (r2 + 2 * x * x),
                 y * radial + self.p1 * (r2 + 2 * y * y) + 2 * self.p2 * x * y)
        derivative = (radial + x * x * slope + 2 * self.p1 * y + 6 * self.p2 * x,
                      x * y * slope + 2 * self.p1 * x + 2 * self.p2 * y,
                      radial + y * y * slope + 6 * self.p1 * y + 2 * self.p2 * x)
        return point, derivative

    @functools.cached_property
    def bearings(self):
        """The bearing of each pixel: x and y of (x, y, 1) in C, float64 (2, height, width), by Newton's method.

        Raises esim.Error where the distortion folds the image back onto itself within the sensor.
        """
        v, u = np.mgrid[: self.height, : self.width].astype(float)
        goal_x, goal_y = (u - self.cx) / self.fx, (v - self.cy) / self.fy
        x, y = goal_x.copy(), goal_y.copy()
        with np.errstate(all="ignore"):
            for _ in range(30):
                (at_x, at_y), (a, b, d) = self._distort(x, y)
                error_x, error_y, determinant = at_x - goal_x, at_y - goal_y, a * d - b * b
                x, y = x - (d * error_x - b * error_y) / determinant, y - (a * error_y - b * error_x) / determinant
            (at_x, at_y), (a, b, d) = self._distort(x, y)
            found = (np.hypot(at_x - goal_x, at_y - goal_y) < 1e-9) & (a > 0) & (a * d - b * b > 0)
        if not found.all():
            row, column = np.argwhere(~found)[0]
            raise esim.Error(f"the distortion cannot be inverted at pixel ({column}, {row})")
        return np.stack([x, y])

    def project(self, bearing):
        """Pixels (2, ...) of bearings (3, ...) in front of the camera; NaN behind it."""
        z = np.where(bearing[2] > 0, bearing[2], np.nan)
        (x, y), _ = self._distort(bearing[0] / z, bearing[1] / z)
        return np.stack([self.fx * x + self.cx, self.fy * y + self.cy])

    def motion_field(self, omega_C):
        """Image velocity of every pixel, float64 (2, height, width), px/s, as the camera turns at omega_C, rad/s."""
        x, y = self.bearings
        wx, wy, wz = omega_C
        # -omega x b, and from it the velocity of (x, y) on the plane z = 1.
        moved_x, moved_y, moved_z = wz * y - wy, wx - wz * x, wy * x - wx * y
        moved_x, moved_y = moved_x - x * moved_z, moved_y - y * moved_z
        _, (a, b, d) = self._distort(x, y)
        return np.stack([self.fx * (a * moved_x + b * moved_y), self.fy * (b * moved_x + d * moved_y)])

    def optical_flow(self, R_C0_C1):
        """Optical flow from t0 to t1: float64 (2, height, width), px.

        R_C0_C1 maps from the camera's frame at t1 to its frame at t0.
        """
        x, y = self.bearings
        bearing = np.einsum("ji,jhw->ihw", R_C0_C1, np.stack([x, y, np.ones_like(x)]))
        v, u = np.mgrid[: self.height, : self.width]
        return self.project(bearing) - np.stack([u, v])


def rotation_of(vector):
    """exp of a rotation vector, rad: the matrix (3, 3), by Rodrigues' formula."""
    angle = np.linalg.norm(vector)
    x, y, z = vector
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    sine, versine = (1.0, 0.5) if angle < 1e-8 else (np.sin(angle) / angle, (1 - np.cos(angle)) / angle**2)
    return np.eye(3) + sine * cross + versine * cross @ cross


def parse_axes(text):
    """The rotation from the IMU's frame to the camera's frame, float64 (3, 3), from text.

    `x,-y,-z`: the camera's x, y and z axes are the IMU's x, -y and -z (left-handed gyroscopes too); or a quaternion of
    R_C_I, `x,y,z,w`. Raises esim.Error.
    """
    words = text.replace(" ", "").split(",")
    rows = [np.multiply(AXES.get(word.lstrip("+-"), (0, 0, 0)), -1 if word.startswith("-") else 1) for word in words]
    if len(words) == 3 and abs(np.linalg.det(rows)) == 1:
        return np.array(rows, float)
    try:
        x, y, z, w = (float(word) for word in words)
    except ValueError:
        raise esim.Error(f'"{text}" is neither three axes like x,-y,-z nor a quaternion x,y,z,w') from None
    if not abs(np.linalg.norm([x, y, z, w]) - 1) < 0.01:
        raise esim.Error(f'the quaternion "{text}" is not of unit norm')
    angle = 2 * np.arctan2(np.linalg.norm([x, y, z]), w)
    return rotation_of(np.array([x, y, z]) / (np.sin(angle / 2) or 1.0) * angle)


@dataclass(frozen=True)
class Gyroscope:
    """Angular rates of the IMU: t int64 (N,) ns, increasing; rate float64 (N, 3) rad/s in C.

    Between measurements the rate goes straight. `delay_ns` is by how much its stamps lag behind the camera's.
    """

    t: np.ndarray
    rate: np.ndarray

    @staticmethod
    def read(path, axes=np.eye(3), max_gap_s=0.02, delay_s=0.0):
        """From the Event Camera Dataset's imu.txt, `t ax ay az gx gy gz` (s, m/s², rad/s).

        Parameters
        ----------
        axes : (3, 3)
            From the IMU's frame to the camera's: `parse_axes`.
        max_gap_s : float
            Longer times without a measurement are an error.
        delay_s : float
            By how much the IMU's stamps lag behind the camera's clock: t_camera = t_imu - delay_s.

        Raises esim.Error, naming the line, for damaged files, times that do not increase, and gaps.
        """
        rows, lines = rows_of(path, 7, "t ax ay az gx gy gz")
        if not (np.abs(rows[:, 0]) < 9e9).all():
            raise esim.Error(f"{path}:{lines[np.abs(rows[:, 0]) >= 9e9][0]}: the time must be in seconds")
        t = np.rint((rows[:, 0] - delay_s) * 1e9).astype(np.int64)
        step = np.diff(t)
        for at in np.flatnonzero(step <= 0)[:1]:
            raise esim.Error(f"{path}:{lines[at + 1]}: the time {rows[at + 1, 0]:.9f} s does not come after the previous one; "
                             "sort the file")
        for at in np.flatnonzero(step > max_gap_s * 1e9)[:1]:
            raise esim.Error(f"{path}:{lines[at + 1]}: no measurement for {step[at] * 1e-9:.3f} s before this line; "
                             f"allow gaps longer than {max_gap_s:g} s (--max-gap-s) or cut the recording")
        return Gyroscope(t, rows[:, 4:] @ np.asarray(axes).T)

    @staticmethod
    def constant(path, t0, t1):
        """From the motion.txt of a short clip, `wx wy wz` in the camera's axes (rad/s), from t0 to t1 (ns).

        Raises esim.Error for damaged files.
        """
        rows, _ = rows_of(path, 3, "wx wy wz")
        if len(rows) != 1:
            raise esim.Error(f"{path}: {len(rows)} lines of numbers instead of one: wx wy wz")
        return Gyroscope(np.array([t0, t1]), np.repeat(rows, 2, axis=0))

    def less(self, bias_C):
        """The same without a bias, rad/s in C."""
        return Gyroscope(self.t, self.rate - bias_C)

    def bias_at_rest(self, t0, t1, most_deviation=0.02):
        """The mean rate from t0 to t1 (ns), when the camera stood still: rad/s in C.

        Raises esim.Error where it moved: where a rate deviates by more than most_deviation (rad/s, standard deviation).
        """
        chosen = self.rate[(self.t >= t0) & (self.t <= t1)]
        if len(chosen) < 10:
            raise esim.Error(f"the gyroscope has {len(chosen)} measurements between {t0 * 1e-9:g} s and {t1 * 1e-9:g} s; "
                             "a bias needs 10")
        deviation = chosen.std(axis=0).max()
        if deviation > most_deviation:
            raise esim.Error(f"the camera does not stand still between {t0 * 1e-9:g} s and {t1 * 1e-9:g} s: its rate "
                             f"deviates by {deviation:.3f} rad/s")
        return chosen.mean(axis=0)

    def covers(self, t0, t1):
        return self.t[0] <= t0 and t1 <= self.t[-1]

    def at(self, t):
        """The rate at t (ns), (3,) or (N, 3) rad/s."""
        return np.stack([np.interp(t, self.t, axis) for axis in self.rate.T], -1)

    def rotation(self, t0, t1):
        """R_C0_C1: how the camera turned from t0 to t1, ns."""
        if not self.covers(t0, t1):
            raise esim.Error(f"the gyroscope measured from {self.t[0] * 1e-9:.3f} s to {self.t[-1] * 1e-9:.3f} s, not from "
                             f"{t0 * 1e-9:.3f} s to {t1 * 1e-9:.3f} s")
        inside = self.t[np.searchsorted(self.t, t0, "right") : np.searchsorted(self.t, t1, "left")]
        t = np.concatenate([[t0], inside, [t1]])
        rate = self.at(t)
        R = np.eye(3)
        for vector in 0.5 * (rate[1:] + rate[:-1]) * (np.diff(t) * 1e-9)[:, None]:
            R = R @ rotation_of(vector)
        return R


def sharpness(events, calibration, omega_C, t0):
    """The fit of events to a rotation: variance of the image of events, each moved back along the motion field to t0, over
    that of the image of events as they are (contrast maximisation, Gallego and Scaramuzza, RA-L 2017). Images are
    smoothed by a pixel, so that events between pixels blur them no more than others."""
    width, height = calibration.width, calibration.height

    def variance(u, v):
        column, row = np.rint(u).astype(int), np.rint(v).astype(int)
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        image = np.bincount(row[inside] * width + column[inside], minlength=width * height).reshape(height, width)
        for axis in (0, 1):
            image = image + 0.5 * (np.roll(image, 1, axis) + np.roll(image, -1, axis))
        return image.var()

    x, y = events["x"].astype(int), events["y"].astype(int)
    flow = calibration.motion_field(omega_C)[:, y, x] * ((events["t"] - t0) * 1e-9)
    return variance(x - flow[0], y - flow[1]) / variance(x, y)


def sharpest_rate(events, calibration, omega_C, t0, step=0.1, least_step=0.003):
    """The constant rate, rad/s (3,), that fits the events best by `sharpness`, from omega_C on by steps along the axes."""
    best, score = np.array(omega_C, float), sharpness(events, calibration, omega_C, t0)
    while step >= least_step:
        tried = [best + sign * step * axis for axis in np.eye(3) for sign in (1, -1)]
        scores = [sharpness(events, calibration, omega, t0) for omega in tried]
        if max(scores) > score:
            best, score = tried[np.argmax(scores)], max(scores)
        else:
            step /= 2
    return best
