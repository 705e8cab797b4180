#!/usr/bin/env python3
"""Draws the pictures of docs/effects.md: docs/effects/draw.py [FOLDER]

One visual language: the declared cell dashed and grey, the real one dark, the cause in the accent colour. The arm is
two links and a tool; deviations are exaggerated. A function is named after the effect that it draws."""

import math
import pathlib
import sys

WIDTH, HEIGHT = 200, 130
HEAD = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 %d %d" width="%d" height="%d">
<style>
path,circle,rect{fill:none;stroke-linecap:round;stroke-linejoin:round}
.n{stroke:#9aa3ad;stroke-width:1.2;stroke-dasharray:3 2.5}
.a{stroke:#24282f;stroke-width:1.6}
.t{stroke:#9aa3ad;stroke-width:.8}
.e{stroke:#c2500b;stroke-width:1.4}
.f{fill:#c2500b;stroke:none}
.j{fill:#fff;stroke:#24282f;stroke-width:1.4}
text{font:italic 10px serif;fill:#24282f}
.l{fill:#c2500b}
</style>
<rect width="%d" height="%d" rx="4" style="fill:#fff"/>
""" % (WIDTH, HEIGHT, WIDTH * 1.5, HEIGHT * 1.5, WIDTH, HEIGHT)

BASE, Q, LINKS = (40, 110), (64, -76, -78), (46, 54, 26)
parts = []


def number(value):
    return "%g" % (round(value, 1) + 0.0)


def point(p):
    return "%s %s" % (number(p[0]), number(p[1]))


def path(points, style="a", closed=False):
    parts.append('<path class="%s" d="M%s%s"/>' % (style, "L".join(point(p) for p in points), "Z" if closed else ""))


def circle(centre, radius, style="a"):
    parts.append('<circle class="%s" cx="%s" cy="%s" r="%s"/>' % (style, number(centre[0]), number(centre[1]), number(radius)))


def text(at, words, style=""):
    parts.append('<text x="%s" y="%s"%s>%s</text>' % (number(at[0]), number(at[1]), ' class="%s"' % style if style else "", words))


def polar(centre, radius, degrees):
    angle = math.radians(degrees)
    return centre[0] + radius * math.cos(angle), centre[1] - radius * math.sin(angle)


def head(at, degrees):
    """Arrow head at a point, in that direction."""
    parts.append('<path class="f" d="M%sL%sL%sZ"/>' % (point(at), point(polar(at, 6, degrees + 157)), point(polar(at, 6, degrees - 157))))


def arrow(start, end, style="e"):
    path([start, end], style)
    head(end, math.degrees(math.atan2(start[1] - end[1], end[0] - start[0])))


def arc(centre, radius, start, end, style="e", arrow_head=True):
    step = 4 if end > start else -4
    angles = list(range(round(start), round(end), step)) + [end]
    path([polar(centre, radius, angle) for angle in angles], style)
    if arrow_head:
        head(polar(centre, radius, end), end + (90 if end > start else -90))


def curve(f, left, right, style="e", steps=60):
    path([f(left + (right - left) * k / steps) for k in range(steps + 1)], style)


def spring(start, end, style="e", turns=5, width=4):
    length = math.dist(start, end)
    along = ((end[0] - start[0]) / length, (end[1] - start[1]) / length)
    across = (-along[1], along[0])
    points = [start]
    for k in range(1, 2 * turns):
        side = width if k % 2 else -width
        points.append(tuple(start[i] + along[i] * length * k / (2 * turns) + across[i] * side for i in (0, 1)))
    path(points + [end], style)


def axes(origin, right, up, x="", y=""):
    path([(origin[0], origin[1] - up), origin, (origin[0] + right, origin[1])], "t")
    text((origin[0] + right - 8, origin[1] + 10), x)
    text((origin[0] - 9, origin[1] - up + 6), y)


def joints_of(base=BASE, q=Q, links=LINKS, tilt=0, pedestal=16):
    """Shoulder, elbow, wrist, tip."""
    points, angle = [polar(base, pedestal, 90 + tilt)], tilt
    for turn, length in zip(q, links):
        angle += turn
        points.append(polar(points[-1], length, angle))
    return points


def ground(base, style="t", tilt=0):
    left, right = polar(base, 16, 180 + tilt), polar(base, 16, tilt)
    path([left, right], style)
    for k in range(5):
        at = tuple(left[i] + (right[i] - left[i]) * (k + 0.5) / 5 for i in (0, 1))
        path([at, (at[0] - 4, at[1] + 5)], "t")


def arm(style="a", base=BASE, q=Q, links=LINKS, tilt=0, tool=True, with_ground=True):
    points = joints_of(base, q, links, tilt)
    if with_ground:
        ground(base, "a" if style == "a" else "t", tilt)
    path([base] + (points if tool else points[:3]), style)
    if style == "a":
        for joint in points[:3]:
            circle(joint, 3, "j")
    return points


def load(at, size=12, style="a", drop=0):
    path([(at[0] - size / 2, at[1] + drop), (at[0] + size / 2, at[1] + drop), (at[0] + size / 2, at[1] + size + drop),
          (at[0] - size / 2, at[1] + size + drop)], style, True)


def weight(at, length=18, label="mg"):
    arrow(at, (at[0], at[1] + length))
    text((at[0] + 4, at[1] + length - 2), label, "l")


def turned(q, joint, degrees):
    return tuple(angle + (degrees if k == joint else 0) for k, angle in enumerate(q))


def bent(start, end, sag, style="a"):
    """A beam from start, clamped, whose end is displaced by the vector sag."""
    curve(lambda u: tuple(start[i] + (end[i] - start[i]) * u + sag[i] * (3 * u * u - u ** 3) / 2 for i in (0, 1)), 0, 1, style)
    return end[0] + sag[0], end[1] + sag[1]


def step_plot(f, origin=(140, 50), right=48, up=34, x="t", y=""):
    axes(origin, right, up, x, y)
    curve(lambda u: (origin[0] + right * u, origin[1] - up * f(u)), 0, 0.95)


def camera(at, degrees, style="a"):
    corner = [polar(at, 9, degrees + turn) for turn in (35, 145, 215, 325)]
    path(corner, style, True)
    path([polar(at, 7.5, degrees + 12), polar(at, 14, degrees + 20), polar(at, 14, degrees - 20), polar(at, 7.5, degrees - 12)], style)


def tag(at, size, style="a"):
    x, y = at
    path([(x - size, y - size), (x + size, y - size), (x + size, y + size), (x - size, y + size)], style, True)
    path([(x - size / 2, y - size / 2), (x + size / 2, y - size / 2), (x, y + size / 2)], style, True)


# The pictures, in the order of the catalogue.

def base_frame():
    arm("n")
    arm(base=(56, 108), tilt=-4)
    arrow((40, 121), (55, 121))
    text((60, 125), "x, y, z", "l")


def tool_frame():
    arm("n")
    points = arm(tool=False)
    tip = joints_of()[3]
    path([points[2], (tip[0] + 12, tip[1] + 6)])
    arrow(tip, (tip[0] + 11, tip[1] + 5.5))


def joint_offset():
    arm("n")
    points = arm(q=turned(Q, 1, -11))
    arc(points[1], 30, Q[0] + Q[1], Q[0] + Q[1] - 11)
    text((points[1][0] + 34, points[1][1] + 3), "v", "l")


def gear_ratio():
    for q, error in ((-30, 3), (-62, 7), (-94, 11)):
        arm("n", q=(Q[0], q, Q[2]), with_ground=False)
        points = arm("a", q=(Q[0], q - error, Q[2]), with_ground=q == -30)
        arc(points[1], 34, Q[0] + q, Q[0] + q - error)
    text((128, 62), "v q", "l")


def axis_coupling():
    points = arm(q=turned(Q, 1, -12))
    arm("n", with_ground=False)
    shoulder, elbow = points[:2]
    for joint in (shoulder, elbow):
        circle(joint, 9, "e")
    for side in (-1, 1):
        path([polar(shoulder, 9, Q[0] + 90 * side), polar(elbow, 9, Q[0] + 90 * side)], "e")
    arc(shoulder, 17, 10, 60)
    arc(elbow, 17, -20, -70)


def link_geometry():
    arm("n")
    points = arm(links=(46, 64, 26))
    middle = joints_of()[2]
    arrow(middle, points[2])
    text((points[2][0] - 2, points[2][1] - 8), "a + v", "l")


def joint_compliance():
    arm("n")
    points = arm(q=turned(Q, 1, -12))
    elbow = points[1]
    path([polar(elbow, 5 + k / 60, k) for k in range(0, 900, 15)], "e")
    load(points[3])
    weight((points[3][0], points[3][1] + 6))


def compliance_asymmetry():
    arm("n")
    arm(q=turned(Q, 1, -8))
    axes((150, 46), 38, 30, "tau", "s")
    path([(150, 46), (184, 20)], "n")
    path([(120, 69), (150, 46)], "n")
    path([(120, 53), (150, 46), (184, 12)], "e")


def joint_hardening():
    arm("n")
    arm(q=turned(Q, 1, -8))
    axes((132, 58), 56, 44, "tau", "s")
    path([(132, 58), (180, 18)], "n")
    curve(lambda u: (132 + 50 * u, 58 - 42 * (u - 0.42 * u ** 3)), 0, 1)


def counterbalance():
    points = arm()
    arm("n", q=turned(Q, 0, -8), with_ground=False)
    spring((18, 108), polar(points[0], 24, Q[0] + 4), turns=6)
    circle((18, 108), 2, "f")
    arc(points[0], 13, 20, 75)


def tool_stiffness():
    root, end = (46, 40), (160, 40)
    path([(46, 18), (46, 62)])
    for y in range(20, 62, 8):
        path([(46, y), (40, y + 5)], "t")
    bent(root, end, (0, 18), "n")
    tip = bent(root, end, (0, 44))
    load(tip)
    arrow((172, 58), (172, 82))
    text((70, 30), "E I (1 + v)", "l")


def tool_shear():
    path([(52, 24), (52, 84)])
    for y in range(26, 84, 8):
        path([(52, y), (46, y + 5)], "t")
    path([(52, 36), (124, 36), (124, 70), (52, 70)], "n", True)
    path([(52, 36), (124, 54), (124, 88), (52, 70)], "a", True)
    for x in (76, 100):
        path([(x, 36 + (x - 52) / 4), (x, 70 + (x - 52) / 4)], "t")
    arrow((124, 70), (124, 108))
    text((129, 106), "F", "l")


def tool_root_compliance():
    path([(30, 26), (30, 88)])
    path([(30, 34), (46, 34), (46, 78), (30, 78)], "a", True)
    path([(46, 56), (160, 56)], "n")
    parts.append('<path class="f" d="M46 34L46 76L55 35Z"/>')
    path([(55, 35), (47, 78)])
    path([(51, 56), (156, 77)])
    load((156, 77))
    arc((46, 56), 66, 0, -10)
    weight((156, 83))


def payload_mass():
    arm("n")
    points = arm(q=turned(Q, 1, -9))
    load(points[3], 20, "e")
    load(points[3], 12, "n")
    arrow((points[3][0] + 18, points[3][1] - 2), (points[3][0] + 18, points[3][1] + 20))
    text((points[3][0] + 24, points[3][1] + 12), "m (1 + v)", "l")


def payload_cog():
    points = arm()
    tip = points[3]
    load(tip, 16, "n")
    circle((tip[0], tip[1] + 8), 1.6, "t")
    path([(tip[0] - 4, tip[1]), (tip[0] + 26, tip[1]), (tip[0] + 26, tip[1] + 14), (tip[0] - 4, tip[1] + 14)], "a", True)
    arrow((tip[0], tip[1] + 8), (tip[0] + 15, tip[1] + 8))
    circle((tip[0] + 17, tip[1] + 8), 2, "f")


def gravity_direction():
    arm()
    axes((140, 70), 40, 40)
    path([(162, 38), (162, 76)], "n")
    arrow((162, 38), (151, 75))
    text((143, 84), "g", "l")
    arc((162, 38), 24, -90, -106)
    text((183, 66), "x")
    text((131, 40), "z")


def pedestal_compliance():
    arm("n")
    points = arm(tilt=-8)
    spring((27, 113), (27, 126), turns=3, width=3)
    spring((54, 117), (54, 126), turns=3, width=3)
    path([(18, 126), (64, 126)], "t")
    load(points[3])
    weight((points[3][0], points[3][1] + 6))


def bearing_tilt():
    centre = (58, 66)
    path([(30, 112), (86, 112)])
    path([(44, 112), (44, 80), (72, 80), (72, 112)])
    for style, degrees in (("n", 0), ("a", -12)):
        path([polar(centre, -14, 90 + degrees), polar(centre, 46, 90 + degrees)], style)
        path([polar(centre, 26, 180 + degrees), polar(centre, 104, degrees)], style)
    for side, reach in ((180, 18), (0, 18)):
        circle((centre[0] - reach if side else centre[0] + reach, centre[1] + (5 if side else 9)), 4.5, "e")
    end = polar(centre, 104, -12)
    load(end)
    weight((end[0], end[1] + 6))
    arc(centre, 40, 90, 79)
    text((44, 18), "axis")


def link_bending():
    points = joints_of()
    arm("n", with_ground=False)
    ground(BASE, "a")
    path([BASE, points[0], points[1]])
    wrist = bent(points[1], points[2], (-2, 22))
    path([wrist, (wrist[0] - 12, wrist[1] + 22)])
    for joint in (points[0], points[1], wrist):
        circle(joint, 3, "j")
    arrow(points[2], (points[2][0] - 2, points[2][1] + 19))


def axis_bending():
    path([(34, 20), (34, 110)])
    path([(34, 36), (74, 36), (74, 54), (34, 54)], "a", True)
    path([(74, 45), (160, 45)], "n")
    tip = bent((74, 45), (160, 45), (-3, 26))
    load(tip)
    weight((tip[0], tip[1] + 6))
    arrow((82, 24), (126, 24))
    text((100, 19), "x", "l")


def guide_play():
    path([(20, 74), (136, 74), (136, 84), (20, 84)], "a", True)
    path([(50, 46), (106, 46), (106, 72), (50, 72)], "n", True)
    path([(50, 40), (107, 47), (104, 73), (47, 66)], "a", True)
    arrow((48, 84), (48, 68))
    text((20, 64), "play", "l")
    path([(78, 43), (164, 54)])
    load((164, 54))
    weight((164, 60), 24)


def gravity_sag():
    arm("n")
    points = arm(q=turned(turned(Q, 0, -5), 1, -8))
    for k in (0, 1):
        middle = tuple((points[k][i] + points[k + 1][i]) / 2 for i in (0, 1))
        circle(middle, 3.5, "e")
        weight(middle, 20, "?")


def backlash():
    centre = (66, 66)
    for k in range(12):
        a = 30 * k
        path([polar(centre, 26, a - 9), polar(centre, 36, a - 5), polar(centre, 36, a + 5), polar(centre, 26, a + 9), polar(centre, 26, a + 21)], "a")
    path([(112, 46), (97, 60), (97, 67), (112, 76)], "a")
    arrow((126, 66), (126, 82))
    arrow((126, 60), (126, 44))
    text((132, 68), "2 v", "l")
    axes((152, 110), 40, 40)
    path([(152, 84), (168, 84), (168, 98), (190, 98)], "e")


def approach_lag():
    arm("n")
    arm("n", q=turned(Q, 0, 44), with_ground=False)
    points = arm(q=turned(Q, 0, 8))
    arc(points[0], 62, 96, 73)
    arc(points[0], 62, 70, 65, arrow_head=False)
    text((66, 16), "1 - v", "l")


def following_error():
    arm("n")
    arm(q=turned(Q, 0, 7))
    axes((122, 66), 68, 52, "t", "q")
    path([(122, 62), (166, 18), (188, 18)], "n")
    path([(122, 66), (128, 64), (170, 23), (188, 23)], "e")
    arrow((180, 34), (180, 25))
    text((172, 45), "v u", "l")


def arrival_friction():
    arm("n")
    points = arm(q=turned(Q, 1, 9))
    load(points[3], 14)
    circle(points[1], 10, "e")
    for k in range(8):
        path([polar(points[1], 10, 45 * k), polar(points[1], 13, 45 * k + 12)], "e")
    arc(points[1], 40, 24, -1)
    weight((points[3][0], points[3][1] + 7), 18)


def gear_periodic():
    centre = (62, 66)
    circle(centre, 34, "n")
    path([polar(centre, 34 + 5 * math.sin(math.radians(9 * k)), k) for k in range(0, 361, 2)], "e")
    circle(centre, 3, "j")
    path([centre, polar(centre, 34, 30)])
    axes((120, 66), 72, 30, "q", "s")
    path([(120, 66), (192, 66)], "t")
    curve(lambda u: (120 + 66 * u, 66 - 16 * math.sin(6 * math.pi * u)), 0, 1)


def thermal_growth():
    arm("n")
    arm(links=(52, 61, 26))
    path([(166, 28), (166, 80)], "e")
    path([(174, 28), (174, 80)], "e")
    arc((170, 28), 4, 0, 180, arrow_head=False)
    circle((170, 86), 8, "e")
    path([(170, 84), (170, 48)], "e")
    text((180, 50), "T", "l")


def thermal_drift():
    arm("n")
    arm(base=(54, 107))
    arrow((40, 120), (53, 120))
    step_plot(lambda u: 1 - math.exp(-4 * u), y="x")


def latency():
    arm("n")
    points = arm(q=turned(Q, 0, 12))
    arc(points[0], 60, 112, 80)
    circle((160, 40), 17, "e")
    path([(160, 28), (160, 40), (169, 45)], "e")
    text((148, 74), "t - time", "l")


def dynamic_inertia():
    arm("n")
    points = arm(q=turned(Q, 0, 9))
    tip = points[3]
    load(tip)
    arrow((tip[0] + 12, tip[1] - 12), (tip[0] + 36, tip[1] - 2))
    text((tip[0] + 28, tip[1] - 12), "a", "l")
    path([polar(points[0], 5 + k / 60, k) for k in range(0, 720, 15)], "e")


def measurement_scale():
    arm()
    for style, step, y in (("n", 14, 24), ("e", 16, 34)):
        path([(72, y), (72 + 7 * step, y)], style)
        for k in range(8):
            path([(72 + k * step, y - 4), (72 + k * step, y + 2)], style)
    text((118, 50), "(1 + v)", "l")


def step_event():
    arm("n")
    arm(base=(54, 110))
    arrow((40, 121), (53, 121))
    step_plot(lambda u: 0.12 if u < 0.5 else 0.8, y="x")


def tilt_event():
    arm("n")
    arm(tilt=-8)
    arc(BASE, 30, 4, -10)
    step_plot(lambda u: 0.12 if u < 0.5 else 0.8, y="x")


def offset_event():
    arm("n")
    points = arm(q=turned(Q, 1, -11))
    arc(points[1], 30, Q[0] + Q[1], Q[0] + Q[1] - 11)
    step_plot(lambda u: 0.12 if u < 0.5 else 0.8, y="s")


def base_tilt():
    arm("n")
    arm(tilt=-8)
    path([polar((40, 113), 30, 172), polar((40, 113), 34, -8)], "e")
    path([(122, 40), (182, 48), (180, 62), (120, 54)], "e", True)
    circle((160, 52), 5, "e")
    path([(150, 44), (148, 58)], "t")


def range_zero():
    points = arm()
    circle((170, 112), 8)
    path([(164, 106), points[3]])
    path([(170, 104), (185, 104), (185, 112)], "e")
    arrow((182, 96), (172, 101))
    text((172, 92), "zero", "l")


def range_anchor():
    points = arm()
    path([(150, 116), points[3]], "n")
    path([(176, 104), points[3]])
    circle((150, 116), 3, "n")
    circle((176, 104), 3, "j")
    arrow((153, 114.5), (172, 106))


def camera_tag_size():
    camera((28, 66), 0)
    tag((104, 66), 11)
    tag((160, 66), 20, "n")
    for side in (-1, 1):
        path([(34, 66), (104, 66 + 11 * side), (160, 66 + 20 * side)], "t")
    arrow((108, 100), (156, 100))
    text((118, 114), "1 + v", "l")


def camera_zoom():
    camera((28, 66), 0)
    path([(42, 66), (190, 66)], "t")
    tag((106, 44), 10)
    tag((158, 44), 10, "n")
    arrow((120, 44), (146, 44))
    text((112, 86), "Z (1 + v)", "l")


def camera_lens():
    centre = (100, 65)
    for style, k1 in (("n", 0), ("a", -0.24)):
        for step in range(-2, 3):
            def warped(u, v):
                factor = 1 + k1 * (u * u + v * v) / 2
                return centre[0] + 66 * u * factor, centre[1] + 44 * v * factor
            curve(lambda u: warped(u, step / 2), -1, 1, style, 16)
            curve(lambda v: warped(step / 2, v), -1, 1, style, 16)
    arrow((166, 21), (156, 29))


def camera_frame():
    camera((34, 30), -28)
    camera((36, 104), 26, "n")
    camera((46, 110), 38, "e")
    for at, target, style in (((34, 30), (150, 66), "t"), ((36, 104), (150, 66), "n"), ((46, 110), (140, 40), "e")):
        path([polar(at, 14, math.degrees(math.atan2(at[1] - target[1], target[0] - at[0]))), target], style)
    circle((150, 66), 4)
    circle((140, 40), 4, "e")
    arrow((149, 61), (142, 45))


def main():
    folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).parent
    for name, draw in list(globals().items()):
        if draw.__class__ is main.__class__ and draw.__code__.co_argcount == 0 and name != "main":
            parts.clear()
            draw()
            (folder / (name + ".svg")).write_text(HEAD + "\n".join(parts) + "\n</svg>\n")


if __name__ == "__main__":
    main()
