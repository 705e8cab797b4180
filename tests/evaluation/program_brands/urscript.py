"""URScript: programs of Universal Robots, and an interpreter that turns them into Python."""

import re

import numpy as np

from .common import Motion, Robot, Tool, from_vector, pose, shift, about, to_vector

NAME = "Universal Robots URScript"
ARM = "ur"
TOOLS = [Tool(1, shift(0, 0, 0.2)), Tool(2, pose(about(0, 0.4) @ about(2, 1.0), (0.05, -0.02, 0.15)))]

SEEDS = np.array([  # postures of the programs [rad]
    [0.2, -1.5, 1.6, -1.7, -1.5, 0.3], [0.5, -1.2, 1.5, -1.9, -1.6, 0.1],
    [0.9, -1.4, 1.9, -2.1, -1.4, -0.4], [-0.4, -1.6, 1.4, -1.2, -1.7, 0.8],
    [-0.8, -1.3, 1.7, -2.0, -1.2, 0.5], [1.3, -1.0, 1.2, -1.6, -1.8, 1.1]])


def literal(X, form="{:.12f}", turns=0):
    """p[..] of a pose; `turns` whole turns are added to its rotation vector."""
    v = to_vector(X[:3, :3])
    v = v * (1 + turns * 2 * np.pi / np.linalg.norm(v))
    return "p[" + ", ".join(re.sub(r"^(-?)0\.", r"\1.", form.format(x))
                            if form == "{:.12f}" else form.format(x)
                            for x in (*X[:3, 3], *v)) + "]"


def programs():
    robot, tool, bent = Robot(ARM), TOOLS[0].tcp, TOOLS[1].tcp
    at = [robot.flange(q) @ tool for q in SEEDS]
    bent_at = [robot.flange(q) @ bent for q in SEEDS]
    joints = ["[" + ", ".join(repr(float(x)) for x in q) + "]" for q in SEEDS]
    middle = "[" + ", ".join(repr(float(x)) for x in SEEDS.mean(axis=0)) + "]"
    tcp = "  set_tcp(p[0.0,0.0,0.2,0.0,0.0,0.0])\n"
    payload = "  set_target_payload(6.500000, [0.010000, -0.020000, 0.120000], [0.01, 0, 0, 0, 0, 0])\n"
    head = "def {}():\n" + tcp + payload
    v = "a=1.2, v=0.25"
    # Where a program is started the posture is not known: its first motion states the joints.
    start = lambda text, i=0: f"movej(get_inverse_kin({text}, qnear={joints[i]}), {v})"
    near = lambda X, distance: X @ shift(0, 0, -distance)
    plane = pose(about(2, 0.7) @ about(0, 0.1), (0.3, -0.2, 0.1))
    in_plane = [np.linalg.inv(plane) @ X for X in at]
    made = {}
    waypoints = "".join(f"  global W_{i}_p={literal(at[i])}\n  global W_{i}_q={joints[i]}\r\n"
                        for i in range(4))
    made["generated"] = head.format("generated") + waypoints + f'''  $ 1 "Robot Program"
  $ 2 "MoveJ p[1,2,3,4,5,6]"
  movej(get_inverse_kin(W_0_p, qnear=W_0_q), a=1.3962634015954636, v=1.0471975511965976)
  $ 3 "W_1" "breakAfter"
  movel(W_1_p, {v}, r=0.01)\r
  movel(W_2_p, {v})
  movej(get_inverse_kin(W_3_p, qnear=W_3_q), {v}, r=0.0)
end
'''
    made["circle"] = head.format("circle") + f'''
  {start(literal(at[0]))}
  movec(pose_via={literal(at[0] @ shift(0.05, 0.05, 0))}, pose_to={literal(at[0] @ shift(0.1, 0, 0))}, {v})
  movep({literal(at[1])}, a=1, v=0.1, r=0.02)
  movep({literal(at[2])}, a=1, v=0.1)
end
'''
    made["features"] = head.format("features") + f'''  global Plane_1={literal(plane)}
  movej(get_inverse_kin(pose_trans(Plane_1, {literal(in_plane[0])}), {joints[0]}), {v})
  movel(pose_trans(Plane_1, {literal(in_plane[1])}), {v})
  global W_p={literal(in_plane[2])}
  movel(pose_trans(Plane_1, W_p), {v})
end
'''
    made["offsets"] = head.format("offsets") + f'''  pick={literal(at[0])}
  {start('pick')}
  movel(pose_trans(pick, p[0, 0, -0.003, 0, 0, 0]), {v})
  movel(pose_add(pick, p[0,0,0.004,0,0,0]), {v})
  place={literal(at[1])}
  movel(place, {v})
  movel(pose_trans(p[0,0,0.002,0,0,0], place), {v})
end
'''
    made["tables"] = head.format("tables") + f'''  global tab=[{", ".join(literal(X) for X in at[:4])}]
  movej(get_inverse_kin(tab[3], qnear={middle}), {v})
  i = 0
  while i < length(tab):
    movej(get_inverse_kin(tab[i], qnear={middle}), {v})
    i = i + 1
  end
  movej(tab[1], a=1, v=1)
  grid=[[{literal(at[4])}], [{literal(at[5])}, {literal(at[2])}]]
  movej(grid[1][0], {v})
end
'''
    made["functions"] = f'''# pick and place
def visit(to, above=0.003, speed=0.2):
movej(get_inverse_kin(pose_trans(to, p[0,0,-0.003,0,0,0]), {middle}), a=1, v=speed)
movel(to, a=1, v=speed / 2)
if above > 1:
halt
elif above == 0.003:
sleep(0.01)
else:
return False
end
return True
end
thread blink():
  while True:
    set_digital_out(1, True)
    sync()
  end
end
def main():
{tcp}{payload}
  run blink()
  {start(literal(at[0]))}
  if visit({literal(at[1])}):
    visit(speed=0.1, to={literal(at[2])})
  end
end
main()
'''
    tools = f'''  tool_b={literal(bent)}
  set_tcp(tool_b)
  set_payload(2.0, [0, 0.01, 0.08])
'''
    made["tools"] = head.format("tools") + f'''  movej(get_inverse_kin({literal(at[0])}, {joints[0]}), {v})
  movel({literal(at[1])}, {v})
{tools}  movel({literal(bent_at[2])}, {v})
  movej({literal(bent_at[3])}, {v})
{tcp}  set_target_payload(9.1, [0, 0, 0.15])
  movel({literal(at[4])}, {v})
end
'''
    made["relative"] = head.format("relative") + f'''  global Start_p={literal(at[0])}
  global R_from_p={literal(at[1])}
  global R_to_p={literal(near(at[1], 0.05))}
  movej(get_inverse_kin(Start_p, qnear={joints[0]}), {v})
  movel(pose_add(get_target_tcp_pose(), pose_sub(R_to_p, R_from_p)), {v})
  movel(Start_p, {v})
end
'''
    made["joints"] = head.format("joints") + f'''  global Home_q={joints[5]}
  movej(Home_q, {v})
  movel({literal(at[1])}, {v})
  movej({joints[2]}, {v})
  q=get_inverse_kin({literal(at[3])}, qnear={joints[3]})
  movej(q, {v})
end
'''
    made["rotation"] = head.format("rotation") + f'''  {start(literal(at[0], turns=-1))}
  movel({literal(at[1], turns=1)}, {v})
  movel({literal(pose(about(0, np.pi - 1e-4), at[1][:3, 3]))}, {v})
end
'''
    made["written"] = head.format("written").replace("\n", "\r\n") + f'''\r
  textmsg("movel(p[1,2,3,4,5,6]) # no comment")\r
  {start(literal(at[0], "{:.6f}"))} # movel(p[1,2,3,4,5,6])
  movel({literal(at[1], "{:.8e}")}, {v}); movel({literal(at[2], "{:+.9f}")},
    {v})
end'''
    made["loops"] = head.format("loops") + f'''  t={literal(at[0])}
  {start('t')}
  n=0
  while (True):
    n=n+1
    if n == 2:
      continue
    end
    if n > 3: break end
    t={literal(at[1])}
    movej(get_inverse_kin(t, qnear={joints[1]}), {v})
    t={literal(at[2])}
    movel(t, {v})
  end
end
'''
    return {name: {name + ".script": text.encode()} for name, text in made.items()}


class Pose(list):
    """Six numbers; `written` if they are those of one p[..], `shared` if with an offset."""

    def __init__(self, numbers, written=True, shared=False):
        super().__init__(float(x) for x in numbers)
        self.written, self.shared = written, shared

    def matrix(self):
        return pose(from_vector(self[3:]), self[:3])


def of(X, *parts, offset=False):
    return Pose([*X[:3, 3], *to_vector(X[:3, :3])], all(p.written for p in parts),
                offset or any(p.shared for p in parts))


class Joints:
    def __init__(self, at, near):
        self.at, self.near = at, near


class Halt(Exception):
    pass


def execute(files):
    return [motion for name in sorted(files) for motion in run(name, files[name].decode())]


def run(name, text):
    motions, state = [], {"tool": np.eye(4), "mass": 0.0, "cog": np.zeros(3), "at": None, "line": 0}

    def move(kind, to, via=None):
        near = None
        if isinstance(to, Joints):
            to, near = to.at, to.near
        joints = None if isinstance(to, Pose) else np.array(to)
        target = Robot(ARM).flange(joints) @ state["tool"] if joints is not None else to.matrix()
        motions.append(Motion(
            kind, target, state["tool"], name, state["line"], state["mass"], state["cog"],
            via=via.matrix() if via else None, joints=joints,
            near=None if near is None else np.array(near),
            left="joints" if joints is not None else "" if to.written else "computed",
            shared=joints is None and to.shared))
        state["at"] = of(target, Pose([0] * 6, written=False))

    def trans(a, b):
        # A small pose behind a point is an offset from it, in front of it one in the base.
        small = [np.abs(p).max() < 0.01 for p in (a, b)]
        return of(a.matrix() @ b.matrix(), a, b, offset=any(small))

    def add(a, b):
        X = pose(from_vector(a[3:]) @ from_vector(b[3:]), np.add(a[:3], b[:3]))
        return of(X, a, b, offset=True)

    def sub(a, b):
        X = pose(from_vector(a[3:]) @ from_vector(b[3:]).T, np.subtract(a[:3], b[:3]))
        return of(X, Pose([0] * 6, written=False))

    def load(mass, cog, *more):
        state["mass"], state["cog"] = mass, np.array(cog, float)

    def halt():
        raise Halt

    known = {
        "P": Pose, "line": lambda n: state.__setitem__("line", n), "halt": halt,
        "movej": lambda q, *a, **k: move("joint", q), "movel": lambda pose, *a, **k: move("linear", pose),
        "movep": lambda pose, *a, **k: move("linear", pose),
        "movec": lambda pose_via, pose_to, *a, **k: move("circular", pose_to, pose_via),
        "set_tcp": lambda p: state.__setitem__("tool", p.matrix()),
        "set_target_payload": load, "set_payload": load, "pose_trans": trans, "pose_add": add,
        "pose_sub": sub, "get_target_tcp_pose": lambda: state["at"], "length": len,
        "get_inverse_kin": lambda x, qnear=None, *a: Joints(x, qnear),
        **{f: lambda *a, **k: None for f in ("textmsg", "sleep", "set_digital_out", "sync")}}
    code = python_of(text)
    try:
        exec(compile(code, name, "exec"), known)
    except Halt:
        pass
    return motions


def python_of(text):
    """The script as Python: blocks by indentation, p[..] as P([..]), all variables global but the
    parameters. The last routine that is defined at the outermost level runs, unless a call does."""
    text = re.sub(r'"[^"\n]*"', lambda m: '"' + " " * (len(m[0]) - 2) + '"', text)  # keep places
    text = re.sub(r"[#$](?=[^\"\n]*(\"[^\"\n]*\"[^\"\n]*)*$)[^\n]*", "", text, flags=re.M)
    text = text.replace("\r", "").replace("halt\n", "halt()\n")
    variables = sorted(set(re.findall(r"(?:^|;|:)\s*(?:global\s+|local\s+)?(\w+)\s*=(?!=)", text, re.M)))
    lines, indent, outer, called = [], 0, [], False

    def put(line):
        lines.append("  " * indent + line)

    statement, depth, begun = "", 0, 1
    pieces = []
    for number, line in enumerate(text.split("\n"), 1):
        for char in line + "\n":
            begun = begun if statement.strip() else number
            depth += (char in "([") - (char in ")]")
            if depth == 0 and char in ";\n":
                pieces.append((begun, statement.strip()))
                statement = ""
            elif depth == 0 and char == ":":
                pieces.append((begun, statement.strip() + ":"))
                statement = ""
            else:
                statement += " " if char == "\n" else char
    for number, piece in pieces:
        ends = 0
        while re.search(r"(^|\s)end$", piece):
            piece, ends = re.sub(r"(^|\s)end$", "", piece).strip(), ends + 1
        piece = re.sub(r"^(global|local)\s+", "", piece)
        piece = re.sub(r"\bp\[((?:[^\[\]])*)\]", r"P([\1])", piece)
        if re.match(r"(def|thread)\b", piece):
            head = re.match(r"(?:def|thread)\s+(\w+)\s*\((.*)\)\s*:$", piece)
            if indent == 0:
                outer.append(head[1])
            put(f"def {head[1]}({head[2]}):")
            indent += 1
            mine = re.findall(r"(\w+)\s*(?:=[^,]*)?(?:,|$)", head[2])
            put("global " + ", ".join(v for v in variables if v not in mine) if variables else "pass")
        elif re.match(r"(elif|else)\b", piece):
            indent -= 1
            put(piece)
            indent += 1
            put("pass")
        elif piece.endswith(":"):
            put(piece)
            indent += 1
            put("pass")
        elif piece.startswith("run "):
            pass  # threads of these programs do not move
        elif piece:
            called |= indent == 0
            put(f"line({number})")
            put(piece)
        indent -= ends
    if not called and outer:
        lines.append(outer[-1] + "()")
    return "\n".join(lines)
