"""How a DAVIS reads its rows, from pairs of events: python3 waiting_rows.py CLIP/events.txt [...]

Counts pairs of events of the same row, and of the same column in different rows, by the time between them, relative to pairs
200 to 600 us apart. Pairs of a row that are missing at short times, and found at 0 us instead, have waited for the same
reading. Lines "OFF, then ON" count pairs in which the first event was OFF; events with the same time stamp are in the
order of the file. Needs numpy."""

import sys

import numpy as np

REACH_US, REFERENCE_US, SHOWN_US = 600, 200, 16
NAMES = ("OFF, then OFF", "OFF, then ON", "ON, then OFF", "ON, then ON")


def pairs_by_distance(t_us, place, other, polarity):
    """Pairs with the same place and different others: (4, REACH_US + 1), by polarities and distance in us."""
    counts = np.zeros((4, REACH_US + 1))
    order = np.argsort(place, kind="stable")
    t_us, place, other, polarity = t_us[order], place[order], other[order], polarity[order]
    for step in range(1, len(t_us)):
        distance = t_us[step:] - t_us[:-step]
        near = (place[step:] == place[:-step]) & (distance <= REACH_US)
        if not near.any():
            return counts
        near &= other[step:] != other[:-step]
        kind = 2 * polarity[:-step] + polarity[step:]
        np.add.at(counts, (kind[near], distance[near]), 1)
    return counts


def show(title, counts):
    print(f"{title}: pairs at 0 us, and at 1 to {SHOWN_US} us")
    for name, row in zip((*NAMES, "all"), (*counts, counts.sum(axis=0))):
        usual = row[REFERENCE_US:].mean()
        shown = " ".join(f"{value:.2f}" for value in row[1 : SHOWN_US + 1] / usual)
        print(f"  {name:14} {2 * row[0] / usual:5.1f}  {shown}")


def main():
    for path in sys.argv[1:]:
        events = np.loadtxt(path)
        t_us = np.round((events[:, 0] - events[0, 0]) * 1e6).astype(int)
        x, y, polarity = (events[:, k].astype(int) for k in (1, 2, 3))
        print(path)
        show("same row", pairs_by_distance(t_us, y, x, polarity))
        show("same column", pairs_by_distance(t_us, x, y, polarity))


if __name__ == "__main__":
    main()
