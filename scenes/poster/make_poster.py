"""Draw poster.jpg, a poster to point a camera at: dead leaves, shapes, gratings.

Run (NumPy and OpenCV; a few seconds):

    python3 make_poster.py [output file]        (default: poster.jpg beside this script)

The collage follows the dead-leaves model: opaque leaves with a 1/r^3 law of
sizes, dropped at random places, which has the statistics of natural images at
all scales.  Around it: flat shapes with crisp edges, a contrast-sensitivity
chart, a checkerboard whose cells shrink, gratings, a zone plate and a Siemens
star.  Everything is drawn at SS times the final size and averaged in linear
light; sinusoids are sinusoids of radiance.  Seeded, hence reproducible.
"""
import os
import sys

import cv2
import numpy as np

WIDTH, HEIGHT, SS = 1600, 1200, 3
JPEG_QUALITY = 90
SEED = 11
# panels: x, y, width, height in pixels of the poster
TITLE = (40, 40, 900, 170)
CONTRAST = (956, 40, 604, 170)
COLLAGE = (40, 226, 1520, 714)
SWEEP = (40, 956, 860, 204)
GRATINGS, ZONES, SIEMENS = ((x, 956, 204, 204) for x in (916, 1136, 1356))

PAPER, INK = "#ece6d8", "#23262b"
LEAVES = ("#6f7b6a", "#8c8a72", "#a59a84", "#b9ab92", "#7d6a5a", "#5b5148", "#8d6f62",
          "#9a857c", "#5f6d78", "#798a92", "#98a3a2", "#454c52", "#c3b9a8", "#6a5f6b")


def bgr(hex_colour):
    h = hex_colour.lstrip("#")
    return tuple(int(h[i:i + 2], 16) for i in (4, 2, 0))


def decode_srgb(x):
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


def encode_srgb(x):
    x = np.clip(x, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def crop(canvas, panel):
    x, y, w, h = (SS * n for n in panel)
    return canvas[y:y + h, x:x + w]


def grid(panel):
    """Coordinates of the panel's samples, in pixels from its upper left corner."""
    _, _, w, h = panel
    return np.meshgrid((np.arange(w * SS) + 0.5) / SS, (np.arange(h * SS) + 0.5) / SS)


def put_radiance(canvas, panel, radiance):
    crop(canvas, panel)[:] = np.rint(255 * encode_srgb(radiance))[..., None]


def fill(target, points, colour):
    """Filled polygon; points in poster pixels relative to the target's corner."""
    fixed = np.rint(np.asarray(points) * SS * 16).astype(np.int32)
    cv2.fillPoly(target, [fixed], colour, cv2.LINE_8, 4)


# ------------------------------------------------------------------- collage
def leaf_outline(kind, r, angle):
    """Disc, ellipse, pointed leaf or rounded square of 'radius' r."""
    n = 24 if r < 20 else 120
    t = 2 * np.pi * np.arange(n) / n
    c, s = np.cos(t), np.sin(t)
    if kind == 0:
        p = np.stack([c, s], 1)
    elif kind == 1:
        p = np.stack([1.2 * c, 0.75 * s], 1)
    elif kind == 2:
        p = np.stack([1.5 * c, 0.62 * s * np.abs(s) ** 0.9], 1)
    else:
        p = 0.95 * np.stack([np.sign(c) * np.abs(c) ** 0.45,
                             np.sign(s) * np.abs(s) ** 0.45], 1)
    ca, sa = np.cos(angle), np.sin(angle)
    return r * p @ np.array([[ca, sa], [-sa, ca]])


def draw_leaves(canvas, rng, count=42000, r_min=4.0, r_max=170.0):
    target = crop(canvas, COLLAGE)
    _, _, w, h = COLLAGE
    target[:] = bgr(LEAVES[0])
    u = rng.random(count)
    radius = r_min / np.sqrt(1 - u * (1 - (r_min / r_max) ** 2))   # density 1/r^3
    kind = rng.choice(4, count, p=(0.35, 0.25, 0.25, 0.15))
    angle = rng.uniform(0, np.pi, count)
    centre = rng.uniform((-r_max, -r_max), (w + r_max, h + r_max), (count, 2))
    colour = np.array([bgr(c) for c in LEAVES])[rng.integers(len(LEAVES), size=count)]
    colour = colour * rng.uniform(0.72, 1.18, (count, 1))
    for k in range(count):
        fill(target, leaf_outline(kind[k], radius[k], angle[k]) + centre[k],
             tuple(np.clip(colour[k], 0, 255).tolist()))


def regular(n, r, inner=None, turn=-90.0):
    """Regular n-gon, or with an inner radius an n-pointed star."""
    m = n if inner is None else 2 * n
    t = np.radians(turn) + 2 * np.pi * np.arange(m) / m
    rho = np.full(m, float(r))
    if inner is not None:
        rho[1::2] = inner
    return np.stack([rho * np.cos(t), rho * np.sin(t)], 1)


def draw_shapes(canvas):
    target = crop(canvas, COLLAGE)
    arrow = np.array([(-150, -38), (30, -38), (30, -100), (150, 0), (30, 100),
                      (30, 38), (-150, 38)]) @ np.array([[0.94, -0.34], [0.34, 0.94]])
    shapes = ((regular(5, 152, 62), (215, 205), "#d3a02c"),
              (regular(6, 130, turn=8), (555, 470), "#2b4f7c"),
              (arrow, (845, 205), "#b23a2e"),
              (regular(4, 165, turn=-30), (1305, 480), INK),
              (regular(240, 108), (1230, 150), PAPER),
              (regular(240, 100), (235, 560), "#2f6b4f"),
              (regular(3, 120, turn=-78), (925, 545), "#e8e2d2"))
    for outline, centre, colour in shapes:
        fill(target, outline + np.array(centre), bgr(colour))
    for outline, centre, colour in ((regular(240, 56), (1230, 150), "#b23a2e"),
                                    (regular(240, 48), (235, 560), PAPER),
                                    (regular(4, 80, turn=-30), (1305, 480), "#d3a02c"),
                                    (regular(6, 62, turn=38), (555, 470), PAPER)):
        fill(target, outline + np.array(centre), bgr(colour))


# ------------------------------------------------------------------- title
def draw_title(canvas):
    """The word 'esim' from arcs and lines, and a line of small print."""
    target = crop(canvas, TITLE)
    target[:] = bgr(INK)
    pen, paint = 19 * SS, bgr(PAPER)

    def line(x0, y0, x1, y1):
        cv2.line(target, (x0 * SS, y0 * SS), (x1 * SS, y1 * SS), paint, pen)

    def arc(x, y, rx, ry, start, end, colour=paint, width=pen):
        cv2.ellipse(target, (x * SS, y * SS), (rx * SS, ry * SS), 0, start, end,
                    colour, width)

    arc(84, 92, 42, 42, 42, 360)                         # e
    line(42, 92, 126, 92)
    arc(198, 71, 32, 21, 90, 325)                        # s
    arc(198, 113, 32, 21, -90, 145)
    line(276, 52, 276, 134)                              # i
    arc(276, 24, 12, 12, 0, 360, bgr("#d3a02c"), -1)
    line(330, 52, 330, 134)                              # m
    arc(361, 84, 31, 34, 180, 360)
    arc(423, 84, 31, 34, 180, 360)
    line(392, 84, 392, 134)
    line(454, 84, 454, 134)
    for text, y, size in (("a target for event cameras", 82, 0.80),
                          ("leaves, edges and gratings at every scale", 122, 0.52)):
        cv2.putText(target, text, (510 * SS, y * SS), cv2.FONT_HERSHEY_DUPLEX,
                    size * SS, paint, round(1.2 * SS), cv2.LINE_AA)


# ---------------------------------------------------------------- test charts
def chirp_phase(x, length, period0, period1):
    """Phase in cycles of a sweep from period0 to period1, geometric in x."""
    rate = np.log(period0 / period1) / length
    return (np.exp(rate * x) - 1) / (period0 * rate)


def draw_contrast_chart(canvas):
    """Frequency rises to the right, contrast falls from bottom to top."""
    x, y = grid(CONTRAST)
    _, _, w, h = CONTRAST
    contrast = 10 ** (-2.2 * (1 - y / h))
    wave = np.sin(2 * np.pi * chirp_phase(x, w, 80, 4))
    put_radiance(canvas, CONTRAST, 0.42 * (1 + 0.95 * contrast * wave))


def draw_sweep(canvas):
    """Checkerboard: cells of 51 px at the left, 2.5 px at the right."""
    x, y = grid(SWEEP)
    _, _, w, h = SWEEP
    widest, finest = h / 4, 2.5
    column = np.floor(2 * chirp_phase(x, w, 2 * widest, 2 * finest))
    rate = np.log(widest / finest) / w
    octave = np.rint(np.log2(1 + widest * rate * (column + 0.5)))   # rows double
    dark = (column + np.floor(y * 2 ** octave / widest)) % 2
    put_radiance(canvas, SWEEP, np.where(dark > 0, 0.03, 0.80))


def draw_gratings(canvas):
    """Three periods (rows) by three orientations (columns), square waves."""
    x, y = grid(GRATINGS)
    _, _, w, h = GRATINGS
    row, column = np.floor(3 * y / h).astype(int), np.floor(3 * x / w).astype(int)
    period = np.array([16.0, 8.0, 4.0])[row]
    angle = np.radians([0.0, 45.0, 90.0])[column]
    dark = ((x % (w / 3)) * np.cos(angle) + (y % (h / 3)) * np.sin(angle)) / period % 1
    put_radiance(canvas, GRATINGS, np.where(dark < 0.5, 0.03, 0.80))


def draw_zone_plate(canvas):
    x, y = grid(ZONES)
    _, _, w, h = ZONES
    squared = (x - w / 2) ** 2 + (y - h / 2) ** 2
    finest = 4.0                                         # period at the panel's edge
    wave = np.cos(np.pi * squared / (finest * w / 2))
    put_radiance(canvas, ZONES, 0.42 * (1 + 0.9 * wave * (squared < (w / 2) ** 2)))


def draw_siemens_star(canvas, spokes=36):
    x, y = grid(SIEMENS)
    _, _, w, h = SIEMENS
    angle, r = np.arctan2(y - h / 2, x - w / 2), np.hypot(x - w / 2, y - h / 2)
    dark = (np.sin(spokes * angle) > 0) & (r < 0.49 * w) & (r > 0.02 * w)
    put_radiance(canvas, SIEMENS, np.where(dark, 0.03, 0.80))


def shrink(canvas):
    """Average SS x SS samples in linear light."""
    table = decode_srgb(np.arange(256) / 255.0).astype(np.float32)
    total = sum(table[canvas[j::SS, i::SS]] for j in range(SS) for i in range(SS))
    return np.rint(255 * encode_srgb(total / SS ** 2)).astype(np.uint8)


def main():
    here = os.path.dirname(os.path.abspath(__file__))
    out = sys.argv[1] if len(sys.argv) > 1 else os.path.join(here, "poster.jpg")
    cv2.setNumThreads(1)
    canvas = np.empty((HEIGHT * SS, WIDTH * SS, 3), np.uint8)
    canvas[:] = bgr(PAPER)
    draw_leaves(canvas, np.random.default_rng(SEED))
    draw_shapes(canvas)
    draw_title(canvas)
    for draw in (draw_contrast_chart, draw_sweep, draw_gratings, draw_zone_plate,
                 draw_siemens_star):
        draw(canvas)
    cv2.imwrite(out, shrink(canvas), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY,
                                      cv2.IMWRITE_JPEG_OPTIMIZE, 1])
    print(f"{out}: {os.path.getsize(out)} bytes")


if __name__ == "__main__":
    main()
