"""The goals beside what was reached: rates with their 95 % bounds, tables, the cases that missed."""

import math
import statistics

import scorer


def share(hits, count):
    if count == 0:
        return "-"
    low, high = scorer.wilson(hits, count)
    return f"{100 * hits / count:.1f} % ({hits}/{count}; {100 * low:.1f} to {100 * high:.1f})"


def quotient(row):
    """Error of the corrected model over that of a fit by one who knows the form."""
    if row.get("fit_mm") and "rms_mm" in row:
        return row["rms_mm"] / row["fit_mm"]
    return None


def median(values, form="{:.2f}"):
    values = [v for v in values if v is not None]
    return form.format(statistics.median(values)) if values else "-"


def count(rows, what):
    return sum(bool(r.get(what)) for r in rows), len(rows)


def rate(rows, what):
    return share(*count(rows, what))


def of_group(rows, start):
    return [r for r in rows if r["group"].startswith(start)]


def separable(rows):
    """What an effect was hidden in, separable; a run without an answer counts among them."""
    return [r for r in rows if r["family"] != "none" and r.get("signal", 5) >= 5
            and r.get("kind", "separable") == "separable"]


def left_over(rows):
    """Median and nine tenths of the error over that of the fit that knows."""
    found = sorted(q for q in map(quotient, rows) if q is not None)
    if not found:
        return "-"
    return f"{statistics.median(found):.2f} and {found[math.ceil(0.9 * len(found)) - 1]:.2f}"


def at_once(rows):
    """Three and four effects at once."""
    for name in dict.fromkeys(r["group"] for r in rows):
        if not name.startswith(("three", "four", "compliance, growth")):
            continue
        some = of_group(rows, name)
        clear = separable(some)
        yield f"{name}: all named exactly, where separable", ">= 90 %", rate(clear, "named")
        yield f"{name}: no name that was not hidden", ">= 98 %", rate(some, "no_false_name")
        yield f"{name}: error over the fit that knows, median and 9 of 10", "<= 1.1", left_over(clear)


def noises(rows):
    for name in dict.fromkeys(r["group"] for r in rows if r["group"].startswith("noise")):
        some = of_group(rows, name)
        clear = separable(some)
        yield f"{name}: confidently wrong", "<= 1 %", rate(some, "wrong")
        yield f"{name}: named exactly, where separable", "-", rate(clear, "named")
        yield f"{name}: error over the fit that knows, median and 9 of 10", "-", left_over(clear)


def unknowns(rows):
    outside = [r for r in of_group(rows, "outside") if r.get("kind", "outside") == "outside"]
    better = [r for r in outside if "rms_mm" in r and r["rms_mm"] <= 0.5 * r["before_mm"]]
    yield "outside: unknown, the driver among the first three", ">= 90 %", rate(outside, "right")
    first = [r for r in outside if r.get("verdict") == "unknown" and r.get("driver_first")]
    yield "outside: unknown, the driver first", "-", share(len(first), len(outside))
    yield "outside: held-out error at most half of before", "-", share(len(better), len(outside))
    linear = [r for r in outside if r["family"] == "air_pressure"]
    yield "a linear driver: its slope told in mm per bar, to a tenth", ">= 90 %", rate(linear, "slope")
    both = of_group(rows, "two drivers")
    yield "two drivers and their product: unknown, both told", ">= 90 %", rate(both, "right")
    either = of_group(rows, "time or temp")
    yield "time and temperature rise together: ambiguous, both told", ">= 95 %", rate(either, "right")
    yield from warmer(of_group(rows, "temperature times"))


def warmer(rows):
    """Beyond the trained temperatures the corrected model may not be worse than the declared one."""
    ratios = [r["rms_mm"] / r["before_mm"] for r in rows if "rms_mm" in r]
    worse = [q for q in ratios if q > 1.05]
    reached = f"{share(len(worse), len(rows))}, at most {max(ratios):.2f} times" if ratios else "-"
    yield "temperature times payload, 3 K warmer: worse than declared by 5 %", "0", reached
    yield "temperature times payload: unknown, both told", ">= 90 %", rate(rows, "right")


def probes(rows):
    hidden = [r for r in of_group(rows, "the closed loop's") if r["family"] != "none"]
    nothing = [r for r in of_group(rows, "the closed loop's") if r["family"] == "none"]
    yield "the closed loop's probes: one effect, named exactly", ">= 98 %", rate(hidden, "named")
    yield "the closed loop's probes, nothing hidden: no_effect", ">= 95 %", rate(nothing, "right")


def damaged(rows):
    for name in dict.fromkeys(r["group"] for r in rows if r["group"].startswith("lost")):
        some = of_group(rows, name)
        yield f"{name}: named exactly, where separable", ">= 95 %", rate(separable(some), "named")
        yield f"{name}: confidently wrong", "<= 1 %", rate(some, "wrong")
        yield (f"{name}: error over the fit that knows, median and 9 of 10", "-",
               left_over(separable(some)))
    for name in dict.fromkeys(r["group"] for r in rows if r["group"].startswith("mistake")):
        some = of_group(rows, name)
        yield f"{name}: named", ">= 95 %", rate(some, "right")
        yield f"{name}: a false effect, explained", "0", rate(some, "wrong")


def summary(rows):
    """The required rates: (what, wanted, reached). A run without an answer counts as a failure."""
    told = [r for r in rows if "signal" in r]
    asked = [r for r in rows if not r["group"].startswith("mistake")]
    catalogued = of_group(rows, "catalogue") + of_group(rows, "two effects") + of_group(rows, "unaligned")
    clear = separable(catalogued)
    between = [r for r in catalogued if r.get("kind") == "between"]
    ambiguous = [r for r in rows if r.get("kind") == "ambiguous"]
    # 1.05: a refusal to correct leaves exactly the error before, which rounds either way.
    harmed = [r for r in told if "rms_mm" in r and r["before_mm"] > 0
              and r["rms_mm"] > 1.05 * r["before_mm"]]
    lines = [
        ("separable effect, signal at least 5: named exactly", ">= 95 %", rate(clear, "named")),
        ("a richer effect imitates it: named, or ambiguous with it among the named", "-",
         rate(between, "right")),
        ("confidently wrong, all runs", "<= 1 %", rate(asked, "wrong"))]
    for name in ("nothing", "nothing, 5 % outliers", "nothing, heavy tails", "nothing, camera"):
        lines.append((f"{name}: no_effect", ">= 95 %",
                      rate([r for r in rows if r["group"] == name], "right")))
    lines.append(("not separable: ambiguous, the true one among the named", ">= 95 %",
                  rate(ambiguous, "right")))
    for part in (at_once, noises, unknowns, probes, damaged):
        lines += part(rows)
    lines += [
        ("held-out error over that of a fit that knows the form, median and 9 of 10", "<= 1.5",
         left_over(clear)),
        ("worse than before by more than 5 %", "0", share(len(harmed), len(told))),
        ("95 % intervals of parameters cover", "92 to 98 %",
         share(sum(r.get("covered", 0) for r in rows), sum(r.get("intervals", 0) for r in rows))),
        ("new measured points within u_mm, and their noise-free truth", "95 %",
         " and ".join(share(sum(r.get(k, 0) for r in rows), sum(r.get("points", 0) for r in rows))
                      for k in ("measured_inside_u", "inside_u"))),
        ("runs that ended without an answer", "0", rate(rows, "error"))]
    return [line for line in lines if line[2].strip("- and")]


def markdown(rows):
    text = "| what | wanted | reached (count; 95 % bounds) |\n|---|---|---|\n"
    text += "".join(f"| {a} | {b} | {c} |\n" for a, b, c in summary(rows))
    text += ("\n| group | family | runs | right | confidently wrong | verdicts | error over fit that "
             "knows | before, mm | after, mm | s |\n|" + "---|" * 10 + "\n")
    for group, family in dict.fromkeys((r["group"], r["family"]) for r in rows):
        some = [r for r in rows if (r["group"], r["family"]) == (group, family)]
        verdicts = [r.get("verdict") or "none" for r in some]
        told = ", ".join(f"{v} {verdicts.count(v)}" for v in sorted(set(verdicts)))
        text += (f"| {group} | {family} | {len(some)} | {count(some, 'right')[0]} | "
                 f"{count(some, 'wrong')[0]} | {told} | {median(map(quotient, some))} | "
                 f"{median([r.get('before_mm') for r in some], '{:.3f}')} | "
                 f"{median([r.get('rms_mm') for r in some], '{:.4f}')} | "
                 f"{median([r.get('seconds') for r in some])} |\n")
    return text


def complaints(rows, limit):
    """What went wrong, to look into: the case as a command that makes it again."""
    text = ""
    for r in [r for r in rows if r.get("error") or r.get("wrong") or not r.get("right")][:limit]:
        told = r.get("error") or f"{r['verdict']} {r['answer']}; hidden {r['truth']}"
        text += (f"- {r['group']}: {r.get('kind', '?')}{', WRONG' if r.get('wrong') else ''}: --family "
                 f"{r['family']} --seed {r['seed']} {' '.join(r['options'])}: {told}")
        if r.get("nearest"):
            text += f"; nearest rival {r['nearest']} at {r['distance']:.1f}"
        text += "\n"
    return text
