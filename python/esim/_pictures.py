"""Pictures of events and recordings, for people: arrays of red, green and blue."""

import os

from . import _core
from ._represent import _span
from ._types import as_bytes, to_events


def time_surface_picture(events, width, height, *, t=None, tau_s=0.03):
    """A time surface for people: each pixel in the colour of its last event until t, ON orange and OFF blue, faded.

    Parameters
    ----------
    events, width, height
        As in `event_count`, in order of time.
    t, tau_s
        As in `time_surface`.

    Returns
    -------
    numpy.ndarray, uint8, shape (height, width, 3)
        Red, green, blue.
    """
    events = to_events(events)
    return _core.time_surface_picture(as_bytes(events), width, height, _span(events, None, t)[1], float(tau_s))


def space_time_plot(events, width, height, *, size=(960, 720), yaw_deg=35.0, pitch_deg=20.0):
    """Events as points in x, y and time, between axes, as `esim play` shows them.

    Parameters
    ----------
    events, width, height
        As in `event_count`, in order of time.
    size : (int, int)
        Width and height of the picture, px.
    yaw_deg, pitch_deg : float
        From where it is seen: at yaw 0 along the time axis, and from above. Best from -60 to 60, and from 0 to 40.

    Returns
    -------
    numpy.ndarray, uint8, shape (size[1], size[0], 3)
        Red, green, blue.
    """
    return _core.space_time_plot(as_bytes(to_events(events)), width, height, *size, float(yaw_deg), float(pitch_deg))


class play:
    """The pictures that the command `esim play` makes a video of, one by one: views of a recording side by side.

    Parameters
    ----------
    path : path
        A recording's folder or a file of events, of any format in `esim.formats()`.
    views : str or list of str, optional
        Of "events", "time-surface", "space-time", "image", "depth" and "motion"; all there is without.
    camera : str, optional
        Of several cameras, the one to show.
    at_s : float, optional
        One picture, of this moment, in s since the start of the recording.
    fps : float
        Pictures per second of a video.
    slow_motion : float, optional
        How many times slower than real time; so that the video lasts about 4 s or longer without.
    start_s, duration_s : float, optional
        What is shown, in s since the start of the recording.
    window_s : float, optional
        Time whose events a picture of events shows; `window_events` shows the latest so many instead.
    tau_s, span_s : float, optional
        Decay of the time surface; time that the plot of space and time spans.
    size : int, optional
        Width of the pictures, about, px.
    light : bool
        On white, for paper.
    width, height : int, optional
        Of the sensor, in place of what the file says.

    Yields
    ------
    numpy.ndarray, uint8, shape (height, width, 3)
        `len` says how many, and the attribute `times` when: int64, ns.

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
        for name, value in (("fps", fps), ("slow_motion", slow_motion), ("duration_s", duration_s)):
            if value is not None and not 0 < value < 1e9:
                raise ValueError(f"{name} is above 0")
        self._core = _core.open_pages(
            os.fspath(path),
            [views] if isinstance(views, str) else list(views or []),
            camera or "",
            fps=float(fps),
            slow_motion=float(slow_motion or 0),
            window_s=float(window_s or 0),
            window_events=int(window_events or 0),
            tau_s=float(tau_s or 0),
            span_s=float(span_s or 0),
            start_s=float(start_s),
            duration_s=duration_s,
            at_s=at_s,
            size=int(size or 0),
            light=bool(light),
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
