#!/usr/bin/python3
"""The judge of outside.py, tested with hand-made answers; and its cells without their causes, which the
product predicts exactly.

    outside_test.py PLUMBLINE"""

import os
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
try:
    import numpy as np
    import outside
    import outside_cells
    import outside_kinds
except ImportError as error:
    print(f"skipped: {error} (install python3-numpy)")
    sys.exit(77)

PRODUCT = sys.argv.pop(1)


def answer(verdict, *named):
    return {"verdict": verdict, "effects": [{"id": name} for name in named]}


def truth(moved_mm=1.0, accepts=(), companion=None):
    return {"kind": next(iter(outside_kinds.KINDS)), "seed": 1, "sigma_mm": 0.1, "accepts": list(accepts),
            "companion": companion, "displacement_mm": {"measured": moved_mm}}


def rows(error, declared, radius=1.0, extrapolated=False, count=6):
    return [{"error_mm": error, "declared_mm": declared, "measured_error_mm": error,
             "radius_mm": radius, "extrapolated": extrapolated}] * count


def judged(given, hidden, **groups):
    same = {name: rows(0.1, 1.0) for name in outside.GROUPS}
    return outside.judge(given, hidden, same | groups)


class ConfidentlyWrong(unittest.TestCase):
    def wrong(self, *arguments, **options):
        return outside.confidently_wrong(answer(*arguments), truth(**options))

    def test_a_name_for_a_cause_that_has_none(self):
        self.assertTrue(self.wrong("explained", "tool_frame"))

    def test_unknown_and_ambiguous_claim_nothing(self):
        self.assertFalse(self.wrong("unknown", "tool_frame"))
        self.assertFalse(self.wrong("ambiguous", "tool_frame"))

    def test_no_effect_is_right_only_below_the_noise(self):
        self.assertTrue(self.wrong("no_effect"))
        self.assertFalse(self.wrong("no_effect", moved_mm=0.05))
        self.assertTrue(self.wrong("no_effect", moved_mm=0.05, companion="joint_compliance"))

    def test_an_accepted_effect(self):
        self.assertFalse(self.wrong("explained", "step_event", accepts=["step_event"]))
        self.assertTrue(self.wrong("explained", "step_event", "tool_frame", accepts=["step_event"]))

    def test_the_companion_alone_does_not_explain_a_visible_cause(self):
        both = {"companion": "joint_compliance"}
        self.assertTrue(self.wrong("explained", "joint_compliance", **both))
        self.assertFalse(self.wrong("explained", "joint_compliance", moved_mm=0.05, **both))
        self.assertFalse(self.wrong("explained", "joint_compliance", "step_event",
                                    accepts=["step_event"], **both))

    def test_imitated_where_the_corrected_model_is_right_inside(self):
        given = answer("explained", "tool_frame")
        self.assertTrue(judged(given, truth(), inside=rows(0.09, 1.0))["imitated"])
        self.assertFalse(judged(given, truth(), inside=rows(0.3, 1.0))["imitated"])
        self.assertFalse(judged(answer("unknown"), truth(), inside=rows(0.09, 1.0))["imitated"])


class Worse(unittest.TestCase):
    def test_by_flag(self):
        mixed = rows(1.0, 2.0) + rows(3.0, 2.0, extrapolated=True)
        region = judged(answer("unknown"), truth(), region=mixed)["groups"]["region"]
        self.assertIsNone(region["worse"])
        self.assertAlmostEqual(region["worse_flagged"], (9.03 / 4.03)**0.5)

    def test_little_and_few_do_not_count(self):
        self.assertIsNone(outside.worse(rows(1.05, 1.0), truth()))
        self.assertIsNone(outside.worse(rows(0.02, 0.01), truth()))  # far below the noise
        self.assertIsNone(outside.worse(rows(3.0, 1.0, count=4), truth()))


class Tables(unittest.TestCase):
    def reached(self, *sets):
        return {what: (reached, met) for what, _, reached, met in outside.goals(list(sets))}

    def a_set(self, given, **groups):
        return truth() | judged(given, truth(), **groups) | {"seconds": 1.0}

    def test_goals_met_and_missed(self):
        good = self.a_set(answer("unknown"), inside=rows(0.1, 1.0, 0.2, count=23) + rows(0.1, 1.0, 0.05,
                                                                                       count=1))
        told = self.reached(good)
        self.assertTrue(told["confidently wrong"][1])
        self.assertTrue(told["within the radius: inside"][1])  # 23 of 24
        self.assertTrue(told["median radius over median error: inside"][1])
        self.assertFalse(told["median radius over median error: outside"][1])  # 10
        bad = self.a_set(answer("explained", "tool_frame"), load=rows(2.0, 1.0))
        told = self.reached(good, bad)
        self.assertFalse(told["confidently wrong"][1])
        self.assertEqual(told["worse than declared, not flagged"][0], "1, at most 1.98 times")
        self.assertFalse(told["within the radius: load"][1])  # 6 of 12

    def test_a_radius_that_is_not_stated_is_not_counted(self):
        row = self.a_set(answer("unknown"), load=rows(5.0, 5.0, radius=None))
        self.assertEqual(row["groups"]["load"]["stated"], 0)
        self.assertIn("nan", outside.line("all", [row]))

    def test_a_set_without_an_answer(self):
        failed = truth() | {"verdict": "none", "failed": "diagnose: no"}
        told = self.reached(self.a_set(answer("unknown")), failed)
        self.assertEqual(told["sets without an answer"], ("1", False))
        self.assertIn("diagnose: no", "".join(outside.complaints([failed])))


class Cells(unittest.TestCase):
    def test_the_product_agrees_where_no_cause_is_hidden(self):
        for name in ("rail_straightness", "gripper_spreads", "gear_exchanged"):
            of_kind = outside_kinds.KINDS[name]
            kept, of_kind.most = of_kind.most, 0.0  # a cause of no size
            seed = next(s for s in range(50) if outside_cells.draw_set(name, s)[4]["companion"] is None)
            text, rows_of, points, _, _ = outside_cells.draw_set(name, seed)
            of_kind.most = kept
            with tempfile.TemporaryDirectory() as folder:
                outside.write(folder, "cell.toml", text)
                linear = {0} if of_kind.rail else set()
                outside.write(folder, "test_load.csv",
                              outside_cells.table_text(rows_of["load"], None, name, linear))
                told = outside.predicted(PRODUCT, folder, "cell", "load")
            tips = np.array([[float(r[n]) for n in outside.MEASURED] for r in told])
            self.assertLess(np.abs(tips - 1e3 * points["load"]).max(), 0.01, name)


if __name__ == "__main__":
    unittest.main()
