"""The loaded arm of the exchange formats once more, in NumPy: truth for evaluations that need cells
of their own. Shares nothing with the product; units are SI."""

import numpy as np

G = 9.80665


class Arm:
    """A serial arm with masses and compliances, a square-tube or rigid tool, coupling and pedestal.

    `joints` are dictionaries: a, alpha, d, offset, mass, com (in the frame after the joint),
    compliance, low, high; of a linear axis `linear` is true and low and high are in m. `tool`: length
    and, unless it is rigid, EI and weight per length. Poses have any leading dimensions: q is
    (..., joints), payload (...) and cog (..., 3).
    """

    def __init__(self, joints, convention, tool, gravity, root=0.0, pedestal=0.0):
        self.joints, self.convention, self.tool = joints, convention, tool
        self.gravity = np.asarray(gravity, float)
        self.root, self.pedestal = root, pedestal

    def frames(self, q):
        """Axis and a point of it for each joint, and the frame after each joint."""
        R, p = np.broadcast_to(np.eye(3), (*q.shape[:-1], 3, 3)), np.zeros((*q.shape[:-1], 3))
        axes, points, after = [], [], []
        for joint, value in zip(self.joints, np.moveaxis(q, -1, 0)):
            linear = joint.get("linear", False)
            angle = joint["offset"] + (0.0 * value if linear else value)
            along = joint["d"] + (value if linear else 0.0 * value)
            c, s, zero, one = np.cos(angle), np.sin(angle), 0.0 * angle, 0.0 * angle + 1
            about_z = np.stack([np.stack(row, -1) for row in
                                ([c, -s, zero], [s, c, zero], [zero, zero, one])], -2)
            ca, sa = np.cos(joint["alpha"]), np.sin(joint["alpha"])
            about_x = np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]])
            if self.convention == "dh":
                axes.append(R[..., 2]), points.append(p)
                p = p + turned(R @ about_z, np.stack([joint["a"] * one, zero, along], -1))
                R = R @ about_z @ about_x
            else:
                p = p + turned(R, np.array([joint["a"], 0, 0])
                               + along[..., None] * (about_x @ np.array([0, 0, 1])))
                R = R @ about_x @ about_z
                axes.append(R[..., 2]), points.append(p)
            after.append((R, p))
        return axes, points, after

    def weights(self, after, payload, cog):
        """(link, mass, place) of everything that hangs on the arm."""
        found = [(i, j["mass"], turned(after[i][0], j["com"]) + after[i][1])
                 for i, j in enumerate(self.joints) if j["mass"] > 0]
        R, p = after[-1]
        last, length = len(self.joints) - 1, self.tool["length"]
        body = self.tool.get("weight", 0.0) * length
        return found + [(last, body, p + turned(R, np.array([0, 0, length / 2]))),
                        (last, payload, p + turned(R, cog))]

    def torques(self, q, payload, cog):
        """Gravity torque about each joint; of a linear axis the force along it."""
        axes, points, after = self.frames(q)
        weights = self.weights(after, payload, cog)
        of = lambda i, mass, place: scaled(mass, dot(axes[i], np.broadcast_to(
            self.gravity, place.shape) if self.joints[i].get("linear") else
            np.cross(place - points[i], self.gravity)))
        return np.stack([sum(of(i, mass, place) for link, mass, place in weights if link >= i)
                         for i in range(len(self.joints))], -1)

    def sagged(self, q, payload, cog, compliance, more=lambda torques: 0.0):
        """Joints after winding up under their torques, and by `more` of these torques."""
        sag = np.zeros(q.shape)
        for _ in range(60):
            torques = self.torques(q + sag, payload, cog)
            new = compliance * torques + more(torques)
            if np.abs(new - sag).max() < 1e-13:
                break
            sag = new
        return q + sag

    def tool_tip(self, R, payload, cog):
        """The tip of the loaded tool in the flange frame, for flanges turned by R."""
        g = turned(np.swapaxes(R, -1, -2), self.gravity)
        length = self.tool["length"]
        tip = np.zeros(g.shape)
        tip[..., 2] = length
        force = scaled(payload, g)
        if "EI" in self.tool:
            moment = np.cross(cog - np.array([0, 0, length]), force)
            w = self.tool["weight"] * g
            for axis, by in ((0, moment[..., 1]), (1, -moment[..., 0])):
                tip[..., axis] += (force[..., axis] * length**3 / 3 + by * length**2 / 2
                                   + w[..., axis] * length**4 / 8) / self.tool["EI"]
        body = self.tool.get("weight", 0.0) * length
        root = np.cross(cog, force) + np.cross([0, 0, length / 2], body * g)
        root[..., 2] = 0
        return tip + np.cross(self.root * root, [0, 0, length])

    def tip(self, q, payload, cog):
        """The loaded tip, for joints commanded to q."""
        compliance = np.array([j["compliance"] for j in self.joints])
        _, _, after = self.frames(self.sagged(q, payload, cog, compliance))
        R, p = after[-1]
        tip = p + turned(R, self.tool_tip(R, payload, cog))
        return tip + np.cross(self.pedestal * self.moment(after, payload, cog), tip)

    def moment(self, after, payload, cog):
        """Moment of all weights about the base origin."""
        return sum(scaled(mass, np.cross(place, self.gravity))
                   for _, mass, place in self.weights(after, payload, cog))


def turned(R, v):
    return np.einsum("...ij,...j->...i", R, v)


def dot(a, b):
    return np.einsum("...i,...i->...", a, b)


def scaled(factor, v):
    """A factor of each pose times what each pose has: a number or a vector."""
    factor = np.asarray(factor)
    return factor.reshape(factor.shape + (1,) * (v.ndim - factor.ndim)) * v


def cell_text(arm, name, cog, declared, measurement=("sigma_mm = 0.05",)):
    """The arm as a cell.toml that declares only what `declared` names: per joint the sets
    `compliance` and `mass`, and whether the payload's centre is told."""
    mm, deg = 1e3, 180 / np.pi
    lines = ["schema = 1", "[robot]", f'name = "{name}"', f'convention = "{arm.convention}"',
             f"gravity_m_s2 = {[float(x) for x in arm.gravity]}",
             "base_xyz_mm = [0.0, 0.0, 0.0]", "base_rpy_deg = [0.0, 0.0, 0.0]"]
    for i, j in enumerate(arm.joints):
        limits = [("min_mm", j["low"] * mm), ("max_mm", j["high"] * mm)] if j.get("linear") else [
            ("min_deg", j["low"] * deg), ("max_deg", j["high"] * deg)]
        lines += ["[[robot.joint]]", *(['type = "prismatic"'] if j.get("linear") else []),
                  f"a_mm = {j['a'] * mm!r}", f"alpha_deg = {j['alpha'] * deg!r}",
                  f"d_mm = {j['d'] * mm!r}", f"theta_offset_deg = {j['offset'] * deg!r}", "sign = 1",
                  *(f"{name} = {value!r}" for name, value in limits)]
        if i in declared["mass"]:
            lines += [f"link_mass_kg = {float(j['mass'])!r}",
                      f"link_com_mm = {[float(x) * mm for x in j['com']]}"]
        if i in declared["compliance"]:
            lines.append(f"compliance_rad_per_Nm = {float(j['compliance'])!r}")
    tool = arm.tool
    lines.append("[tool]")
    if "EI" in tool:
        lines += ['model = "euler_bernoulli"', f"length_mm = {tool['length'] * mm!r}",
                  'section = "square_tube"', f"side_mm = {tool['side'] * mm!r}",
                  f"wall_mm = {tool['wall'] * mm!r}", f"youngs_modulus_GPa = {tool['E'] / 1e9!r}",
                  "poisson_ratio = 0.3", f"density_kg_m3 = {tool['density']!r}",
                  "mount_mass_kg = 0.0"]
    else:
        lines += ['model = "rigid"', f"tcp_mm = [0.0, 0.0, {tool['length'] * mm!r}]"]
    if declared["cog"]:
        lines += ["[payload]", f"cog_mm = {[float(x) * mm for x in cog]}"]
    lines += ["[measurement]", 'kind = "position"', *measurement]
    if "root" in declared:
        lines += ["[[effect]]", 'id = "tool_root_compliance"',
                  f'parameters = [ {{ name = "compliance", value = {declared["root"]!r}, '
                  'sd = 0.0, unit = "rad/(N m)" } ]']
    return "\n".join(lines) + "\n"
