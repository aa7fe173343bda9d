import numpy as np
import pytest

import scanloc
from conftest import place_pose, pose, scene

SECOND_NS = 10**9


def drive(detector, count):
    for i in range(count):
        assert detector.add(scene(i), i * SECOND_NS, place_pose(i)) == i


def test_closes_loops():
    detector = scanloc.LoopDetector(window_s=5.0)
    drive(detector, 20)
    assert len(detector) == 20
    T_place_scan = pose(0.8, 1.5, 3.0)
    said = detector.query(scene(7, T_place_scan), 20 * SECOND_NS)
    assert said.answer.localized, said.answer.reason
    assert said.loop.place == 7
    np.testing.assert_allclose(said.loop.T_place_scan, T_place_scan, atol=0.3)
    assert said.loop.information.shape == (6, 6)
    np.linalg.cholesky(said.loop.information)
    assert detector.query(scene(18), 20 * SECOND_NS).loop is None


def test_takes_moved_places():
    detector = scanloc.LoopDetector(window_s=0.0)
    drive(detector, 10)
    moved = np.stack([pose(5, -9, 0.5) @ place_pose(i) for i in range(10)])
    detector.move_places(moved)
    said = detector.query(scene(4), 10 * SECOND_NS)
    np.testing.assert_allclose(said.answer.T_map_query, moved[4], atol=0.3)
    with pytest.raises(scanloc.InvalidArgument):
        detector.move_places(moved[:3])


def test_refuses_bad_input():
    detector = scanloc.LoopDetector(scanloc.Params(), window_places=2, method="a-pc")
    drive(detector, 5)
    for points, stamp_ns, T in ((scene(5), 0, place_pose(5)), (scene(5), SECOND_NS * 9, np.eye(3)),
                                (scene(5).T, SECOND_NS * 9, place_pose(5)),
                                (scene(5), SECOND_NS * 9, np.full((4, 4), np.nan))):
        with pytest.raises(scanloc.InvalidArgument):
            detector.add(points, stamp_ns, T)
    with pytest.raises(TypeError):
        detector.add(scene(5), "now", place_pose(5))
    assert len(detector) == 5
    for options in ({"window_s": -1.0}, {"window_places": -1}, {"method": "none"},
                    {"num_candidates": 0}):
        with pytest.raises(scanloc.InvalidArgument):
            scanloc.LoopDetector(**options)
