"""ABB RAPID: programs that use its constructs, and an interpreter of the language."""

import copy
import re

import numpy as np

from .common import Motion, Robot, Tool, from_quaternion, pose, shift, about, to_quaternion

NAME = "ABB RAPID"
ARM = "abb"
OPTIONS = {"records": ["--complete"],  # they are persistent: other tasks can use them
           "late_binding": ["--complete"]}  # other modules could be called by their name
UNUSED = "[9E9,9E+09,9E9,9E9,9E9,9E+9]"


def frame(x, y, z, turns=()):
    """A pose in mm, turned by (axis, degrees) one after the other."""
    X = shift(x / 1e3, y / 1e3, z / 1e3)
    for axis, angle in turns:
        X = X @ pose(about(axis, np.radians(angle)), (0, 0, 0))
    return X


GRIP = frame(20, -10, 180)
TORCH = frame(60, 0, 350, [(1, 35)])
TOOLS = [Tool(1, GRIP, 6.0, np.array([0.005, 0, 0.08])),
         Tool(2, TORCH, 4.5, np.array([0.02, 0, 0.15]))]
TABLE = frame(900, -300, 200, [(2, 30)]) @ frame(15, 5, 40, [(0, 5)])
BASES = {"wobj0": np.eye(4), "wTable": TABLE}
TIPS = {"tGrip": GRIP, "tTorch": TORCH}

DATA = """\
  PERS tooldata tGrip:=[TRUE,[[20,-10,180],[1,0,0,0]],[6,[5,0,80],[1,0,0,0],0,0,0]];
  PERS tooldata tTorch:=[TRUE,[[60,0,350],[0.953716951,0,0.3007058,0]],[4.5,[20,0,150],[1,0,0,0],0,0,0]];
  PERS tooldata tFixed:=[FALSE,[[900,0,700],[1,0,0,0]],[6,[5,0,80],[1,0,0,0],0,0,0]];
  PERS wobjdata wTable:=[FALSE,TRUE,"",[[900,-300,200],[0.965925826,0,0,0.258819045]],\
[[15,5,40],[0.999048222,0.043619387,0,0]]];
  PERS wobjdata wTurn:=[FALSE,FALSE,"STN1",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PERS loaddata lPart:=[8,[10,0,60],[1,0,0,0],0,0,0];
"""


def sides(robot, q):
    """Wrist centre in front of axis 1 and of the lower arm [m], and axis 5 [rad]."""
    _, points, after = robot.arm.frames(robot.axes @ np.asarray(q, float))
    X = pose(*after[-1])
    wrist = X[:3, 3] - X[:3, 2] * robot.cell["robot"]["joint"][5]["d_mm"] / 1e3
    forward = np.array([np.cos(q[0]), np.sin(q[0]), 0])
    flat = lambda p: np.array([forward @ p, p[2]])
    arm, reach = flat(points[2]) - flat(points[1]), flat(wrist) - flat(points[1])
    return flat(wrist)[0], (arm[1] * reach[0] - arm[0] * reach[1]) / np.hypot(*arm), q[4]


def confdata(robot, q):
    """[cf1, cf4, cf6, cfx] of readings q."""
    front, lower, fifth = sides(robot, q)
    return [int(np.floor(q[i] / (np.pi / 2))) for i in (0, 3, 5)] + [
        4 * (front < 0) + 2 * (lower < 0) + (fifth < 0)]


class Writer:
    """Literals of points that the arm reaches in the joints (degrees) that are given."""

    def __init__(self):
        self.robot = Robot(ARM)

    def point(self, joints, tool="tGrip", base="wobj0", decimals=2, external=UNUSED):
        q = np.radians(joints)
        X = np.linalg.inv(BASES[base]) @ self.robot.flange(q) @ TIPS[tool]
        p = ",".join(f"{v * 1e3:.{decimals}f}" for v in X[:3, 3])
        r = ",".join(f"{v:.7g}" for v in to_quaternion(X[:3, :3]))
        return f"[[{p}],[{r}],{confdata(self.robot, q)},{external}]".replace(", ", ",")

    def row(self, count, start=(5, 25, 5, 10, 45, -20), step=(6, 1, -1, 2, -2, 5), **where):
        return [self.point(np.array(start) + i * np.array(step, float), **where)
                for i in range(count)]


def module(body, name="Cell", data=DATA):
    return f"MODULE {name}\n{data}{body}ENDMODULE\n"


def const(points, name="p", kind="CONST"):
    return "".join(f"  {kind} robtarget {name}{i + 1}0:={p};\n" for i, p in enumerate(points))


def programs():
    w = Writer()
    made = {}

    def add(name, text, crlf=False, more=None):
        files = {"main.mod": text, **(more or {})}
        made[name] = {file: (t.replace("\n", "\r\n") if crlf else t).encode("latin-1")
                      for file, t in files.items()}

    header = "%%%\n  VERSION:1\n  LANGUAGE:ENGLISH\n%%%\n\n"
    add("moves", header + module(
        const(w.row(4, base="wTable")) + "  PROC main()\n    MoveJ p10,v1000,z50,tGrip\\WObj:=wTable;\n"
        "    MoveL p20,v200,fine,tGrip\\WObj:=wTable;\n    movel p30 , v200\\T:=2 , z1,tGrip \\WObj:=wTable ;\n"
        "    MoveJ p40,v1000,fine\\Inpos:=inpos50,tGrip\\WObj:=wTable;\n  ENDPROC\n",
        name="Cell(SYSMODULE,NOSTEPIN)"), crlf=True)
    c = w.row(4)
    add("circles", module(
        const(c) + "  PROC main()\n    MoveJ p10,v500,fine,tGrip;\n    MoveC p20,p30,v100,z10,tGrip;\n"
        f"    MoveC {w.point([20, 27.6, 2.5, 15, 40, -7.5])},p40,v100,fine,tGrip;\n  ENDPROC\n"))
    add("payload", module(
        const(w.row(4)) + "  PROC main()\n    GripLoad load0;\n    MoveJ p10,v500,z10,tGrip;\n"
        "    MoveL p20,v100,fine,tGrip;\n    Set doGrip;\n    WaitTime 0.5;\n    GripLoad lPart;\n"
        "    MoveL p30,v100,z10,tGrip;\n    MoveL p40,v100,fine,tGrip;\n    Reset doGrip;\n    GripLoad load0;\n"
        "  ENDPROC\n"), crlf=True)
    r = w.row(6)
    add("records", module(
        "  RECORD job\n    num id;\n    robtarget pick;\n    robtarget place;\n  ENDRECORD\n"
        f"  CONST robtarget pRow{{3}}:=[{r[0]},\n    {r[1]},\n    {r[2]}];\n"
        f"  PERS job jobs{{1}}:=[[7,{r[3]},{r[4]}]];\n  LOCAL PERS robtarget pHome:={r[5]};\n"
        "  PROC main()\n    FOR i FROM 1 TO Dim(pRow,1) DO\n      MoveL pRow{i},v100,z5,tGrip;\n    ENDFOR\n"
        "    MoveJ jobs{1}.pick,v100,fine,tGrip;\n    MoveJ jobs{1}.place,v100,fine,tGrip;\n"
        "    MoveJ pHome,v100,fine,tGrip;\n  ENDPROC\n"))
    r, s = w.row(3, base="wTable"), w.row(2, tool="tTorch")
    add("parameters", module(
        const(r) + const(s, "s") +
        "  PROC main()\n    Go p10,v100,tGrip\\WObj:=wTable;\n    Go p20,v50,tGrip\\WObj:=wTable;\n"
        "    Go s10,v50,tTorch;\n    Twice p30,s20;\n  ENDPROC\n"
        "  PROC Go(robtarget p,speeddata v,PERS tooldata t\\PERS wobjdata WObj)\n"
        "    MoveL p,v,fine,t\\WObj?WObj;\n  ENDPROC\n"
        "  LOCAL PROC Twice(robtarget a,robtarget b)\n    Go a,v10,tGrip\\WObj:=wTable;\n"
        "    Go b,v10,tTorch;\n  ENDPROC\n"))
    r = w.row(3)
    add("literals", module(
        "  ! Gr\xfc\xdfe: [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]\n"
        "  CONST string text:=\"! \"\"[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]\";\n"
        f"  PROC main()\n    MoveJ {r[0]},v100,z10,tGrip;  ! \xe4\n    MoveL\n      {r[1]}\n      ,v100,fine,tGrip;"
        f" MoveL {r[2].replace(',', ' , ')},v100,fine,tGrip;\n  ENDPROC\n").rstrip("\n"))
    r = w.row(6, tool="tTorch", base="wTable")
    add("processes", module(
        const(r) + "  PROC main()\n    MoveJDO p10,v500,z10,tTorch\\WObj:=wTable,doGas,1;\n"
        "    ArcLStart p20,v100,seam1,weld1,fine,tTorch\\WObj:=wTable\\SeamName:=\"a;b\";\n"
        "    ArcL p30,v100,seam1,weld1\\Weave:=weave1,z1,tTorch\\WObj:=wTable;\n"
        "    ArcCEnd p40,p50,v100,seam1,weld1,fine,tTorch\\WObj:=wTable;\n"
        "    TriggL p60,v200,trigg1,z10,tTorch\\WObj:=wTable;\n  ENDPROC\n"), crlf=True)
    r = w.row(3)
    add("offsets", module(
        const(r) + "  CONST num up:=5;\n  PROC main()\n    MoveJ Offs(p10,0,0,up),v500,z10,tGrip;\n"
        "    MoveL p10,v100,fine,tGrip;\n    MoveL Offs(p20,-up/2,5,up*2),v500,fine,tGrip;\n"
        "    MoveL RelTool(p30,0,0,-(up+5)\\Rz:=10),v100,fine,tGrip;\n  ENDPROC\n"))
    r = w.row(6)
    add("control", module(
        const(r) + "  VAR num n:=0;\n  VAR intnum i1;\n  PROC main()\n    CONNECT i1 WITH tStop;\n"
        "    MoveJ p10,v100,fine,tGrip;\n    again:\n    n:=n+1;\n    IF n<2 AND NOT (n>5 OR n=7) THEN\n"
        "      MoveL p20,v100,fine,tGrip;\n    ELSEIF n=2 THEN\n      MoveL p30,v100,fine,tGrip;\n    ELSE\n"
        "      MoveL p40,v100,fine,tGrip;\n    ENDIF\n    IF n<3 GOTO again;\n    TEST n\n    CASE 1,2:\n"
        "      MoveL p10,v100,fine,tGrip;\n    CASE 3:\n      MoveL p50,v100,fine,tGrip;\n    DEFAULT:\n"
        "      Stop;\n    ENDTEST\n    WHILE n>0 DO\n      n:=n-2;\n      IF n>0 MoveL p60,v100,fine,tGrip;\n"
        "    ENDWHILE\n  ERROR\n    IF ERRNO=ERR_PATH_STOP RETRY;\n    RAISE;\n  ENDPROC\n"
        "  TRAP tStop\n    TPWrite \"stop\";\n    RETURN;\n  ENDTRAP\n"))
    r = w.row(5)
    add("displacements", module(
        const(r) + "  CONST pose lifted:=[[0,0,10],[1,0,0,0]];\n  PROC main()\n"
        "    MoveJ p10,v100,fine,tGrip;\n    PDispSet lifted;\n    MoveL p20,v100,fine,tGrip; ! left: displaced\n"
        "    PDispOff;\n    MoveL p30,v100,fine,tGrip;\n    PDispOn\\ExeP:=p40,p50,tGrip;\n    PDispOff;\n"
        "    MoveL p40,v100,fine,tGrip; ! left: a displacement is measured from it\n  ENDPROC\n"))
    r = w.row(7)
    add("run_time", module(
        const(r[:5]) + f"  VAR robtarget pVar:={r[5]}; ! left: assigned\n"
        f"  VAR robtarget pFound:={r[6]}; ! left: assigned\n"
        "  PROC main()\n    VAR robtarget pGoal;\n    pGoal:=p10;\n    MoveJ pGoal,v100,fine,tGrip;\n"
        "    MoveL Choose(2),v100,fine,tGrip;\n    MoveL Choose(1),v100,fine,tGrip;\n"
        "    pVar.trans.z:=pVar.trans.z+5;\n    MoveL pVar,v100,fine,tGrip;\n"
        "    SearchL\\Stop,diHit,pFound,p40,v20,tGrip; ! left: a search\n"
        "    IF p50.trans.z>5000 Stop;\n    MoveL p50,v100,fine,tGrip; ! left: read\n  ENDPROC\n"
        "  FUNC robtarget Choose(num which)\n    IF which=1 RETURN p20;\n    RETURN p30;\n  ENDFUNC\n"))
    joints = [[10, 20, 10, -100, 40, 95], [-100, 20, 10, 80, -40, -95], [170, -60, -20, 20, 50, 10],
              [20, 45, -130, 10, 60, 30], [10, 30, 5, 10, 40, 20]]
    p = [w.point(j) for j in joints]
    add("postures", module(
        const(p) + "  PROC main()\n    MoveAbsJ [[10,20,10,-100,40,95],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,"
        "v100,fine,tGrip; ! left: joints\n" +
        "".join(f"    MoveJ p{i}0,v100,fine,tGrip;\n" for i in (1, 2, 3, 4)) +
        "    ConfJ\\Off;\n    ConfL\\Off;\n    MoveJ p50,v100,fine,tGrip;\n  ENDPROC\n"))
    r = w.row(4)
    add("modules", module(
        "  LOCAL CONST robtarget p10:=" + r[0] + ";\n  PROC main()\n    MoveJ p10,v100,fine,tGrip;\n"
        "    Path2;\n    MoveL pShared,v100,fine,tGrip;\n  ENDPROC\n"),
        more={"points.sys": module("  TASK PERS robtarget pShared:=" + r[1] + ";\n  LOCAL CONST robtarget p10:=" +
                                   r[2] + ";\n  PROC Path2()\n    MoveL p10,v100,fine,tGrip;\n  ENDPROC\n",
                                   "Points", ""),
              "cell.pgf": "<?xml version=\"1.0\" encoding=\"ISO-8859-1\" ?>\n<Program>\n  <Module>main.mod</Module>\n"
                          "  <Module>points.sys</Module>\n</Program>\n"})
    r = w.row(3)
    add("late_binding", module(
        const(r) + "  VAR num n:=1;\n  PROC main()\n    WHILE n<=2 DO\n      %\"part\"+ValToStr(n)%;\n"
        "      n:=n+1;\n    ENDWHILE\n    MoveJ p30,v100,fine,tGrip;\n  ENDPROC\n"
        "  PROC part1()\n    MoveJ p10,v100,fine,tGrip;\n  ENDPROC\n"
        "  PROC part2()\n    MoveJ p20,v100,fine,tGrip;\n  ENDPROC\n"), crlf=True)
    r = w.row(3)
    add("stationary", module(
        const(r) + "  PROC main()\n    MoveJ p10,v100,fine,tGrip;\n"
        "    MoveL p20,v100,fine,tFixed; ! left: stationary tool\n"
        "    MoveL p30,v100,fine,tGrip\\WObj:=wTurn; ! left: moved by a mechanical unit\n  ENDPROC\n"))
    return made


TOKEN = re.compile(r"""(?P<blank>\s+|![^\r\n]*|%%%.*?%%%)|(?P<text>"(?:[^"\r\n]|"")*")|
(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<word>[A-Za-z_\x80-\xff][\w\x80-\xff]*)|
(?P<sign>:=|<>|<=|>=|.)""", re.X | re.S)


def tokens_of(file, data):
    """(kind, text in lower case if a word, begin, end, line) of a module."""
    source, found, at, line = data.decode("latin-1"), [], 0, 1
    while at < len(source):
        match = TOKEN.match(source, at)
        kind, text = match.lastgroup, match.group()
        if kind != "blank":
            found.append((kind, text.lower() if kind == "word" else text, at, match.end(), line, file))
        line += text.count("\n")
        at = match.end()
    return found


class Literal(list):
    """An aggregate, with the file and line at which it is written; None once it is changed."""
    place = None


class Jump(Exception):
    pass


class Return(Exception):
    def __init__(self, value=None):
        self.value = value


RECORDS = {"robtarget": ["trans", "rot", "robconf", "extax"], "pos": ["x", "y", "z"],
           "pose": ["trans", "rot"], "robtarget.trans": ["x", "y", "z"]}
PARTS = {("robtarget", "trans"): "pos"}
ENDS = {"if": "endif", "for": "endfor", "while": "endwhile", "test": "endtest"}


class Interpreter:
    """Runs main() once; signals are 0 and unknown names are their own text."""

    def __init__(self, files):
        self.motions, self.routines, self.records = [], {}, dict(RECORDS)
        self.types, self.modules = dict(PARTS), []
        self.lines = {name: data.decode("latin-1").splitlines() for name, data in files.items()}
        self.displaced, self.load, self.free = False, (0.0, np.zeros(3)), False
        self.robot = Robot(ARM)
        self.everywhere = {"load0": [0.0, [0, 0, 0]], "true": True, "false": False,
                           "tool0": [True, [[0, 0, 0], [1, 0, 0, 0]], [0, [0, 0, 0]]],
                           "wobj0": [False, True, "", [[0, 0, 0], [1, 0, 0, 0]],
                                     [[0, 0, 0], [1, 0, 0, 0]]]}
        for name, data in files.items():
            if not name.endswith(".pgf"):
                self.read(tokens_of(name, data))

    # Declarations.

    def read(self, t):
        scope, local, i = {}, False, 0
        while i < len(t):
            word = t[i][1] if t[i][0] == "word" else ""
            if word in ("const", "pers", "var"):
                name, value, i = self.declared(t, i, [scope, self.everywhere])
                (scope if local else self.everywhere)[name] = value
            elif word == "record":
                end = next(k for k in range(i, len(t)) if t[k][1] == "endrecord")
                fields = [(t[k][1], t[k + 1][1]) for k in range(i + 2, end, 3)]
                self.records[t[i + 1][1]] = [field for _, field in fields]
                self.types.update({(t[i + 1][1], field): kind for kind, field in fields})
                i = end + 1
            elif word in ("proc", "func", "trap"):
                end = next(k for k in range(i, len(t)) if t[k][1] == "end" + word)
                i += word == "func"
                name, i, parameters = t[i + 1][1], i + 2, []
                if t[i][1] == "(":
                    close = self.close(t, i)
                    parameters = self.parameters(t[i + 1:close])
                    i = close + 1
                self.routines[name] = (parameters, t[i:end], scope)
                i = end + 1
            else:
                i += 1
            local = word == "local"

    @staticmethod
    def close(t, i):
        depth = 0
        for k in range(i, len(t)):
            depth += t[k][0] == "sign" and t[k][1] in "([{"
            depth -= t[k][0] == "sign" and t[k][1] in ")]}"
            if not depth:
                return k
        raise SyntaxError("bracket")

    @staticmethod
    def parameters(t):
        """[(name, optional)]"""
        found, words, optional = [], [], False
        for kind, text, *_ in t + [("sign", ",")]:
            if kind == "word":
                words.append(text)
            elif text in ",\\|":
                if words:
                    found.append((words[-1], optional))
                words, optional = [], text == "\\" or (optional and text == "|")
        return found

    def declared(self, t, i, scopes):
        kind, name, i, value = t[i + 1][1], t[i + 2][1], i + 3, None
        if t[i][1] == "{":
            i = self.close(t, i) + 1
        if t[i][1] == ":=":
            value, i = self.expression(t, i + 1, scopes)
        return name, [kind, value], i + 1

    # Expressions: (value, next token).

    LEVELS = [("or", "xor"), ("and",), ("=", "<>", "<", ">", "<=", ">="), ("+", "-"),
              ("*", "/", "div", "mod")]
    ACTIONS = {"or": lambda a, b: a or b, "xor": lambda a, b: a != b, "and": lambda a, b: a and b,
               "=": lambda a, b: a == b, "<>": lambda a, b: a != b, "<": lambda a, b: a < b,
               ">": lambda a, b: a > b, "<=": lambda a, b: a <= b, ">=": lambda a, b: a >= b,
               "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b,
               "/": lambda a, b: a / b, "div": lambda a, b: a // b, "mod": lambda a, b: a % b}

    def expression(self, t, i, scopes, level=0):
        if level == len(self.LEVELS):
            return self.operand(t, i, scopes)
        value, i = self.expression(t, i, scopes, level + 1)
        while i < len(t) and t[i][0] != "text" and t[i][1] in self.LEVELS[level]:
            action = self.ACTIONS[t[i][1]]
            other, i = self.expression(t, i + 1, scopes, level + 1)
            value = action(value, other)
        return value, i

    def operand(self, t, i, scopes):
        kind, text, _, _, line, file = t[i]
        if text in ("-", "+"):
            value, i = self.operand(t, i + 1, scopes)
            return (-value if text == "-" else value), i
        if text == "not":
            value, i = self.operand(t, i + 1, scopes)
            return not value, i
        if kind == "number":
            return float(text), i + 1
        if kind == "text":
            return text[1:-1].replace('""', '"'), i + 1
        if text == "(":
            value, i = self.expression(t, i + 1, scopes)
            return value, i + 1
        if text == "[":
            value, i = Literal(), i + 1
            value.place = (file, line)
            while True:
                part, i = self.expression(t, i, scopes)
                value.append(part)
                if t[i][1] == "]":
                    return value, i + 1
                i += 1
        if i + 1 < len(t) and t[i + 1][1] == "(":
            close = self.close(t, i + 1)
            return self.function(text, self.arguments(t[i + 2:close], scopes), scopes), close + 1
        holder, key, i = self.designated(t, i, scopes)
        return (holder[key] if holder is not None else text), i

    def designated(self, t, i, scopes):
        """(container, key, next token) of a name with its indices and fields."""
        name, i = t[i][1], i + 1
        holder = next((s for s in scopes if name in s), None)
        if holder is None:
            while i < len(t) and t[i][1] in (".", "{"):
                i = i + 2 if t[i][1] == "." else self.close(t, i) + 1
            return None, name, i
        entry, key, kind = holder[name], 1, None
        if not (isinstance(entry, list) and len(entry) == 2 and isinstance(entry[0], str)):
            return holder, name, i  # a constant of the language
        kind = entry[0]
        while i < len(t) and t[i][1] in (".", "{"):
            entry = entry[key]
            if t[i][1] == ".":
                key = self.records[kind].index(t[i + 1][1])
                kind, i = self.types.get((kind, t[i + 1][1])), i + 2
            else:
                index, i = self.expression(t, i + 1, scopes)
                key, i = int(index) - 1, i + 1
        return entry, key, i

    def arguments(self, t, scopes):
        """([required values], {optional: value}); an optional one that is passed on may lack."""
        required, optional, i = [], {}, 0
        while i < len(t):
            if t[i][1] == ",":
                i += 1
            elif t[i][1] == "\\":
                name, sign, i = t[i + 1][1], t[i + 2][1] if i + 2 < len(t) else "", i + 2
                if sign == "?":
                    if any(t[i + 1][1] in s for s in scopes):
                        optional[name] = self.operand(t, i + 1, scopes)[0]
                    i += 2
                elif sign == ":=":
                    optional[name], i = self.expression(t, i + 1, scopes)
                else:
                    optional[name] = True
            else:
                value, i = self.expression(t, i, scopes)
                required.append(value)
        return required, optional

    def function(self, name, arguments, scopes):
        required, optional = arguments
        if name in self.routines:
            return self.call(name, required, optional)
        if name in ("offs", "reltool"):
            moved = copy.deepcopy(required[0])
            X = self.pose_of(moved[:2])
            D = shift(*np.array(required[1:4]) / 1e3)
            for axis, key in enumerate(("rx", "ry", "rz")):
                D[:3, :3] = D[:3, :3] @ about(axis, np.radians(optional.get(key, 0)))
            X = X @ D if name == "reltool" else D @ X
            moved[0] = list(X[:3, 3] * 1e3)
            moved[1] = list(to_quaternion(X[:3, :3]))
            return moved
        if name == "valtostr":
            return f"{required[0]:g}"
        if name == "dim":
            return len(required[0])
        return 0.0

    @staticmethod
    def pose_of(value):
        return pose(from_quaternion(value[1]), np.array(value[0]) / 1e3)

    # Statements.

    def call(self, name, required, optional):
        parameters, body, scope = self.routines[name]
        mine, required = {}, list(required)
        for parameter, is_optional in parameters:
            if not is_optional:
                mine[parameter] = ["", required.pop(0)]
            elif parameter in optional:
                mine[parameter] = ["", optional[parameter]]
        try:
            self.run(body, [mine, scope, self.everywhere])
        except Return as result:
            return result.value
        return None

    def run(self, t, scopes):
        """One routine or block; handlers of errors are never entered."""
        labels = {t[k][1]: k for k in range(len(t) - 1) if t[k][0] == "word" and t[k + 1][1] == ":"
                  and (k == 0 or t[k - 1][1] != "default")}
        i = 0
        while i < len(t):
            try:
                if t[i][1] in ("error", "undo", "backward"):
                    return
                i = self.statement(t, i, scopes)
            except Jump as jump:
                if jump.args[0] not in labels:
                    raise
                i = labels[jump.args[0]]

    def end_of(self, t, i):
        return next(k for k in range(i, len(t)) if t[k][:2] == ("sign", ";"))

    def block(self, t, i):
        """The token of the END that closes the block at i."""
        depth, k = 0, i
        while k < len(t):
            word = t[k][1] if t[k][0] == "word" else ""
            if word == "if":
                depth += self.has_then(t, k)
            elif word in ENDS:
                depth += 1
            elif word in ENDS.values():
                depth -= 1
                if not depth:
                    return k
            k += 1
        raise SyntaxError("block")

    @staticmethod
    def has_then(t, k):
        for kind, text, *_ in t[k:]:
            if kind == "word" and text == "then":
                return True
            if text == ";":
                return False
        return False

    def alternatives(self, t, i, end, words):
        """The tokens at depth 0 of a block at which an alternative starts."""
        found, k = [], i
        while k < end:
            word = t[k][1] if t[k][0] == "word" else ""
            if k > i and (word in ENDS and (word != "if" or self.has_then(t, k))):
                k = self.block(t, k)
            elif word in words:
                found.append(k)
            k += 1
        return found + [end]

    def statement(self, t, i, scopes):
        kind, word = t[i][0], t[i][1]
        if word == ";":
            return i + 1
        if word in ("var", "pers", "const"):
            name, value, after = self.declared(t, i, scopes)
            scopes[0][name] = value
            return after
        if word == "if" and not self.has_then(t, i):
            value, after = self.expression(t, i + 1, scopes)
            return self.statement(t, after, scopes) if value is True else self.end_of(t, after) + 1
        if word == "if":
            end = self.block(t, i)
            starts = self.alternatives(t, i, end, ("if", "elseif", "else"))
            for start, stop in zip(starts, starts[1:]):
                value, after = (True, start + 1) if t[start][1] == "else" else (
                    self.expression(t, start + 1, scopes))
                if value is True:
                    self.run(t[after + (t[start][1] != "else"):stop], scopes)
                    break
            return end + 1
        if word == "while":
            end = self.block(t, i)
            while True:
                value, after = self.expression(t, i + 1, scopes)
                if value is not True:
                    return end + 1
                self.run(t[after + 1:end], scopes)
        if word == "for":
            end = self.block(t, i)
            first, after = self.expression(t, i + 3, scopes)
            last, after = self.expression(t, after + 1, scopes)
            for n in range(int(first), int(last) + 1):
                self.run(t[after + 1:end], [{t[i + 1][1]: ["num", float(n)]}] + scopes)
            return end + 1
        if word == "test":
            end = self.block(t, i)
            value, _ = self.expression(t, i + 1, scopes)
            starts = self.alternatives(t, i, end, ("case", "default"))
            for start, stop in zip(starts, starts[1:]):
                values, after = [], start + 1
                while t[after][1] != ":":
                    one, after = self.expression(t, after + (t[after][1] == ","), scopes)
                    values.append(one)
                if t[start][1] == "default" or value in values:
                    self.run(t[after + 1:stop], scopes)
                    break
            return end + 1
        if kind == "word" and t[i + 1][1] == ":":
            return i + 2
        end = self.end_of(t, i)
        if word == "goto":
            raise Jump(t[i + 1][1])
        if word == "return":
            raise Return(self.expression(t, i + 1, scopes)[0] if end > i + 1 else None)
        if word == "%":
            name, after = self.expression(t, i + 1, scopes)
            self.call(name.lower(), *self.arguments(t[after + 1:end], scopes))
        elif word != "connect":
            self.simple(t[i:end], scopes)
        return end + 1

    def simple(self, t, scopes):
        holder, key, after = self.designated(t, 0, scopes)
        if after < len(t) and t[after][1] == ":=":
            value = copy.deepcopy(self.expression(t, after + 1, scopes)[0])
            holder[key] = value
            if isinstance(holder, Literal):
                holder.place = None
            return
        name = t[0][1]
        required, optional = self.arguments(t[1:], scopes)
        if name in self.routines:
            self.call(name, required, optional)
        elif name == "gripload":
            self.load = (required[0][0], np.array(required[0][1]) / 1e3)
        elif name.startswith("pdisp"):
            self.displaced = name != "pdispoff"
        elif name in ("confj", "confl"):
            self.free = "off" in optional
        else:
            self.move(name, required, optional, t[0])

    KINDS = {"movej": "joint", "movel": "linear", "movec": "circular", "moveabsj": "joint",
             "movejdo": "joint", "arclstart": "linear", "arcl": "linear", "arccend": "circular",
             "triggl": "linear", "searchl": "linear"}

    def move(self, name, required, optional, token):
        if name not in self.KINDS:
            return
        kind = self.KINDS[name]
        targets = [r for r in required if isinstance(r, list) and len(r) in (2, 4) and
                   isinstance(r[0], list)]
        tool = next(r for r in required if isinstance(r, list) and isinstance(r[0], bool))
        wobj = optional.get("wobj", self.everywhere["wobj0"])
        wobj = wobj if isinstance(wobj[0], bool) else wobj[1]
        X_BW = self.pose_of(wobj[3]) @ self.pose_of(wobj[4])
        X_FT = self.pose_of(tool[1])
        end = targets[-1]
        file, line = getattr(end, "place", None) or (token[5], token[4])
        remarks = [self.lines[file][line - 1], self.lines[token[5]][token[4] - 1]]
        left = next((r.split("! left: ")[1] for r in remarks if "! left: " in r), "")
        if self.displaced and not left:
            left = "displaced"
        mass, cog = self.load
        motion = Motion(kind, None, X_FT, file, line, mass,
                        X_FT[:3, :3] @ cog + X_FT[:3, 3] if mass else np.zeros(3), tool[2][0],
                        np.array(tool[2][1], float) / 1e3, left=left, instruction=token[4])
        if name == "moveabsj":
            motion.joints = np.radians(end[0])
            motion.target = self.robot.flange(motion.joints) @ X_FT
        else:
            motion.target = X_BW @ self.pose_of(end[:2])
            if kind == "circular":
                motion.via = X_BW @ self.pose_of(targets[-2][:2])
            stated = [int(v) for v in end[2]]
            if not self.free:
                motion.agrees = lambda q: self.agrees(stated, q)
        self.motions.append(motion)

    def agrees(self, stated, q):
        near = 2e-3
        quarter = lambda value, number: (number * np.pi / 2 - near < value
                                         < (number + 1) * np.pi / 2 + near)
        if not all(quarter(q[i], n) for i, n in zip((0, 3, 5), stated)):
            return False
        return all(abs(value) < near or (value < 0) == bool(stated[3] & bit)
                   for value, bit in zip(sides(self.robot, q), (4, 2, 1)))


def execute(files):
    """The motions of main(), from {file name: bytes}."""
    interpreter = Interpreter(files)
    try:
        interpreter.call("main", [], {})
    except Jump as jump:
        raise SyntaxError(f"no label {jump}") from None
    return interpreter.motions


def numbers(files):
    """{file name: [(begin, end)]} of the numbers of position, orientation and posture."""
    found = {}
    for name, data in files.items():
        t, spans = tokens_of(name, data), []
        for i in range(len(t)):
            if t[i][1] != "[" or i + 1 == len(t) or t[i + 1][1] != "[":
                continue
            close = Interpreter.close(t, i)
            groups, k = [], i + 1
            while k < close and t[k][1] == "[":
                end = Interpreter.close(t, k)
                groups.append([(t[m - 1][2] if t[m - 1][1] in "+-" else t[m][2], t[m][3])
                               for m in range(k, end) if t[m][0] == "number"])
                k = end + 2
            if [len(g) for g in groups] == [3, 4, 4, 6]:
                spans += groups[0] + groups[1] + groups[2]
        found[name] = spans
    return found
