# SPDX-License-Identifier: Apache-2.0
"""A room with painted walls and floor as a camera on a robot sees it: each pixel's ray is cut with the planes, so the point behind a pixel is exact.
Axes of the world: x east, y north, z up; of the camera: z along the view, x right, y down."""
import cv2
import numpy as np

HALF_M, HEIGHT_M = 7.0, 3.0       # of the room
TEXELS, BLOCK = 50, 5             # a metre of paint; texels of a block of one colour
WIDTH_PX, ROWS_PX, FOCAL_PX = 320, 240, 229.0
CENTRE_PX = ((WIDTH_PX - 1) / 2, (ROWS_PX - 1) / 2)
MOUNT_M = np.array([0.2, 0.0, 0.3])
TO_BODY = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])
# origin, two directions along the plane, length along each of them
PLANES = [(np.array([-HALF_M, -HALF_M, 0]), np.array([1.0, 0, 0]), np.array([0, 1.0, 0]), (2 * HALF_M, 2 * HALF_M)),
          *[(np.array(at) * HALF_M, np.array(along), np.array([0, 0, 1.0]), (2 * HALF_M, HEIGHT_M))
            for at, along in (((-1.0, -1, 0), (1.0, 0, 0)), ((1.0, -1, 0), (0, 1.0, 0)), ((1.0, 1, 0), (-1.0, 0, 0)), ((-1.0, 1, 0), (0, -1.0, 0)))]]


def paints(seed):
    random = np.random.default_rng(seed)
    made = []
    for *_, (long_m, high_m) in PLANES:
        blocks = random.integers(30, 226, (round(high_m * TEXELS / BLOCK), round(long_m * TEXELS / BLOCK))).astype(np.uint8)
        made.append(cv2.GaussianBlur(cv2.resize(blocks, None, fx=BLOCK, fy=BLOCK, interpolation=cv2.INTER_NEAREST), (0, 0), 1.2))
    return made


def turn_of(yaw_rad):
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def hits(pixels, place_m, yaw_rad):
    """Points [m] behind pixels (n, 2), the plane of each (-1: none) and its place in that plane's paint."""
    rays = np.column_stack([(pixels - CENTRE_PX) / FOCAL_PX, np.ones(len(pixels))]) @ (turn_of(yaw_rad) @ TO_BODY).T
    eye = np.array([*place_m, 0]) + turn_of(yaw_rad) @ MOUNT_M
    best, plane, paint = np.full(len(pixels), np.inf), np.full(len(pixels), -1), np.zeros((len(pixels), 2), np.float32)
    for i, (origin, along, up, size_m) in enumerate(PLANES):
        normal = np.cross(along, up)
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = normal @ (origin - eye) / (rays @ normal)
            at = eye + depth[:, None] * rays - origin
            u, v = at @ along, at @ up
            here = (depth > 0) & (depth < best) & (u >= 0) & (u <= size_m[0]) & (v >= 0) & (v <= size_m[1])
        best[here], plane[here] = depth[here], i
        paint[here] = np.column_stack([u, v])[here] * TEXELS
    with np.errstate(invalid="ignore"):
        return eye + best[:, None] * rays, plane, paint


def pixels_of(points_m, place_m, yaw_rad):
    """Where the camera sees these points; NaN behind it."""
    eye = np.array([*place_m, 0]) + turn_of(yaw_rad) @ MOUNT_M
    seen = (points_m - eye) @ (turn_of(yaw_rad) @ TO_BODY)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(seen[:, 2:] > 0.1, seen[:, :2] / seen[:, 2:] * FOCAL_PX + CENTRE_PX, np.nan)


def image(paint_of, place_m, yaw_rad, noise):
    """What the camera sees from there, with white noise of 2 grey levels."""
    v, u = np.mgrid[0:ROWS_PX, 0:WIDTH_PX]
    _, plane, paint = hits(np.column_stack([u.ravel(), v.ravel()]).astype(float), place_m, yaw_rad)
    columns, rows = (paint[:, i].reshape(ROWS_PX, WIDTH_PX) - 0.5 for i in (0, 1))
    shown, plane = np.full((ROWS_PX, WIDTH_PX), 128, np.uint8), plane.reshape(ROWS_PX, WIDTH_PX)
    for i, one in enumerate(paint_of):
        mine = plane == i
        if mine.any():
            shown[mine] = cv2.remap(one, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)[mine]
    return np.clip(shown + noise.normal(0, 2, (ROWS_PX, WIDTH_PX)), 0, 255).astype(np.uint8)
