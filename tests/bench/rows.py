"""Rows of the benchmark table, as in rows.h: printed, and appended to the file $PLUMBLINE_BENCH_ROWS."""
import json
import os


def _append(row):
    file = os.environ.get("PLUMBLINE_BENCH_ROWS")
    if file:
        with open(file, "a") as out:
            out.write(json.dumps(row) + "\n")


def report(what, ours, unit="", goal=None, peer="", peers=None, timed=True):
    """@param goal  ("ours" or "ratio", "<=" or ">=", bound)"""
    of, sense, bound = goal or ("", "", 0)
    text = "> %s: %.4g %s" % (what, ours, unit)
    if peer:
        text += "; %s: %.4g %s, ratio %.3g" % (peer, peers, unit, ours / peers if peers else float("nan"))
    if of:
        text += "; goal: %s %s %g" % (of, sense, bound)
    print(text, flush=True)
    _append({"what": what, "ours": ours, "unit": unit, "of": of, "sense": sense, "bound": bound, "peer": peer,
             "peers": peers, "timed": timed})


def skipped(what, reason):
    print("SKIPPED: %s: %s" % (what, reason), flush=True)
    _append({"what": what, "skipped": reason})
