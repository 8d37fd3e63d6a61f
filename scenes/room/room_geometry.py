"""Geometry kernel of the living-room scene: everything is a grid patch.

A patch is a (rows x columns) grid of 3-D points that is mapped to one axis
aligned rectangle of a texture atlas.  Boxes, rounded boxes, pillows, lathes
and tubes are all made of such patches, so UV unwrapping is a matter of packing
rectangles, and textures can be computed per patch with plain NumPy.

Part of the scene generator; run make_room.py, not this file.
"""
import math

import numpy as np

ATLAS_SIZE = 2048
PAD = 2  # replicated texels around every rectangle (gap between two: 2 * PAD)


class Patch:
    """Grid of points P[j, i] (j along t, i along s), outward normal ds x dt."""

    def __init__(self, P, L, mat, atlas, density, prm):
        self.P, self.L = P, L          # world and local coordinates
        self.mat, self.atlas, self.density, self.prm = mat, atlas, density, prm
        self.rect = None               # x, y, w, h in texels, y upwards
        self.turned = False            # True: s runs along the image's y axis
        self.s_knots, self.width = self._arc(P, 1)
        self.t_knots, self.height = self._arc(P, 0)

    @staticmethod
    def _arc(P, axis):
        """Normalised knots and length of the grid along one axis."""
        seg = np.linalg.norm(np.diff(P, axis=axis), axis=2)
        total = seg.sum(axis=axis)
        mean = seg.mean(axis=1 - axis) + 1e-9
        knots = np.concatenate([[0.0], np.cumsum(mean)])
        return knots / knots[-1], 0.5 * float(total.mean() + total.max())

    def sample(self, ss, tt, grid=None):
        """Bilinear interpolation of the grid at normalised s (cols), t (rows)."""
        G = self.P if grid is None else grid
        i, fi = _locate(self.s_knots, ss)
        j, fj = _locate(self.t_knots, tt)
        fi, fj = fi[None, :, None], fj[:, None, None]
        a = G[j][:, i] * (1 - fi) + G[j][:, i + 1] * fi
        b = G[j + 1][:, i] * (1 - fi) + G[j + 1][:, i + 1] * fi
        return a * (1 - fj) + b * fj

    def uv(self):
        """Texture coordinates (rows, cols, 2) of the grid points."""
        x, y, w, h = self.rect
        s, t = np.meshgrid(self.s_knots, self.t_knots)
        if self.turned:
            s, t = t, s
        return np.stack([x + s * w, y + t * h], -1) / ATLAS_SIZE


def _locate(knots, x):
    i = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, len(knots) - 2)
    f = (x - knots[i]) / np.maximum(knots[i + 1] - knots[i], 1e-12)
    return i, np.clip(f, 0.0, 1.0)


def rot_z(deg):
    c, s = math.cos(math.radians(deg)), math.sin(math.radians(deg))
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])


def rot_x(deg):
    c, s = math.cos(math.radians(deg)), math.sin(math.radians(deg))
    return np.array([[1.0, 0, 0], [0, c, -s], [0, s, c]])


def rot_y(deg):
    c, s = math.cos(math.radians(deg)), math.sin(math.radians(deg))
    return np.array([[c, 0, s], [0, 1.0, 0], [-s, 0, c]])


class Placed:
    """Context manager that moves everything added inside it."""

    def __init__(self, scene, pos, R):
        self.scene, self.pos, self.R = scene, np.asarray(pos, float), R

    def __enter__(self):
        sc = self.scene
        self.saved = sc.R, sc.pos
        sc.pos = sc.pos + sc.R @ self.pos
        sc.R = sc.R @ self.R
        return sc

    def __exit__(self, *exc):
        self.scene.R, self.scene.pos = self.saved


# face name -> (s axis, s sign, t axis, normal axis, normal sign)
FACES = {"X": (1, 1, 2, 0, 1), "x": (1, -1, 2, 0, -1), "y": (0, 1, 2, 1, -1),
         "Y": (0, -1, 2, 1, 1), "Z": (0, 1, 1, 2, 1), "z": (0, -1, 1, 2, -1)}


class Scene:
    """List of patches plus the primitives that create them."""

    def __init__(self):
        self.patches = []
        self.R, self.pos = np.eye(3), np.zeros(3)

    def at(self, pos, yaw=0.0, R=None):
        return Placed(self, pos, rot_z(yaw) if R is None else R)

    def add(self, grid, mat, atlas="furniture", density=1.0, **prm):
        L = np.asarray(grid, float)
        self.patches.append(
            Patch(L @ self.R.T + self.pos, L, mat, atlas, density, prm))

    def quad(self, origin, es, et, mat, **kw):
        o, es, et = (np.asarray(a, float) for a in (origin, es, et))
        self.add([[o, o + es], [o + et, o + es + et]], mat, **kw)

    def box(self, lo, hi, mat, faces="xXyYzZ", mats=None, **kw):
        """Axis-aligned box; `mats` overrides the material of single faces."""
        lo, hi = np.asarray(lo, float), np.asarray(hi, float)
        for f in faces:
            sa, ss, ta, na, ns = FACES[f]
            o = lo.copy()
            o[na] = hi[na] if ns > 0 else lo[na]
            o[sa] = lo[sa] if ss > 0 else hi[sa]
            es, et = np.zeros(3), np.zeros(3)
            es[sa], et[ta] = ss * (hi - lo)[sa], (hi - lo)[ta]
            m = (mats or {}).get(f, mat)
            self.quad(o, es, et, m, **kw)

    def rbox(self, centre, half, r, mat, faces="xXyYzZ", crown=0.0, mids=0,
             **kw):
        """Box with rounded edges; `crown` bulges the top face (cushions)."""
        half = np.asarray(half, float)
        inner = half - r

        def knots(k):
            a = inner[k] + r * np.tan(np.radians([0.0, 22.5, 45.0]))
            mid = np.linspace(-inner[k], inner[k], mids + 2)[1:-1]
            return np.concatenate([-a[::-1], mid, a])

        for f in faces:
            sa, ss, ta, na, ns = FACES[f]
            s, t = np.meshgrid(ss * knots(sa), knots(ta))
            q = np.zeros(s.shape + (3,))
            q[..., sa], q[..., ta], q[..., na] = s, t, ns * half[na]
            base = np.clip(q, -inner, inner)
            d = q - base
            p = base + r * d / np.linalg.norm(d, axis=2, keepdims=True)
            if crown:
                e = np.clip(1 - (p / half) ** 2, 0, 1)
                p[..., 2] += crown * e[..., 0] * e[..., 1] * (p[..., 2] > 0)
            self.add(p + np.asarray(centre, float), mat, **kw)

    def pillow(self, w, h, thick, mat, n=8, **kw):
        """Throw pillow standing in the local x-z plane, centred at 0."""
        u = np.sin(np.linspace(-1, 1, n + 1) * np.pi / 2)
        x, z = np.meshgrid(u, u)
        bulge = thick / 2 * ((1 - x ** 2) * (1 - z ** 2)) ** 0.45
        pinch_x = 1 - 0.10 * (1 - z ** 2) * x ** 2
        pinch_z = 1 - 0.10 * (1 - x ** 2) * z ** 2
        for side in (-1, 1):
            P = np.stack([-side * x * w / 2 * pinch_x, side * bulge,
                          z * h / 2 * pinch_z], -1)
            self.add(P, mat, **kw)

    def lathe(self, profile, mat, n=16, arc=(0.0, 360.0), **kw):
        """Surface of revolution about local z; profile [(r, z)] seen from
        outside runs upwards (downwards gives an inner surface)."""
        prof = np.asarray(profile, float)
        a = np.radians(np.linspace(arc[0], arc[1], n + 1))
        x = prof[:, :1] * np.cos(a)
        y = prof[:, :1] * np.sin(a)
        z = np.repeat(prof[:, 1:], n + 1, axis=1)
        self.add(np.stack([x, y, z], -1), mat, **kw)

    def cylinder(self, r, z0, z1, mat, n=12, top=True, **kw):
        self.lathe([(r, z0), (r, z1)], mat, n, **kw)
        if top:
            self.disc(r, z1, mat, n, **kw)

    def disc(self, r, z, mat, n=12, up=True, **kw):
        """Filled circle built from a square grid, so its texture is planar."""
        k = max(4, n // 4)
        u = np.linspace(-1, 1, k + 1)
        x, y = np.meshgrid(u, u)
        m = np.maximum(np.abs(x), np.abs(y))
        a = np.hypot(x, y)
        f = np.where(a > 0, m / np.maximum(a, 1e-9), 0)
        s = 1 if up else -1
        self.add(np.stack([s * x * f * r, y * f * r, np.full_like(x, z)], -1),
                 mat, **kw)

    def sphere(self, r, mat, n=10, squash=1.0, **kw):
        a = np.radians(np.linspace(-90, 90, n // 2 + 1))
        self.lathe(np.stack([r * np.cos(a), r * squash * np.sin(a)], -1), mat,
                   n, **kw)

    def tube(self, points, radius, mat, n=6, **kw):
        """Round tube along a polyline; `radius` a number or one per point."""
        pts = np.asarray(points, float)
        rad = np.broadcast_to(radius, len(pts))
        tan = np.gradient(pts, axis=0)
        tan /= np.linalg.norm(tan, axis=1, keepdims=True)
        ref = np.array([1.0, 0, 0]) if abs(tan[0, 0]) < 0.8 else \
            np.array([0, 1.0, 0])
        a = np.radians(np.linspace(0, 360, n + 1))
        rows = []
        for p, t, r in zip(pts, tan, rad):
            e1 = ref - t * (ref @ t)
            e1 /= np.linalg.norm(e1)
            e2 = np.cross(t, e1)
            rows.append(p + r * (np.cos(a)[:, None] * e1
                                 + np.sin(a)[:, None] * e2))
        self.add(np.array(rows), mat, **kw)


# ------------------------------------------------------------------ packing
def _try_pack(items, density):
    """Shelf packing at a given texel density; None if it does not fit."""
    sized = []
    for p in items:
        w, h = (max(4, 2 * math.ceil(a * density * p.density / 2))
                for a in (p.width, p.height))
        turned = h > w
        sized.append((h, w, turned, p) if not turned else (w, h, turned, p))
    sized.sort(key=lambda e: (-e[0], -e[1]))
    shelves, top, out = [], 0, []
    for h, w, turned, p in sized:
        for sh in shelves:  # first shelf with room
            if sh[2] + w + 2 * PAD <= ATLAS_SIZE:
                break
        else:
            sh = [top, h, 0]
            top += h + 2 * PAD
            if top > ATLAS_SIZE or w + 2 * PAD > ATLAS_SIZE:
                return None
            shelves.append(sh)
        out.append((p, (sh[2] + PAD, sh[0] + PAD, w, h), turned))
        sh[2] += w + 2 * PAD
    return out


def pack_atlas(patches):
    """Assign a rectangle to every patch; returns the texel density (1/m)."""
    lo, hi = 10.0, 2000.0
    best = None
    for _ in range(24):
        mid = 0.5 * (lo + hi)
        got = _try_pack(patches, mid)
        if got:
            best, lo = got, mid
        else:
            hi = mid
    for p, rect, turned in best:
        p.rect, p.turned = rect, turned
    return lo


# ------------------------------------------------------------------- meshes
def weld(patches, digits=4):
    """Shared vertices, per-corner UVs: (verts, uvs, tris_v, tris_uv)."""
    vid, verts, uvs, tv, tt = {}, [], [], [], []
    for p in patches:
        uv = p.uv()
        m, n = p.P.shape[:2]
        ids = np.empty((m, n), int)
        for j in range(m):
            for i in range(n):
                key = tuple(np.round(p.P[j, i], digits) + 0.0)
                if key not in vid:
                    vid[key] = len(verts)
                    verts.append(key)
                ids[j, i] = vid[key]
        base = len(uvs)
        uvs.extend(uv.reshape(-1, 2))
        for j in range(m - 1):
            for i in range(n - 1):
                q = [(j, i), (j, i + 1), (j + 1, i + 1), (j + 1, i)]
                for tri in ((0, 1, 2), (0, 2, 3)):
                    v = [ids[q[k]] for k in tri]
                    if len(set(v)) == 3:
                        tv.append(v)
                        tt.append([base + q[k][0] * n + q[k][1] for k in tri])
    return np.array(verts), np.array(uvs), np.array(tv), np.array(tt)
