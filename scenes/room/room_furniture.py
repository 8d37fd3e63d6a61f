"""Furniture and small objects of the living room."""
import numpy as np

from room_geometry import rot_x, rot_z
from room_shell import X, Y, frame

BOOK_COLOURS = ("#7a2f2a", "#2c4a63", "#3d5b3f", "#c9a24b", "#d8cdb4", "#4a3550",
                "#a4502d", "#22272e", "#8a9a8c", "#b7b3a6", "#5f2433", "#3f7379",
                "#cf7f3a", "#6d6257", "#e3ddcf", "#30435c")


def build_furniture(sc, rng):
    sc.quad((-1.85, -0.35, 0.012), (2.7, 0, 0), (0, 1.9, 0), "rug", atlas="floor",
            density=1.1)
    for x in (-1.93, 0.85):
        sc.quad((x, -0.35, 0.008), (0.08, 0, 0), (0, 1.9, 0), "fringe",
                atlas="floor")
    with sc.at((-0.65, 2.0, 0)):
        sofa(sc)
    with sc.at((-0.55, 0.72, 0.012), 3):
        coffee_table(sc, rng)
    with sc.at((1.62, 0.45, 0), -72):
        armchair(sc)
    with sc.at((X - 0.155, 1.40, 0), -90):
        bookcase(sc, rng)
    with sc.at((0.86, 2.12, 0)):
        floor_lamp(sc)
    with sc.at((-2.45, 1.95, 0)):
        plant(sc, rng)
    with sc.at((X - 0.235, -1.2, 0), -90):
        sideboard(sc, rng)
    with sc.at((-1.15, -Y + 0.23, 0), 180):
        chest(sc, rng)
    with sc.at((-2.05, 0.10, 0)):
        pouf(sc)


# --------------------------------------------------------------------- sofa
def sofa(sc):
    """2.15 m sofa facing -y, centred, back towards +y."""
    grey = dict(colour="#48606d", second="#748c98", density=0.85)
    sc.rbox((0, 0.0, 0.21), (0.98, 0.42, 0.10), 0.03, "fabric", "yxXZ", **grey)
    sc.rbox((0, 0.33, 0.50), (0.92, 0.11, 0.37), 0.06, "fabric", "xXyZ", **grey)
    for s in (-1, 1):
        sc.rbox((s * 1.0, 0.0, 0.36), (0.10, 0.44, 0.26), 0.06, "fabric",
                "xXyYZ", **grey)
        sc.rbox((s * 0.45, -0.11, 0.385), (0.445, 0.33, 0.085), 0.04, "fabric",
                "xXyYZ", crown=0.035, mids=3, **grey)
        with sc.at((s * 0.45, 0.13, 0.65), R=rot_x(-14)):
            sc.rbox((0, 0, 0), (0.435, 0.085, 0.22), 0.07, "fabric", "xXyYZ",
                    mids=2, **grey)
        for y in (-0.34, 0.36):
            with sc.at((s * 0.9, y, 0)):
                sc.cylinder(0.025, 0, 0.13, "wood", 8, False)
    pillows = (((-0.70, -0.03, 0.66), 14, -20, dict(kind="zigzag", size=0.07,
                colour="#d9c79a", second="#b0502f")),
               ((-0.36, -0.01, 0.64), -10, -24, dict(kind="dot", size=0.06,
                colour="#31414d", second="#d9a441")),
               ((0.68, -0.03, 0.66), -16, -20, dict(kind="check", size=0.055,
                colour="#d8d0bf", second="#8a3d30")))
    for pos, yaw, tilt, kw in pillows:
        with sc.at(pos, R=rot_z(yaw) @ rot_x(tilt)):
            sc.pillow(0.46, 0.42, 0.17, "pattern_fabric", **kw)
    throw(sc)


def throw(sc):
    """Blanket draped over the right arm of the sofa."""
    section = np.array([(0.885, 0.47), (0.893, 0.57), (0.93, 0.623), (1.0, 0.632),
                        (1.07, 0.623), (1.107, 0.57), (1.112, 0.42), (1.12, 0.22)])
    y = np.linspace(-0.30, 0.14, 9)
    rows = []
    for k, (x, z) in enumerate(section[::-1]):
        wave = 0.010 * np.sin(np.linspace(0, 9, 9) + k * 0.3) * (1 if k < 2 else 0.3)
        rows.append(np.stack([x + np.abs(wave) + 0 * y, y, z + 0 * y], -1))
    sc.add(np.array(rows), "pattern_fabric", kind="check", size=0.05,
           colour="#cdb98c", second="#465a44")


def armchair(sc):
    """Leather armchair with wooden legs, facing -y."""
    kw = dict(colour="#96582f", density=0.85)
    sc.rbox((0, 0.0, 0.27), (0.36, 0.36, 0.08), 0.03, "leather", "xXyYZ", **kw)
    sc.rbox((0, -0.05, 0.40), (0.27, 0.32, 0.075), 0.045, "leather", "xXyYZ",
            crown=0.03, mids=3, **kw)
    with sc.at((0, 0.33, 0.60), R=rot_x(-12)):
        sc.rbox((0, 0, 0), (0.36, 0.075, 0.34), 0.06, "leather", "xXyYZ",
                mids=2, **kw)
    for s in (-1, 1):
        sc.rbox((s * 0.335, -0.02, 0.42), (0.065, 0.36, 0.18), 0.045, "leather",
                "xXyYZ", **kw)
        for y in (-0.31, 0.31):
            sc.tube([(s * 0.32, y * 1.05, 0), (s * 0.29, y, 0.2)],
                    (0.014, 0.024), "wood")
    with sc.at((0.02, 0.14, 0.62), R=rot_z(6) @ rot_x(-18)):
        sc.pillow(0.40, 0.36, 0.14, "pattern_fabric", kind="stripe", size=0.07,
                  colour="#ddd3bd", second="#2f5560")


def pouf(sc):
    prof = [(0.18, 0.0), (0.25, 0.05), (0.28, 0.15), (0.27, 0.26), (0.21, 0.33),
            (0.10, 0.36), (0.0, 0.365)]
    sc.lathe(prof, "basket", 20)


# ---------------------------------------------------------------- the tables
def book(sc, lo, hi, seed, colour, spine="y", faces="xXyZ", **kw):
    """Closed book; `spine` is the face that carries the title."""
    opposite = {"y": "Y", "x": "X", "X": "x", "Y": "y"}[spine]
    mats = dict.fromkeys("xXyYzZ", "pages")
    covers = "zZ" if hi[2] - lo[2] < hi[0] - lo[0] else "xX"
    for f in covers + spine:
        mats[f] = "spine"
    faces = "".join(f for f in faces if f != opposite) + opposite
    sc.box(lo, hi, "pages", faces, mats, seed=seed, colour=colour, **kw)


def coffee_table(sc, rng):
    kw = dict(colour="#9a6a3c", dark="#5c3819")
    sc.box((-0.58, -0.31, 0.407), (0.58, 0.31, 0.445), "wood", **kw)
    sc.box((-0.50, -0.24, 0.15), (0.50, 0.24, 0.168), "wood", **kw)
    for sx in (-1, 1):
        for sy in (-1, 1):
            sc.tube([(sx * 0.54, sy * 0.27, 0), (sx * 0.50, sy * 0.24, 0.41)],
                    (0.016, 0.024), "wood", 7, **kw)
    top = 0.445
    for k, (w, d, h, yaw) in enumerate(((0.27, 0.21, 0.035, 8),
                                        (0.24, 0.18, 0.028, -7),
                                        (0.21, 0.15, 0.024, 17))):
        z = top + (0, 0.035, 0.063)[k]
        with sc.at((-0.33, 0.07, z), yaw):
            book(sc, (-w / 2, -d / 2, 0), (w / 2, d / 2, h), 40 + k,
                 ("#2c4a63", "#d8cdb4", "#a4502d")[k], faces="xXyYZ")
    bowl_of_fruit(sc, (0.06, 0.05, top))
    vase_with_twigs(sc, (0.40, 0.14, top), rng)
    mug(sc, (0.24, -0.17, top), "#c24f3a")
    with sc.at((-0.10, -0.17, top + 0.004), -14):  # open magazine
        for s in (-1, 1):
            x = np.array([0, 0.05, 0.11, 0.17]) * s
            z = np.array([0.0, 0.012, 0.010, 0.0])
            if s < 0:
                x, z = x[::-1], z[::-1]
            rows = [np.stack([x, 0 * x + y, z], -1) for y in (-0.12, 0.12)]
            sc.add(np.array(rows), "print_page", seed=3 + s, density=1.4)
    with sc.at((-0.42, -0.19, top), 35):
        sc.box((-0.022, -0.085, 0), (0.022, 0.085, 0.02), "metal", "xXyYZ",
               colour="#2a2a2c")
    for k, x in enumerate((-0.25, 0.12)):
        book(sc, (x, -0.15, 0.169), (x + 0.29, 0.10, 0.19 + 0.02 * k), 60 + k,
             ("#8a9a8c", "#cf7f3a")[k], faces="xXyYZ")


def bowl_of_fruit(sc, pos):
    with sc.at(pos):
        outer = [(0.05, 0), (0.055, 0.012), (0.10, 0.04), (0.135, 0.085)]
        sc.lathe(outer, "ceramic", 20, bands=2, colour="#d5cdbb")
        sc.lathe([(0.128, 0.085), (0.095, 0.048), (0.0, 0.02)], "ceramic", 20,
                 bands=0, colour="#d5cdbb")
        fruits = ((0.05, 0.03, 0.075, "#d9822b", "#c2661c"),
                  (-0.05, 0.035, 0.075, "#b7372a", "#d2a23b"),
                  (0.0, -0.055, 0.075, "#d9822b", "#c2661c"),
                  (0.005, 0.005, 0.125, "#8ba23c", "#b0b552"))
        for x, y, z, a, b in fruits:
            with sc.at((x, y, z)):
                sc.sphere(0.037, "fruit", 10, 0.93, colour=a, second=b)


def vase_with_twigs(sc, pos, rng, colour="#3e6570", second="#d9cba9", scale=1.0):
    with sc.at(pos):
        prof = [(0.035, 0), (0.06, 0.03), (0.072, 0.09), (0.055, 0.16),
                (0.03, 0.20), (0.028, 0.225), (0.036, 0.24)]
        sc.lathe([(r * scale, z * scale) for r, z in prof], "ceramic", 16,
                 colour=colour, second=second, bands=4)
        z0 = 0.20 * scale
        for k in range(5):
            a = 2 * np.pi * (k + 0.3) / 5
            lean = rng.uniform(0.06, 0.13)
            tip = np.array([lean * np.cos(a), lean * np.sin(a), z0 + rng.uniform(0.2, 0.3)])
            mid = np.array([0.25 * tip[0], 0.25 * tip[1], z0 + 0.12])
            sc.tube([(0, 0, z0), mid, tip], 0.0035, "wood", 3, density=0.5)
            for j in range(3):
                p = mid + (tip - mid) * (0.35 + 0.3 * j)
                twig_leaf(sc, p, a + (j - 1) * 1.9, 0.075, seed=k)


def twig_leaf(sc, p, azimuth, size, seed):
    t = np.linspace(0, 1, 4)
    half = 0.22 * size * np.sin(np.pi * np.clip(t, 0.08, 0.97)) ** 0.8
    out = np.array([np.cos(azimuth), np.sin(azimuth), 0])
    side = np.array([-out[1], out[0], 0])
    c = p + size * (t[:, None] * out + (0.5 * t - 0.5 * t ** 2)[:, None] * [0, 0, 1])
    rows = [[q + h * side * -1, q + h * side] for q, h in zip(c, half)]
    sc.add(np.array(rows)[:, ::-1], "leaf", seed=seed)


def mug(sc, pos, colour):
    with sc.at(pos):
        sc.lathe([(0.036, 0), (0.04, 0.02), (0.04, 0.09)], "ceramic", 12, bands=2,
                 colour=colour, second="#e8dcc0")
        sc.lathe([(0.036, 0.09), (0.034, 0.02)], "ceramic", 12, bands=0, colour=colour)
        sc.disc(0.035, 0.07, "soil", 12)
        a = np.radians(np.linspace(-80, 80, 6))
        sc.tube([(0.038 + 0.028 * np.cos(k), 0, 0.048 + 0.028 * np.sin(k)) for k in a],
                0.006, "ceramic", 6, bands=0, colour=colour)


# ------------------------------------------------------------------ bookcase
def bookcase(sc, rng):
    """1.7 m x 2.1 m, two columns of five bays, facing -y."""
    w, h, d, t = 1.70, 2.12, 0.30, 0.025
    kw = dict(colour="#6b4226", dark="#3c2312")
    y0, y1 = -d / 2, d / 2
    sc.box((-w / 2, y0, 0), (-w / 2 + t, y1, h), "wood", "xXyZ", **kw)
    sc.box((w / 2 - t, y0, 0), (w / 2, y1, h), "wood", "xXyZ", **kw)
    sc.box((-t / 2, y0 + 0.01, 0.08), (t / 2, y1, h - t), "wood", "xXy", **kw)
    sc.quad((-w / 2, y1 - 0.01, 0), (w, 0, 0), (0, 0, h), "wood", density=0.5, **kw)
    sc.box((-w / 2, y0 + 0.02, 0), (w / 2, y0 + 0.03, 0.08), "wood", "y", **kw)
    levels = np.array([0.08, 0.50, 0.90, 1.29, 1.66, h - t])
    for z in levels:
        for a in (-w / 2 + t, t / 2):
            sc.box((a, y0 + 0.005, z), (a + w / 2 - 1.5 * t, y1, z + t), "wood",
                   "yzZ", density=0.8, **kw)
    bay = 0
    for col in (-w / 2 + t + 0.004, t / 2 + 0.004):
        for k in range(5):
            bay += 1
            fill_bay(sc, rng, col, col + w / 2 - 1.5 * t - 0.008, levels[k] + t,
                     levels[k + 1], y0 + 0.03, bay)
    for x, s in ((-0.55, 0.8), (0.45, 1.0)):
        vase_like = [(0.06 * s, h), (0.10 * s, h + 0.07), (0.08 * s, h + 0.16), (0.04 * s, h + 0.2)]
        with sc.at((x, 0, 0)):
            sc.lathe(vase_like, "ceramic", 14, colour="#b9ab90", second="#7b3b2c")


def fill_bay(sc, rng, x0, x1, z0, z1, y, bay):
    """Row of books, with a gap for an ornament in some bays."""
    x, gap_at = x0, None
    if bay in (2, 5, 8, 9):
        gap_at = x0 + (x1 - x0) * rng.uniform(0.25, 0.6)
    run = BOOK_COLOURS[rng.integers(len(BOOK_COLOURS))]
    while True:
        if gap_at is not None and x > gap_at:
            ornament(sc, (x + 0.10, y + 0.11, z0), bay)
            x, gap_at = x + 0.21, None
        th = rng.uniform(0.020, 0.052)
        if x + th > x1:
            break
        if rng.random() < 0.72:
            run = BOOK_COLOURS[rng.integers(len(BOOK_COLOURS))]
        hgt = min(rng.uniform(0.62, 0.90) * (z1 - z0), z1 - z0 - 0.02)
        dep = rng.uniform(0.15, 0.21)
        y_front = y + rng.uniform(0.0, 0.03)
        sc.box((x, y_front, z0), (x + th - 0.0015, y_front + dep, z0 + hgt), "spine",
               "y", seed=int(rng.integers(1e6)), colour=run)
        sc.box((x, y_front, z0), (x + th - 0.0015, y_front + dep, z0 + hgt), "pages",
               "xXZ", {"x": "spine", "X": "spine"}, seed=1, colour=run, density=0.28)
        x += th


def ornament(sc, pos, bay):
    with sc.at(pos):
        if bay % 3 == 2:
            sc.lathe([(0.03, 0), (0.065, 0.05), (0.06, 0.12), (0.025, 0.17), (0.035, 0.20)],
                     "ceramic", 12, colour="#c8c2b4", second="#2f4d63", bands=5)
        else:
            sc.cylinder(0.045, 0, 0.02, "wood", 10)
            sc.tube([(0, 0, 0.02), (0, 0, 0.06)], 0.008, "metal", 6)
            with sc.at((0, 0, 0.13)):
                sc.sphere(0.075, "fruit", 10, colour="#4d7f96", second="#b79b5a")


# ---------------------------------------------------------- cabinets, lamps
def drawers(sc, w, h, d, rows, cols, colour, dark, z0):
    """Cabinet body facing -y with drawer fronts and knobs, back at y = d/2."""
    kw = dict(colour=colour, dark=dark)
    sc.box((-w / 2, -d / 2, z0), (w / 2, d / 2, h - 0.025), "wood", "xXyz", **kw)
    sc.box((-w / 2 - 0.015, -d / 2 - 0.02, h - 0.025), (w / 2 + 0.015, d / 2, h),
           "wood", "xXyzZ", **kw)
    dw, dh = w / cols, (h - 0.025 - z0) / rows
    for i in range(cols):
        for j in range(rows):
            a, b = -w / 2 + i * dw + 0.012, z0 + j * dh + 0.012
            sc.box((a, -d / 2 - 0.016, b), (a + dw - 0.024, -d / 2, b + dh - 0.024),
                   "wood", "xXyzZ", **kw)
            with sc.at((a + dw / 2 - 0.012, -d / 2 - 0.016, b + dh / 2), R=rot_x(90)):
                sc.lathe([(0.007, 0), (0.007, 0.015), (0.017, 0.022), (0, 0.032)],
                         "metal", 7, colour="#b08d4f")
    for sx in (-1, 1):
        for y in (-d / 2 + 0.05, d / 2 - 0.05):
            sc.tube([(sx * (w / 2 - 0.05), y, 0), (sx * (w / 2 - 0.07), y, z0)],
                    (0.013, 0.02), "wood", 6, **kw)


def sideboard(sc, rng):
    drawers(sc, 1.45, 0.74, 0.42, 2, 3, "#a06d3f", "#63401f", 0.16)
    vase_with_twigs(sc, (-0.52, 0.02, 0.74), rng, "#b9742f", "#3a2a20", 1.25)
    for k in range(6):
        x = 0.26 + 0.036 * k
        book(sc, (x, -0.05, 0.74), (x + 0.034, 0.12, 0.93 + 0.02 * (k * 7 % 4)), 80 + k,
             BOOK_COLOURS[(k * 5 + 1) % 16], faces="xXyYZ")
    with sc.at((0.05, -0.02, 0.74), 12):  # box with a photo frame next to it
        sc.box((-0.12, -0.08, 0), (0.10, 0.08, 0.09), "basket", "xXyYZ")
    with sc.at((-0.22, 0.06, 0.865), R=rot_z(-14) @ rot_x(-12)):
        frame(sc, 0.20, 0.25, "hills", "#b08d4f", 0.015, 0.014)
    mug(sc, (0.58, -0.08, 0.74), "#dcd6c8")


def chest(sc, rng):
    drawers(sc, 1.0, 0.86, 0.44, 3, 2, "#d2cbbb", "#a99f8b", 0.10)
    with sc.at((0.30, 0, 0.86)):  # table lamp
        sc.lathe([(0.08, 0), (0.09, 0.03), (0.06, 0.14), (0.02, 0.22), (0.012, 0.30)],
                 "ceramic", 14, colour="#2f4d63", second="#c8b98f", bands=3)
        sc.lathe([(0.15, 0.28), (0.11, 0.48)], "shade", 20)
        sc.lathe([(0.106, 0.48), (0.146, 0.28)], "shade", 20, density=0.6)
    for k in range(4):
        book(sc, (-0.40, -0.12, 0.86 + 0.033 * k), (-0.15 - 0.02 * k, 0.06, 0.89 + 0.033 * k),
             95 + k, BOOK_COLOURS[(3 * k + 2) % 16], faces="xXyYZ")


def floor_lamp(sc):
    sc.lathe([(0.15, 0), (0.15, 0.015), (0.03, 0.03), (0.012, 0.05)], "metal", 18,
             colour="#b08d4f")
    sc.tube([(0, 0, 0.04), (0, 0, 1.52)], 0.011, "metal", 7, colour="#b08d4f")
    sc.lathe([(0.24, 1.38), (0.17, 1.70)], "shade", 28)
    sc.lathe([(0.164, 1.70), (0.234, 1.38)], "shade", 28, density=0.6)
    with sc.at((0, 0, 1.55)):
        sc.sphere(0.035, "bulb", 8)


# -------------------------------------------------------------------- plant
def plant(sc, rng):
    """Large-leaved plant in a woven pot."""
    sc.lathe([(0.15, 0), (0.19, 0.10), (0.20, 0.25), (0.18, 0.34)], "basket", 18)
    sc.lathe([(0.17, 0.34), (0.175, 0.27)], "basket", 18, density=0.5)
    sc.disc(0.18, 0.30, "soil", 16)
    for k in range(17):
        az = k * 2.39996 + 0.3
        el = np.radians(rng.uniform(38, 84))
        stalk, blade = rng.uniform(0.35, 0.75), rng.uniform(0.34, 0.52)
        out = np.array([np.cos(az), np.sin(az), 0])
        if out[0] < -0.2 or out[1] > 0.3:
            stalk, el = stalk * 0.9, max(el, np.radians(72))
        dirn = out * np.cos(el) + np.array([0, 0, np.sin(el)])
        foot = np.array([0, 0, 0.30]) + 0.06 * out
        tip = foot + stalk * dirn
        sc.tube([foot, foot + 0.5 * stalk * (dirn + 0.1 * np.array([0, 0, 1])), tip],
                (0.010, 0.008, 0.006), "leaf", 4, density=0.4)
        big_leaf(sc, tip, out, el, blade, k)


def big_leaf(sc, p, out, el, size, seed):
    t = np.linspace(0, 1, 8)
    ang = el - 0.3 - 1.7 * t
    step = np.stack([np.cos(ang), np.sin(ang)], -1) * size / 7
    rad = np.concatenate([[[0, 0]], np.cumsum(step[:-1], 0)])
    c = p + rad[:, :1] * out + rad[:, 1:] * np.array([0, 0, 1.0])
    half = 0.27 * size * np.sin(np.pi * np.clip(t, 0.06, 0.985) ** 0.75) ** 0.9
    side = np.array([-out[1], out[0], 0])
    rows = []
    for q, hw in zip(c, half):
        fold = np.array([0, 0, 0.35 * hw])
        rows.append([q + side * hw + fold, q, q - side * hw + fold])
    sc.add(np.array(rows), "leaf", seed=seed, density=1.1)
