#!/usr/bin/python3
"""Is a table of robot poses that means something else named, and never used, by calibrate-hand-eye?

Each scene is a rendered chessboard in 10 to 20 views with the true poses of a robot, camera in the
cell or on the flange. Its table is written in every wrong way of KINDS: another unit, order of the
quaternion, convention of the angles, direction. Goals: silently wrong 0, named right >= 95 %, right
tables accepted.
"""

import argparse
import concurrent.futures
import json
import os
import subprocess
import sys
import tempfile

try:
    import numpy as np
except ImportError as error:
    print(f"skipped: {error} (install python3-numpy)")
    sys.exit(77)

WIDTH, HEIGHT, FOCAL_PX = 800, 600, 1000.0
COLUMNS, ROWS, SQUARE_MM = 9, 6, 20.0  # inner corners
ROBOT_MM, ROBOT_RAD = 0.05, 1e-4
WRONG_MM, WRONG_RAD = 20, 0.05  # an accepted camera further off is silently wrong


# Rotations, written anew.

def about(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3)
    R[i, i] = R[j, j] = c
    R[i, j], R[j, i] = -s, s
    return R


def from_vector(v):
    angle = np.linalg.norm(v)
    if angle == 0:
        return np.eye(3)
    k = v / angle
    K = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def quaternion(R):
    """w, x, y, z, from the eigenvector of Bar-Itzhack's matrix."""
    K = np.array([[R[0, 0] - R[1, 1] - R[2, 2], 0, 0, 0],
                  [R[0, 1] + R[1, 0], R[1, 1] - R[0, 0] - R[2, 2], 0, 0],
                  [R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], R[2, 2] - R[0, 0] - R[1, 1], 0],
                  [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], np.trace(R)]]) / 3
    x, y, z, w = np.linalg.eigh(K)[1][:, -1]
    return np.array([w, x, y, z]) * (1 if w >= 0 else -1)


def to_vector(R):
    q = quaternion(R)
    s = np.linalg.norm(q[1:])
    return q[1:] * (2 * np.arctan2(s, q[0]) / s if s > 0 else 2)


def fixed_xyz(a):
    return about(2, a[2]) @ about(1, a[1]) @ about(0, a[0])


def moving_xyz(a):
    return about(0, a[0]) @ about(1, a[1]) @ about(2, a[2])


def zyz(a):
    return about(2, a[0]) @ about(1, a[1]) @ about(2, a[2])


def to_fixed_xyz(R):
    return np.array([np.arctan2(R[2, 1], R[2, 2]), -np.arcsin(np.clip(R[2, 0], -1, 1)), np.arctan2(R[1, 0], R[0, 0])])


def to_zyz(R):
    return np.array([np.arctan2(R[1, 2], R[0, 2]), np.arccos(np.clip(R[2, 2], -1, 1)), np.arctan2(R[2, 1], -R[2, 0])])


def pose(R, p):
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R, p
    return X


# What people write, from the true pose (mm): x y z and qw qx qy qz of the columns.

def row(R, p):
    return np.concatenate([p, quaternion(R)])


def rotated(convert):
    return lambda X: row(convert(X[:3, :3]), X[:3, 3])


def scaled(factor):
    return lambda X: row(X[:3, :3], X[:3, 3] * factor)


def permuted(*order):
    return lambda X: np.concatenate([X[:3, 3], quaternion(X[:3, :3])[list(order)]])


def inverted(X):
    Y = np.linalg.inv(X)
    return row(Y[:3, :3], Y[:3, 3])


RIGHT = scaled(1)
AS_FIXED, VECTOR = "converted as angles about the fixed x, y, z", "numbers are a rotation vector"
INVERTED = "inverted (the base in the flange), or"
# name: (table, what a message must say; None: accepted, size of the squares told, other setup told)
KINDS = {
    "right": (RIGHT, None, 1, False),
    "positions in metres": (scaled(1e-3), "positions of the poses are probably in metres", 1, False),
    "positions in centimetres": (scaled(0.1), "positions of the poses are probably in centimetres", 1, False),
    "positions in inches": (scaled(1 / 25.4), "positions of the poses are probably in inches", 1, False),
    "positions in feet": (scaled(1 / 304.8), "positions of the poses are probably in feet", 1, False),
    "positions in micrometres": (scaled(1e3), "in micrometres", 1, False),
    "squares in centimetres": (RIGHT, "size of the target is probably in centimetres", 0.1, False),
    "squares in inches": (RIGHT, "size of the target is probably in inches", 1 / 25.4, False),
    "quaternions x y z w": (permuted(1, 2, 3, 0), "in the order x, y, z, w", 1, False),
    "quaternions z w x y": (permuted(3, 0, 1, 2), "in the order w, x, y, z", 1, False),
    "inverted poses": (inverted, INVERTED, 1, False),
    "other setup": (RIGHT, INVERTED, 1, True),
    "inverted orientations": (rotated(np.transpose), "orientations are inverted", 1, False),
    "rotation vector as roll pitch yaw": (rotated(lambda R: fixed_xyz(to_vector(R))),
                                          VECTOR + ", and were " + AS_FIXED, 1, False),
    "roll pitch yaw as rotation vector": (rotated(lambda R: from_vector(to_fixed_xyz(R))),
                                          "converted as a rotation vector", 1, False),
    "roll pitch yaw, other order": (rotated(lambda R: moving_xyz(to_fixed_xyz(R))),
                                    "converted as angles about the moving x, y, z", 1, False),
    "A B C as roll pitch yaw": (rotated(lambda R: fixed_xyz(to_fixed_xyz(R)[::-1])), "(A, B, C)", 1, False),
    "ZYZ as roll pitch yaw": (rotated(lambda R: fixed_xyz(to_zyz(R))), "angles about the moving z, y, z", 1, False),
    "radians as degrees": (rotated(lambda R: fixed_xyz(np.radians(to_fixed_xyz(R)))),
                           "in radians, and were converted as degrees", 1, False),
    "rotation vector as roll pitch yaw, in metres": (
        lambda X: row(fixed_xyz(to_vector(X[:3, :3])), X[:3, 3] / 1e3), VECTOR + ", and were " + AS_FIXED, 1, False),
    "about one axis": (RIGHT, "about nearly one axis only", 1, False),
}


def render(X_CK, random):
    """The chessboard as a camera at the origin sees it, 2 x 2 samples a pixel."""
    v, u = np.meshgrid(np.arange(2 * HEIGHT) / 2 - 0.25, np.arange(2 * WIDTH) / 2 - 0.25, indexing="ij")
    rays = np.stack([(u - (WIDTH - 1) / 2) / FOCAL_PX, (v - (HEIGHT - 1) / 2) / FOCAL_PX, np.ones_like(u)])
    plane = np.linalg.inv(X_CK[:3, [0, 1, 3]]) @ rays.reshape(3, -1)
    x, y = (plane[:2] / plane[2]) / SQUARE_MM
    on_squares = (x > -1) & (x < COLUMNS) & (y > -1) & (y < ROWS)
    on_sheet = (x > -2) & (x < COLUMNS + 1) & (y > -2) & (y < ROWS + 1)
    black = on_squares & ((np.floor(x) + np.floor(y)) % 2 == 0)
    grey = np.where(black, 30.0, np.where(on_sheet, 220.0, 110.0)).reshape(HEIGHT, 2, WIDTH, 2).mean((1, 3))
    return np.clip(grey + random.normal(0, 1.5, grey.shape), 0, 255).astype(np.uint8)


def scene(folder, seed, one_axis):
    """Draws images and lens.json. @return  (camera in the cell, true poses X_BF, pose of the camera)"""
    random = np.random.default_rng(seed)
    to_hand = bool(random.integers(2))
    X_camera = pose(from_vector(random.uniform(-2, 2, 3)), random.uniform(-900, 900, 3))
    X_target = pose(from_vector(random.uniform(-1.5, 1.5, 3)), random.uniform(-150, 150, 3))
    if not to_hand:
        X_camera[:3, 3], X_target[:3, 3] = X_target[:3, 3].copy(), X_camera[:3, 3].copy()
    os.makedirs(folder + "/frames")
    poses = []
    for k in range(int(random.integers(10, 21))):
        tilt = np.radians(random.uniform(15, 40)) * np.array([1, 0] if one_axis else random.permutation([1, 0.4]))
        tilt *= random.choice([-1, 1], 2)
        R = from_vector(np.array([*tilt, 0])) @ about(2, 0 if one_axis else random.uniform(-2.5, 2.5))
        middle = np.array([(COLUMNS - 1) / 2 * SQUARE_MM, (ROWS - 1) / 2 * SQUARE_MM, 0])
        place = np.array([random.uniform(-50, 50), random.uniform(-30, 30), random.uniform(420, 560)])
        X_CK = pose(R, place - R @ middle)
        with open(f"{folder}/frames/{k:02}.pgm", "wb") as file:
            file.write(b"P5 %d %d 255\n" % (WIDTH, HEIGHT) + render(X_CK, random).tobytes())
        X_BF = X_camera @ X_CK @ np.linalg.inv(X_target)
        if not to_hand:
            X_BF = X_target @ np.linalg.inv(X_CK) @ np.linalg.inv(X_camera)
        error = pose(from_vector(random.normal(0, ROBOT_RAD, 3)), random.normal(0, ROBOT_MM, 3))
        poses.append(X_BF @ error)
    with open(folder + "/lens.json", "w") as file:
        json.dump({"schema": 1, "accepted": True, "image_size": [WIDTH, HEIGHT], "fx": FOCAL_PX, "fy": FOCAL_PX,
                   "cx": (WIDTH - 1) / 2, "cy": (HEIGHT - 1) / 2, "distortion": [0.0] * 5}, file)
    return to_hand, poses, X_camera


def run(product, folder, drawn, kind):
    """@return  (named right, silently wrong, what it said)"""
    to_hand, poses, X_camera = drawn
    table, words, size, other = KINDS[kind]
    name = f"{folder}/{kind.replace(' ', '_').replace(',', '')}.csv"
    with open(name, "w") as file:
        file.write("image,x_mm,y_mm,z_mm,qw,qx,qy,qz\n")
        for k, X in enumerate(poses):
            file.write(f"{k:02}.pgm," + ",".join(f"{value:.9g}" for value in table(X)) + "\n")
    setup = "eye-to-hand" if to_hand != other else "eye-in-hand"
    done = subprocess.run(
        [product, "calibrate-hand-eye", "--images", folder + "/frames", "--poses", name, "--intrinsics",
         folder + "/lens.json", "--setup", setup, "--board", f"{COLUMNS}x{ROWS}", "--square-mm",
         f"{SQUARE_MM * size:.9g}", "--acceptable-mm", "3", "--json", "-", "--quiet"],
        capture_output=True, text=True, timeout=300)
    if done.returncode != 0:
        return words is not None and words in done.stderr, False, done.stderr.strip()
    answer = json.loads(done.stdout)
    said = "accepted" if answer["accepted"] else "; ".join(answer["reasons"])
    if not answer["accepted"]:
        return words is not None and words in said, False, said
    w, x, y, z = answer["camera"]["quaternion_wxyz"]
    R = from_vector(2 * np.arctan2(np.linalg.norm([x, y, z]), w) * np.array([x, y, z]) /
                    max(1e-12, np.linalg.norm([x, y, z])))
    off_mm = np.linalg.norm(np.array(answer["camera"]["xyz_mm"]) - X_camera[:3, 3])
    off_rad = np.linalg.norm(to_vector(R.T @ X_camera[:3, :3]))
    wrong = off_mm > WRONG_MM or off_rad > WRONG_RAD
    return words is None and not wrong, wrong, f"accepted, {off_mm:.2f} mm and {1e3 * off_rad:.2f} mrad off"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--product", default="build/bin/plumbline")
    parser.add_argument("--scenes", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=int.from_bytes(os.urandom(3), "big"))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--kind", action="append", choices=KINDS, help="only this kind; may be repeated")
    options = parser.parse_args()
    kinds = options.kind or list(KINDS)
    score = {kind: [0, 0, 0] for kind in kinds}
    print(f"seeds {options.first_seed} to {options.first_seed + options.scenes - 1}")
    for seed in range(options.first_seed, options.first_seed + options.scenes):
        with tempfile.TemporaryDirectory() as folder, \
                concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            drawn = {one: scene(f"{folder}/{one}", seed, one == "axis") for one in
                     ["axis"] * ("about one axis" in kinds) + ["all"] * (kinds != ["about one axis"])}
            places = {kind: "axis" if kind == "about one axis" else "all" for kind in kinds}
            runs = {kind: pool.submit(run, options.product, f"{folder}/{places[kind]}", drawn[places[kind]], kind)
                    for kind in kinds}
            for kind, done in runs.items():
                named, wrong, said = done.result()
                score[kind][0] += named
                score[kind][1] += wrong
                score[kind][2] += 1
                if wrong or not named:
                    print(f"seed {seed}, {kind}: {said}")
    for kind, (named, wrong, all_runs) in score.items():
        print(f"{kind:46} {named:3} of {all_runs} right, {wrong} silently wrong")
    named, wrong, all_runs = (sum(one[k] for one in score.values()) for k in range(3))
    print(f"named right {named} of {all_runs} ({100 * named / all_runs:.1f} %, goal 95), silently wrong {wrong} (goal 0)")
    return 1 if wrong > 0 or named < 0.95 * all_runs else 0


sys.exit(main())
