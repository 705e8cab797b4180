#!/usr/bin/python3
"""The judge, held against answers made by hand, and the harness against a product that knows."""

import os
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
try:
    import damage
    import evaluate
    import goals
    import groups
    import runs
    import scorer
    import separability
    import timing
except ImportError as error:
    print(f"skipped: {error} (install python3-numpy)")
    sys.exit(77)

SIMULATE = os.environ.get("PLUMBLINE_SIMULATE", "build/bin/plumbline-simulate")
CATALOGUE = groups.Group("catalogue", [])
SEPARABLE = {"class": "separable", "optional": [[]]}


def effect(name, scope=(), **values):
    return {"id": name, "scope": list(scope),
            "parameters": [{"name": n, "value": v, "sd": 0.1, "unit": "1"} for n, v in values.items()]}


def truth(*effects, **more):
    return {"family": effects[0]["id"] if effects else "none", "effects": list(effects),
            "in_catalogue": True, "equivalents": [], "nuisances": []} | more


def explained(*effects):
    return {"verdict": "explained", "effects": list(effects)}


class Separability(unittest.TestCase):
    def test_a_rival_of_a_sign_that_no_machine_has_is_none(self):
        field, fixed = separability.np.array([1.0, 2.0, 0.0]), separability.np.zeros((3, 0))
        same = separability.np.array([[1.0], [2.0], [0.0]])
        self.assertAlmostEqual(separability.least_left_over(field, fixed, same), 0)
        self.assertAlmostEqual(separability.least_left_over(field, fixed, -same), 5**0.5)
        self.assertAlmostEqual(separability.left_over(field, fixed, -same), 0)


class Names(unittest.TestCase):
    def judged(self, answer, hidden, judged=SEPARABLE):
        return scorer.judge_answer(answer, hidden, judged)

    def test_right_effect_and_joints(self):
        row = self.judged(explained(effect("joint_offset", ["q2"], q2=1.1)),
                          truth(effect("joint_offset", ["q2"], q2=1.0)))
        self.assertTrue(row["right"] and row["named"] and not row["wrong"])
        self.assertEqual((row["covered"], row["intervals"]), (1, 1))

    def test_wrong_joint_is_confidently_wrong(self):
        row = self.judged(explained(effect("joint_offset", ["q3"], q3=1)),
                          truth(effect("joint_offset", ["q2"], q2=1)))
        self.assertTrue(row["wrong"] and not row["right"])

    def test_one_effect_too_many_is_wrong(self):
        row = self.judged(explained(effect("joint_offset", ["q2"], q2=1), effect("tool_shear")),
                          truth(effect("joint_offset", ["q2"], q2=1)))
        self.assertTrue(row["wrong"])

    def test_one_effect_of_two_is_wrong(self):
        row = self.judged(explained(effect("tool_shear")),
                          truth(effect("joint_offset", ["q2"], q2=1), effect("tool_shear")))
        self.assertTrue(row["wrong"])

    def test_a_joint_too_small_to_see_may_be_left_out(self):
        hidden = truth(effect("joint_compliance", ["q2", "q3"], q2=1, q3=0.001))
        answer = explained(effect("joint_compliance", ["q2"], q2=1))
        self.assertTrue(self.judged(answer, hidden)["wrong"])
        self.assertTrue(self.judged(answer, hidden, {"class": "separable", "optional": [["q3"]]})["right"])

    def test_kind_of_backlash_counts(self):
        hidden = truth(effect("backlash", ["q2"], q2=1) | {"by": "move"})
        self.assertTrue(self.judged(explained(effect("backlash", ["q2"], q2=1) | {"by": "move"}), hidden)["right"])
        self.assertTrue(self.judged(explained(effect("backlash", ["q2"], q2=1) | {"by": "load"}), hidden)["wrong"])

    def test_equivalents_of_the_format(self):
        same = [{"instead_of": "counterbalance", "id": "gear_periodic", "scope": ["q2"]}]
        hidden = truth(effect("counterbalance", ["q2"], q2_amplitude=1), equivalents=same)
        self.assertTrue(self.judged(explained(effect("gear_periodic", ["q2"])), hidden)["right"])
        self.assertTrue(self.judged(explained(effect("gear_periodic", ["q3"])), hidden)["wrong"])

    def test_unknown_frames_are_no_effects(self):
        answer = explained(effect("base_frame", x=1), effect("tool_stiffness", ratio=1))
        hidden = truth(effect("tool_stiffness", ratio=1))
        self.assertTrue(self.judged(answer, hidden)["wrong"])
        self.assertTrue(self.judged(answer, hidden | {"unaligned": True})["right"])

    def test_older_name_of_thermal_growth(self):
        self.assertEqual(scorer.key(effect("thermal_link_growth")), scorer.key(effect("thermal_growth")))

    def test_joints_of_link_geometry_come_from_its_parameters(self):
        self.assertEqual(scorer.key(effect("link_geometry", (), a2=1, alpha3=1))[1], {"q2", "q3"})


    def test_another_way_to_write_the_same_link_is_right(self):
        hidden = truth(effect("link_geometry", ["q3"], d3=1))
        answer = explained(effect("link_geometry", ["q2"], d2=1))
        self.assertTrue(self.judged(answer, hidden)["wrong"])
        self.assertTrue(self.judged(answer, hidden, {"class": "between", "optional": [[]], "twins": [[["q2"]]]})["right"])


class FalseNames(unittest.TestCase):
    HIDDEN = truth(effect("joint_offset", ["q2", "q3"], q2=1, q3=1), effect("tool_shear"))

    def false(self, verdict, *named, rivals=()):
        answer = {"verdict": verdict, "effects": list(named), "rivals": list(rivals)}
        return scorer.false_names(answer, self.HIDDEN)

    def test_too_few_effects_or_joints_are_no_false_name(self):
        self.assertEqual(self.false("unknown", effect("joint_offset", ["q2"], q2=1)), [])

    def test_a_name_or_joint_that_was_not_hidden_is_one_whatever_the_verdict(self):
        for verdict in ("explained", "unknown"):
            self.assertEqual(self.false(verdict, effect("payload_mass")), [["payload_mass", []]])
        self.assertEqual(len(self.false("unknown", effect("joint_offset", ["q2", "q5"], q2=1))), 1)

    def test_an_empirical_term_is_no_name(self):
        self.assertEqual(self.false("unknown", effect("empirical")), [])

    def test_a_name_with_a_rival_in_its_place_is_no_claim(self):
        rival = {"instead_of": "payload_mass", "id": "tool_shear"}
        self.assertEqual(self.false("ambiguous", effect("payload_mass"), rivals=[rival]), [])
        self.assertEqual(len(self.false("ambiguous", effect("payload_mass"))), 1)


class Honesty(unittest.TestCase):
    def test_nothing_hidden(self):
        row = scorer.judge_answer({"verdict": "no_effect", "effects": []}, truth(), {"class": "none"})
        self.assertTrue(row["right"] and not row["wrong"])
        row = scorer.judge_answer(explained(effect("tool_shear")), truth(), {"class": "none"})
        self.assertTrue(row["wrong"] and not row["right"])

    def test_ambiguous_needs_the_true_one_among_the_named(self):
        hidden = truth(effect("tool_stiffness", ratio=1))
        judged = {"class": "ambiguous", "optional": [[]]}
        answer = {"verdict": "ambiguous", "effects": [effect("payload_mass")],
                  "rivals": [{"instead_of": "payload_mass", "id": "tool_stiffness"}]}
        self.assertTrue(scorer.judge_answer(answer, hidden, judged)["right"])
        answer["rivals"][0]["id"] = "payload_cog"
        self.assertFalse(scorer.judge_answer(answer, hidden, judged)["right"])
        lucky = scorer.judge_answer(explained(effect("tool_stiffness")), hidden, judged)
        self.assertFalse(lucky["right"] or lucky["wrong"])

    def test_outside_needs_the_driver(self):
        hidden = truth(effect("creep"), in_catalogue=False, drivers=["t_s"])
        judged = {"class": "separable", "optional": [[]]}
        right = {"verdict": "unknown", "effects": [], "drivers": ["temp_C", "t_s"]}
        row = scorer.judge_answer(right, hidden, judged)
        self.assertTrue(row["right"] and not row["driver_first"])
        right["drivers"] = ["q1", "q2", "q3", "t_s"]
        self.assertFalse(scorer.judge_answer(right, hidden, judged)["right"])
        self.assertTrue(scorer.judge_answer(explained(effect("tool_shear")), hidden, judged)["wrong"])

    def test_two_drivers_must_both_be_told(self):
        hidden = truth(effect("two_drivers"), in_catalogue=False, drivers=["air_pressure_bar", "temp_C"])
        self.assertFalse(scorer.right_driver({"drivers": ["temp_C"]}, hidden))
        self.assertTrue(scorer.right_driver({"drivers": ["temp_C", "air_pressure_bar"]}, hidden))

    def test_signals_that_rise_together_must_both_be_told_as_ambiguous(self):
        hidden = truth(effect("temperature_squared"), in_catalogue=False, drivers=["temp_C"],
                       interchangeable_drivers=["t_s", "temp_C"])
        judged = {"class": "separable", "optional": [[]]}
        for verdict, drivers, right in (("ambiguous", ["t_s", "temp_C"], True),
                                        ("ambiguous", ["temp_C"], False),
                                        ("unknown", ["t_s", "temp_C"], False)):
            answer = {"verdict": verdict, "effects": [], "drivers": drivers}
            self.assertEqual(scorer.judge_answer(answer, hidden, judged)["right"], right)

    def test_a_slope_counts_to_a_tenth(self):
        hidden = truth(effect("air_pressure", x=0.3, y=0.4, z=0.0))
        self.assertTrue(scorer.tells_slope("the base moves by 0.52 mm per bar", hidden))
        self.assertFalse(scorer.tells_slope("the base moves by 0.56 mm per bar", hidden))
        self.assertFalse(scorer.tells_slope("follows air_pressure_bar", hidden))

    def test_a_mistake_must_be_named(self):
        words = damage.WORDS["inches"]
        row = scorer.judge_mistake(None, "x_mm, y_mm, z_mm: the points are in inches", words, truth())
        self.assertTrue(row["right"])
        self.assertFalse(scorer.judge_mistake(None, "the points lie 3 m off", words, truth())["right"])
        wrong = scorer.judge_mistake(explained(effect("tool_shear")), "inches?", words, truth())
        self.assertTrue(wrong["wrong"] and not wrong["right"])

    def test_joint_drivers_by_column_or_by_name(self):
        self.assertTrue(scorer.right_driver({"drivers": ["q3"]}, {"drivers": ["q3_deg"]}))
        self.assertFalse(scorer.right_driver({"drivers": ["qd3_deg_s"]}, {"drivers": ["q3_deg"]}))

    def test_phase_is_an_angle_and_may_trade_sign_with_the_amplitude(self):
        hidden = truth(effect("gear_periodic", ["q2"], q2_amplitude=1.0, q2_phase=0.1))
        turned = explained(effect("gear_periodic", ["q2"], q2_amplitude=-1.0, q2_phase=0.1 + 3.14159))
        self.assertEqual(scorer.covered(turned, hidden), (2, 2))
        off = explained(effect("gear_periodic", ["q2"], q2_amplitude=1.0, q2_phase=0.5))
        self.assertEqual(scorer.covered(off, hidden), (1, 2))

    def test_wilson_bounds(self):
        low, high = scorer.wilson(95, 100)
        self.assertAlmostEqual(low, 0.8883, places=3)
        self.assertAlmostEqual(high, 0.9785, places=3)
        self.assertEqual(scorer.wilson(0, 0), (0.0, 1.0))


class WholeRuns(unittest.TestCase):
    def runs(self, families, extra=(), group=CATALOGUE, **environment):
        product = os.path.join(HERE, "truthful_product.py")
        rows = []
        os.environ.update(environment)
        try:
            for family in families:
                case = (group, family, 5, ["--signal", "15", "--tests", "20", *extra])
                rows.append(evaluate.run_case(case, product, SIMULATE, 60, None))
        finally:
            for name in environment:
                del os.environ[name]
        return rows

    def test_a_product_that_knows_is_right(self):
        for row in self.runs(["none", "joint_offset", "backlash_move", "creep", "gear_periodic"]):
            self.assertNotIn("error", row)
            self.assertTrue(row["right"], row)
            self.assertFalse(row["wrong"])

    def test_a_product_that_lies_is_confidently_wrong(self):
        for row in self.runs(["none", "joint_offset", "creep"], PLUMBLINE_LIES="1"):
            self.assertTrue(row["wrong"], row)

    def test_mass_and_stiffness_cannot_be_told_apart_with_one_payload(self):
        design = ["--one-payload", "--rigid-joints"]
        for row in self.runs(["payload_mass", "tool_stiffness"], design):
            self.assertEqual(row["kind"], "ambiguous", row)
        for row in self.runs(["payload_mass"], design, PLUMBLINE_VERDICT="ambiguous"):
            self.assertTrue(row["right"], row)
        self.assertEqual(self.runs(["payload_mass"])[0]["kind"], "separable")

    def test_rows_without_values_keep_their_place_for_the_truth(self):
        for what in ("30 % measured values empty", "30 % lines lost"):
            group = groups.Group("lost", [], damage=what)
            for row in self.runs(["backlash_move"], group=group):
                self.assertNotIn("error", row)
                self.assertEqual(row["kind"], "separable")
                self.assertLess(row["fit_mm"], 0.05)

    def test_a_mistake_needs_neither_a_judge_nor_an_answer(self):
        group = groups.Group("mistake: inches", [], damage="inches")
        case = (group, "none", 5, ["--tests", "20"])
        row = evaluate.run_case(case, "/bin/false", SIMULATE, 60, None)
        self.assertEqual((row["verdict"], row["right"]), ("refused", False))

    def test_what_cannot_be_told_apart_is_drawn_again(self):
        group = groups.Group("three effects", [], separable=True)
        case = (group, "three", 500001, ["--signal", "13.5", "--tests", "20", "--rows", "50"])
        row = evaluate.run_case(case, os.path.join(HERE, "truthful_product.py"), SIMULATE, 60, None)
        self.assertEqual((row["kind"], row["named"]), ("separable", True))

    def test_a_product_that_fails_is_told(self):
        case = (CATALOGUE, "joint_offset", 5, ["--tests", "20"])
        self.assertIn("diagnose ends with 1", evaluate.run_case(case, "/bin/false", SIMULATE, 60, None)["error"])

    def test_the_summary_counts_a_failure_as_not_named(self):
        rows = [{"group": "catalogue", "family": "joint_offset", "signal": 9, "error": "x"}]
        self.assertIn("0.0 % (0/1", dict((a, c) for a, _, c in goals.summary(rows))[
            "separable effect, signal at least 5: named exactly"])


class Damage(unittest.TestCase):
    def damaged(self, name):
        """(cell's text, rows before, rows after, rows as executed)"""
        with tempfile.TemporaryDirectory() as folder:
            place = lambda file: os.path.join(folder, file)
            rows = [{"t_s": str(10.0 * k), "q1_deg": str(k), "q2_deg": "30", "payload_kg": "10",
                     "temp_C": "22", "x_mm": str(254.0 + k), "y_mm": "20", "z_mm": "30"} for k in range(60)]
            damage.write(place("measured.csv"), rows, list(rows[0]))
            with open(place("cell.toml"), "w") as file:
                file.write("gravity_m_s2 = [0, 0, -9.80665]\nbase_rpy_deg = [0, 0, 0]\n")
            damage.apply(name, folder, 3)
            read = lambda file: separability.table(place(file))
            with open(place("cell.toml")) as file:
                return file.read(), rows, read("measured.csv"), read("as_executed.csv")

    def test_every_transformation_has_a_group_and_changes_the_files(self):
        named = {group.damage for group in groups.table([])} - {""}
        self.assertEqual(named, set(damage.LOST) | set(damage.MISTAKES))
        # A change of unit part-way is recognised by its column, line and unit instead.
        whole = {name for name in damage.MISTAKES if ", then " not in name}
        self.assertEqual(set(damage.WORDS), whole)
        for name in named - {"TCP 30 mm off"}:
            _, before, after, _ = self.damaged(name)
            self.assertNotEqual(before, after, name)

    def test_a_lost_line_is_gone_for_the_product_alone(self):
        _, before, after, executed = self.damaged("30 % lines lost")
        self.assertEqual(len(executed), len(before))
        self.assertEqual(len(after), sum(bool(row["x_mm"]) for row in executed))
        self.assertTrue(30 < len(after) < 55)

    def test_an_unmeasured_row_keeps_its_place_for_both(self):
        _, before, after, executed = self.damaged("30 % rows unmeasured")
        self.assertEqual(after, executed)
        self.assertEqual([r["q1_deg"] for r in after], [r["q1_deg"] for r in before])

    def test_units(self):
        self.assertEqual(self.damaged("inches")[2][0]["x_mm"], "10.00000")
        self.assertEqual(self.damaged("kelvin")[2][0]["temp_C"], "295.15000")
        self.assertEqual(self.damaged("pounds")[2][0]["payload_kg"], "22.04623")

    def test_the_other_euler_convention_keeps_distances_and_turns_gravity(self):
        cell, before, after, _ = self.damaged("other Euler convention")
        size = lambda row: sum(float(row[c]) ** 2 for c in damage.MEASURED)
        self.assertAlmostEqual(size(before[0]), size(after[0]), places=1)
        gravity = [float(v) for v in cell.split("gravity_m_s2 = [")[1].split("]")[0].split(",")]
        self.assertAlmostEqual(sum(g * g for g in gravity) ** 0.5, 9.80665, places=4)
        self.assertGreater(abs(gravity[0]) + abs(gravity[1]), 1.0)


def doubled(number):
    return {"number": 2 * number}


class Runs(unittest.TestCase):
    def test_finished_runs_are_kept_and_their_settings_with_them(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "runs.jsonl")
            first = runs.Results(path, {"draws": 5, "first_seed": 7})
            first.add({"seed": 7, "proposed": float("inf")})
            again = runs.Results(path, {"draws": 5, "first_seed": None})
            self.assertEqual(again.rows, first.rows)
            self.assertEqual(again.settings["first_seed"], 7)
            with self.assertRaises(SystemExit):
                runs.Results(path, {"draws": 3, "first_seed": None})

    def test_no_case_is_begun_once_the_caller_has_enough(self):
        asked = []

        def cases():
            for number in range(100):
                if len(found) >= 4:
                    return
                asked.append(number)
                yield number

        found = []
        for row in runs.run_each(2, doubled, cases()):
            found.append(row["number"])
        self.assertEqual(sorted(found), [2 * number for number in asked])
        self.assertLess(len(asked), 8)

    def test_time_and_memory_are_those_of_the_run(self):
        seconds, peak_MB, status = timing.measured_run(
            [sys.executable, "-c", "import time; b = bytearray(150 << 20); time.sleep(0.3)"])
        self.assertGreater(seconds, 0.3)
        self.assertTrue(150 < peak_MB < 400)
        self.assertEqual(status, 0)
        self.assertLess(timing.measured_run([sys.executable, "-c", "pass"])[1], 100)
        self.assertEqual(timing.measured_run(["/bin/false"])[2], 1)


class Goals(unittest.TestCase):
    ROW = {"signal": 9, "kind": "separable", "seed": 1, "options": [], "rms_mm": 0.02, "before_mm": 1.0}

    def lines(self, *rows):
        return {what: reached for what, _, reached in goals.summary([self.ROW | row for row in rows])}

    def test_effects_at_once_are_counted_by_name_and_error(self):
        group = "three effects, 60 rows"
        lines = self.lines(*[{"group": group, "family": "three", "named": k < 9, "no_false_name": k < 8,
                              "fit_mm": 0.01} for k in range(10)])
        self.assertIn("90.0 % (9/10", lines[group + ": all named exactly, where separable"])
        self.assertIn("80.0 % (8/10", lines[group + ": no name that was not hidden"])
        self.assertEqual("2.00 and 2.00", lines[group + ": error over the fit that knows, median and 9 of 10"])

    def test_a_correction_worse_than_none_is_counted(self):
        group = "temperature times payload, 3 K warmer"
        lines = self.lines(*[{"group": group, "family": "temperature_payload", "rms_mm": error}
                             for error in (0.5, 1.02, 155.0)])
        told = lines["temperature times payload, 3 K warmer: worse than declared by 5 %"]
        self.assertIn("(1/3", told)
        self.assertIn("at most 155.00 times", told)

    def test_mistakes_are_counted_apart(self):
        lines = self.lines({"group": "mistake: inches", "family": "none", "wrong": True},
                           {"group": "catalogue", "family": "joint_offset", "wrong": False})
        self.assertIn("(0/1", lines["confidently wrong, all runs"])
        self.assertIn("(1/1", lines["mistake: inches: a false effect, explained"])


if __name__ == "__main__":
    unittest.main()
