"""KUKA KRL: programs that use its constructs, and an interpreter that runs them line by line."""

import re

import numpy as np

from .common import Motion, Robot, Tool, about, from_zyx, pose, shift, to_zyx

NAME = "KUKA KRL"
ARM = "kuka"
OPTIONS = {"public_points": ["--complete"]}
TOOLS = [Tool(1, shift(0, 0, 0.25)), Tool(2, pose(about(2, 0.5) @ about(1, 0.7), (0.12, -0.03, 0.3)))]
DEG = 180 / np.pi

LOADS = [(120.0, (20.0, -10.0, 180.0)), (60.0, (80.0, 0.0, 150.0))]  # [kg], [mm] in the flange
BASES = [pose(about(2, 0.4), (1.2, -0.6, 0.7)), pose(about(2, -1.0) @ about(0, 0.1), (0.9, 0.8, 0.4))]
SEEDS = np.array([  # postures of the programs [deg]
    [10, -80, 95, 12, 40, -20], [-15, -70, 85, -25, 55, 30], [25, -95, 105, 35, 45, 15],
    [-30, -75, 80, 8, 62, -70], [5, -85, 90, -40, 38, 100], [18, -65, 75, 20, 70, -10],
    [-30, -75, 80, 8, -62, -70]]) / DEG  # the last one with the other wrist


# --- writing -------------------------------------------------------------------------------------

def status(q):
    """S of a KR 210 R2700-2: x of the wrist in the frame of axis 1, A3 beyond the stretched arm
    (its forearm is 115 mm above axis 3), sign of A5."""
    a2, a3, a5 = q[1], q[2], q[4]
    fore = a2 + a3
    x = 0.33 + 1.15 * np.cos(a2) + 1.22 * np.cos(fore) + 0.115 * np.sin(fore)
    return int(x < 0) + 2 * int(np.sin(a3 - np.arctan2(0.115, 1.22)) > 0) + 4 * int(np.sin(a5) < 0)


def turn(q):
    return sum(1 << i for i in range(6) if q[i] < 0)


def six(X, form="{:.6f}"):
    angles = np.array(to_zyx(X[:3, :3])) * DEG
    return ",".join(f"{name} {form.format(value)}"
                    for name, value in zip("XYZABC", (*X[:3, 3] * 1e3, *angles)))


def e6pos(X, q, bits=str, external="0.0"):
    return (f"{{{six(X)},S {bits(status(q))},T {bits(turn(q))},E1 {external},E2 0.0,E3 0.0,E4 0.0,"
            "E5 0.0,E6 0.0}")


def config(extra=""):
    lines = ["&ACCESS RVO", "DEFDAT  $CONFIG", "DECL FRAME TOOL_DATA[16]", "DECL FRAME BASE_DATA[32]",
             "DECL LOAD LOAD_DATA[16]",
             "DECL E6AXIS XHOME={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 30.0,A6 0.0}"]
    lines += [f"TOOL_DATA[{t.number}]={{{six(t.tcp, '{:.9f}')}}}" for t in TOOLS]
    lines += [f"BASE_DATA[{i}]={{{six(X, '{:.9f}')}}}" for i, X in enumerate(BASES, 1)]
    for i, (mass, cog) in enumerate(LOADS, 1):
        x, y, z = cog
        lines += [f"LOAD_DATA[{i}]={{M {mass},CM {{X {x},Y {y},Z {z},A 0.0,B 0.0,C 0.0}},"
                  "J {X 0.0,Y 0.0,Z 0.0}}"]
    return "\r\n".join(lines) + "\r\n" + extra + "ENDDAT\r\n"


def files(name, src, dat, crlf=True, encoding="latin-1", public="", extra=""):
    """{file name: bytes} of one module and the controller's $config.dat."""
    head = "&ACCESS RVP\n&REL 7\n&PARAM TEMPLATE = C:\\KRC\\Roboter\\Template\\vorgabe\n"
    source = head + src
    data = f"&ACCESS RVP\n&REL 7\nDEFDAT  {name}{public}\n;FOLD EXTERNAL DECLARATIONS;%{{PE}}\n" \
        f"EXT  BAS (BAS_COMMAND  :IN,REAL  :IN )\n;ENDFOLD\n{dat}ENDDAT\n"
    ends = (lambda text: text.replace("\n", "\r\n")) if crlf else (lambda text: text)
    return {f"{name.lower()}.src": ends(source).encode(encoding),
            f"{name.lower()}.dat": ends(data).encode(encoding),
            "$config.dat": config(extra).encode("latin-1")}


def programs():
    robot = Robot(ARM)
    flanges = [robot.flange(q) for q in SEEDS]
    # The points of program text: seed i with tool t in base b (0: the robot's own).
    def X(i, t=1, b=0, off=np.eye(4)):
        at = flanges[i] @ TOOLS[t - 1].tcp @ off
        return at if b == 0 else np.linalg.inv(BASES[b - 1]) @ at

    def point(name, i, t=1, b=0, **more):
        return f"DECL E6POS {name}={e6pos(X(i, t, b), SEEDS[i], **more)}\n"

    def record(name, t, b, frame="#BASE"):
        return f'DECL FDAT {name}={{TOOL_NO {t},BASE_NO {b},IPO_FRAME {frame},POINT2[] " ",TQ_STATE FALSE}}\n'

    def inline(kind, i, end="", params="PTP_PARAMS"):
        act, dat = ("PDAT_ACT", "PPDAT1") if kind == "PTP" else ("LDAT_ACT", "LCPDAT1")
        return (f";FOLD {kind} P{i} Vel=50 % PDAT1 Tool[1]:Gr\xfcn Base[1]:B\xfchne;%{{PE}}%R 8.2.24,"
                f"%MKUKATPBASIS,%CMOVE,%V{kind},%P 1:{kind}, 2:P{i}\n$BWDSTART=FALSE\n{act}={dat}\n"
                f"FDAT_ACT=FP{i}\nBAS(#{params},50)\n{kind} XP{i}{end}\n;ENDFOLD\n")

    init = (";FOLD INI\n  ;FOLD BASISTECH INI\n    GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO "
            "IR_STOPM ( )\n    INTERRUPT ON 3\n    BAS (#INITMOV,0 )\n  ;ENDFOLD\n;ENDFOLD\n")
    dats = ("DECL PDAT PPDAT1={VEL 100.0,ACC 100.0,APO_DIST 100.0}\n"
            "DECL LDAT LCPDAT1={VEL 2.0,ACC 100.0,APO_DIST 100.0,APO_FAC 50.0}\n")
    expert = "$TOOL=TOOL_DATA[1]\n$BASE=$WORLD\n$LOAD=LOAD_DATA[1]\n"
    bits = lambda value: f"'B{value:08b}'"
    made = {}

    made["inline_forms"] = files(
        "WELD1", "DEF  WELD1 ( )\n" + init + inline("PTP", 1) + inline("LIN", 2, " C_DIS", "CP_PARAMS")
        + inline("LIN", 3, "", "CP_PARAMS")
        + ";FOLD LIN P9 Vel=1 m/s ; Tool[1]={X 1,Y 2,Z 3,A 0,B 0,C 0};%{PE}\n;LIN XP9\n;ENDFOLD\nEND\n",
        dats + point("XP1", 0, 1, 1) + record("FP1", 1, 1) + point("XP2", 1, 1, 1) + record("FP2", 1, 1)
        + point("XP3", 2, 2, 2) + record("FP3", 2, 2) + point("XP9", 3))

    spline = "SVEL_JOINT(50.0), $TOOL=STOOL2({0}), $BASE=SBASE({0}.BASE_NO), $IPO_MODE=" \
        "SIPO_MODE({0}.IPO_FRAME), $LOAD=SLOAD({0}.TOOL_NO), $ACC_AXIS[1]=SACC_JOINT(PPDAT1)"
    made["spline_forms"] = files(
        "SEAM", "DEF SEAM( )\n" + init + "; \u00e4u\u00dfere Naht\n"
        + f"SPTP XP1 WITH $VEL_AXIS[1]={spline.format('FP1')}\n"
        + f"SLIN XP2 WITH $VEL_AXIS[1]={spline.format('FP1')} C_SPL\n"
        + f"SLIN XP3 WITH $VEL_AXIS[1]={spline.format('FP2')}\n"
        + f"SCIRC XP4, XP5 WITH $VEL_AXIS[1]={spline.format('FP2')}\nEND\n",
        dats + point("XP1", 0, 1, 1) + point("XP2", 1, 1, 1) + point("XP3", 2, 2, 2) + record("FP1", 1, 1)
        + record("FP2", 2, 2) + point("XP4", 5, 2, 2) + point("XP5", 1, 2, 2), crlf=False, encoding="utf-8")

    made["literals"] = files(
        "EXPERT", "DEF EXPERT( )\n" + expert
        + f"PTP {e6pos(X(0), SEEDS[0], bits)}\nLIN {{{six(X(1))}}} C_DIS\nLIN {{POS: {six(X(4))}}}\n"
        + f"CIRC {{{six(X(5))}}}, {{{six(X(1))}}} C_ORI\n"
        + f"ptp {{x {X(6)[0, 3] * 1e3:.3f},y {X(6)[1, 3] * 1e3:.3f},{six(X(6)).split(',', 2)[2].lower()},"
        + f"s {status(SEEDS[6])},t 'H{turn(SEEDS[6]):X}'}}\nEND\n", "")

    table = BASES[0] @ shift(0.02, 0.03, 0)
    made["frames"] = files(
        "FRAMES", "DEF FRAMES( )\nDECL FRAME PLATE\nDECL INT N\n" + expert
        + f"PLATE={{{six(BASES[1], '{:.9f}')}}}\n$BASE=PLATE\nPTP XP1\n"
        + "$BASE=BASE_DATA[1]:{X 20.0,Y 30.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n"
        + f"LIN {{{six(np.linalg.inv(table) @ X(1))}}}\nBAS(#BASE,GRIPBASE)\nBAS(#TOOL,2)\nLIN XP2\n"
        + "BAS(#BASE,0)\nLIN XP3\nEND\n",
        "CONST INT GRIPBASE=2\n" + point("XP1", 0, 1, 2) + point("XP2", 2, 2, 2) + point("XP3", 5, 2, 0))

    made["arrays"] = files(
        "TABLES", "DEF TABLES( )\nINT I\n" + expert
        + "FOR I=1 TO 3\n  PTP TAB[I] C_PTP\nENDFOR\nFOR I=2 TO 1 STEP -1\n  PTP GRID[I,2]\nENDFOR\n"
        + "PTP TAB[4]\nLIN LAST[2]\nEND\n",
        "DECL POS TAB[4]\n" + "".join(f"TAB[{i + 1}]={{{six(X(i))},S {status(SEEDS[i])},T {turn(SEEDS[i])}}}\n"
                                      for i in range(4))
        + "DECL E6POS GRID[2,2]\n" + "".join(f"GRID[{i + 1},2]={e6pos(X(4 + i), SEEDS[4 + i])}\n"
                                            for i in range(2))
        + f"DECL FRAME LAST[2]\nLAST[2]={{{six(X(1))}}}\n")

    made["structures"] = files(
        "JOBS", "DEF JOBS( )\nINT I\n" + expert
        + "FOR I=1 TO 2\n  PTP JOB[I].GOAL\n  $VEL.CP=JOB[I].SPEED\nENDFOR\nPTP JOB[1].GOAL\nLIN ONE.AWAY\nEND\n",
        "STRUC JOBTYPE E6POS GOAL,AWAY,REAL SPEED,CHAR NAME[8]\nDECL JOBTYPE JOB[2]\n"
        + "".join(f'JOB[{i + 1}]={{GOAL {e6pos(X(i), SEEDS[i])},SPEED 0.2,NAME[] "Teil {i}"}}\n'
                  for i in range(2))
        + f"DECL JOBTYPE ONE={{SPEED 0.1,AWAY {{{six(X(2))}}}}}\n")

    made["control_flow"] = files(
        "FLOW", "DEF FLOW( )\nINT I,K\nBOOL DONE\n" + expert + "I=0\nK=0\nDONE=FALSE\n"
        + "WHILE I<2\n I=I+1\n IF I==1 THEN\n  PTP XP1\n ELSE\n  LIN XP2\n ENDIF\nENDWHILE\n"
        + "REPEAT\n K=K+1\n SWITCH K\n CASE 1,5\n  LIN XP3\n CASE 2\n  LIN XP4\n DEFAULT\n  DONE=TRUE\n"
        + " ENDSWITCH\nUNTIL DONE OR (K>9)\nLOOP\n LIN XP5 C_VEL\n IF NOT (K==99) THEN\n  EXIT\n ENDIF\n"
        + "ENDLOOP\nGOTO LAST\nLIN XP9\nLAST:\nWAIT SEC 0.5\nLIN XP6\nEND\n",
        "".join(point(f"XP{i + 1}", i) for i in range(6)) + point("XP9", 0), crlf=False)

    sub = files("GRIP", "GLOBAL DEF GRIP(N :IN)\nINT N\n$TOOL=TOOL_DATA[2]\n$LOAD=LOAD_DATA[2]\n"
                "IF N>0 THEN\n LIN XP1\n RETURN\nENDIF\nLIN XP2\nEND\n", point("XP1", 3, 2) + point("XP2", 4, 2))
    sub["cell.src"] = ("DEF CELL( )\nEXT GRIP(INT :IN)\n" + expert + "PTP XSTART\nGRIP(1)\nLIN XNEXT\nINNER( )\n"
                       "GRIP(0)\nEND\nDEF INNER( )\n$TOOL=TOOL_DATA[1]\nLIN XLAST\n$TOOL=TOOL_DATA[2]\nEND\n"
                       ).encode()
    sub["cell.dat"] = ("DEFDAT CELL\n" + point("XSTART", 0, 1) + point("XNEXT", 1, 2) + point("XLAST", 2, 1)
                       + "ENDDAT\n").encode()
    made["subprograms"] = {name: sub[name] for name in ("cell.src", "cell.dat", "grip.src", "grip.dat",
                                                         "$config.dat")}

    made["geometric_operator"] = files(
        "SHIFTS", "DEF SHIFTS( )\n" + expert
        + "PTP XP1:{X 0.0,Y 0.0,Z -2.0,A 0.0,B 0.0,C 0.0}\nLIN {X 0.0,Y 3.0,Z 0.0,A 0.0,B 0.0,C 0.0}:XP2\n"
        + "LIN $NULLFRAME:XP3\nEND\n",
        point("XP1", 0) + point("XP2", 1) + point("XP3", 2))

    made["spline_block"] = files(
        "CURVE", "DEF CURVE( )\n" + expert + "PTP XP1\nSPLINE WITH $TOOL=TOOL_DATA[1], $VEL.CP=0.2\n SPL XP2\n"
        + " SPL XP3 WITH $VEL.CP=0.1\n SLIN XP6\n SCIRC XVIA, XEND\nENDSPLINE C_SPL\nEND\n",
        "".join(point(f"XP{i + 1}", i) for i in (0, 1, 2, 5)) + "".join(
            f"DECL E6POS {n}={e6pos(X(5, off=shift(x, y, 0)), SEEDS[5])}\n"
            for n, x, y in (("XVIA", 0.05, 0.02), ("XEND", 0.1, 0))))

    left = "  ; left"
    made["computed"] = files(
        "COMPUTE", "DEF COMPUTE( )\nDECL E6POS P\nREAL STEP\n" + expert + "STEP=5\nPTP XP1\n"
        + "P=XP2\nP.Z=P.Z+STEP\nLIN P" + left + "\nLIN_REL {Z -20.0} #TOOL" + left
        + "\nLIN_REL {X 3.5,A 0.5}" + left + "\nLIN XP2" + left + "\nXP3.X=XP3.X-1.5\nLIN XP3" + left
        + "\nLIN XP4\nEND\n",
        "".join(point(f"XP{i + 1}", i) for i in range(4)))

    made["left_alone"] = files(
        "SPECIAL", "DEF SPECIAL( )\n" + init + expert + "PTP XHOME" + left + "\nPTP XP1\nFDAT_ACT=FP2\nBAS(#FRAMES)\nLIN XP2"
        + left + "\n$IPO_MODE=#BASE\nTOOL_DATA[5]=TOOL_DATA[1]\nTOOL_DATA[5].Z=260.0\n$TOOL=TOOL_DATA[5]\nLIN XP3"
        + left + "\n$TOOL=TOOL_DATA[1]\n$BASE=$WORLD\n$LOAD=LOAD_DATA[1]\nLIN XP4\nEND\n",
        "".join(point(f"XP{i + 1}", i) for i in range(4)) + record("FP2", 1, 0, "#TCP"))

    tree = files("LIB", "DEF LIB( )\nEND\n", "".join(
        "DECL GLOBAL" + point(f"GP{i + 1}", i)[4:] for i in range(3)), public=" PUBLIC")
    made["public_points"] = {
        "main.src": ("DEF MAIN( )\n" + expert + "PTP GP1\nLIN GP2\nGP3USE( )\nEND\n").encode(),
        "gp3use.src": "DEF GP3USE( )\r\nLIN GP3\r\nEND\r\n".encode(),
        "lib.src": tree["lib.src"], "lib.dat": tree["lib.dat"], "$config.dat": tree["$config.dat"]}

    root = pose(about(2, 0.3), (0.1, 0.2, 0.6))
    made["robot_in_the_world"] = files(
        "WORLD", "DEF WORLD( )\n$TOOL=TOOL_DATA[1]\n$LOAD=LOAD_DATA[1]\n$BASE=$WORLD\n"
        + f"PTP {e6pos(root @ X(0), SEEDS[0])}\n$BASE=BASE_DATA[1]\n"
        + f"LIN {{{six(np.linalg.inv(BASES[0]) @ root @ X(1))}}}\nEND\n", "")
    made["robot_in_the_world"]["$machine.dat"] = (
        f"DEFDAT $MACHINE PUBLIC\r\nFRAME $ROBROOT={{{six(root, '{:.9f}')}}}\r\nENDDAT\r\n").encode()
    return made


# --- running -------------------------------------------------------------------------------------

TOKEN = re.compile(r'\s*("[^"]*"|\'[BHbh][0-9A-Fa-f]+\'|\d+\.?\d*(?:[Ee][+-]?\d+)?|\.\d+|[$A-Za-z_][\w$]*'
                   r'|==|<>|<=|>=|[-+*/:<>=#.,(){}\[\]])')


class Place(dict):
    """An aggregate with the line that wrote it."""
    at = None


class Parser:
    """Values of the expressions of one line, in a frame of variables."""

    def __init__(self, text, run, at):
        self.tokens, self.run, self.at, self.i = TOKEN.findall(text), run, at, 0

    def peek(self, ahead=0):
        return self.tokens[self.i + ahead].lower() if self.i + ahead < len(self.tokens) else ""

    def take(self, *words):
        if self.peek() in words:
            self.i += 1
            return self.tokens[self.i - 1].lower()
        return ""

    LEVELS = [("or", "exor"), ("and",), ("==", "<>", "<", ">", "<=", ">="), ("+", "-"), ("*", "/"), (":",)]

    def value(self, level=0):
        if level == 2 and self.take("not"):
            return not self.value(2)
        if level == len(self.LEVELS):
            return self.atom()
        left = self.value(level + 1)
        while operator := self.take(*self.LEVELS[level]):
            right = self.value(level + 1)
            left = {"or": lambda: bool(left) or bool(right), "exor": lambda: bool(left) != bool(right),
                    "and": lambda: bool(left) and bool(right), "==": lambda: left == right,
                    "<>": lambda: left != right, "<": lambda: left < right, ">": lambda: left > right,
                    "<=": lambda: left <= right, ">=": lambda: left >= right, "+": lambda: left + right,
                    "-": lambda: left - right, "*": lambda: left * right, "/": lambda: left / right,
                    ":": lambda: product(left, right)}[operator]()
        return left

    def atom(self):
        if self.take("-"):
            return -self.atom()
        if self.take("("):
            inner = self.value()
            self.take(")")
            return inner
        if self.take("#"):
            self.i += 1
            return "#" + self.tokens[self.i - 1].lower()
        if self.peek() == "{":
            return self.aggregate()
        word = self.tokens[self.i]
        self.i += 1
        if word[0] == "'":
            return int(word[2:-1], 2 if word[1] in "Bb" else 16)
        if word[0] == '"':
            return word
        if word[0].isdigit() or word[0] == ".":
            return float(word) if re.search(r"[.eE]", word) else int(word)
        if word.lower() in ("true", "false"):
            return word.lower() == "true"
        if self.peek() == "(":
            return self.run.call(word.lower(), self.arguments())
        self.i -= 1
        return self.run.load(self.reference())

    def arguments(self):
        self.take("(")
        given = []
        while not self.take(")"):
            given.append(self.value())
            self.take(",")
        return given

    def aggregate(self):
        made = Place()
        made.at = self.at
        self.take("{")
        if self.peek(1) == ":":
            self.i += 2
        while not self.take("}"):
            name = self.tokens[self.i].lower()
            self.i += 1
            if self.take("["):
                self.take("]")
            made[name] = self.atom()
            self.take(",")
        return made

    def reference(self):
        parts = [self.tokens[self.i].lower()]
        self.i += 1
        while self.peek() in ("[", "."):
            if self.take("."):
                parts.append(self.tokens[self.i].lower())
                self.i += 1
                continue
            self.take("[")
            index = []
            while not self.take("]"):
                index.append(self.value())
                self.take(",")
            parts.append(tuple(index))
        return parts


def matrix(frame):
    a, b, c = (frame[k] / DEG for k in "abc")
    return pose(from_zyx(a, b, c), np.array([frame[k] for k in "xyz"]) * 1e-3)


def product(left, right):
    made = Place(zip("xyzabc", (0.0,) * 6))
    X = matrix(left) @ matrix(right)
    made.update(zip("xyz", X[:3, 3] * 1e3))
    made.update(zip("abc", np.array(to_zyx(X[:3, :3])) * DEG))
    made.at = right.at or left.at
    # The point that is moved carries the status and turn.
    for part in (left, right):
        made.update({k: part[k] for k in "st" if k in part})
    made.matrix = X
    return made


ZERO = Place(zip("xyzabc", (0.0,) * 6))
END = {"if": ("else", "endif"), "for": ("endfor",), "while": ("endwhile",), "loop": ("endloop",),
       "repeat": ("until",), "switch": ("case", "default", "endswitch")}


class Run:
    def __init__(self, given):
        self.motions, self.globals, self.modules, self.routines = [], {}, {}, {}
        self.frame, self.module, self.with_ = {}, "", {}
        self.globals.update({"$nullframe": ZERO, "$world": ZERO, "$robroot": ZERO, "$ipo_mode": "#base"})
        self.first = None
        for name, data in given.items():
            self.read(name, [line.split(";")[0].strip() if '"' not in line else line.strip()
                             for line in re.split("\r\n|\n|\r", data.decode("latin-1"))],
                      re.split("\r\n|\n|\r", data.decode("latin-1")))

    def read(self, name, lines, raw):
        module, routine = "", None
        for number, line in enumerate(lines, 1):
            if not line or line.startswith(("&", ";")):
                continue
            head = re.match(r"(GLOBAL\s+)?(DEFDAT|DEF)\s+([$\w]+)\s*(\(.*\))?", line, re.I)
            if head and head[2].upper() == "DEFDAT":
                module = head[3].lower()
            elif head:
                module = module or head[3].lower()
                names = re.findall(r"[(,]\s*(\w+)\s*:", head[4] or "")
                routine = {"module": module, "name": name, "lines": [], "parameters": [n.lower() for n in names]}
                self.routines[head[3].lower()] = routine
                self.first = self.first or routine
            elif routine is not None:
                if line.upper() != "END":
                    routine["lines"].append((number, line, raw[number - 1]))
            elif module:
                self.declare(module, line, (name, number))

    def declare(self, module, line, at):
        here = re.sub(r"^((DECL|GLOBAL|CONST)\s+)+", "", line, flags=re.I)
        if "=" not in here or here.upper().startswith(("STRUC", "EXT", "SIGNAL")):
            return
        found = re.match(r"(?:[$\w]+\s+)?([$\w]+(?:\[[\d,]*\])?)\s*=\s*(.*)", here)
        if not found:
            return
        scope = self.globals if module.startswith("$") or "GLOBAL" in line.upper().split("=")[0] \
            else self.modules.setdefault(module, {})
        parts = Parser(found[1], self, at).reference()
        self.put(scope, parts, Parser(found[2], self, at).value())

    @staticmethod
    def put(scope, parts, value):
        for part in parts[:-1]:
            scope = scope.setdefault(part, Place())
        if isinstance(value, Place):
            old = scope.get(parts[-1])
            value, at = Place({**(old if isinstance(old, Place) else {}), **value}), value.at
            value.at = at
        scope[parts[-1]] = value

    def scope_of(self, name):
        for scope in (self.frame, self.modules.get(self.module, {}), self.globals):
            if name in scope:
                return scope
        return self.globals if name.startswith("$") else self.frame

    def load(self, parts):
        if parts[0] in ("$in", "$out", "$flag"):
            return False
        value = self.scope_of(parts[0])
        for part in parts:
            value = value[part]
        return value

    def store(self, parts, value):
        self.put(self.scope_of(parts[0]), parts, value)

    def call(self, name, given):
        if name == "stool2":
            return self.data("tool_data", given[0]["tool_no"])
        if name in ("sbase", "sload"):
            return self.data({"sbase": "base_data", "sload": "load_data"}[name], given[0])
        if name == "sipo_mode":
            return given[0]
        if name == "bas":
            return self.bas(*given)
        if name not in self.routines:
            return 0
        routine = self.routines[name]
        outer = self.frame, self.module
        self.frame, self.module = dict(zip(routine["parameters"], given)), routine["module"]
        self.lines(routine)
        self.frame, self.module = outer
        return 0

    def data(self, name, number):
        return ZERO if number == 0 else self.globals[name][(number,)]

    def bas(self, command, number=0):
        if command == "#tool":
            self.globals["$tool"], self.globals["$load"] = self.data("tool_data", number), self.data("load_data", number)
        elif command == "#base":
            self.globals["$base"] = self.data("base_data", number)
        elif command == "#initmov":
            self.globals.update({"$tool": self.data("tool_data", 1), "$base": ZERO, "$ipo_mode": "#base"})
        elif command in ("#frames", "#ptp_params", "#cp_params"):
            record = self.load(["fdat_act"])
            self.bas("#tool", record["tool_no"])
            self.bas("#base", record["base_no"])
            self.globals["$ipo_mode"] = record["ipo_frame"]

    # One routine: lines with a counter; blocks are found by counting their openings.

    def lines(self, routine):
        code = routine["lines"]
        words = [re.match(r"[$\w]*", line)[0].lower() for _, line, _ in code]
        partner = lambda i, step, wanted, block: next(
            j for j in range(i + step, len(code) if step > 0 else -1, step)
            if words[j] in wanted and self.depth(words, i, j, step, block) == 0)
        i, done = 0, 0
        loops = {}
        while i < len(code):
            done += 1
            assert done < 100000, "a loop without end"
            number, line, raw = code[i]
            word, rest = words[i], line[len(words[i]):]
            at = (routine["name"], number)
            value = lambda text: Parser(text, self, at).value()
            if word == "if":
                i = i if value(re.sub(r"\bTHEN\b", "", rest, flags=re.I)) else partner(i, 1, END["if"], "if")
            elif word == "else":
                i = partner(i, 1, ("endif",), "if")
            elif word == "for":
                variable, start, last, step = re.match(
                    r"\s*(\w+)\s*=\s*(.+?)\s+TO\s+(.+?)(?:\s+STEP\s+(.+))?$", rest, re.I).groups()
                step = value(step) if step else 1
                now = self.load([variable.lower()]) + step if i in loops else value(start)
                self.store([variable.lower()], now)
                loops[i] = True
                if (now - value(last)) * step > 0:
                    del loops[i]
                    i = partner(i, 1, END["for"], "for")
            elif word == "while":
                i = i if value(rest) else partner(i, 1, END["while"], "while")
            elif word in ("endfor", "endwhile", "endloop"):
                block = word[3:]
                i = partner(i, -1, (block,), block) - 1
            elif word == "until":
                i = i if value(rest) else partner(i, -1, ("repeat",), "repeat") - 1
            elif word == "exit":
                i = next(j for j in range(i, len(code)) if words[j] in ("endloop", "endfor", "endwhile", "until"))
            elif word == "switch":
                chosen, j = value(rest), i
                while True:
                    j = partner(j if j == i else j, 1, END["switch"], "switch")
                    if words[j] != "case" or chosen in [value(t) for t in code[j][1][4:].split(",")]:
                        break
                i = j
            elif word in ("case", "default"):
                i = partner(i, 1, ("endswitch",), "switch")
            elif word == "goto":
                i = next(j for j in range(len(code)) if code[j][1].lower().rstrip(" :") == rest.strip().lower()
                         and code[j][1].endswith(":"))
            elif word == "return":
                return
            else:
                self.statement(word, line, rest, raw, at)
            i += 1

    @staticmethod
    def depth(words, i, j, step, block):
        """Blocks of this kind that are open between the lines i and j."""
        opens, closes = (block, END[block][-1])[::step]
        between = words[i + step:j:step]
        return between.count(opens) - between.count(closes)

    def statement(self, word, line, rest, raw, at):
        motion = re.match(r"(s?)(ptp|lin|circ|spl)(_rel)?$", word)
        if motion and not rest.lstrip().startswith("="):
            self.motion(motion[2], bool(motion[3]), rest, raw, at)
        elif word in ("spline", "ptp_spline"):
            self.with_ = self.settings(rest, at)
        elif word == "endspline":
            self.with_ = {}
        elif word in ("interrupt", "global", "wait", "ext", "decl", "int", "real", "bool") or line.endswith(":"):
            return
        elif re.match(r"[$\w]+\s*\(", line):
            Parser(line, self, at).value()
        elif found := re.match(r"([^=]+)=(.*)", line):
            self.store(Parser(found[1], self, at).reference(), Parser(found[2], self, at).value())

    def settings(self, text, at):
        found, changed = re.search(r"\bWITH\b(.*)", text, re.I), {}
        if not found:
            return changed
        for name, value in re.findall(r"(\$\w+)(?:\.\w+|\[\d+\])?\s*=\s*([^,]+(?:\([^)]*\))?)", found[1]):
            if name.lower() in ("$tool", "$base", "$load", "$ipo_mode"):
                changed[name.lower()] = Parser(value, self, at).value()
        return changed

    def motion(self, kind, relative, rest, raw, at):
        now = {**self.globals, **self.with_, **self.settings(rest, at)}
        text = re.split(r"\bWITH\b|\bC_(?:PTP|DIS|VEL|ORI|SPL)\b|#BASE|#TOOL", rest, flags=re.I)[0]
        parser = Parser(text, self, at)
        goals = [parser.value()]
        if parser.take(","):
            goals.append(parser.value())
        # In B, which $ROBROOT places in the world.
        tool = matrix(now["$tool"])
        base = np.linalg.inv(matrix(now["$robroot"])) @ matrix(now["$base"])
        left = "left" if "; left" in raw else ""
        end = goals[-1]
        load = now.get("$load", {"m": 0.0, "cm": ZERO})
        common = {"tool": tool, "mass": float(load["m"]), "file": (end.at or at)[0], "line": (end.at or at)[1],
                  "cog": np.array([load["cm"][k] for k in "xyz"]) * 1e-3, "left": left, "instruction": at[1]}
        if "a1" in end:
            q = np.array([end[f"a{i}"] for i in range(1, 7)]) / DEG
            self.motions.append(Motion("joint", Robot(ARM).flange(q) @ tool, joints=q, **common))
            return
        if relative:
            # About the axes of the base or of the tool, from the last target.
            step = matrix({**ZERO, **end})
            last = self.motions[-1].target
            if "#TOOL" in rest.upper():
                target = last @ step
            else:
                inside = np.linalg.inv(base) @ last
                shifted = np.eye(4)
                shifted[:3, :3], shifted[:3, 3] = step[:3, :3] @ inside[:3, :3], inside[:3, 3] + step[:3, 3]
                target = base @ shifted
        else:
            target = base @ getattr(end, "matrix", matrix(end) if "a" in end else None)
        agrees = None
        if kind == "ptp" and "s" in end and "t" in end:
            s, t = end["s"] & 7, end["t"]
            agrees = lambda q: status(q) == s and turn(q) == t
        self.motions.append(Motion(
            {"ptp": "joint", "circ": "circular", "spl": "spline"}.get(kind, "linear"), target, agrees=agrees,
            via=base @ matrix(goals[0]) if kind == "circ" else None, **common))


def execute(given):
    """[Motion] of the first routine of the first source file."""
    run = Run({**{n: d for n, d in given.items() if not n.endswith(".src")},
               **{n: d for n, d in given.items() if n.endswith(".src")}})
    run.call(next(n for n, r in run.routines.items() if r is run.first), [])
    return run.motions
