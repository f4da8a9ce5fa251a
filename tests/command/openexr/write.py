"""Writes the pictures of this folder with the OpenEXR project's own library, from what `hbao render` dumps:

    hbao render -o final.png --dump dump --size 48x36 --fov-y 40 --radius 150 --msaa 1 --normal-format rgba16f
    pip install OpenEXR numpy && python3 write.py dump
"""

import sys

import numpy as np
import OpenEXR

NEAR = 10.0
# From world to eye space, right-handed with -z forward: a turn of 40 degrees about (1, 2, 3).
ANGLE, AXIS = np.radians(40), np.array([1, 2, 3]) / np.sqrt(14)


def turn():
    x, y, z = AXIS
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(ANGLE) * cross + (1 - np.cos(ANGLE)) * cross @ cross


def read(path):
    with OpenEXR.File(path, separate_channels=True) as file:
        return {name: channel.pixels for name, channel in file.channels().items()}


folder = sys.argv[1]
depth = read(f"{folder}/depth.exr")["Y"]
normals = read(f"{folder}/normals.exr")
normal = np.stack([normals["R"], normals["G"], -normals["B"]], axis=-1)  # of the other hand, as renderers have them
height, width = depth.shape
half = np.tan(np.radians(20))
x = (2 * (np.arange(width) + 0.5) / width - 1) * half * width / height
y = (1 - 2 * (np.arange(height) + 0.5) / height) * half
ray = np.sqrt(x[None, :] ** 2 + y[:, None] ** 2 + 1)
world = (normal @ turn()).astype(np.float32)


def kind(compression, tiled=False):
    header = {"compression": compression, "type": OpenEXR.tiledimage if tiled else OpenEXR.scanlineimage}
    if tiled:
        header["tiles"] = OpenEXR.TileDescription()
        header["tiles"].xSize = header["tiles"].ySize = 16
    return header


# A file of three parts, in tiles and lines, with distances along the rays and half floats beside them.
distance = (depth * ray).astype(np.float32)
colour = np.full((height, width), 0.5, np.float16)
OpenEXR.File(
    [
        OpenEXR.Part(kind(OpenEXR.PIZ_COMPRESSION), {"R": colour, "G": colour, "B": colour}, "beauty"),
        OpenEXR.Part(kind(OpenEXR.ZIP_COMPRESSION, tiled=True), {"Z": distance}, "depth"),
        OpenEXR.Part(
            kind(OpenEXR.ZIPS_COMPRESSION), {c: normal[..., i].astype(np.float32) for i, c in enumerate("XYZ")}, "normals"
        ),
    ]
).write("parts.exr")

# Many layers in one part, normals of world space, and 1e10 where nothing is.
layers = {"ViewLayer.Combined." + c: colour for c in "RGBA"}
layers["ViewLayer.Depth.Z"] = np.where(np.isfinite(depth), depth, 1e10).astype(np.float32)
layers |= {"ViewLayer.Normal." + c: world[..., i].copy() for i, c in enumerate("XYZ")}
OpenEXR.File(kind(OpenEXR.ZIP_COMPRESSION), layers).write("layers.exr")

# The values of a reversed depth buffer whose far plane is infinitely far.
stored = np.where(np.isfinite(depth), NEAR / depth, 0).astype(np.float32)
OpenEXR.File(kind(OpenEXR.RLE_COMPRESSION), {"d": stored}).write("reversed.exr")
print("--view-matrix", ",".join(f"{c:.9g}" for row in np.hstack([turn(), [[1], [2], [3]]]) for c in row) + ",0,0,0,1")
