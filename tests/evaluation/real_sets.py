"""The measured folder's real sets, and which of their rows are held out: stretches of the order of
execution, whole sessions, whole sets of the same arm."""

import os
from dataclasses import dataclass

import numpy as np

import separability


@dataclass
class Split:
    """Rows are numbers from 0. Folds of one split share their words."""
    name: str
    words: str
    train_set: str
    train: np.ndarray
    test_set: str
    test: np.ndarray
    align: np.ndarray = None  # of test_set, where it belongs to another session; never among `test`
    goal_mm: float = None


def rows_of(measured, name):
    return separability.table(os.path.join(measured, name, "measured.csv"))


def schema(measured, name):
    with open(os.path.join(measured, name, "cell.toml")) as file:
        for line in file:
            key, _, value = line.partition("=")
            if key.strip() == "schema":
                return int(value.split("#")[0])
    return 1


def blocks(measured, name, length, folds, goal_mm=None):
    """Every fifth block of consecutive rows."""
    count = len(rows_of(measured, name))
    block = np.arange(count) // length
    for fold in range(folds):
        out = block % 5 == fold
        yield Split(name, f"every fifth block of {length}", name, np.flatnonzero(~out), name,
                    np.flatnonzero(out), goal_mm=goal_mm)


def last_in_time(measured, name, share, goal_mm=None):
    count = len(rows_of(measured, name))
    first = round((1 - share) * count)
    yield Split(name, f"last {100 * share:.0f} % in time", name, np.arange(first), name,
                np.arange(first, count), goal_mm=goal_mm)


def sessions(measured, name, goals_mm):
    """Each session from all the others."""
    session = np.array([row["session"] for row in rows_of(measured, name)])
    for one in sorted(set(session)):
        held = np.flatnonzero(session == one)
        others = "+".join(sorted(set(session) - {one}))
        yield Split(name, f"session {one} from {others}, aligned on every fifth row", name,
                    np.flatnonzero(session != one), name, np.setdiff1d(held, held[::5]), held[::5],
                    goals_mm.get(one))


def another_set(measured, name, other):
    """The same arm, measured another time."""
    held = np.arange(len(rows_of(measured, other)))
    yield Split(f"{name} to {other}", "the whole set, aligned on every fifth row", name,
                np.arange(len(rows_of(measured, name))), other, np.setdiff1d(held, held[::5]), held[::5])


def splits(measured, folds):
    """(all splits of the sets that are there, why others are skipped)"""
    there = lambda *names: all(os.path.isdir(os.path.join(measured, n)) for n in names)
    found, grid, random = [], "real-ur10-grid", "real-ur10-random"
    if there(random):
        found += blocks(measured, random, 60, folds, 0.095)
    if there(grid):
        found += blocks(measured, grid, 300, min(folds, 1))
    if there(grid, random):
        found += [*another_set(measured, grid, random), *another_set(measured, random, grid)]
    if there("real-irb120"):
        found += last_in_time(measured, "real-irb120", 0.3, 0.23)
    if there("real-iiwa7"):
        found += sessions(measured, "real-iiwa7", {"2": 0.37})
    used = {s.train_set for s in found}
    skipped = []
    for name in sorted(os.listdir(measured)) if os.path.isdir(measured) else []:
        if name.startswith("real-") and name not in used:
            why = "rows of schema 2 have no measured point" if schema(measured, name) >= 2 \
                else "no split is made for it"
            skipped.append(f"{name}: skipped, {why}")
    return found, skipped
