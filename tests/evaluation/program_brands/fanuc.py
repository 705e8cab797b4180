"""FANUC TP: programs with the backup of their controller, and an interpreter of listings."""

import re

import numpy as np

from .common import Motion, Robot, Tool, about, from_zyx, pose, shift, to_zyx

NAME = "FANUC TP"
ARM = "fanuc"
TOOLS = [Tool(1, shift(0, 0, 0.2)), Tool(2, pose(about(1, 0.5) @ about(2, 0.9), (0.06, -0.03, 0.18)))]
OPTIONS = {"groups": ["--external-axes-still"], "rail": ["--external-axes-still"]}
RAD = np.pi / 180

FRAMES = {0: np.eye(4), 1: pose(from_zyx(0.7, -0.1, 0.05), (0.4, -0.3, -0.2)),
          2: pose(from_zyx(-1.4, 0.3, 0.2), (-0.2, 0.5, 0.1))}
LOADS = {1: (8.0, (0.01, -0.02, 0.12)), 2: (16.0, (-0.03, 0.04, 0.15)), 3: (3.5, (0.0, 0.0, 0.08))}

SEEDS = np.array([  # readings of the postures [deg], J3 against the ground
    [10, 15, -20, 5, -60, 20], [-25, 30, -10, -15, -80, -40], [40, -10, -35, 20, -50, 70],
    [-50, 20, 5, -10, -95, 110], [5, 45, -15, 30, -40, -120], [70, 5, -30, -40, -70, 15]]) * RAD


# Writing.

def number(x, unit, lead=False):
    text = "%.3f" % x
    if not lead:
        text = re.sub(r"^(-?)0\.", r"\1.", text)
    return "%9s%s%s" % (text, "  " if unit == "mm" else " ", unit)


def turns(q):
    return [int(round(q[j] / (2 * np.pi))) for j in (0, 3, 5)]


def sides(robot, q):
    """On which side of their limits J5, the elbow and the wrist are, as +1 or -1."""
    def planar(q):
        axes, points, after = robot.arm.frames(robot.axes @ np.asarray(q, float))
        wrist = after[3][1]
        return (np.dot(axes[1], np.cross(points[2] - points[1], wrist - points[1])),
                np.dot(np.cross(axes[1], axes[0]), wrist - points[0]))
    here, zero = planar(q), planar(np.zeros(6))
    return np.sign([q[4], here[0] * zero[0], here[1] * zero[1]])


def config_of(robot, q):
    flip, up, front = sides(robot, q)
    return "%s %s %s, %d, %d, %d" % ("F" if flip > 0 else "N", "U" if up > 0 else "D",
                                     "T" if front > 0 else "B", *turns(q))


def agreeing(robot, config):
    letters, *counts = config.split(",")
    wanted = [+1 if letter in "FUT" else -1 for letter in letters.split()]
    counts = [int(c) for c in counts]

    def agrees(q):
        return (list(sides(robot, q)) == wanted
                and all(abs(q[j] - 2 * np.pi * c) <= np.pi for j, c in zip((0, 3, 5), counts)))
    return agrees


class Writer:
    def __init__(self, name, frame=1, tool=1):
        self.robot, self.name, self.frame, self.tool = Robot(ARM), name, frame, tool
        self.lines, self.points = [], []

    def line(self, text, count=True):
        number_ = sum(1 for _, counted in self.lines if counted) + 1
        self.lines.append((("%4d:%s ;" % (number_, text)) if count else text, count))
        return self

    def lines_of(self, *texts):
        for text in texts:
            self.line("  " + text if not re.match(r"[JLCA] |//", text) else text)
        return self

    def pose(self, q, extra="", frame=None, tool=None, lead=False, label="", word="CONFIG", shift_by=None):
        frame, tool = self.frame if frame is None else frame, self.tool if tool is None else tool
        X = self.robot.flange(q) @ TOOLS[tool - 1].tcp
        if shift_by is not None:
            X = X @ shift(*shift_by)
        X = np.linalg.inv(FRAMES[frame]) @ X
        r, p, w = np.array(to_zyx(X[:3, :3])) / RAD
        x, y, z = X[:3, 3] * 1e3
        self.points.append(
            "P[%d%s]{\n   GP1:\n\tUF : %d, UT : %d,\t\t%s : '%s',\n\tX = %s,\tY = %s,\tZ = %s,\n"
            "\tW = %s,\tP = %s,\tR = %s%s\n};\n"
            % (len(self.points) + 1, label and ':"%s"' % label, frame, tool, word,
               config_of(self.robot, q), *(number(v, "mm", lead) for v in (x, y, z)),
               *(number(v, "deg", lead) for v in (w, p, r)), extra))
        return self

    def joints(self, q):
        self.points.append("P[%d]{\n   GP1:\n\tUF : %d, UT : %d,\t\n\t%s\n};\n"
                           % (len(self.points) + 1, self.frame, self.tool, ",\t".join(
                               "J%d= %s" % (i + 1, number(v / RAD, "deg")) for i, v in enumerate(q))))
        return self

    def raw(self, text):
        self.points.append(text.replace("N]", "%d]" % (len(self.points) + 1)))
        return self

    def text(self, head="COMMENT\t\t= \"\";"):
        return ("/PROG  %s\n/ATTR\nOWNER\t\t= MNEDITOR;\n%s\nPROG_SIZE\t= 687;\nLINE_COUNT\t= %d;\n"
                "DEFAULT_GROUP\t= 1,*,*,*,*;\n/APPL\n/MN\n%s/POS\n%s/END\n"
                % (self.name, head, len(self.lines), "".join(line + "\n" for line, _ in self.lines),
                   "".join(self.points)))


def backup(frames=FRAMES):
    """sysframe.va and symotn.va of the controller."""
    def entries(values):
        text = ""
        for n, X in sorted(values.items()):
            if n:
                z, y, x = np.array(to_zyx(X[:3, :3])) / RAD
                text += ("    [1,%d] = \n  Group: 1   Config: N U T, 0, 0, 0\n  X: %.9f   Y: %.9f   Z: %.9f\n"
                         "  W: %.9f   P: %.9f   R: %.9f\n" % (n, *(X[:3, 3] * 1e3), x, y, z))
        return text + "    [2,1] = \n  Group: 2   Config: \n  X: 1.0   Y: 1.0   Z: 1.0\n  W: 0.0   P: 0.0   R: 0.0\n\n"
    listed = "[*SYSTEM*]$%s  Storage: SHADOW  Access: RW  : ARRAY[2,32] OF POSITION\n"
    sysframe = (listed % "MNUFRAME" + entries(frames) + listed % "MNUTOOL"
                + entries({t.number: t.tcp for t in TOOLS})
                + "[*SYSTEM*]$MNUTOOLNUM  Storage: SHADOW  Access: RW  : ARRAY[2] OF BYTE\n  [1] = 1\n")
    symotn = "[*SYSTEM*]$PLST_GRP1  Storage: SHADOW  Access: RO  : ARRAY[20] OF PLST_GRP_T\n"
    for n, (mass, cog) in LOADS.items():
        for field, value in zip(("", "_X", "_Y", "_Z"), (mass, *(100 * c for c in cog))):
            symotn += "     Field: $PLST_GRP1[%d].$PAYLOAD%s Access: RO: REAL = %e\n" % (n, field, value)
    return {"sysframe.va": sysframe.encode(), "symotn.va": symotn.encode()}


def programs():
    select = ("UFRAME_NUM=1", "UTOOL_NUM=1", "PAYLOAD[1]")
    made = {}

    def add(name, *writers, encoding="utf-8", crlf=False, frames=FRAMES):
        files = {}
        for writer in writers:
            text = writer if isinstance(writer, str) else writer.text()
            file = re.search(r"/PROG +(\w+)", text)[1].lower() + ".ls"
            files[file] = (text.replace("\n", "\r\n") if crlf else text).encode(encoding)
        made[name] = {**files, **backup(frames)}

    w = Writer("PLAIN").lines_of(*select, "J P[1] 100% FINE    ", "L P[2] 200mm/sec CNT50 ACC80    ",
                                 "L P[3:near] 100mm/sec CNT0    ", "J P[4] 50% CNT100    ", "END")
    w.pose(SEEDS[0]).pose(SEEDS[1]).pose(SEEDS[2], label="near").pose(SEEDS[3], lead=True)
    add("plain", w)

    w = Writer("CIRCLE", frame=0).lines_of("UFRAME_NUM=0", *select[1:], "J P[1] 100% FINE    ")
    w.line("C P[2]    \n    :  P[3] 50mm/sec FINE    ").lines_of("L P[4] 100mm/sec CD5    ")
    for by in ((0, 0, 0), (0.05, 0.05, 0), (0.1, 0, 0), (0.1, 0, 0.05)):
        w.pose(SEEDS[0], shift_by=by)
    add("circle", w)

    w = Writer("FRAMES").lines_of(*select, "J P[1] 100% FINE    ", "UFRAME_NUM=2", "UTOOL_NUM=2",
                                  "J P[2] 100% FINE    ", "L P[3] 100mm/sec FINE    ", "UFRAME_NUM=1",
                                  "L P[4] 100mm/sec FINE    ")
    w.pose(SEEDS[1]).pose(SEEDS[2], frame=2, tool=2).pose(SEEDS[2], frame=2, tool=2, shift_by=(0, 0.05, 0))
    w.pose(SEEDS[2], frame=1, tool=2, shift_by=(0.02, 0, 0))
    add("frames", w)

    w = Writer("LOADS").lines_of(*select, "J P[1] 100% FINE    ", "L P[2] 100mm/sec FINE    ", "PAYLOAD[2:part]",
                                 "L P[2] 100mm/sec FINE    ", "L P[3] 100mm/sec FINE    ", "PAYLOAD[3]",
                                 "J P[4] 100% FINE    ")
    for i, by in ((0, (0, 0, 0)), (0, (0, 0, 0.1)), (0, (0.05, 0, 0.1)), (1, (0, 0, 0))):
        w.pose(SEEDS[i], shift_by=by)
    add("loads", w)

    group = "\n   GP2:\n\tUF : 1, UT : 1,\t\n\tJ1=%s,\tJ2=%s"
    w = Writer("GROUPS").lines_of(*select, "J P[1] 100% FINE    ", "L P[2] 100mm/sec FINE COORD    ",
                                  "J P[3] 100% FINE    ")
    w.pose(SEEDS[0], extra=group % (number(100, "mm"), number(6.378, "deg")))
    w.pose(SEEDS[1], extra=group % (number(100, "mm"), number(-0.5, "deg")))
    w.pose(SEEDS[2], extra=group % (number(0, "mm"), number(0, "deg")))
    add("groups", w)

    w = Writer("RAIL").lines_of(*select, "J P[1] 100% FINE    ", "L P[2] 100mm/sec FINE    ")
    w.pose(SEEDS[3], extra=",\n\tE1= %s" % number(2580.816, "mm"))
    w.pose(SEEDS[3], extra=",\n\tE1= %s" % number(2580.816, "mm"), shift_by=(0.03, 0, -0.04))
    add("rail", w)

    w = Writer("HOMES").lines_of(*select, "J P[1] 100% FINE    ", "L P[2] 100mm/sec FINE    ", "J PR[1:home] 100% FINE    ",
                                 "J P[3] 100% FINE    ")
    w.joints(SEEDS[0]).pose(SEEDS[0], shift_by=(0, 0, 0.05)).pose(SEEDS[4])
    add("homes", w)

    w = Writer("TEIL").lines_of("!Gr\xfc\xdfe aus der Halle", "BENUTZER_NUM=1", "WKZ_NUM=1", "TRAGLST[2]",
                                "J P[1] 100% CNT0 ACC100 ZEIT VOR   0.00sek    ", "L P[2] 200mm/sek FINE    ",
                                "SPRUNG LABEL[1]", "L P[4] 100mm/sek FINE    ", "LABEL[1]", "L P[3] 100mm/sek FINE    ",
                                "ENDE")
    for i in range(4):
        w.pose(SEEDS[0], word="KONFIG", shift_by=(0, 0.04 * i, 0))
    add("german", w.text("KOMMENTAR\t= \"\xdcbung\";\nGE\xc4NDERT\t= TAG 16-05-25  ZEIT 22:57:52;"),
        encoding="latin-1", crlf=True)

    sub = Writer("SUB").lines_of("PAYLOAD[2]", "L P[1] 100mm/sec FINE    ", "END").pose(SEEDS[1], shift_by=(0, 0, 0.06))
    w = Writer("MAIN").lines_of(*select, "J P[1] 100% FINE    ", "CALL SUB(1,'a')    ", "L P[2] 100mm/sec FINE    ")
    w.pose(SEEDS[1]).pose(SEEDS[1], shift_by=(0.04, 0, 0))
    add("calls", w, sub)

    w = Writer("BRANCHES").lines_of(
        *select, "R[1]=1", "LBL[1:again]", "J P[1] 100% FINE    ", "IF R[1]=2,JMP LBL[2]", "L P[2] 100mm/sec FINE    ",
        "R[1]=2", "JMP LBL[1]", "LBL[2]", "SELECT R[1]=1,JMP LBL[1]")
    w.line("       :       =2,JMP LBL[3] ;", count=False).line("       :       ELSE,JMP LBL[1] ;", count=False)
    w.lines_of("LBL[3]", "FOR R[2]=1 TO 2", "L P[3] 100mm/sec FINE    ", "ENDFOR", "IF (R[1]=2) THEN",
               "L P[4] 100mm/sec FINE    ", "ELSE", "L P[3] 100mm/sec FINE    ", "ENDIF",
               "IF (R[1]=2),PAYLOAD[3]")
    for i in range(4):
        w.pose(SEEDS[2], shift_by=(0.03 * i, 0, 0.02 * i))
    add("branches", w)

    w = Writer("OFFSETS").lines_of(*select, "J P[1] 100% FINE    ", "L P[2] 100mm/sec FINE Offset,PR[3]    ",
                                   "L P[3] 100mm/sec FINE Tool_Offset,PR[4]    ", "J P[4] 100% FINE    ")
    for i in range(4):
        w.pose(SEEDS[5], shift_by=(0, 0.02 * i, 0))
    add("offsets", w)

    w = Writer("SPECIAL").lines_of(
        *select, "J P[1] 100% FINE    ", "//L P[9] 100mm/sec FINE    ", "--eg:L P[9] is a remark",
        "L P[2] 100mm/sec FINE Skip,LBL[5],PR[7]=LPOS    ", "LBL[5]", "J P[1] 100% FINE    ",
        "L P[3] 10mm/sec FINE INC    ", "J P[1] 100% FINE    ", "L P[4] 95mm/sec CNT0 RTCP    ",
        "J P[5] 100% FINE    ", "L P[6] WELD_SPEED CNT100 Wjnt\n    :  Weave Sine[5]\n    :  Arc Start[1]    ",
        "L P[7] 12mm/sec FINE Arc End[1]    ")
    for i in range(7):
        w.pose(SEEDS[0], shift_by=(0.01 * i, 0.02 * i, 0))
    add("special", w)

    w = Writer("COPIES").lines_of(*select, "PR[5]=P[2]", "P[3,2]=R[1]", "J P[1] 100% FINE    ", "J P[2] 100% FINE    ",
                                  "J P[3] 100% FINE    ", "J P[4] 100% FINE    ")
    for i in range(4):
        w.pose(SEEDS[i])
    w.raw("P[N]{\n   GP1:\n\tUF : F, UT : F,\t\tCONFIG : '',\n\tX =********  mm,\tY =********  mm,\tZ =********  mm,\n"
          "\tW =******** deg,\tP =******** deg,\tR =******** deg\n};\n")
    add("copies", w)

    w = Writer("TURNS", frame=0).lines_of("UFRAME_NUM=0", *select[1:], *("J P[%d] 100%% FINE    " % n for n in range(1, 6)))
    for q in ([10, 15, -20, 5, -60, 220], [10, 15, -20, -190, -60, 20], [10, 15, -20, 150, 60, -130],
              [10, 15, -20, 5, -60, -200], [150, -60, 30, 10, -50, 30]):
        w.pose(np.array(q) * RAD)
    add("turns", w)

    w = Writer("BLOCKS").lines_of(*select)
    w.line("J P[1] 100% CNT0 ACC100 TB    .10sec,P-SPS    ")
    for inner in ("      1:  TC_ONLINE (ON) ;", "      2:  LBL[1] ;", "      3:  WAIT (DI[9])    ;",
                  "      4:  DO[1]=(ON) ;", "       ------ ;"):
        w.line(inner, count=False)
    w.lines_of("L P[2] 100mm/sec FINE    ", "UNLOCK PREG", "L P[3] 100mm/sec FINE    ")
    for i in range(3):
        w.pose(SEEDS[3], shift_by=(0, 0.02 * i, 0.03 * i))
    add("blocks", w)

    # A frame in which the middle angle of the target is 90 deg within its digits.
    X = Robot(ARM).flange(SEEDS[0]) @ TOOLS[0].tcp
    upright = X @ np.linalg.inv(pose(from_zyx(0.5, 90.0 * RAD, 0.0), (0.1, 0.2, 0.3)))
    near = X @ np.linalg.inv(pose(from_zyx(0.5, 89.95 * RAD, 0.3), (0.1, 0.2, 0.3)))
    saved = dict(FRAMES)
    FRAMES.update({3: upright, 4: near})
    w = Writer("UPRIGHT").lines_of("UFRAME_NUM=3", *select[1:], "J P[1] 100% FINE    ", "UFRAME_NUM=4", "J P[2] 100% FINE    ")
    w.pose(SEEDS[0], frame=3).pose(SEEDS[0], frame=4)
    add("upright", w, frames=dict(FRAMES))
    FRAMES.clear()
    FRAMES.update(saved)
    return made


# Running.

VALUE = r"[-+]?\d*\.?\d+(?:[eE][-+]?\d+)?"


def read_backup(files):
    frames, tools, loads = {0: np.eye(4)}, {0: np.eye(4)}, {}
    text = files["sysframe.va"].decode()
    for kind, values in (("MNUFRAME", frames), ("MNUTOOL", tools)):
        section = re.search(r"\$%s .*?(?=\[\*SYSTEM|\Z)" % kind, text, re.S)[0]
        for n, body in re.findall(r"\[1,(\d+)\] =(.*?)(?=\[\d,|\Z)", section, re.S):
            v = {k: float(x) for k, x in re.findall(r"\b([XYZWPR]): *(%s)" % VALUE, body)}
            values[int(n)] = pose(from_zyx(v["R"] * RAD, v["P"] * RAD, v["W"] * RAD),
                                  np.array([v["X"], v["Y"], v["Z"]]) / 1e3)
    for n, field, value in re.findall(r"\$PLST_GRP1\[(\d+)\]\.\$PAYLOAD(\S*) .*= (\S+)", files["symotn.va"].decode()):
        load = loads.setdefault(int(n), [0.0, np.zeros(3)])
        if field:
            load[1]["_X _Y _Z".split().index(field)] = float(value) / 100
        else:
            load[0] = float(value)
    return frames, tools, loads


class Listing:
    def __init__(self, file, data):
        self.file = file
        text = data.decode("latin-1").replace("\r\n", "\n")
        self.name = re.search(r"/PROG +(\w+)", text)[1]
        before, body, positions = re.split(r"^/MN\n|^/POS\n", text, flags=re.M)
        first = before.count("\n") + 2
        self.statements = []  # (line, text)
        for i, line in enumerate(body.split("\n")):
            match = re.match(r"( *)(\d*) *:(.*)$", line)
            if not match or len(match[1]) > 5 and match[2]:
                continue  # blocks of a motion change nothing here
            content = match[3].strip()
            if match[2] or not self.open:
                self.statements.append([first + i, ""])
            self.statements[-1][1] = (self.statements[-1][1] + " " + content.rstrip("; ")).strip()
            self.open = not content.endswith(";")
        self.points = {}
        start = first + body.count("\n") + 1
        for match in re.finditer(r"^P\[(\d+).*?^\};", positions, re.S | re.M):
            text = match[0].split("GP2:")[0]
            line = start + positions[:match.start()].count("\n")
            fields = dict(re.findall(r"\b([A-Z]+\d?) *= *(%s)" % VALUE, text))
            config = re.search(r"[CK]ONFIG : '(.*?)'", text)
            self.points[int(match[1])] = (line, {k: float(v) for k, v in fields.items()},
                                          config and config[1])


ENGLISH = {"BENUTZER_NUM": "UFRAME_NUM", "WKZ_NUM": "UTOOL_NUM", "TRAGLST": "PAYLOAD",
           "SPRUNG LABEL": "JMP LBL", "LABEL": "LBL", "ENDE": "END"}
LEFT = [("Skip", "search"), ("INC", "relative"), ("COORD", "coordinated"), ("RTCP", "remote tool"),
        ("Offset", "offset in a register")]


def execute(files):
    robot = Robot(ARM)
    frames, tools, loads = read_backup(files)
    listings = {x.name: x for x in (Listing(f, d) for f, d in files.items() if f.endswith(".ls"))}
    called = {c for x in listings.values() for _, s in x.statements for c in re.findall(r"CALL (\w+)", s)}
    whole = "\n".join(s for x in listings.values() for _, s in x.statements if s[:2] not in ("//", "--"))
    motions, registers = [], {}
    now = {"UFRAME_NUM": None, "UTOOL_NUM": None, "PAYLOAD": None}

    def move(listing, line, kind, n, via, text):
        at, v, config = listing.points[n]
        tool = tools[now["UTOOL_NUM"]]
        mass, cog = loads[now["PAYLOAD"]]

        def target(v):
            return frames[now["UFRAME_NUM"]] @ pose(
                from_zyx(v["R"] * RAD, v["P"] * RAD, v["W"] * RAD), np.array([v["X"], v["Y"], v["Z"]]) / 1e3)
        motion = Motion(kind, np.eye(4), tool, listing.file, at, mass, cog, instruction=line)
        motion.left = next((why for word, why in LEFT if re.search(r"\b\w*" + word + r"\b", text)), "")
        if re.search(r"(=P\[%d\]|^ *P\[%d,)" % (n, n), whole, re.M):
            motion.left = "used otherwise"
        if "J1" in v:
            motion.joints = np.array([v["J%d" % (i + 1)] for i in range(6)]) * RAD
            motion.target, motion.left = robot.flange(motion.joints) @ tool, "joints"
        else:
            motion.target = target(v)
            motion.agrees = agreeing(robot, config)
        if via is not None:
            motion.via = target(listing.points[via][1])
        motions.append(motion)

    def true(condition):
        n, value = re.fullmatch(r"\(?R\[(\d+)\]=(\d+)\)?", condition.strip()).groups()
        return registers.get(int(n)) == int(value)

    def run(listing):
        statements, at, loops = listing.statements, 0, []
        labels = {re.match(r"LBL\[(\d+)", t)[1]: i for i, (_, t) in enumerate(
            (line, english(t)) for line, t in statements) if t.startswith("LBL[")}

        def matching(at, words):
            depth = 0
            while True:
                at += 1
                text = statements[at][1]
                depth += text.endswith("THEN")
                if depth == 0 and text in words:
                    return at
                depth -= text == "ENDIF"
        while at < len(statements):
            line, text = statements[at]
            text, at = english(text), at + 1
            if not text or text[0] in "!-/=" or text.startswith("ELSE,"):
                continue
            motion = re.match(r"([JLC]) +P\[(\d+)[^\]]*\](.*)$", text)
            if motion:
                end = re.match(r" *P\[(\d+)", motion[3]) if motion[1] == "C" else None
                kind = {"J": "joint", "L": "linear", "C": "circular"}[motion[1]]
                move(listing, line, kind, int(end[1] if end else motion[2]), int(motion[2]) if end else None, motion[3])
                continue
            setting = re.fullmatch(r"(UFRAME_NUM|UTOOL_NUM)=(\d+)|(PAYLOAD)\[(\d+).*\]", text)
            if setting:
                now[setting[1] or setting[3]] = int(setting[2] or setting[4])
            elif re.fullmatch(r"R\[\d+\]=\d+", text):
                registers[int(text[2:text.index("]")])] = int(text.split("=")[1])
            elif text.startswith("JMP LBL["):
                at = labels[re.match(r"JMP LBL\[(\d+)", text)[1]]
            elif text.startswith("CALL "):
                run(listings[re.match(r"CALL (\w+)", text)[1]])
            elif text.startswith("SELECT "):
                register = re.match(r"SELECT (R\[\d+\])", text)[1]
                cases = [re.search(r"=(\d+),JMP LBL\[(\d+)\]", text).groups()]
                while statements[at][1].startswith("="):
                    cases.append(re.search(r"=(\d+),JMP LBL\[(\d+)\]", statements[at][1]).groups())
                    at += 1
                other = re.match(r"ELSE,JMP LBL\[(\d+)\]", statements[at][1])
                at = labels[next((label for value, label in cases if true(register + "=" + value)), other[1])]
            elif text.endswith("THEN"):
                if not true(re.match(r"IF (.*) THEN", text)[1]):
                    at = matching(at - 1, ("ELSE", "ENDIF")) + 1
            elif text == "ELSE":
                at = matching(at - 1, ("ENDIF",)) + 1
            elif text.startswith("IF "):
                condition, action = re.match(r"IF (.*?),(.*)$", text).groups()
                if true(condition):
                    if action.startswith("JMP"):
                        at = labels[re.search(r"\[(\d+)\]", action)[1]]
                    else:
                        now["PAYLOAD"] = int(re.fullmatch(r"PAYLOAD\[(\d+)\]", action)[1])
            elif text.startswith("FOR "):
                n, first, last = re.match(r"FOR R\[(\d+)\]=(\d+) TO (\d+)", text).groups()
                registers[int(n)] = int(first)
                loops.append((int(n), int(last), at))
            elif text == "ENDFOR":
                n, last, start = loops[-1]
                registers[n] += 1
                at = start if registers[n] <= last else loops.pop() and at
            elif text == "END":
                return

    def english(text):
        for german, word in ENGLISH.items():
            if re.match(german + r"\b", text):
                return word + text[len(german):]
        return text

    for name, listing in listings.items():
        if name not in called:
            run(listing)
    for motion in motions:  # a point that is reached with two loads has no single correction
        same = [m for m in motions if (m.file, m.line) == (motion.file, motion.line)]
        if any(m.mass != motion.mass for m in same) or any(m.left for m in same):
            motion.left = motion.left or "several contexts"
    return motions
