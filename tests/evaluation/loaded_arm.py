"""The loaded arm of the exchange formats once more, in NumPy: truth for evaluations that need cells
of their own. Shares nothing with the product; units are SI."""

import numpy as np

G = 9.80665


class Arm:
    """A serial arm with masses and compliances, a square-tube or rigid tool, coupling and pedestal.

    `joints` are dictionaries: a, alpha, d, offset, mass, com (in the frame after the joint),
    compliance, low, high. `tool`: length and, unless it is rigid, EI and weight per length.
    """

    def __init__(self, joints, convention, tool, gravity, root=0.0, pedestal=0.0):
        self.joints, self.convention, self.tool = joints, convention, tool
        self.gravity = np.asarray(gravity, float)
        self.root, self.pedestal = root, pedestal

    def frames(self, q):
        """Axis and a point of it for each joint, and the frame after each joint."""
        R, p = np.eye(3), np.zeros(3)
        axes, points, after = [], [], []
        for joint, angle in zip(self.joints, q + np.array([j["offset"] for j in self.joints])):
            ca, sa = np.cos(joint["alpha"]), np.sin(joint["alpha"])
            c, s = np.cos(angle), np.sin(angle)
            about_z = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
            about_x = np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]])
            if self.convention == "dh":
                axes.append(R[:, 2]), points.append(p)
                p = p + R @ about_z @ np.array([joint["a"], 0, joint["d"]])
                R = R @ about_z @ about_x
            else:
                p = p + R @ (np.array([joint["a"], 0, 0]) + about_x @ np.array([0, 0, joint["d"]]))
                R = R @ about_x @ about_z
                axes.append(R[:, 2]), points.append(p)
            after.append((R, p))
        return axes, points, after

    def weights(self, after, payload, cog):
        """(mass, place) of everything that hangs on the arm, with the index of its link."""
        found = [(i, j["mass"], after[i][0] @ j["com"] + after[i][1])
                 for i, j in enumerate(self.joints) if j["mass"] > 0]
        R, p = after[-1]
        last = len(self.joints) - 1
        body = self.tool.get("weight", 0.0) * self.tool["length"]
        if body > 0:
            found.append((last, body, p + R @ np.array([0, 0, self.tool["length"] / 2])))
        if payload > 0:
            found.append((last, payload, p + R @ cog))
        return found

    def torques(self, q, payload, cog):
        axes, points, after = self.frames(q)
        weights = self.weights(after, payload, cog)
        return np.array([sum(axes[i] @ np.cross(place - points[i], mass * self.gravity)
                             for link, mass, place in weights if link >= i)
                         for i in range(len(self.joints))])

    def tip(self, q, payload, cog):
        """The loaded tip, for joints commanded to q."""
        compliance = np.array([j["compliance"] for j in self.joints])
        sag = np.zeros(len(q))
        for _ in range(60):
            new = compliance * self.torques(q + sag, payload, cog)
            if np.abs(new - sag).max() < 1e-13:
                break
            sag = new
        _, _, after = self.frames(q + sag)
        R, p = after[-1]
        g = R.T @ self.gravity
        length = self.tool["length"]
        bend = np.zeros(3)
        if "EI" in self.tool:
            force, EI = payload * g, self.tool["EI"]
            moment = np.cross(cog - np.array([0, 0, length]), force)
            w = self.tool["weight"] * g
            bend[0] = (force[0] * length**3 / 3 + moment[1] * length**2 / 2 + w[0] * length**4 / 8) / EI
            bend[1] = (force[1] * length**3 / 3 - moment[0] * length**2 / 2 + w[1] * length**4 / 8) / EI
        body = self.tool.get("weight", 0.0) * length
        root = np.cross(cog, payload * g) + np.cross([0, 0, length / 2], body * g)
        root[2] = 0
        bend = bend + np.cross(self.root * root, [0, 0, length])
        tip = p + R @ (np.array([0, 0, length]) + bend)
        moment = sum(np.cross(place, mass * self.gravity)
                     for _, mass, place in self.weights(after, payload, cog))
        return tip + np.cross(self.pedestal * moment, tip)


def cell_text(arm, name, cog, declared):
    """The arm as a cell.toml that declares only what `declared` names: per joint the sets
    `compliance` and `mass`, and whether the payload's centre is told."""
    mm, deg = 1e3, 180 / np.pi
    lines = ["schema = 1", "[robot]", f'name = "{name}"', f'convention = "{arm.convention}"',
             f"gravity_m_s2 = {[float(x) for x in arm.gravity]}",
             "base_xyz_mm = [0.0, 0.0, 0.0]", "base_rpy_deg = [0.0, 0.0, 0.0]"]
    for i, j in enumerate(arm.joints):
        lines += ["[[robot.joint]]", f"a_mm = {j['a'] * mm!r}", f"alpha_deg = {j['alpha'] * deg!r}",
                  f"d_mm = {j['d'] * mm!r}", f"theta_offset_deg = {j['offset'] * deg!r}", "sign = 1",
                  f"min_deg = {j['low'] * deg!r}", f"max_deg = {j['high'] * deg!r}"]
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
    lines += ["[measurement]", 'kind = "position"', "sigma_mm = 0.05"]
    if "root" in declared:
        lines += ["[[effect]]", 'id = "tool_root_compliance"',
                  f'parameters = [ {{ name = "compliance", value = {declared["root"]!r}, '
                  'sd = 0.0, unit = "rad/(N m)" } ]']
    return "\n".join(lines) + "\n"
