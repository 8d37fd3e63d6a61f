"""Writers of Gaussian splats of degree 0: the PLY of 3D Gaussian splatting, and .spz version 3."""
import struct
import zlib

import numpy as np

C0 = 0.28209479177387814  # the spherical harmonic of degree 0
SPZ_BITS = 16             # of a position, behind the point


def write_ply(path, splats, opacity):
    """float32: positions, degree 0, logit of the opacity, logarithms of the deviations, rotation w x y z. Linear light."""
    names = "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3".split()
    n = len(splats.positions)
    columns = np.column_stack([splats.positions, (splats.colours - 0.5) / C0, np.full(n, np.log(opacity / (1 - opacity))),
                               np.log(splats.deviations), splats.rotations])
    with open(path, "wb") as file:
        file.write(("ply\nformat binary_little_endian 1.0\ncomment esim_light linear\ncomment SplatRenderMode: mip\nelement vertex %d\n" % n
                    + "".join("property float %s\n" % name for name in names) + "end_header\n").encode())
        file.write(columns.astype("<f4").tobytes())


def smallest_three(q):
    """uint32 of quaternions x y z w: index of the largest, then sign and 9 bits of each of the others, in order."""
    largest = np.abs(q).argmax(1)
    q = q * np.where(np.take_along_axis(q, largest[:, None], 1) < 0, -1, 1)
    code = largest.astype(np.uint32)
    for i in range(4):
        part = (np.where(q[:, i] < 0, 512, 0) + np.floor(511 * np.abs(q[:, i]) * np.sqrt(2) + 0.5)).astype(np.uint32)
        code = np.where(largest == i, code, code << np.uint32(10) | part)
    return code.astype("<u4")


def write_spz(path, splats, opacity):
    """Its axes are x right, y up, z back; ours go to (x, -y, -z) of it, as if they were x right, y down, z forward."""
    n = len(splats.positions)
    flip = np.array([1, -1, -1])
    fixed = np.round(splats.positions * flip * (1 << SPZ_BITS)).astype("<i4")
    w, x, y, z = splats.rotations.T
    byte = lambda v: np.clip(np.round(v), 0, 255).astype(np.uint8)
    raw = b"".join([
        struct.pack("<IIIBBBB", 0x5053474E, 3, n, 0, SPZ_BITS, 1, 0),  # 1: antialiased
        fixed.view(np.uint8).reshape(n, 3, 4)[:, :, :3].tobytes(),
        byte(np.full(n, 255 * opacity)).tobytes(),
        byte((splats.colours - 0.5) / C0 * 0.15 * 255 + 127.5).tobytes(),
        byte((np.log(splats.deviations) + 10) * 16).tobytes(),
        smallest_three(np.column_stack([x, -y, -z, w])).tobytes()])
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    body = packer.compress(raw) + packer.flush()
    with open(path, "wb") as file:
        file.write(b"\x1f\x8b\x08\0\0\0\0\0\2\xff" + body + struct.pack("<II", zlib.crc32(raw), len(raw)))
