#!/usr/bin/python3
"""Does `plumbline explain` name files for what they are, and doubt what is damaged?

Every kind of recognition_files.py is drawn in several variants, some with a planted contradiction
(more distortion terms than the model has, a skew, a polynomial that folds ..). As many mutations
follow: cut, with flipped bits, other separators, without its first lines, in another encoding, and two
files in one. Named right: the kind, the counts and sizes, and the planted contradiction. Silently
wrong: another kind stated as certain, wrong counts, or a second file overlooked, without a doubt or a
contradiction. Goals: named right 95 % of the whole files, silently wrong 0. The last lines state the
processor time for 10 MB of several kinds: at most 0.3 s."""

import argparse
import json
import os
import random
import resource
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import recognition_files as invented  # noqa: E402

# Kinds of one content: a cut file may be taken for the other without harm.
ALIKE = ({"measured", "table", "bare-table", "tracker", "cmm", "rtde", "ros-csv", "dh-table"},
         {"opencv-lens", "ros-camera-info", "plain-lens"}, {"vrml97", "vrml1", "open-inventor"}, {"urdf", "xacro"})
CERTAIN = ("shown",)


def explained(product, folder, names):
    """Answers by name."""
    run = subprocess.run([product, "explain", "--json", *names], cwd=folder, capture_output=True, text=True, timeout=300)
    if run.returncode not in (0, 1):
        raise RuntimeError(f"explain ended with {run.returncode}: {run.stderr[-400:]}")
    return {file["file"]: file for file in json.loads(run.stdout)["files"]}


def facts_are_right(answer, facts):
    stated = [(fact["what"], fact["value"]) for fact in answer["facts"]]
    return all((what, value) in stated for what, value in facts.items() if what != "contradiction")


def doubted(answer):
    return bool(answer["certainty"] not in CERTAIN or answer["contradictions"] or answer["not_stated"])


def judge_whole(answer, kind, facts):
    planted = facts.get("contradiction")
    named = [one["what"] for one in answer["contradictions"]]
    right_kind = answer["kind"] == kind and answer["certainty"] in CERTAIN
    right = right_kind and facts_are_right(answer, facts) and (planted in named if planted else not named)
    wrong = answer["certainty"] in CERTAIN and not (right_kind and facts_are_right(answer, facts)) and not named
    return right, bool(wrong or (planted and not named))


def judge_mutated(answer, kind, mutation):
    if answer["kind"] in ("bare-utf16", "empty"):  # which they then are
        return True, False
    alike = next((group for group in ALIKE if kind in group), {kind})
    if mutation == "two in one":
        # Several cameras, messages, solids or functions in one file are nothing wrong.
        several = kind in ("colmap-cameras", "ros-camera-info-echo", "stl-text", "obj", "urscript")
        return bool(answer["contradictions"]) or answer["certainty"] not in CERTAIN or several, not (several or doubted(answer))
    right = answer["kind"] in alike or doubted(answer)
    return right, answer["kind"] not in alike and not doubted(answer)


def draw(options, folder):
    """Writes the files. @return  (name, kind, mutation or None, facts)"""
    cases = []
    for kind, make in invented.MAKERS.items():
        for variant in range(options.variants):
            rng = random.Random(f"{options.first_seed}/{kind}/{variant}")
            name, data, facts = make(rng)
            def write(label, content):
                sub = f"{kind}-{variant}-{label}"
                os.mkdir(os.path.join(folder, sub))
                with open(os.path.join(folder, sub, name), "wb") as file:
                    file.write(content)
                return f"{sub}/{name}"
            cases.append((write("whole", data), kind, None, facts))
            choices = list(invented.MUTATIONS) if kind not in invented.BINARY else ["truncated", "bytes flipped"]
            mutation = (choices + (["two in one"] if kind not in invented.BINARY else []))[variant % (len(choices) + (kind not in invented.BINARY))]
            if mutation == "two in one":
                content = data + make(rng)[1]
            else:
                content = invented.MUTATIONS[mutation](data, rng)
            cases.append((write("mutated", content), kind, mutation, facts))
    return cases


def large_files(rng):
    """10 MB of several kinds."""
    def repeated(kind, part=None):
        data = invented.MAKERS[kind](rng)[1]
        part = part or data
        return data + part * (10_000_000 // len(part))
    lines = "".join("%.5f,%.5f,%.5f\n" % tuple(rng.uniform(-9, 9) for _ in range(3)) for _ in range(2000)).encode()
    return {"measured.csv": invented.MAKERS["measured"](rng)[1] + b"1,2,3,4,5,6,7,8,9\n" * 555_000, "points.csv": lines * 170,
            "arm.urdf": repeated("urdf", b'<link name="more"/>\n'), "part.wrl": repeated("vrml97"), "part.obj": repeated("obj"),
            "lens.yaml": repeated("ros-camera-info"), "part.stl": repeated("stl-text"), "nested.json": b"[" * 10_000_000,
            "open.yaml": b"a: [\n" * 2_000_000, "tags.xml": b"<a>" * 3_300_000, "blank.txt": b" \n" * 5_000_000,
            "noise.bin": bytes(rng.randrange(256) for _ in range(1000)) * 10_000}


def time_large(product, folder):
    worst = []
    for name, data in large_files(random.Random(7)).items():
        with open(os.path.join(folder, name), "wb") as file:
            file.write(data)
        seconds = []
        for _ in range(3):
            begun = resource.getrusage(resource.RUSAGE_CHILDREN)
            explained(product, folder, [name])
            ended = resource.getrusage(resource.RUSAGE_CHILDREN)
            seconds.append(ended.ru_utime + ended.ru_stime - begun.ru_utime - begun.ru_stime)
        worst.append((min(seconds), name))
        os.remove(os.path.join(folder, name))
    return sorted(worst, reverse=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--product", default="build/bin/plumbline")
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--variants", type=int, default=12, help="of each kind; as many are mutated")
    parser.add_argument("--quick", action="store_true", help="two variants, no timing, fail at a miss")
    options = parser.parse_args()
    options.product = os.path.abspath(options.product)
    if options.quick:
        options.variants = 2
    with tempfile.TemporaryDirectory() as folder:
        cases = draw(options, folder)
        answers = explained(options.product, folder, [case[0] for case in cases])
        results = []
        for name, kind, mutation, facts in cases:
            judged = judge_mutated(answers[name], kind, mutation) if mutation else judge_whole(answers[name], kind, facts)
            results.append((kind, mutation, *judged))
            if not judged[0] or judged[1]:
                answer = answers[name]
                print(f"{name} {mutation or 'whole'}: {'SILENTLY WRONG' if judged[1] else 'not named'}: {answer['kind']} "
                      f"{answer['certainty']} {answer['facts']} {answer['contradictions']}; expected {facts}", file=sys.stderr)
        print("| files | number | named right, or doubted if damaged | silently wrong |\n|---|---|---|---|")
        for label, rows in [("whole", [r for r in results if r[1] is None])] + [
                (m, [r for r in results if r[1] == m]) for m in [*invented.MUTATIONS, "two in one"]]:
            if rows:
                print(f"| {label} | {len(rows)} | {100 * sum(r[2] for r in rows) / len(rows):.1f} % | {sum(r[3] for r in rows)} |")
        print(f"\n{len(invented.MAKERS)} kinds, {options.variants} variants of each")
        if not options.quick:
            for seconds, name in time_large(options.product, folder):
                print(f"10 MB of {name}: {seconds:.2f} s of processor time (goal 0.3)")
    missed = any(r[3] for r in results) or sum(r[2] for r in results if r[1] is None) < 0.95 * len(results) / 2
    return 1 if options.quick and missed else 0


if __name__ == "__main__":
    sys.exit(main())
