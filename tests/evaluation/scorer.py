"""Judges one answer of the diagnosis against what the data hid. Pure functions, no files."""

import math
import re

NUISANCES = ("base_frame", "tool_frame")
ALIASES = {"thermal_link_growth": "thermal_growth"}


def wilson(hits, count, z=1.96):
    """95 % bounds of a rate (Wilson 1927)."""
    if count == 0:
        return 0.0, 1.0
    rate = hits / count
    middle = (rate + z * z / (2 * count)) / (1 + z * z / count)
    half = z * math.sqrt(rate * (1 - rate) / count + z * z / (4 * count * count)) / (1 + z * z / count)
    return max(0.0, middle - half), min(1.0, middle + half)


def joints_of(effect):
    """The joints of an effect, from its scope or, where that is empty, from its parameters."""
    scope = [str(name) for name in effect.get("scope") or []]
    if scope:
        return frozenset(scope)
    names = [p["name"] for p in effect.get("parameters") or []]
    found = [re.match(r"(?:q|a|d|alpha|beta)(\d+)", name) for name in names]
    return frozenset("q" + match.group(1) for match in found if match)


def key(effect):
    """(id with its kind, joints): what has to be right for an effect to be named."""
    name = ALIASES.get(effect["id"], effect["id"])
    if name == "backlash":
        by = effect.get("by")
        for parameter in effect.get("parameters") or []:
            if parameter["name"] == "by":
                by = parameter["value"]
        name = f"backlash/{by}" if by else name
    return name, joints_of(effect)


def fits(named, wanted, optional=frozenset()):
    """Same id, and the same joints but for those too small to be seen."""
    return named[0] == wanted[0] and wanted[1] - optional <= named[1] <= wanted[1]


def twins_of(judged, number):
    """Link parameters of other joints that say the same as those of a hidden effect."""
    twins = (judged or {}).get("twins") or []
    return [("link_geometry", frozenset(t)) for t in twins[number]] if number < len(twins) else []


def choices_of(truth, judged, number):
    """All that a hidden effect may be called, and those of its joints that may be left out."""
    effect = truth["effects"][number]
    choices = [key(effect)] + twins_of(judged, number)
    choices += [(e["id"], frozenset(e["scope"])) for e in truth.get("equivalents", [])
                if e["instead_of"] == effect["id"]]
    optional = (judged or {}).get("optional") or []
    return choices, frozenset(optional[number]) if number < len(optional) else frozenset()


def same_effects(answer, truth, judged=None, nuisances=False):
    """Whether the effects of an answer are those of the truth, one for one.

    judged: what separability.judge found, of which `optional` names the joints too small to see,
    one list an effect of the truth. nuisances: base_frame and tool_frame were declared unknown.
    """
    named = [key(effect) for effect in answer]
    if nuisances:
        named = [k for k in named if k[0] not in NUISANCES]
    wanted = [choices_of(truth, judged, number) for number in range(len(truth["effects"]))]
    if len(named) != len(wanted):
        return False
    for choices, leave_out in wanted:
        hit = next((k for k in named if any(fits(k, c, leave_out) for c in choices)), None)
        if hit is None:
            return False
        named.remove(hit)
    return True


def false_names(answer, truth, judged=None, nuisances=False):
    """Named effects, or effects in joints, that were not hidden. What an ambiguous answer names with
    a rival in its place is no claim; an empirical term is no name."""
    hedged = set()
    if answer.get("verdict") == "ambiguous":
        hedged = {rival.get("instead_of") for rival in answer.get("rivals") or []}
    allowed = [c for n in range(len(truth["effects"])) for c in choices_of(truth, judged, n)[0]]
    found = []
    for effect in answer.get("effects") or []:
        name, joints = key(effect)
        if name == "empirical" or effect["id"] in hedged or (nuisances and name in NUISANCES):
            continue
        if not any(name == choice[0] and joints <= choice[1] for choice in allowed):
            found.append([name, sorted(joints)])
    return found


def truth_among(answer, truth, judged=None):
    """Whether each hidden effect is named, by `effects` or as one of the `rivals`.

    A rival carries no joints in the format: its id is enough then.
    """
    def names_it(item, choice, leave_out):
        named = key(item)
        if not named[1] and named[0].split("/")[0] == choice[0].split("/")[0]:
            return True
        return fits(named, choice, leave_out)

    for number in range(len(truth["effects"])):
        choices, leave_out = choices_of(truth, judged, number)
        items = (answer.get("effects") or []) + (answer.get("rivals") or [])
        if not any(names_it(item, c, leave_out) for item in items for c in choices):
            return False
    return True


def only_equivalents(answer, truth):
    """Whether every rival is what the exchange format calls the same as a hidden effect."""
    same = {e["id"] for e in truth.get("equivalents", [])} | {e["id"] for e in truth["effects"]}
    rivals = answer.get("rivals") or []
    return bool(rivals) and all(rival["id"] in same for rival in rivals)


def bare(name):
    return re.sub(r"_(deg|deg_s|deg_s2)$", "", name)


def driver_names(answer):
    return [bare(d if isinstance(d, str) else d.get("name", "")) for d in answer.get("drivers", [])]


def right_driver(answer, truth, among=3):
    """Whether all true drivers are among the first named."""
    wanted = {bare(name) for name in truth.get("drivers", [])}
    return bool(wanted) and wanted <= set(driver_names(answer)[:among])


def rival_drivers(answer, truth):
    """Whether signals that the rows cannot tell apart are all named, as drivers or as rivals."""
    named = set(driver_names(answer))
    named |= {bare(str(r.get(k))) for r in answer.get("rivals") or [] for k in ("id", "word", "driver")}
    return {bare(name) for name in truth["interchangeable_drivers"]} <= named


def tells_slope(said, truth):
    """Whether a sentence has the slope of a base that follows the pressure, to a tenth."""
    true = math.hypot(*(p["value"] for p in truth["effects"][0]["parameters"]))
    told = re.findall(r"([\d.]+)\s*mm per bar", said)
    return any(abs(float(value) - true) <= 0.1 * true for value in told)


def covered(answer, truth):
    """(parameters within 1.96 sd of the truth, parameters that carry an sd)."""
    hits = count = 0
    for effect in answer.get("effects", []):
        same = [t for t in truth["effects"] if key(t)[0] == key(effect)[0]]
        if not same:
            continue
        values = {p["name"]: p["value"] for p in same[0]["parameters"]}
        told = {p["name"]: p for p in effect.get("parameters", [])}
        for name, parameter in told.items():
            sd = parameter.get("sd")
            if sd is None or not sd > 0 or name not in values:
                continue
            off = parameter["value"] - values[name]
            if name.endswith("phase"):
                amplitude = told.get(name.replace("phase", "amplitude"))
                wanted = values.get(name.replace("phase", "amplitude"))
                if amplitude and wanted and amplitude["value"] * wanted < 0:
                    off += math.pi
                off = math.remainder(off, 2 * math.pi)
            if name.endswith("amplitude"):
                off = abs(parameter["value"]) - abs(values[name])
            count += 1
            hits += abs(off) <= 1.96 * sd
    return hits, count


def judge_outside(answer, truth, judged):
    """A cause outside the catalogue: unknown, with its drivers; where the rows cannot tell two signals
    apart, ambiguous between them."""
    verdict = answer.get("verdict")
    kind = "outside" if judged["class"] in ("separable", "outside") else "between"
    row = {"kind": kind, "driver": right_driver(answer, truth),
           "driver_first": bool(set(driver_names(answer)[:1]) & {bare(d) for d in truth["drivers"]})}
    row["right"] = verdict == "unknown" and row["driver"]
    row["wrong"] = verdict == "explained" and kind == "outside"
    if truth.get("interchangeable_drivers"):
        row["kind"] = "rival drivers"
        row["right"] = verdict == "ambiguous" and rival_drivers(answer, truth)
    return row


def judge_catalogued(answer, truth, judged):
    verdict, kind = answer.get("verdict"), judged["class"]
    named = same_effects(answer.get("effects", []), truth, judged, bool(truth.get("unaligned")))
    # The hidden effect beside nothing but its equivalents under other names is named exactly.
    same_only = verdict == "ambiguous" and named and only_equivalents(answer, truth)
    row = {"kind": kind, "named": (verdict == "explained" or same_only) and named,
           "among": verdict == "ambiguous" and truth_among(answer, truth, judged),
           "wrong": verdict == "explained" and not named}
    row["right"] = {"separable": row["named"], "ambiguous": row["among"],
                    "unseen": verdict == "no_effect" or row["named"] or row["among"]}.get(
                        kind, row["named"] or row["among"])
    return row


def judge_answer(answer, truth, judged):
    """One row of the evaluation: what kind of case it was, and how the answer stands in it.

    kind: none, outside, rival drivers, separable, ambiguous (an effect as simple imitates the hidden
    one below the noise), between (neither clear) or unseen (the hidden effect itself is below the noise).
    """
    verdict = answer.get("verdict")
    row = {"verdict": verdict, "named": False}
    if truth["family"] == "none":
        row.update(kind="none", right=verdict == "no_effect", wrong=verdict == "explained")
    elif not truth.get("in_catalogue", True):
        row.update(judge_outside(answer, truth, judged))
    else:
        row.update(judge_catalogued(answer, truth, judged))
    false = false_names(answer, truth, judged, bool(truth.get("unaligned")))
    row["no_false_name"] = not false
    row["answer"] = [[k[0], sorted(k[1])] for k in map(key, answer.get("effects", []))]
    row["truth"] = [[k[0], sorted(k[1])] for k in map(key, truth["effects"])]
    row["covered"], row["intervals"] = covered(answer, truth) if row["named"] else (0, 0)
    return row


def judge_mistake(answer, said, words, truth):
    """A mistake in the files: named by what the product printed, and nothing false explained by it.

    answer: None where the product refused. words: a pattern that says the mistake.
    """
    false = false_names(answer, truth) if answer else []
    row = {"kind": "mistake", "verdict": answer["verdict"] if answer else "refused",
           "wrong": bool(answer) and answer["verdict"] == "explained" and bool(false),
           "named_mistake": bool(re.search(words, said, re.IGNORECASE))}
    row["right"] = row["named_mistake"] and not row["wrong"]
    row["answer"] = [[k[0], sorted(k[1])] for k in map(key, (answer or {}).get("effects", []))]
    row["truth"] = [[k[0], sorted(k[1])] for k in map(key, truth["effects"])]
    return row
