"""Images of events and recordings for display: RGB arrays."""

import os

from . import _checks, _core
from ._events import as_bytes, size_of, to_layout
from ._represent import moment


def time_surface_picture(events, width=None, height=None, *, t=None, tau_s=0.03):
    """Draws a time surface: each pixel has the colour of its last event until t (ON orange, OFF blue), which fades.

    Parameters
    ----------
    events, width, height
        As in `event_count`, in order of time.
    t, tau_s
        As in `time_surface`.

    Returns
    -------
    numpy.ndarray, uint8, shape (height, width, 3)
        RGB image.
    """
    size, tau = size_of(events, width, height), _checks.seconds(tau_s, "tau_s", above=0)
    events = to_layout(events)
    return _core.time_surface_picture(as_bytes(events), *size, moment(events, t), tau)


def space_time_plot(events, width=None, height=None, *, size=(960, 720), yaw_deg=35.0, pitch_deg=20.0):
    """Draws events as points in x, y and time with axes, as `esim play` does.

    Parameters
    ----------
    events, width, height
        As in `event_count`, in order of time.
    size : (int, int)
        Width and height of the image, px.
    yaw_deg, pitch_deg : float
        Direction of view: yaw 0 is along the time axis; a positive pitch is from above. Useful ranges are -60 to 60 and
        0 to 40.

    Returns
    -------
    numpy.ndarray, uint8, shape (size[1], size[0], 3)
        RGB image.
    """
    columns, rows = size
    return _core.space_time_plot(
        as_bytes(events),
        *size_of(events, width, height),
        _checks.whole(columns, "width in size", 64, 16384),
        _checks.whole(rows, "height in size", 64, 16384),
        _checks.number(yaw_deg, "yaw_deg"),
        _checks.number(pitch_deg, "pitch_deg"),
    )


class play:
    """Iterates over the images of `esim play`: views of a recording side by side.

    Parameters
    ----------
    path : path
        A recording's folder or an event file, of any format in `esim.formats()`.
    views : str or list of str, optional
        From "events", "time-surface", "space-time", "image", "depth" and "motion". Default: all available views.
    camera : str, optional
        Name of the camera to show, if there are several.
    at_s : float, optional
        Time of a single image, s since the start of the recording.
    fps : float
        Images per second.
    slow_motion : float, optional
        Slow-motion factor. Default: so that the video lasts at least about 4 s.
    start_s, duration_s : float, optional
        The part to show, s; the start is relative to the start of the recording.
    window_s : float, optional
        Time window of the shown events, s; `window_events` shows a number of the latest events instead.
    tau_s, span_s : float, optional
        Decay time of the time surface, s; time span of the space-time plot, s.
    size : int, optional
        Approximate width of the images, px.
    light : bool
        White background, for print.
    width, height : int, optional
        Size of the sensor, px; overrides the file.

    Yields
    ------
    numpy.ndarray, uint8, shape (height, width, 3)
        RGB images. `len` gives their number, and the attribute `times` their times: int64, ns.

    Raises
    ------
    esim.Error
    """

    def __init__(
        self,
        path,
        *,
        views=None,
        camera=None,
        at_s=None,
        fps=30.0,
        slow_motion=None,
        start_s=0.0,
        duration_s=None,
        window_s=None,
        window_events=None,
        tau_s=None,
        span_s=None,
        size=None,
        light=False,
        width=None,
        height=None,
    ):
        width, height = _checks.optional_sensor_size(width, height)

        def seconds(value, name):
            return None if value is None else _checks.seconds(value, name, above=0)

        self._core = _core.open_pages(
            os.fspath(path),
            [views] if isinstance(views, str) else list(views or []),
            camera or "",
            fps=_checks.number(fps, "fps", above=0, high=1e9),
            slow_motion=0.0 if slow_motion is None else _checks.number(slow_motion, "slow_motion", above=0, high=1e9),
            window_s=seconds(window_s, "window_s") or 0.0,
            window_events=0 if window_events is None else _checks.whole(window_events, "window_events", 1, 2**40),
            tau_s=seconds(tau_s, "tau_s") or 0.0,
            span_s=seconds(span_s, "span_s") or 0.0,
            start_s=_checks.seconds(start_s, "start_s", low=0),
            duration_s=seconds(duration_s, "duration_s"),
            at_s=None if at_s is None else _checks.seconds(at_s, "at_s", low=0),
            size=0 if size is None else _checks.whole(size, "size", 1, 16384),
            light=_checks.flag(light, "light"),
            width=width,
            height=height,
        )
        self.times = self._core.times()

    def __len__(self):
        return len(self.times)

    def __iter__(self):
        return self

    def __next__(self):
        picture = self._core.next()
        if picture is None:
            raise StopIteration
        return picture
