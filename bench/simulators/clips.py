"""What the adapters in this folder have in common: the frames and the events of `esim evaluate realism --program`."""

import pathlib

import cv2


def read_frames(folder):
    """Yields (time in ns, image from 0 to 1, linear) for the frames that images.csv of a folder lists."""
    folder = pathlib.Path(folder)
    for line in (folder / "images.csv").read_text().split():
        t, name = line.split(",")
        image = cv2.imread(str(folder / name), cv2.IMREAD_UNCHANGED)
        if image is None:
            raise SystemExit(f"{folder / name}: cannot be read as an image")
        yield int(t), image / 65535


def write_events(path, events):
    """Writes (time in s, x, y, polarity 0 or 1), in order of time."""
    with open(path, "w", encoding="ascii") as file:
        file.writelines(f"{t:.9f} {int(x)} {int(y)} {int(p)}\n" for t, x, y, p in sorted(events, key=lambda event: event[0]))
