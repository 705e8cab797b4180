"""Drawing of the demo's cell: the arm at the first assembly point, with its deflection enlarged.

The arm is computed here from the cell file alone, so that the drawing shows what the cell file and the
hidden effect imply; `Scene` checks the tip against the measured landing.
"""
import math
import tomllib

GRAVITY = 9.80665


def multiply(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def link_frame(joint, q_rad):
    """Rz(theta) Tz(d) Tx(a) Rx(alpha), lengths in metres."""
    theta = joint["sign"] * q_rad + math.radians(joint["theta_offset_deg"])
    alpha = math.radians(joint["alpha_deg"])
    c, s, ca, sa = math.cos(theta), math.sin(theta), math.cos(alpha), math.sin(alpha)
    a, d = joint["a_mm"] / 1e3, joint["d_mm"] / 1e3
    return [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]


def frames(joints, q):
    """Frames 0 (base) to n (flange) in the base."""
    result = [[[float(i == j) for j in range(4)] for i in range(4)]]
    for joint, angle in zip(joints, q):
        result.append(multiply(result[-1], link_frame(joint, angle)))
    return result


def point(frame, p):
    return [sum(frame[i][k] * p[k] for k in range(3)) + frame[i][3] for i in range(3)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


class Scene:
    """The arm as the controller assumes it, and deflected."""

    def __init__(self, cell_file, q_deg, payload_kg, more_compliance):
        """more_compliance: rad/(N m) by joint name, in addition to the cell file."""
        with open(cell_file, "rb") as file:
            cell = tomllib.load(file)
        self.joints, tool = cell["robot"]["joint"], cell["tool"]
        self.q = [math.radians(angle) for angle in q_deg]
        self.length = tool["length_mm"] / 1e3
        inner = tool["side_mm"] - 2 * tool["wall_mm"]
        area = (tool["side_mm"] ** 2 - inner**2) / 1e6
        inertia = (tool["side_mm"] ** 4 - inner**4) / 12 / 1e12
        self.stiffness = tool["youngs_modulus_GPa"] * 1e9 * inertia
        self.weight_per_m = tool["density_kg_m3"] * area * GRAVITY
        self.payload_N = payload_kg * GRAVITY
        self.cog = [x / 1e3 for x in cell["payload"]["cog_mm"]]
        mount = tool["mount_mass_kg"] + self.weight_per_m / GRAVITY * self.length
        self.flange_masses = [(mount, [0, 0, self.length / 2]), (payload_kg, self.cog)]
        self.compliance = [joint["compliance_rad_per_Nm"] + more_compliance.get(f"q{k + 1}", 0)
                           for k, joint in enumerate(self.joints)]
        self.sag = self.joint_sag()

    def joint_sag(self):
        at = frames(self.joints, self.q)
        masses = [(joint["link_mass_kg"], point(at[k + 1], [x / 1e3 for x in joint["link_com_mm"]]), k)
                  for k, joint in enumerate(self.joints)]
        masses += [(kg, point(at[-1], p), len(self.joints) - 1) for kg, p in self.flange_masses]
        sag = []
        for i, joint in enumerate(self.joints):
            axis = [joint["sign"] * at[i][k][2] for k in range(3)]
            origin = [at[i][k][3] for k in range(3)]
            torque = 0.0
            for kg, p, link in masses:
                if link < i:
                    continue
                lever = [p[k] - origin[k] for k in range(3)]
                moment = cross(lever, [0, 0, -kg * GRAVITY])
                torque += sum(axis[k] * moment[k] for k in range(3))
            sag.append(self.compliance[i] * torque)
        return sag

    def bend(self, z):
        """Deflection of the tool at z, along gravity, for a tool that is nearly horizontal [m]."""
        length, force = self.length, self.payload_N
        moment = force * (self.cog[2] - length)
        by_force = force * z * z * (3 * length - z) / 6
        by_weight = self.weight_per_m * z * z * (6 * length**2 - 4 * length * z + z * z) / 24
        return (by_force + moment * z * z / 2 + by_weight) / self.stiffness

    def arm(self, factor):
        """Origins of base to flange with the joints deflected `factor` times."""
        q = [angle + factor * sag for angle, sag in zip(self.q, self.sag)]
        at = frames(self.joints, q)
        return [[frame[k][3] for k in range(3)] for frame in at], at[-1]

    def tool(self, factor, steps=24):
        flange = self.arm(factor)[1]
        line = []
        for k in range(steps + 1):
            z = k / steps * self.length
            p = point(flange, [0, 0, z])
            line.append([p[0], p[1], p[2] - factor * self.bend(z)])
        return line

    def tip_shift_mm(self):
        return [1e3 * (a - b) for a, b in zip(self.tool(1)[-1], self.tool(0)[-1])]


def projected(p, scale=260, azimuth_deg=-62, elevation_deg=15):
    """Parallel projection: x right, y down, px."""
    azimuth, elevation = math.radians(azimuth_deg), math.radians(elevation_deg)
    right = p[1] * math.cos(azimuth) - p[0] * math.sin(azimuth)
    nearer = p[0] * math.cos(azimuth) + p[1] * math.sin(azimuth)
    return scale * right, scale * (nearer * math.sin(elevation) - p[2] * math.cos(elevation))


def path(points, closed=False):
    return "M" + "L".join(f"{x:.1f},{y:.1f}" for x, y in map(projected, points)) + ("Z" if closed else "")


def floor_grid(cells=7, start=(-0.5, -1.5), size=0.5):
    lines = []
    for k in range(cells + 1):
        along = k * size
        lines.append(path([[start[0] + along, start[1], 0], [start[0] + along, start[1] + cells * size, 0]]))
        lines.append(path([[start[0], start[1] + along, 0], [start[0] + cells * size, start[1] + along, 0]]))
    return f'<path d="{"".join(lines)}" class="floor"/>'


def arm_lines(points, css):
    parts = [f'<path d="{path(points)}" class="{css}"/>']
    for p in points[1:]:
        x, y = projected(p)
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="12" class="{css} joint"/>')
    return "".join(parts)


def box(centre, half):
    """The visible edges of an upright block, as its outline and inner edges."""
    c = [[centre[k] + half[k] * (1 if corner >> k & 1 else -1) for k in range(3)] for corner in range(8)]
    faces = [[0, 1, 5, 4], [1, 3, 7, 5], [4, 5, 7, 6]]
    return "".join(f'<path d="{path([c[k] for k in face], True)}" class="module"/>' for face in faces)


def drawing(scene, points, factor):
    """SVG of the cell. points: (name, target in the base [m]); the first one is approached."""
    straight, bent = scene.tool(0), scene.tool(factor)
    arm = scene.arm(factor)[0]
    module = [p + d for p, d in zip(bent[-1], [0.1, 0, -0.02])]
    corners = [projected(p) for p in straight + bent + arm + [q for _, q in points] + [[0, 0, 0]]]
    left, right = min(x for x, _ in corners) - 110, max(x for x, _ in corners) + 150
    top, bottom = min(y for _, y in corners) - 50, max(y for _, y in corners) + 60
    parts = [f'<svg viewBox="{left:.0f} {top:.0f} {right - left:.0f} {bottom - top:.0f}" role="img" '
             f'aria-label="The arm at the first assembly point, deflection drawn {factor} times larger">',
             floor_grid(), box([0, 0, 0.12], [0.3, 0.3, 0.12]), arm_lines([[0, 0, 0.24]] + arm[1:], "arm"), box(module, [0.12, 0.45, 0.12]),
             f'<path d="{path(straight)}" class="taught"/>', f'<path d="{path(bent)}" class="bent"/>']
    for name, p in points:
        x, y = projected(p)
        parts.append(f'<path d="M{x - 9:.1f},{y:.1f}h18M{x:.1f},{y - 9:.1f}v18" class="target"/>')
        parts.append(f'<text x="{x + 14:.1f}" y="{y - 10:.1f}">{name}</text>')
    x, y = projected(bent[-1])
    _, y0 = projected(straight[-1])
    parts.append(f'<path d="M{x + 60:.1f},{y0:.1f}h16m-8,0V{y:.1f}m-8,0h16" class="measure"/>')
    parts.append(f'<text x="{x + 84:.1f}" y="{(y + y0) / 2 + 6:.1f}" class="strong">'
                 f'{math.dist(scene.tip_shift_mm(), [0, 0, 0]):.1f} mm</text>')
    return "".join(parts) + "</svg>"
