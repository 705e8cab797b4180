#!/usr/bin/env python3
"""`plumbline registers scan` on simulated controllers: right profiles, wrong ones, seconds.

    register_scan.py --product build/bin/plumbline [--devices 232] [--first-seed 1] [--jobs 4]

A person is simulated too: who moves the robot below zero if the scan asks for that, reads the teach
pendant, lets the robot work, or moves one axis at a time. Some devices must stay open, because every
profile of them is wrong somewhere (angles modulo one turn without whole turns, of an arm that turns
further), and some may, because two places hold the same joints. A profile is right if it decodes 20 further postures as the
controller has them and asks only for registers that the controller gives."""

import argparse
import concurrent.futures
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import time
import tomllib

try:
    import numpy as np
    import register_devices as devices
except ImportError as missing:
    print("SKIPPED:", missing)
    sys.exit(77)

CELLS = ["ur10", "ur5", "irb120", "kr210", "xarm6", "iiwa7"]
STEP_DEG, RUNS = 10.0, 5


class Person:
    """Operates one device and the scan of it."""

    def __init__(self, product, device, folder):
        self.product, self.device, self.folder = product, device, folder
        self.seconds, self.runs, self.longest = 0.0, [], 0.0

    def scan(self, *words, confirm=False):
        server = self.server
        profile = self.folder / "profile.toml"
        profile.unlink(missing_ok=True)
        command = [self.product, "registers", "scan", "127.0.0.1:%d" % server.port, "--cell", self.device.arm.path,
                   "--output", str(profile), "--json", *words, *(["--confirm"] if confirm else [])]
        start, waited = time.monotonic(), 0.0
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        if confirm:
            for joint in range(len(self.device.q)):
                if not self.prompted(process):
                    break
                with self.device.lock:
                    step = STEP_DEG if self.device.q[joint] + STEP_DEG < self.device.arm.upper[joint] else -STEP_DEG
                    self.device.q[joint] += step * self.device.rng.uniform(0.99, 1.01)
                try:
                    process.stdin.write("%g\n" % step)
                    process.stdin.flush()
                except BrokenPipeError:
                    break
        out, err = process.communicate(timeout=300)
        self.longest = max(self.longest, time.monotonic() - start - waited)
        self.seconds += time.monotonic() - start - waited
        try:
            answer = json.loads(out)
        except ValueError:
            answer = {"verdict": "failed", "open": "", "notes": [], "problem": "rc %d: %s %s" % (process.returncode, out[-300:], err[-300:])}
        answer["exit"] = process.returncode
        self.runs.append((words, confirm, answer))
        return answer, profile.read_text() if profile.exists() else None

    @staticmethod
    def prompted(process):
        prompt = ""
        while not prompt.endswith("stop: "):
            more = process.stderr.read(1)
            if not more:
                return False
            prompt += more
        return True

    def pendant(self):
        with self.device.lock:
            return "--joints=" + ",".join("%.2f" % value for value in self.device.now()[0])

    def work(self):
        device, rng = self.device, self.device.rng
        self.server = devices.Server(device)
        with_pendant = rng.random() < 0.5 and not getattr(device, "only_confirm", False)
        words, confirm = (), False
        try:
            for _ in range(RUNS):
                answer, profile = self.scan(*words, confirm=confirm)
                if answer["verdict"] != "undecided":
                    return answer, profile
                hint = answer["open"]
                if "two places" in hint:
                    return answer, profile
                if "--watch" in hint and rng.random() < 0.4:
                    with device.lock:
                        device.q, device.speed_deg_s = device.posture(negative=True), rng.uniform(1, 3, len(device.q))
                        device.start_s = time.monotonic()
                    answer, profile = self.scan("--watch=5")
                    if answer["verdict"] == "decided":
                        return answer, profile
                if device.speed_deg_s.any():  # a person stops the robot before reading the pendant
                    device.q, device.speed_deg_s = device.now()[0], np.zeros(len(device.q))
                if any(words in hint for words in ("below zero", "joints all differ", "not round")):
                    with device.lock:
                        device.q = device.posture(negative=True)
                if with_pendant or getattr(device, "needs_pendant", False) or "with --joints" in hint and "--confirm" not in hint:
                    words = (self.pendant(),)
                if not words or getattr(device, "only_confirm", False):
                    confirm = True
            return answer, profile
        finally:
            self.server.shutdown()
            self.server.server_close()


def decode(profile, registers):
    """Joints in degrees from a profile, independent of the product."""
    q = []
    for group in profile["joints"]:
        per_unit = {"deg": 1, "rad": 180 / math.pi, "mrad": 0.18 / math.pi, "urad": 1.8e-4 / math.pi}[group["unit"]]
        for j, address in enumerate(group["address"]):
            words = [registers.get(address, 0), registers.get(address + 1, 0)]
            value = devices.number_of(words, group["type"], group.get("word_order", "ABCD"))
            value = value * group.get("scale", 1) * per_unit + group.get("offset", 0)
            if group.get("wrap") == "pi" and value > 180:
                value -= 360
            if group.get("wrap") == "revolutions":
                turn = registers.get(group["revolutions"][j], 0)
                value += 360 * group.get("revolutions_scale", 1) * (turn - 65536 if turn > 32767 else turn)
            q.append(value)
    return np.array(q)


def faults_of(profile, device):
    """Why a profile is wrong; empty if it is right."""
    if device.units is not None and profile["unit_id"] not in device.units:
        return "unit %d" % profile["unit_id"]
    for block in profile["read"]:
        function = {"holding": 3, "input": 4}[block["table"]]
        if function not in device.functions or block["count"] > device.max_count or not device.readable(block["first"], block["count"]):
            return "block %s" % block
    resolution = {"int16": 0.06, "uint16": 0.06, "int32": 0.006, "float32": 0.003}[profile["joints"][0]["type"]]
    rng = np.random.default_rng(7)
    for _ in range(20):
        q = device.arm.posture(rng)
        if not device.one_turn:  # also beyond half a turn, where the arm goes there
            q = np.where(rng.random(len(q)) < 0.2, np.clip(1.9 * q, device.arm.lower, device.arm.upper), q)
        found = decode(profile, device.registers(q, np.zeros(len(q))))
        if len(found) != len(q) or np.abs(found - q).max() > resolution:
            return "joints %s instead of %s" % (np.round(found, 2), np.round(q, 2))
    return ""


def judge(kind, seed, product):
    rng = np.random.default_rng([seed, devices.KINDS.index(kind)])
    arm = devices.Arm("config/cells/%s.toml" % CELLS[seed % len(CELLS)])
    device = kind(arm, rng)
    with tempfile.TemporaryDirectory() as folder:
        person = Person(product, device, pathlib.Path(folder))
        answer, text = person.work()
    words = " ".join(answer["notes"] + [answer["problem"], answer["open"]])
    if text is not None:
        fault = "a profile where none is possible" if device.expected or device.must_stay_open else faults_of(tomllib.loads(text), device)
        outcome = "WRONG" if fault else "right"
        words = fault or words
    elif device.expected is not None:
        named = device.expected in words or (answer["verdict"] == "none" and device.expected.startswith("no decoding"))
        outcome = "right" if named else "missed"
    else:
        kept = device.must_stay_open and answer["verdict"] == "undecided" or device.may_stay_open and "two places" in words
        outcome = "open" if kept else "missed"
    return {"kind": kind.__name__, "seed": seed, "arm": pathlib.Path(arm.path).stem, "outcome": outcome, "words": words,
            "runs": len(person.runs), "seconds": person.longest, "requests": answer.get("requests", 0)}


def main():
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    options.add_argument("--product", required=True)
    options.add_argument("--devices", type=int, default=8 * len(devices.KINDS))
    options.add_argument("--first-seed", type=int, default=1)
    options.add_argument("--jobs", type=int, default=4)
    options.add_argument("--only", help="one kind")
    options.add_argument("--verbose", action="store_true")
    options = options.parse_args()
    kinds = [kind for kind in devices.KINDS if options.only in (None, kind.__name__)]
    work = [(kinds[k % len(kinds)], options.first_seed + k // len(kinds)) for k in range(options.devices)]
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        results = list(pool.map(lambda one: judge(*one, options.product), work))
    print("%-24s %6s %6s %6s %6s %9s %9s" % ("kind", "right", "open", "missed", "WRONG", "requests", "longest s"))
    for kind in kinds:
        of_kind = [one for one in results if one["kind"] == kind.__name__]
        if not of_kind:
            continue
        count = {o: sum(one["outcome"] == o for one in of_kind) for o in ("right", "open", "missed", "WRONG")}
        print("%-24s %6d %6d %6d %6d %9.0f %9.1f" % (kind.__name__, *count.values(), np.mean([one["requests"] for one in of_kind]),
                                                    max(one["seconds"] for one in of_kind)))
    for one in results:
        if options.verbose or one["outcome"] in ("missed", "WRONG"):
            print("%s %s: seed %d, %s, %d runs: %s" % (one["outcome"], one["kind"], one["seed"], one["arm"], one["runs"], one["words"][:300]))
    count = {o: sum(one["outcome"] == o for one in results) for o in ("right", "open", "missed", "WRONG")}
    decidable = len(results) - count["open"]
    share, longest = count["right"] / max(1, decidable), max(one["seconds"] for one in results)
    print("%d devices of %d kinds: right %d of the %d that were not left open for a reason (%.1f %%, goal 95 %%), missed %d, wrong %d"
          " (goal 0), left open because nothing decides %d, longest scan %.1f s (goal 30 s)"
          % (len(results), len(kinds), count["right"], decidable, 100 * share, count["missed"], count["WRONG"], count["open"], longest))
    sweep = 2 * 1024 + 2 * 64  # the same registers of both tables, one by one
    requests = float(np.median([one["requests"] for one in results]))
    print("requests of a scan: median %.0f; one by one the same registers take %d (ratio %.2f)" % (requests, sweep, requests / sweep))
    # Seconds depend on what else the machine does: shown, not judged.
    return 0 if count["WRONG"] == 0 and share >= 0.95 else 1


if __name__ == "__main__":
    sys.exit(main())
