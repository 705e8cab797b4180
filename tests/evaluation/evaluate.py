#!/usr/bin/python3
"""Scores `plumbline diagnose` on fresh simulated data: simulate, diagnose, predict, judge, count."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np  # noqa: E402  (after the thread limits)

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import damage  # noqa: E402
import goals  # noqa: E402
import groups  # noqa: E402
import runs  # noqa: E402
import scorer  # noqa: E402
import separability  # noqa: E402


def rms(a, b):
    return float(np.sqrt(np.mean(np.sum((a - b) ** 2, axis=1))))


class Case:
    """One run of a group, as files in a folder of its own."""

    def __init__(self, case, product, simulate, timeout_s, folder):
        self.group, family, seed, options = case
        self.product, self.simulate, self.timeout_s, self.folder = product, simulate, timeout_s, folder
        self.row = {"group": self.group.name, "family": family, "seed": seed, "options": options}
        self.draw()
        for _ in range(30 if self.group.separable else 0):
            if self.judged()["class"] == "separable":
                break
            self.row["seed"] += 1000000
            self.draw()

    def draw(self):
        """Simulates the row's seed."""
        subprocess.run([self.simulate, "--family", self.row["family"], "--seed", str(self.row["seed"]),
                        "--out", self.folder] + self.row["options"],
                       check=True, capture_output=True, text=True)
        with open(self.place("truth.json")) as file:
            self.truth = json.load(file)
        self.row["signal"] = self.truth["signal"]
        self.executed = self.place("measured.csv")
        if self.group.damage:
            self.words = damage.apply(self.group.damage, self.folder, self.row["seed"])
            self.executed = self.place("as_executed.csv")

    def judged(self):
        return separability.judge(self.folder, self.simulate, scorer.key, self.executed)

    def place(self, name):
        return os.path.join(self.folder, name)

    def ask(self, command, *arguments):
        """What the product printed. @throws RuntimeError where it fails"""
        done = subprocess.run([self.product, command, *arguments], capture_output=True, text=True,
                              timeout=self.timeout_s)
        self.said = done.stdout + done.stderr
        if done.returncode != 0:
            raise RuntimeError(f"{command} ends with {done.returncode}: {done.stderr.strip()[-300:]}")

    def diagnose(self):
        begin = time.monotonic()
        self.ask("diagnose", self.place("cell.toml"), self.place("measured.csv"), "--json",
                 self.place("diagnosis.json"), "--write-model", self.place("corrected.toml"), "--details",
                 *self.group.diagnose)
        self.row["seconds"] = time.monotonic() - begin
        with open(self.place("diagnosis.json")) as file:
            return json.load(file)

    def judge_mistake(self):
        """A mistake in the files is to be named, in a refusal or beside the answer."""
        try:
            self.row.update(scorer.judge_mistake(self.diagnose(), self.said, self.words, self.truth))
        except RuntimeError:
            self.row.update(scorer.judge_mistake(None, self.said, self.words, self.truth))

    def judge_answer(self):
        judged = self.judged()
        self.row.update({k: judged.get(k) for k in ("distance", "nearest", "confusable")})
        self.fit_by_one_who_knows()
        self.row.update(scorer.judge_answer(self.diagnose(), self.truth, judged))
        if self.row["family"] == "air_pressure":
            self.row["slope"] = scorer.tells_slope(self.said, self.truth)
        self.judge_prediction()

    def fit_by_one_who_knows(self):
        if not self.truth["effects"] and not self.truth["nuisances"]:
            return
        true_cell = self.place("true_cell.toml")
        subprocess.run([self.simulate, "--fit", "--with", self.place("truth.json"), "--cell",
                        true_cell if os.path.exists(true_cell) else self.place("cell.toml"), "--measured", self.executed, "--poses",
                        self.place("test_poses.csv"), "--out", self.place("fit.csv")],
                       check=True, capture_output=True)
        decided = self.decided()
        self.row["fit_mm"] = rms(separability.points(self.place("fit.csv"))[decided],
                                 self.true_tips()[decided])

    def true_tips(self):
        return separability.points(self.place("test_truth.csv"))

    def decided(self):
        """False of new points between the two rows that an event fell between: the fit that knows
        the moment has them right, the rows do not tell."""
        tests = separability.table(self.place("test_poses.csv"))
        decided = np.ones(len(tests), bool)
        events = [p["value"] for e in self.truth["effects"] for p in e["parameters"]
                  if p["name"] == "time"]
        if not events or "t_s" not in tests[0]:
            return decided
        moments = np.array([float(row["t_s"]) for row in tests])
        rows = np.sort([float(row["t_s"]) for row in separability.table(self.place("measured.csv"))])
        for event in events:
            before, after = rows[rows <= event], rows[rows > event]
            if before.size and after.size:
                decided &= (moments < before[-1]) | (moments > after[0])
        return decided

    def judge_prediction(self):
        self.ask("predict", self.place("corrected.toml"), self.place("test_poses.csv"), "--out",
                 self.place("predicted.csv"))
        predicted = np.genfromtxt(self.place("predicted.csv"), delimiter=",", names=True)
        tips = np.column_stack([predicted[n] for n in ("x_mm", "y_mm", "z_mm")])
        real, sigma_mm, row = self.true_tips(), 1e3 * self.truth["sigma"], self.row
        decided = self.decided()
        row["rms_mm"] = rms(tips[decided], real[decided])
        row["rms_over_sigma"] = row["rms_mm"] / (np.sqrt(3) * sigma_mm)
        row["before_mm"] = self.truth["before_test_rms_mm"]
        if "u_mm" in predicted.dtype.names:
            off = np.linalg.norm(tips - real, axis=1)
            row["inside_u"], row["points"] = int(np.sum(off <= predicted["u_mm"])), len(off)
            noise = np.random.default_rng(row["seed"]).normal(0, sigma_mm, tips.shape)
            off = np.linalg.norm(tips - real - noise, axis=1)
            row["measured_inside_u"] = int(np.sum(off <= predicted["u_mm"]))


def run_case(case, product, simulate, timeout_s, keep):
    group, family, seed, _ = case
    folder = tempfile.mkdtemp(prefix=f"{family}-{seed}-", dir=keep or tempfile.gettempdir())
    run = Case(case, product, simulate, timeout_s, folder)
    try:
        if group.damage in damage.MISTAKES:
            run.judge_mistake()
        else:
            run.judge_answer()
    except subprocess.TimeoutExpired:
        run.row["error"] = f"no answer within {timeout_s} s"
    except (RuntimeError, OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        run.row["error"] = f"{type(error).__name__}: {error}"
    finally:
        if not keep:
            shutil.rmtree(folder, ignore_errors=True)
    return run.row


def main():
    # Half the cores, so that each run has two.
    parser = runs.parser(__doc__, 12, max(1, (os.cpu_count() or 2) // 2), "one run of each family")
    parser.add_argument("--group", action="append", help="only groups that start so")
    parser.add_argument("--timeout-s", type=float, default=120)
    parser.add_argument("--out", help="write the tables here too")
    parser.add_argument("--show", type=int, default=30, help="cases to tell that were not right")
    options = runs.parse(parser)
    listed = subprocess.run([options.simulate, "--list"], check=True, capture_output=True, text=True)
    cases = list(groups.plan(listed.stdout.split(), 1 if options.quick else options.seeds,
                      options.first_seed))
    if options.family:
        cases = [c for c in cases if c[1] in options.family]
    if options.group:
        cases = [c for c in cases if c[0].name.startswith(tuple(options.group))]
    rows = runs.run_all(options.jobs, run_case, cases, options.product, options.simulate,
                        options.timeout_s, options.keep)
    text = f"{len(rows)} runs, seeds from {options.first_seed}.\n\n" + goals.markdown(rows)
    print(text)
    not_right = goals.complaints(rows, options.show)
    if not_right:
        print("Not right:\n\n" + not_right)
    if options.out:
        with open(options.out, "w") as file:
            file.write(text)
    if options.json:
        with open(options.json, "w") as file:
            json.dump({"first_seed": options.first_seed, "summary": goals.summary(rows), "runs": rows}, file,
                      indent=1)


if __name__ == "__main__":
    main()
