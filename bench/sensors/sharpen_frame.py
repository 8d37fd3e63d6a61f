"""Copies a clip of a real sensor with a sharper frame, to see what the blur of the frame changes:

    python3 bench/sensors/sharpen_frame.py CLIP OUT [SIGMA_PX]

CLIP is a folder as for `esim evaluate realism` (docs/methods/realism.md), whose frame is in the second row and first column of
its picture. The sharper frame is 2 p - G p, where G is a Gaussian of SIGMA_PX (default: 0.6): it raises the contrast of
structures of 2 px by 1.8, and of those of 4 px by 1.4. OUT, a new folder, becomes CLIP with this frame. Needs numpy and OpenCV."""

import pathlib
import shutil
import sys

import cv2
import numpy as np

clip, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
sigma_px = float(sys.argv[3]) if len(sys.argv) > 3 else 0.6
(source,) = clip.glob("*.png")
picture = cv2.imread(str(source), cv2.IMREAD_GRAYSCALE)
height, width = np.load(clip / "flow.npy").shape[2:]
frame = picture[height : 2 * height, :width]
inside = frame[1:-1, 1:-1].astype(float)  # without the black line around it
sharp = 2 * inside - cv2.GaussianBlur(inside, (0, 0), sigma_px, borderType=cv2.BORDER_REPLICATE)
frame[1:-1, 1:-1] = np.clip(np.rint(sharp), 1, 255)

out.mkdir(parents=True)
for file in clip.iterdir():
    if file != source:
        shutil.copyfile(file, out / file.name)
cv2.imwrite(str(out / source.name), picture)
