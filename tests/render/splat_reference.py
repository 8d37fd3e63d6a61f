"""A slow reference of the rendering of Gaussian splats by a pinhole camera, in double precision, for tests.

The equations are those of
  EWA      Zwicker et al., EWA splatting, 2002; Kerbl et al., 3D Gaussian splatting, 2023: the splats are projected to
           Gaussians in the image and composited in one order for all pixels.
  per ray  the response along the ray of each pixel, composited by the depth of its maximum.

    camera = Camera(fx, fy, cx, cy, width, height)           # pixel centres at integers
    image, depth = render_ewa(splats, camera, pose)          # pose: 4 x 4, T_world_camera, x right, y down, z forward
    image, depth = render_per_ray(splats, camera, pose)

Images are float64, height x width x 3, before any display curve. The depth, along z, is that of the splat at which the
transmittance passes 0.5, and infinite where it does not. Run as a program, it renders a PLY; see --help.
"""

import argparse
import dataclasses

import numpy as np

MAX_ALPHA = 0.99
MIN_ALPHA = 1 / 255
FLATTEST = 1e-6  # least deviation, relative to the largest of the splat, so that its covariance can be inverted
PAIRS = 3_000_000  # of a splat and a pixel, that are held in memory at once


@dataclasses.dataclass
class Camera:
    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int


@dataclasses.dataclass
class Splats:
    """Arrays with an entry per splat."""

    positions: np.ndarray  # n x 3
    deviations: np.ndarray  # n x 3, along their own axes
    rotations: np.ndarray  # n x 4, unit quaternions x y z w, from their own axes to the world's
    opacities: np.ndarray  # n
    harmonics: np.ndarray  # n x (degree + 1)^2 x 3

    def __post_init__(self):
        for field in dataclasses.fields(self):
            setattr(self, field.name, np.asarray(getattr(self, field.name), np.float64))


def rotation_matrices(q):
    """n x 3 x 3, of quaternions x y z w."""
    x, y, z, w = (q / np.linalg.norm(q, axis=-1, keepdims=True)).T
    return np.stack([
        1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
        2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
        2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=-1).reshape(-1, 3, 3)


def basis(degree, d):
    """Real spherical harmonics of unit vectors: n x (degree + 1)^2."""
    x, y, z = d.T
    one = np.ones_like(x)
    values = [0.28209479177387814 * one]
    if degree > 0:
        c = 0.4886025119029199
        values += [-c * y, c * z, -c * x]
    if degree > 1:
        c = 1.0925484305920792
        values += [c * x * y, -c * y * z, 0.31539156525252005 * (2 * z * z - x * x - y * y), -c * x * z,
                   0.5462742152960396 * (x * x - y * y)]
    if degree > 2:
        a, b, c = 0.5900435899266435, 2.890611442640554, 0.4570457994644658
        values += [-a * y * (3 * x * x - y * y), b * x * y * z, -c * y * (4 * z * z - x * x - y * y),
                   0.3731763325901154 * z * (2 * z * z - 3 * x * x - 3 * y * y), -c * x * (4 * z * z - x * x - y * y),
                   b / 2 * z * (x * x - y * y), -a * x * (x * x - 3 * y * y)]
    return np.stack(values, axis=-1)


def colours(splats, eye):
    """n x 3: max(0, 0.5 + sum of the harmonics in the direction from the camera to the splat)."""
    d = splats.positions - eye
    d /= np.maximum(np.linalg.norm(d, axis=1, keepdims=True), 1e-300)
    degree = round(splats.harmonics.shape[1] ** 0.5) - 1
    return np.maximum(0, 0.5 + np.einsum("nk,nkc->nc", basis(degree, d), splats.harmonics))


def in_camera(splats, pose):
    """Centres in the camera's frame, and the matrices R S, whose columns are the deviations along the splats' axes."""
    turn = pose[:3, :3].T
    deviations = np.maximum(splats.deviations, FLATTEST * splats.deviations.max(axis=1, keepdims=True))
    return (splats.positions - pose[:3, 3]) @ turn.T, turn @ rotation_matrices(splats.rotations) * deviations[:, None, :]


def bounds_to_pixels(low, high, size):
    """First and last pixel between two image coordinates; last < first if it has no pixel."""
    return (np.ceil(np.clip(low, -1, size)).astype(int).clip(0), np.floor(np.clip(high, -1, size)).astype(int).clip(None, size - 1))


def pairs(bounds, camera):
    """Yields the pairs of splats and pixels whose bounds overlap, rows after rows: splat, x, y. bounds: x0 x1 y0 y1."""
    x0, x1, y0, y1 = bounds
    seen = np.flatnonzero((x1 >= x0) & (y1 >= y0))
    width = (x1 - x0 + 1)[seen]
    per_row = np.zeros(camera.height + 1)
    np.add.at(per_row, y0[seen], width)
    np.add.at(per_row, y1[seen] + 1, -width)
    per_row = np.cumsum(per_row)
    first = 0
    while first < camera.height:
        last = first + 1
        while last < camera.height and per_row[first:last + 1].sum() <= PAIRS:
            last += 1
        inside = seen[(y0[seen] < last) & (y1[seen] >= first)]
        top, bottom = np.maximum(y0[inside], first), np.minimum(y1[inside], last - 1)
        columns = (x1 - x0 + 1)[inside]
        count = columns * (bottom - top + 1)
        local = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        which = np.repeat(np.arange(len(inside)), count)
        yield inside[which], x0[inside][which] + local % columns[which], top[which] + local // columns[which]
        first = last


def composite(image, depth, splat, x, y, alpha, order, z, colour):
    """Composites pairs in their order in each pixel, and writes the pixels that they have."""
    pixel = y * image.shape[1] + x
    sequence = np.lexsort((splat, order, pixel))
    splat, pixel, alpha, z = splat[sequence], pixel[sequence], alpha[sequence], z[sequence]
    start = np.flatnonzero(np.diff(pixel, prepend=-1))
    length = np.diff(start, append=len(pixel))
    log_t = np.cumsum(np.log1p(-alpha))
    before = np.concatenate([[0], log_t[:-1]])
    base = np.repeat(before[start], length)
    t_before, t_after = np.exp(before - base), np.exp(log_t - base)
    for channel in range(3):
        sums = np.bincount(pixel, alpha * t_before * colour[splat, channel], image.shape[0] * image.shape[1])
        image[..., channel] += sums.reshape(image.shape[:2])
    passing = (t_before > 0.5) & (t_after <= 0.5)
    depth.flat[pixel[passing]] = z[passing]
    opaque = np.ones(depth.size)
    opaque[pixel[start]] = np.exp((log_t - base)[start + length - 1])
    return opaque.reshape(depth.shape)


def start_images(camera):
    shape = (camera.height, camera.width)
    return np.zeros((*shape, 3)), np.full(shape, np.inf), np.ones(shape)


def projected(centres, axes, camera, jacobian_limit):
    """Centres in the image, and their 2D covariances J W S W^T J^T as n x 2 x 2.

    jacobian_limit: the derivative is taken at most at this multiple of the field of view, as by the original; None: at
    the centre itself.
    """
    x, y, z = centres.T
    u, v = x / z, y / z
    if jacobian_limit is not None:
        limit_x, limit_y = (jacobian_limit * np.array([camera.width / 2 / camera.fx, camera.height / 2 / camera.fy]))
        u_j, v_j = np.clip(u, -limit_x, limit_x), np.clip(v, -limit_y, limit_y)
    else:
        u_j, v_j = u, v
    zero = np.zeros_like(z)
    jacobian = np.stack([np.stack([camera.fx / z, zero, -camera.fx * u_j / z], -1),
                         np.stack([zero, camera.fy / z, -camera.fy * v_j / z], -1)], 1)
    half = jacobian @ axes
    return np.stack([camera.fx * u + camera.cx, camera.fy * v + camera.cy], -1), half @ half.transpose(0, 2, 1)


def render_ewa(splats, camera, pose, variance=0.3, antialiased=False, order="z", cut=MIN_ALPHA, background=0.0, near=0.01,
               jacobian_limit=1.3):
    """Image and median depth with one order for all pixels.

    variance: by which the splats are widened, px^2. antialiased: the opacity is then multiplied by sqrt(det / det').
    order: 'z' or 'distance' of the centres. cut: smaller alphas are left out; 0 keeps all (down to 1e-9).
    """
    pose = np.asarray(pose, np.float64)
    centres, axes = in_camera(splats, pose)
    colour = colours(splats, pose[:3, 3])
    kept = np.flatnonzero(centres[:, 2] > near)
    centres, axes, colour, opacity = centres[kept], axes[kept], colour[kept], splats.opacities[kept].copy()
    mean, covariance = projected(centres, axes, camera, jacobian_limit)
    before = np.linalg.det(covariance)
    covariance = covariance + variance * np.eye(2)
    if antialiased:
        opacity *= np.sqrt(np.maximum(before, 0) / np.linalg.det(covariance))
    inverse = np.linalg.inv(covariance)
    reach = np.sqrt(2 * np.log(np.maximum(opacity / max(cut, 1e-9), 1)))
    extent = reach[:, None] * np.sqrt(np.stack([covariance[:, 0, 0], covariance[:, 1, 1]], -1))
    extent[opacity < max(cut, 1e-9)] = -1
    bounds = (*bounds_to_pixels(mean[:, 0] - extent[:, 0], mean[:, 0] + extent[:, 0], camera.width),
              *bounds_to_pixels(mean[:, 1] - extent[:, 1], mean[:, 1] + extent[:, 1], camera.height))
    key = centres[:, 2] if order == "z" else np.linalg.norm(centres, axis=1)
    rank = np.empty(len(kept), int)
    rank[np.argsort(key, kind="stable")] = np.arange(len(kept))

    image, depth, left = start_images(camera)
    for splat, x, y in pairs(bounds, camera):
        dx, dy = x - mean[splat, 0], y - mean[splat, 1]
        a = inverse[splat]
        q = a[:, 0, 0] * dx * dx + 2 * a[:, 0, 1] * dx * dy + a[:, 1, 1] * dy * dy
        alpha = np.minimum(MAX_ALPHA, opacity[splat] * np.exp(-q / 2))
        ok = np.flatnonzero(alpha >= cut)
        splat, x, y, alpha = splat[ok], x[ok], y[ok], alpha[ok]
        left *= composite(image, depth, splat, x, y, alpha, rank[splat], centres[splat, 2], colour)
    return image + left[..., None] * background, depth


def ellipsoid_bounds(centres, axes, reach, camera):
    """Pixels x0 x1 y0 y1 that bound the image of {mu + reach R S v, |v| <= 1}; all pixels if it meets the camera's plane."""
    covariance = axes @ axes.transpose(0, 2, 1)
    dual = reach[:, None, None] ** 2 * covariance - centres[:, :, None] * centres[:, None, :]
    behind = centres[:, 2] + reach * np.sqrt(covariance[:, 2, 2]) <= 0
    around = (dual[:, 2, 2] >= 0) & ~behind
    bounds = []
    for i, focal, centre, size in ((0, camera.fx, camera.cx, camera.width), (1, camera.fy, camera.cy, camera.height)):
        d = np.where(dual[:, 2, 2] < 0, dual[:, 2, 2], -1)
        root = np.sqrt(np.maximum(dual[:, i, 2] ** 2 - dual[:, i, i] * d, 0))
        ends = np.sort(np.stack([(dual[:, i, 2] - root) / d, (dual[:, i, 2] + root) / d]), axis=0) * focal + centre
        first, last = bounds_to_pixels(ends[0], ends[1], size)
        first[around], last[around] = 0, size - 1
        last[behind] = -1
        bounds += [first, last]
    return bounds


def dot(a, b):
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]


def render_per_ray(splats, camera, pose, cut=MIN_ALPHA, background=0.0, near=0.01):
    """Image and median depth with the splats of each ray in the order of their maximum response along it.

    With d = (x, y, 1), the splat's covariance in the camera's frame A^-1 and its centre mu: z* = (d^T A mu) / (d^T A d),
    limited to mu_z +- 3 sigma_z for order and depth; alpha = min(0.99, o exp(-q / 2)), q = |z* d - mu|^2_A.
    """
    pose = np.asarray(pose, np.float64)
    centres, axes = in_camera(splats, pose)
    colour = colours(splats, pose[:3, 3])
    limit = max(cut, 1e-9)
    reach = np.sqrt(2 * np.log(np.maximum(splats.opacities / limit, 1)))
    bounds = ellipsoid_bounds(centres, axes, reach, camera)
    bounds[1][splats.opacities < limit] = -1
    deviation_z = np.linalg.norm(axes[:, 2, :], axis=1)
    # With A = L^T L: |z* d - mu|^2_A = |L mu x L d|^2 / |L d|^2, without cancellation. Both are linear in d.
    whiten = np.linalg.inv(axes).transpose(0, 2, 1)  # [splat, i]: column i of L
    centres_w = np.einsum("nij,ni->nj", whiten, centres)
    crossed = np.cross(centres_w[:, None], whiten)

    image, depth, left = start_images(camera)
    for splat, x, y in pairs(bounds, camera):
        u, v = ((x - camera.cx) / camera.fx)[:, None], ((y - camera.cy) / camera.fy)[:, None]
        d, cross = (m[splat, 0] * u + m[splat, 1] * v + m[splat, 2] for m in (whiten, crossed))
        dd = dot(d, d)
        z, q = dot(d, centres_w[splat]) / dd, dot(cross, cross) / dd
        alpha = np.minimum(MAX_ALPHA, splats.opacities[splat] * np.exp(-q / 2))
        ok = np.flatnonzero((alpha >= cut) & (z > near))
        splat, x, y, z, alpha = splat[ok], x[ok], y[ok], z[ok], alpha[ok]
        z = np.clip(z, centres[splat, 2] - 3 * deviation_z[splat], centres[splat, 2] + 3 * deviation_z[splat])
        left *= composite(image, depth, splat, x, y, alpha, z, z, colour)
    return image + left[..., None] * background, depth


def pose_matrix(position, quaternion):
    """4 x 4 of a position and a quaternion x y z w."""
    pose = np.eye(4)
    pose[:3, :3] = rotation_matrices(np.asarray(quaternion, float)[None])[0]
    pose[:3, 3] = position
    return pose


def read_ply(path):
    """A binary PLY with the properties of 3D Gaussian splatting, all of them float."""
    with open(path, "rb") as file:
        names, line = [], b""
        while line != b"end_header":
            line = file.readline().strip()
            if line.startswith(b"element vertex"):
                count = int(line.split()[2])
            if line.startswith(b"property float"):
                names.append(line.split()[2].decode())
        values = dict(zip(names, np.fromfile(file, "<f4", count * len(names)).reshape(count, -1).T.astype(np.float64)))
    take = lambda *names: np.stack([values[name] for name in names], -1)
    rest = sum(name.startswith("f_rest_") for name in names)
    harmonics = take("f_dc_0", "f_dc_1", "f_dc_2")[:, None]
    if rest:
        others = take(*(f"f_rest_{i}" for i in range(rest))).reshape(count, 3, rest // 3).transpose(0, 2, 1)
        harmonics = np.concatenate([harmonics, others], 1)
    return Splats(take("x", "y", "z"), np.exp(take("scale_0", "scale_1", "scale_2")), take("rot_1", "rot_2", "rot_3", "rot_0"),
                  1 / (1 + np.exp(-values["opacity"])), harmonics)


def main():
    parser = argparse.ArgumentParser(description="Render a PLY of splats; write an .npz with image and depth.")
    parser.add_argument("ply")
    parser.add_argument("out")
    parser.add_argument("--camera", type=float, nargs=6, required=True, metavar=("FX", "FY", "CX", "CY", "WIDTH", "HEIGHT"))
    parser.add_argument("--pose", type=float, nargs=7, required=True, metavar=tuple("tx ty tz qx qy qz qw".split()))
    parser.add_argument("--mode", choices=["dilated", "antialiased", "mip", "per_ray"], default="dilated")
    parser.add_argument("--order", choices=["z", "distance"], default="z")
    parser.add_argument("--cut", type=float, default=MIN_ALPHA)
    a = parser.parse_args()
    camera, pose = Camera(*a.camera[:4], *map(int, a.camera[4:])), pose_matrix(a.pose[:3], a.pose[3:])
    if a.mode == "per_ray":
        image, depth = render_per_ray(read_ply(a.ply), camera, pose, a.cut)
    else:
        image, depth = render_ewa(read_ply(a.ply), camera, pose, 0.1 if a.mode == "mip" else 0.3, a.mode != "dilated", a.order, a.cut)
    np.savez(a.out, image=image, depth=depth)


if __name__ == "__main__":
    main()
