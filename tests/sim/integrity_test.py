"""What scripts/integrity.py counts, on answers made by hand."""
import os
import sys
import tempfile
import unittest
from pathlib import Path

os.environ.setdefault("SCANLOC", "/bin/false")
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts"))
import integrity  # noqa: E402
import integrity_sets  # noqa: E402


def told(outcome, confidence, is_right, is_mapped=True):
    return integrity.Answer("a.bin", outcome, confidence, is_right, is_mapped)


class TallyTest(unittest.TestCase):
    def test_shares_are_of_the_queries_of_the_map(self):
        tally = integrity.Tally([told("localized", 0.9, True), told("ambiguous", 0.4, True),
                                 told("localized", 0.9, False, False)])
        self.assertEqual(tally.share(lambda a: a.is_right), 1.0)
        self.assertEqual(tally.share(lambda a: a.outcome == "localized"), 0.5)
        self.assertIsNone(integrity.Tally().share(lambda a: True))

    def test_false_is_localized_and_not_right_wherever_it_was_taken(self):
        tally = integrity.Tally([told("localized", 0.9, True), told("localized", 0.8, False),
                                 told("localized", 0.7, False, False),
                                 told("ambiguous", 0.9, False)])
        self.assertEqual([a.confidence for a in tally.false()], [0.8, 0.7])

    def test_calibration_error_is_in_ten_bins_of_what_was_told(self):
        tally = integrity.Tally([told("localized", 1.0, True), told("localized", 0.95, False),
                                 told("not_recognized", 0.05, False),
                                 told("insufficient_scan", None, False)])
        self.assertAlmostEqual(tally.calibration_error(), (0.95 + 0.05) / 3)
        self.assertIsNone(integrity.Tally().calibration_error())


class JudgeTest(unittest.TestCase):
    ROW = {"query": "000000.bin", "outcome": "localized", "confidence": "0.9", "x": "1", "y": "0",
           "missed": "height", "error_m": "0.1", "height_error_m": "3.5", "yaw_error_deg": "1",
           "true_x": "1", "true_y": "0"}

    def test_takes_what_was_missed_from_locate(self):
        answer = integrity.Bench.answer(self.ROW, integrity.Ask([]))
        self.assertFalse(answer.is_right)
        self.assertIn("height by 0.10 m, 3.50 m", answer.errors)
        self.assertTrue(integrity.Bench.answer({**self.ROW, "missed": ""},
                                               integrity.Ask([])).is_right)

    def test_nothing_is_right_elsewhere(self):
        row = {"query": "a.bin", "outcome": "localized", "confidence": "0.9", "x": "1"}
        answer = integrity.Bench.answer(row, integrity.Ask([], elsewhere=True))
        self.assertFalse(answer.is_right or answer.is_mapped)

    def test_a_walk_is_judged_when_it_has_settled(self):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            poses, rows = [], []
            for i in range(40):
                (folder / f"{i:06d}.bin").touch()
                poses.append(f"1 0 0 {i} 0 1 0 0 0 0 1 0")
                rows.append({**self.ROW, "query": f"{i:06d}.bin", "true_x": str(i), "missed": ""})
            (folder / "poses.txt").write_text("\n".join(poses))
            bench = integrity.Bench(folder, None)
            case = integrity.Case("walk", [], [], 3.0)
            answers = bench.judge(case, folder, [(0, 0, 0)], integrity.Ask([], walk=True), rows)
            self.assertEqual(len(answers), 10)
            self.assertFalse(answers[0].is_mapped, "30 m from the only mapped scan")

    def test_another_floor_is_not_mapped(self):
        self.assertTrue(integrity.is_near((1, 1, 0.5), [(0, 0, 0)], 2.0))
        self.assertFalse(integrity.is_near((1, 1, 3.5), [(0, 0, 0)], 2.0))


class SetsTest(unittest.TestCase):
    def test_names_of_cases_tell_them_apart(self):
        for made in integrity_sets.sets(False, 1).values():
            names = [case.name for case in made().cases]
            self.assertEqual(len(names), len(set(names)))


if __name__ == "__main__":
    unittest.main()
