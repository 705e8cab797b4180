#!/usr/bin/python3
"""The judge, held against answers made by hand, and the harness against a product that knows."""

import os
import sys
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
try:
    import evaluate
    import scorer
    import separability
except ImportError as error:
    print(f"skipped: {error} (install python3-numpy)")
    sys.exit(77)

SIMULATE = os.environ.get("PLUMBLINE_SIMULATE", "build/bin/plumbline-simulate")
SEPARABLE = {"class": "separable", "optional": [[]]}


def effect(name, scope=(), **values):
    return {"id": name, "scope": list(scope),
            "parameters": [{"name": n, "value": v, "sd": 0.1, "unit": "1"} for n, v in values.items()]}


def truth(*effects, **more):
    return {"family": effects[0]["id"] if effects else "none", "effects": list(effects),
            "in_catalogue": True, "equivalents": [], "nuisances": []} | more


def explained(*effects):
    return {"verdict": "explained", "effects": list(effects)}


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
    def runs(self, families, extra=(), **environment):
        product = os.path.join(HERE, "truthful_product.py")
        rows = []
        os.environ.update(environment)
        try:
            for family in families:
                case = ("catalogue", family, 5, ["--signal", "15", "--tests", "20", *extra])
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

    def test_a_product_that_fails_is_told(self):
        case = ("catalogue", "joint_offset", 5, ["--tests", "20"])
        self.assertIn("diagnose ends with 1", evaluate.run_case(case, "/bin/false", SIMULATE, 60, None)["error"])

    def test_the_summary_counts_a_failure_as_not_named(self):
        rows = [{"group": "catalogue", "family": "joint_offset", "signal": 9, "error": "x"}]
        self.assertIn("0.0 % (0/1", dict((a, c) for a, _, c in evaluate.summary(rows))[
            "separable effect, signal at least 5: named exactly"])


if __name__ == "__main__":
    unittest.main()
