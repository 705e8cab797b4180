"""Yaskawa INFORM: jobs with the tools of their controller, and an interpreter of jobs."""

import re

import numpy as np

from .common import Motion, Robot, Tool, about, from_zyx, pose, shift, to_zyx

NAME = "Yaskawa INFORM"
ARM = "yaskawa"
TOOLS = [Tool(1, shift(0, 0, 0.21)), Tool(2, pose(about(0, 0.6) @ about(2, -0.5), (-0.05, 0.04, 0.17)))]
RAD = np.pi / 180
START = np.array([5, 20, -15, 10, -60, 10]) * RAD  # jobs do not state the flip
LOADS = {1: (7.25, (0.012, -0.02, 0.11)), 2: (14.5, (-0.02, 0.03, 0.14))}  # by tool
USER = pose(from_zyx(0.4, 0.1, -0.2), (0.3, -0.25, 0.15))
OPTIONS = {"SPECIAL": ["--start", "shift=none"], "user": ["--base", "USER 2=" + ",".join(
    "%.9f" % v for v in (*(USER[:3, 3] * 1e3), *(np.array(to_zyx(USER[:3, :3]))[::-1] / RAD)))]}

SEEDS = np.array([
    [10, 20, -20, 15, -60, 20], [-25, 30, -10, -15, -80, -40], [40, -10, -35, 20, -50, 70],
    [-50, 25, 5, -10, -95, 110], [5, 45, -15, 30, -40, -120]]) * RAD


def rconf(robot, q):
    """Upper or lower arm, front or rear, and the ranges of R, T and S; flip is not read."""
    def planar(q):
        axes, points, after = robot.arm.frames(robot.axes @ np.asarray(q, float))
        wrist = after[3][1]
        return np.array([np.dot(axes[1], np.cross(points[2] - points[1], wrist - points[1])),
                         np.dot(np.cross(axes[1], axes[0]), wrist - points[0])])
    lower, rear = planar(q) * planar(np.zeros(6)) < 0
    return [1, int(lower), int(rear), *(int(abs(q[j]) > np.pi) for j in (3, 5, 0))]


def job(name, blocks, instructions):
    """`blocks`: (tool, base matrix, header of the base, [(posture, shift)])."""
    robot, lines, count = Robot(ARM), [], 0
    for tool, base, header, points in blocks:
        lines += ["///TOOL %d" % tool] if not header else [header[0], "///TOOL %d" % tool, *header[1:]]
        for i, by in points:
            X = np.linalg.inv(base) @ robot.flange(SEEDS[i]) @ TOOLS[tool - 1].tcp @ shift(*by)
            z, y, x = np.array(to_zyx(X[:3, :3])) / RAD
            conf = "///RCONF " + ",".join(map(str, rconf(robot, SEEDS[i]) + [0] * 18))
            if conf not in lines[-2:] and (not any(c.startswith("///RCONF") for c in lines)
                                           or [c for c in lines if c.startswith("///RCONF")][-1] != conf):
                lines.append(conf)
            lines.append("C%05d=%.3f,%.3f,%.3f,%.4f,%.4f,%.4f" % (count, *(X[:3, 3] * 1e3), x, y, z))
            count += 1
    text = ["/JOB", "//NAME " + name, "//POS", "///NPOS %d,0,0,1,0,0" % count, *lines,
            "P00010=0.000,0.000,50.000,0.0000,0.0000,0.0000", "//INST", "///DATE 2024/05/06 07:08",
            "///ATTR SC,RW", "///GROUP1 RB1", "NOP", *instructions, "END"]
    return "\r\n".join(text) + "\r\n"


def programs():
    tools = ""
    for n in range(3):
        tcp = TOOLS[n - 1].tcp if n else np.eye(4)
        mass, cog = LOADS.get(n, (0.0, (0, 0, 0)))
        z, y, x = np.array(to_zyx(tcp[:3, :3])) / RAD
        tools += "//TOOL %d\r\n///NAME T%d\r\n%.3f,%.3f,%.3f,%.9f,%.9f,%.9f\r\n%.3f,%.3f,%.3f\r\n%.3f\r\n" % (
            n, n, *(tcp[:3, 3] * 1e3), x, y, z, *(1e3 * np.array(cog)), mass)
        tools += "0.000,0.000,0.000\r\n0.000,0,1\r\n"
    robot = ["///POSTYPE ROBOT", "///RECTAN"]
    here = [(0, (0, 0, 0)), (0, (0.05, 0, 0.02)), (0, (0.1, 0.05, 0)), (0, (0.12, 0.1, 0))]
    far = [(1, (0, 0, 0)), (2, (0, 0, 0)), (3, (0, 0, 0)), (4, (0, 0, 0))]
    made = {
        "PLAIN": {"PLAIN.JBI": job("PLAIN", [(1, np.eye(4), robot, far)], [
            "MOVJ C00000 VJ=50.00", "MOVJ C00001 VJ=50.00 PL=0  //NEAR", "MOVL C00001 V=100.0",
            "MOVJ C00002 VJ=10.00 PL=3", "'MOVJ C00009 VJ=1.00", "COMM MOVL C00000 V=1.0", "MOVJ C00003 VJ=50.00"])},
        "TOOLS": {"TOOLS.JBI": job("TOOLS", [(1, np.eye(4), robot, far[:2]), (2, np.eye(4), robot, far[2:])], [
            "MOVJ C%05d VJ=50.00" % i for i in range(4)])},
        "user": {"USERS.JBI": job("USERS", [
            (1, USER, ["///USER 2", "///POSTYPE USER", "///RECTAN"], here),
            (1, np.eye(4), ["///POSTYPE BASE", "///RECTAN"], far[:1])], [
            "MOVJ C00000 VJ=50.00", "MOVL C00001 V=100.0 CR=5.0", "MOVC C00001 V=50.0", "MOVC C00002 V=50.0",
            "MOVC C00003 V=50.0", "MOVJ C00004 VJ=20.00"])},
        "CALLS": {"CALLS.JBI": job("CALLS", [(1, np.eye(4), robot, here)], [
            "SET B001 0", "*LOOP", "MOVJ C00000 VJ=50.00", "CALL JOB:INNER", "JUMP *DONE IF B001=1", "SET B001 1",
            "JUMP *LOOP", "*DONE", "IFTHENEXP B001=1", "MOVL C00001 V=100.0", "ELSE", "MOVL C00002 V=100.0",
            "ENDIF"]),
            "INNER.JBI": job("INNER", [(2, np.eye(4), robot, far[1:3])], [
                "MOVJ C00000 VJ=50.00", "MOVJ C00001 VJ=50.00", "RET"])},
        "SPECIAL": {"SPECIAL.JBI": job("SPECIAL", [(1, np.eye(4), robot, here)], [
            "MOVJ C00000 VJ=50.00", "MOVL C00001 V=5.0 UNTIL IN#(1)=ON", "MOVJ C00000 VJ=50.00", "SFTON P00010",
            "MOVL C00002 V=50.0", "SFTOF", "REFP 1 C00003", "MOVJ C00000 VJ=50.00", "MOVJ C00003 VJ=50.00"])},
    }
    return {name: {**{f: t.encode() for f, t in files.items()}, "TOOL.CND": tools.encode()}
            for name, files in made.items()}


def execute(files):
    robot, tools, motions = Robot(ARM), {}, []
    for n, body in re.findall(r"//TOOL (\d+)\r\n(.*?)(?=//TOOL|\Z)", files["TOOL.CND"].decode(), re.S):
        rows = [list(map(float, r.split(","))) for r in body.split("\r\n") if r and not r.startswith("///")]
        x, y, z = np.array(rows[0][3:]) * RAD
        tools[int(n)] = (pose(from_zyx(z, y, x), np.array(rows[0][:3]) / 1e3), rows[2][0], np.array(rows[1]) / 1e3)
    jobs = {}
    for file, data in files.items():
        if not file.endswith(".JBI"):
            continue
        lines, now, points, start = data.decode().split("\r\n"), {}, {}, None
        for i, line in enumerate(lines):
            if line.startswith("///"):
                now[line[3:].split(" ")[0]] = line.partition(" ")[2]
            elif line == "//INST":
                start = i
                break
            elif re.match(r"C\d+=", line):
                name, numbers = line.split("=")
                points[name] = (i + 1, list(map(float, numbers.split(","))), dict(now))
        jobs[lines[1].split(" ")[1]] = (file, points, [l for l in lines[start + 1:] if l])
    variables, shifted = {}, [False]

    def run(name):
        file, points, lines = jobs[name]
        labels = {l: i for i, l in enumerate(lines) if l.startswith("*")}
        at = 0
        while at < len(lines):
            line, at = lines[at].split("//")[0].strip(), at + 1
            words = line.split()
            if not words or words[0][0] in "'*/" or words[0] in ("COMM", "NOP", "REFP"):
                continue
            if words[0] in ("END", "RET"):
                return
            if words[0] == "SET":
                variables[words[1]] = int(words[2])
            elif words[0] == "CALL":
                run(words[1][4:])
            elif words[0] == "JUMP":
                if len(words) == 2 or variables[words[3].split("=")[0]] == int(words[3].split("=")[1]):
                    at = labels[words[1]]
            elif words[0] == "IFTHENEXP":
                variable, value = words[1].split("=")
                if variables[variable] != int(value):
                    at = lines.index("ELSE", at) + 1
            elif words[0] == "ELSE":
                at = lines.index("ENDIF", at) + 1
            elif words[0] in ("SFTON", "SFTOF"):
                shifted[0] = words[0] == "SFTON"
            elif words[0].startswith("MOV"):
                number, v, head = points[words[1]]
                tool, mass, cog = tools[int(head["TOOL"])]
                base = USER if head["POSTYPE"] == "USER" else np.eye(4)
                kind = {"J": "joint", "L": "linear", "C": "circular"}[words[0][3]]
                motion = Motion(kind, base @ pose(from_zyx(v[5] * RAD, v[4] * RAD, v[3] * RAD), np.array(v[:3]) / 1e3),
                                tool, file, number, tool_mass=mass, tool_cog=cog)
                wanted = list(map(int, head["RCONF"].split(",")))[1:6]
                motion.agrees = lambda q, wanted=wanted: rconf(robot, q)[1:] == wanted
                motion.left = "search" if "UNTIL" in words else "shift" if shifted[0] else ""
                if re.search(r"^REFP \d+ %s" % words[1], "\n".join(lines), re.M):
                    motion.left = "reference point"
                motions.append(motion)
    called = {n for _, _, lines in jobs.values() for l in lines for n in re.findall(r"CALL JOB:(\w+)", l)}
    for name in jobs:
        if name not in called:
            run(name)
    for motion in motions:
        if any(m.left for m in motions if (m.file, m.line) == (motion.file, motion.line)):
            motion.left = motion.left or "used otherwise"
    return motions
