#!/usr/bin/python3
"""Recomputes a file of ISO 9283 characteristics and uncertainties with NumPy, from their formulas.

usage: reference.py FILE.json   exit code 0: all figures agree within 1e-9, 1: some do not, 77: no NumPy
"""
import json
import math
import sys

try:
    import numpy as np
except ImportError:
    sys.exit(77)

COVERAGE = math.erf(math.sqrt(2))  # of two standard deviations
NODES, WEIGHTS = np.polynomial.legendre.leggauss(200)


def coverage_factor(freedom):
    """Two-sided quantile of Student's t: with t = sqrt(v) tan(a), the density is cos(a)^(v - 1)."""
    if not math.isfinite(freedom) or freedom > 1e9:
        return 2.0

    def integral(k):
        upper = math.atan(k / math.sqrt(freedom))
        # Panels much narrower than the density's width 1 / sqrt(v).
        edges = np.linspace(0, upper, 41)
        half = np.diff(edges) / 2
        a = half[:, None] * NODES + (edges[:-1] + half)[:, None]
        log_norm = math.lgamma((freedom + 1) / 2) - math.lgamma(freedom / 2) - math.log(math.pi) / 2
        density = np.exp(log_norm + (freedom - 1) * np.log(np.cos(a)))
        return 2 * float((half[:, None] * WEIGHTS * density).sum())

    low, high = 0.0, 1000.0
    for _ in range(200):
        middle = (low + high) / 2
        if integral(middle) < COVERAGE:
            low = middle
        else:
            high = middle
    return (low + high) / 2


def expanded(lines):
    """Combined standard uncertainty and coverage factor; lines are {source: [[u, freedom], ..]}."""
    u = {source: math.sqrt(sum(one[0] ** 2 for one in of)) for source, of in lines.items()}
    combined = math.sqrt(sum(one ** 2 for one in u.values()))
    inverse = sum(u[source] ** 4 / of[0][1] for source, of in lines.items()
                  if of[0][1] is not None and of[0][1] > 0)
    freedom = combined ** 4 / inverse if inverse > 0 else math.inf
    return combined, coverage_factor(max(1.0, freedom))


def main():
    case = json.load(open(sys.argv[1]))
    readings, given, said = case["readings"], case["contributions"], case["figures"]
    pose = np.array([one["pose"] for one in readings])
    session = np.array([one["session"] for one in readings])
    t = np.array([one["t_s"] for one in readings])
    attained = np.array([one["attained"] for one in readings])
    error = np.array([one["error"] for one in readings])
    command = attained - error
    names = list(dict.fromkeys(pose.tolist()))

    figures = {}
    accuracy, repeatability, repeatability_u, scatter, freedom = [], [], [], 0.0, 0
    for name in names:
        of = error[pose == name]
        accuracy.append(np.linalg.norm(of.mean(axis=0)))
        about = of - of.mean(axis=0)
        scatter += (about ** 2).sum()
        freedom += 3 * (len(of) - 1)
        if len(of) >= 3:
            length = np.linalg.norm(about, axis=1)
            deviation = length.std(ddof=1)
            repeatability.append(length.mean() + 3 * deviation)
            repeatability_u.append(deviation * math.sqrt(1 / len(of) + 4.5 / (len(of) - 1)))
    figures["accuracy"] = accuracy
    figures["mean_accuracy"] = float(np.mean(accuracy))
    figures["repeatability"] = repeatability
    figures["repeatability_u"] = repeatability_u
    figures["cycle_sigma"] = math.sqrt(scatter / freedom) if freedom else 0.0

    cycles = {name: int((pose == name).sum()) for name in names}
    best = (-1.0, 0.0, None)
    for i, a in enumerate(names):
        for b in names[i + 1:]:
            if session[pose == a][0] != session[pose == b][0]:
                continue
            reached = np.linalg.norm(attained[pose == b].mean(0) - attained[pose == a].mean(0))
            wanted = np.linalg.norm(command[pose == b].mean(0) - command[pose == a].mean(0))
            if wanted > best[0]:
                best = (wanted, reached - wanted, (a, b))
    figures["distance_commanded"], figures["distance"] = float(best[0]), float(best[1])

    def repeatability_line(n):
        if freedom == 0:
            return [given["residual"], given["residual_freedom"]]
        return [figures["cycle_sigma"] / math.sqrt(n), freedom]

    def lines(n):
        of = {"joint": [[given["joint_reading"], None]], "repeat": [repeatability_line(n)],
              "model": [[given["residual"] * math.sqrt(given["parameters"] / given["lengths"]),
                         given["residual_freedom"]]]}
        if given["instrument"] is not None:
            of["instrument"] = [[given["instrument"], None]]
        return of

    budgets = [expanded(lines(cycles[name])) for name in names]
    figures["combined"] = [one[0] for one in budgets]
    figures["k"] = [one[1] for one in budgets]
    both = lines(cycles[best[2][0]])
    for source, of in lines(cycles[best[2][1]]).items():
        both[source] = both[source] + of
    figures["distance_u"], figures["distance_k"] = expanded(both)

    drift, longest = None, 0.0
    for name in names:
        at = np.flatnonzero(pose == name)
        visits = np.split(at, np.flatnonzero(np.diff(at) > 1) + 1)
        if len(visits) < 2:
            continue
        first, last = visits[0], visits[-1]
        elapsed = t[last].mean() - t[first].mean()
        if elapsed <= longest:
            continue
        longest = elapsed
        drift = (abs(np.linalg.norm(error[last].mean(0)) - np.linalg.norm(error[first].mean(0))),
                 len(first), len(last))
    if drift:
        figures["drift"], figures["drift_elapsed"] = float(drift[0]), float(longest)
        of = {"repeat": [repeatability_line(drift[1]), repeatability_line(drift[2])]}
        if given["instrument"] is not None:
            of["instrument"] = 2 * [[given["instrument"], None]]
        figures["drift_u"], figures["drift_k"] = expanded(of)

    wrong = sorted(set(figures) ^ set(said))
    for name in set(figures) & set(said):
        mine, theirs = np.atleast_1d(figures[name]), np.atleast_1d(said[name])
        if mine.shape != theirs.shape or not np.all(np.abs(mine - theirs) <= 1e-9 * np.maximum(1, np.abs(mine))):
            wrong.append(f"{name}: {mine} here, {theirs} in the file")
    print("\n".join(wrong))
    sys.exit(1 if wrong else 0)


main()
