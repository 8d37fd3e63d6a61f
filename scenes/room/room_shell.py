"""Architecture of the living room: walls, floor, window, door, wall fittings."""
import numpy as np

from room_geometry import rot_x

X, Y, H = 3.0, 2.5, 2.7                       # half length, half width, height
WIN = dict(y0=-1.35, y1=0.75, z0=0.85, z1=2.30, depth=0.16)  # in the west wall
DOOR = dict(x0=0.75, x1=1.65, z1=2.06)        # in the south wall
WHITE = "#e2ded4"


def build_shell(sc):
    floor_and_ceiling(sc)
    walls(sc)
    trims(sc)
    window(sc)
    curtains(sc)
    radiator(sc)
    door(sc)
    pictures(sc)
    fittings(sc)


def floor_and_ceiling(sc):
    sc.quad((-X, -Y, 0), (2 * X, 0, 0), (0, 2 * Y, 0), "planks", atlas="floor")
    sc.quad((-X, Y, H), (2 * X, 0, 0), (0, -2 * Y, 0), "ceiling",
            atlas="floor", density=0.36)


def wall_piece(sc, origin, along, z0, z1, mat, **kw):
    """Rectangle of wall, cut into pieces of at most 2.6 m for packing."""
    along = np.asarray(along, float)
    n = int(np.ceil(np.linalg.norm(along) / 2.6))
    for k in range(n):
        o = np.array([origin[0], origin[1], z0]) + along * k / n
        sc.quad(o, along / n, (0, 0, z1 - z0), mat, atlas="walls", **kw)


def walls(sc):
    wall_piece(sc, (-X, Y), (2 * X, 0, 0), 0, H, "wallpaper")
    wall_piece(sc, (X, Y), (0, -2 * Y, 0), 0, H, "brick")
    w, d = WIN, DOOR
    for y0, y1, z0, z1 in ((-Y, w["y0"], 0, H), (w["y1"], Y, 0, H),
                           (w["y0"], w["y1"], 0, w["z0"]),
                           (w["y0"], w["y1"], w["z1"], H)):
        wall_piece(sc, (-X, y0), (0, y1 - y0, 0), z0, z1, "plaster",
                   colour="#d8cfbd")
    for x0, x1, z0, z1 in ((-X, d["x0"], 0, H), (d["x1"], X, 0, H),
                           (d["x0"], d["x1"], d["z1"], H)):
        wall_piece(sc, (x1, -Y), (x0 - x1, 0, 0), z0, z1, "plaster",
                   colour="#d3b99a", density=0.8)


def trims(sc):
    """Skirting boards and a cornice."""
    kw = dict(atlas="walls", colour=WHITE)
    h, t = 0.11, 0.018
    d = DOOR
    sc.box((-X, Y - t, 0), (X, Y, h), "paint", "yZ", **kw)
    sc.box((X - t, -Y, 0), (X, Y, h), "paint", "xZ", **kw)
    sc.box((-X, -Y, 0), (-X + t, Y, h), "paint", "XZ", **kw)
    for x0, x1 in ((-X, d["x0"] - 0.09), (d["x1"] + 0.09, X)):
        sc.box((x0, -Y, 0), (x1, -Y + t, h), "paint", "YZ", **kw)
    for k, (size, z) in enumerate(((0.075, 0.035), (0.035, 0.09))):
        lo, hi = H - z, H - (0.0 if k == 0 else 0.035)
        sc.box((-X, Y - size, lo), (X, Y, hi), "paint", "yz", **kw)
        sc.box((X - size, -Y, lo), (X, Y, hi), "paint", "xz", **kw)
        sc.box((-X, -Y, lo), (-X + size, Y, hi), "paint", "Xz", **kw)
        sc.box((-X, -Y, lo), (X, -Y + size, hi), "paint", "Yz", **kw)


def window(sc):
    w = WIN
    y0, y1, z0, z1, xo = w["y0"], w["y1"], w["z0"], w["z1"], -X - w["depth"]
    kw = dict(atlas="walls", colour=WHITE)
    dep = w["depth"]
    sc.quad((-X, y0, z0), (0, 0, z1 - z0), (-dep, 0, 0), "paint", **kw)
    sc.quad((-X, y1, z1), (0, 0, z0 - z1), (-dep, 0, 0), "paint", **kw)
    sc.quad((-X, y1, z0), (0, y0 - y1, 0), (-dep, 0, 0), "paint", **kw)
    sc.quad((-X, y0, z1), (0, y1 - y0, 0), (-dep, 0, 0), "paint", **kw)
    f, ym = 0.06, 0.5 * (y0 + y1)
    zt = z0 + 0.66 * (z1 - z0)
    bars = [(y0, y0 + f, z0, z1), (y1 - f, y1, z0, z1), (ym - f, ym + f, z0, z1)]
    for a, b in ((y0 + f, ym - f), (ym + f, y1 - f)):  # rails between them
        bars += [(a, b, z0, z0 + f), (a, b, z1 - f, z1), (a, b, zt - 0.02, zt + 0.02)]
    for a, b, c, d in bars:
        sc.box((xo, a, c), (xo + 0.05, b, d), "paint", "yYzZX", **kw)
    for side in (-1, 1):  # thin glazing bars and a handle
        yb = ym + side * 0.5 * (y1 - ym)
        sc.box((xo + 0.01, yb - 0.011, z0 + f), (xo + 0.04, yb + 0.011, z1 - f),
               "paint", "yYX", **kw)
    sc.box((xo + 0.05, ym - 0.012, zt - 0.34), (xo + 0.085, ym + 0.012, zt - 0.22),
           "metal", "yYzZX", atlas="walls", colour="#8d867a")
    sc.box((-X - 0.02, y0 - 0.06, z0 - 0.035), (-X + 0.14, y1 + 0.06, z0 + 0.004),
           "wood", "yYzZX", atlas="walls", colour="#a87a4c", dark="#74492a")
    sc.quad((-4.6, -9.0, -2.0), (0, 18, 0), (0, 0, 9), "outdoor",
            atlas="walls", density=0.085)


def curtains(sc):
    """Two wavy curtains on a rod with finials."""
    zt, xr = 2.46, -X + 0.20
    n = 49
    for a, b in ((-1.86, -1.24), (0.64, 1.26)):
        u = np.linspace(0, 1, n + 1)
        rows = []
        for k, z in enumerate((0.03, 0.8, 1.6, 2.2, zt)):
            amp = 0.042 - 0.004 * k
            phase = 2 * np.pi * (7 * u + 0.12 * np.sin(9 * u + k * 0.5))
            y = a + (b - a) * u + (0.02 - 0.005 * k) * np.sin(5 * u + 1)
            rows.append(np.stack([xr + amp * np.sin(phase), y,
                                  np.full(n + 1, z)], -1))
        sc.add(np.array(rows), "curtain", density=0.8)
    sc.tube([(xr, -1.98, zt + 0.02), (xr, 1.38, zt + 0.02)], 0.014, "metal",
            colour="#4a3a2c")
    for y in (-2.0, 1.40):
        with sc.at((xr, y, zt + 0.02)):
            sc.sphere(0.032, "metal", 8, colour="#4a3a2c")


def radiator(sc):
    y0, y1, x0 = -0.95, 0.35, -X + 0.04
    n = 15
    for k in range(n):
        y = y0 + (y1 - y0) * (k + 0.5) / n
        sc.box((x0, y - 0.032, 0.13), (x0 + 0.085, y + 0.032, 0.70), "paint",
               "yYZX", colour=WHITE, density=0.7)
    for z in (0.19, 0.64):
        sc.box((x0 + 0.02, y0, z - 0.02), (x0 + 0.06, y1, z + 0.02), "paint",
               "XZ", colour=WHITE, density=0.6)
    sc.tube([(x0 + 0.04, y1, 0.19), (x0 + 0.04, y1 + 0.1, 0.19),
             (x0 + 0.04, y1 + 0.12, 0.0)], 0.012, "metal", 6, colour="#b0a898")


def door(sc):
    d, y = DOOR, -Y
    x0, x1, z1 = d["x0"], d["x1"], d["z1"]
    kw = dict(colour="#5f7a74", atlas="walls")
    trim = dict(colour=WHITE, atlas="walls")
    sc.box((x0, y - 0.05, 0), (x1, y, 0.004), "wood", "ZY", atlas="walls")
    sc.box((x0, y - 0.05, 0), (x1, y - 0.02, z1), "paint", "Y", **kw)
    for a, b in ((x0 - 0.09, x0), (x1, x1 + 0.09)):
        sc.box((a, y - 0.05, 0), (b, y + 0.03, z1), "paint", "xXYZ", **trim)
    sc.box((x0 - 0.09, y - 0.05, z1), (x1 + 0.09, y + 0.03, z1 + 0.09),
           "paint", "xXYZz", **trim)
    xm = 0.5 * (x0 + x1)
    for a, b in ((x0 + 0.11, xm - 0.05), (xm + 0.05, x1 - 0.11)):
        for c, e in ((0.2, 0.82), (1.0, 1.92)):
            sc.box((a, y - 0.02, c), (b, y - 0.004, e), "paint", "xXYzZ", **kw)
            sc.box((a + 0.05, y - 0.004, c + 0.05), (b - 0.05, y + 0.006, e - 0.05),
                   "paint", "xXYzZ", **kw)
    brass = dict(colour="#b08d4f")
    sc.box((x0 + 0.035, y - 0.02, 0.92), (x0 + 0.075, y - 0.012, 1.12), "metal",
           "xXYzZ", **brass)
    sc.tube([(x0 + 0.055, y - 0.02, 1.05), (x0 + 0.055, y + 0.045, 1.05)], 0.01,
            "metal", 8, **brass)
    sc.tube([(x0 + 0.05, y + 0.04, 1.05), (x0 + 0.16, y + 0.04, 1.05)], 0.010,
            "metal", 8, **brass)


def frame(sc, w, h, kind, colour="#2b221b", mount=0.05, bar=0.028):
    """Framed picture hanging in the local x-z plane, facing -y, back at 0."""
    t = 0.03
    for lo, hi in (((-w / 2, -h / 2), (w / 2, -h / 2 + bar)),
                   ((-w / 2, h / 2 - bar), (w / 2, h / 2)),
                   ((-w / 2, -h / 2 + bar), (-w / 2 + bar, h / 2 - bar)),
                   ((w / 2 - bar, -h / 2 + bar), (w / 2, h / 2 - bar))):
        sc.box((lo[0], -t, lo[1]), (hi[0], 0, hi[1]), "wood", "xXyzZ",
               colour=colour, dark="#17110c", density=0.8)
    sc.quad((-w / 2 + bar, -0.012, -h / 2 + bar), (w - 2 * bar, 0, 0),
            (0, 0, h - 2 * bar), "art", kind=kind, mount=mount)


def pictures(sc):
    for x, z, w, h, kind, col in ((-1.45, 1.62, 0.62, 0.80, "leaf", "#b58a4e"),
                                  (-0.62, 1.64, 0.86, 0.62, "hills", "#2b221b"),
                                  (0.16, 1.62, 0.54, 0.70, "circles", "#b58a4e")):
        with sc.at((x, Y - 0.002, z)):
            frame(sc, w, h, kind, col)
    with sc.at((X - 0.002, -1.22, 1.62), -90):
        frame(sc, 1.15, 0.80, "flow", "#1f1b18", 0.0)
    with sc.at((X - 0.002, -0.18, 1.66), -90):
        frame(sc, 0.42, 0.54, "sea", "#d8d2c4")
    with sc.at((-0.95, -Y + 0.002, 1.58), 180):
        frame(sc, 0.80, 1.0, "blocks", "#1f1b18", 0.06)
    with sc.at((-1.75, -Y + 0.002, 1.72), 180):
        frame(sc, 0.42, 0.52, "sea", "#b58a4e")
    with sc.at((-X + 0.002, -2.17, 1.60), 90):
        frame(sc, 0.40, 0.52, "circles", "#d8d2c4")
    with sc.at((-X + 0.002, 1.92, 1.72), 90):
        frame(sc, 0.46, 0.60, "flow", "#2b221b")


def fittings(sc):
    """Wall clock, switch, sockets, pendant lamp."""
    r = 0.17
    with sc.at((0.20, -Y + 0.001, 1.85), R=rot_x(-90)):
        sc.lathe([(r + 0.02, 0), (r + 0.02, 0.04), (r, 0.04), (r, 0.025)],
                 "wood", 20, colour="#4d2f1b", density=0.7)
        with sc.at((0, 0, 0), 180):
            sc.disc(r, 0.026, "clock", 24, radius=r)
    kw = dict(colour="#e8e6df", density=0.6)
    sc.box((0.48, -Y, 1.02), (0.57, -Y + 0.012, 1.13), "paint", "xXYzZ", **kw)
    for x in (1.05, 1.16):
        sc.box((x, Y - 0.012, 0.22), (x + 0.09, Y, 0.31), "paint", "xXyzZ", **kw)
    with sc.at((-0.5, 0.55, 0.0)):  # pendant above the rug
        sc.tube([(0, 0, 2.42), (0, 0, H)], 0.006, "metal", 5, colour="#222222")
        sc.cylinder(0.06, H - 0.03, H, "metal", 12, False, colour="#b08d4f")
        dome = [(0.23, 2.20), (0.20, 2.27), (0.14, 2.34), (0.05, 2.39), (0.025, 2.44)]
        sc.lathe(dome, "metal", 24, colour="#9c4a32")
        inner = [(rr - 0.008, z - 0.004) for rr, z in dome[:4]]
        sc.lathe(inner[::-1], "paint", 24, colour="#efe9d8", density=0.6)
        with sc.at((0, 0, 2.27)):
            sc.sphere(0.05, "bulb", 10)
