"""What a map in memory and a server are asked alike."""

import numpy as np
import pytest

import scanloc
from conftest import place_pose, pose, scene

T_PLACE_QUERY = pose(0.8, 1.5, 3.0)


@pytest.fixture(params=["map", "server"])
def asked(request, town):
    if request.param == "map":
        return scanloc.Localizer(town)
    return scanloc.Client(request.getfixturevalue("server"))


def test_tells_how_far_off_the_pose_may_be(asked):
    covariance = asked.localize(scene(5, T_PLACE_QUERY)).candidates[0].covariance
    assert covariance.shape == (6, 6) and covariance.dtype == np.float64
    np.testing.assert_array_equal(covariance, covariance.T)
    assert (np.linalg.eigvalsh(covariance) > 0).all()
    assert 0.0 < np.sqrt(covariance[0, 0]) < 0.5
    paper = asked.localize(scene(5, T_PLACE_QUERY), method="a-pc")
    assert paper.candidates[0].covariance is None
    assert paper.candidates[0].geo is None  # the map was not told where it stands


def test_gives_stamp_and_frame_back(asked):
    answer = asked.localize(scene(5), stamp_ns=1_700_000_000_123_456_789, frame_id="lidar")
    assert (answer.stamp_ns, answer.frame_id) == (1_700_000_000_123_456_789, "lidar")
    assert answer.map in ("town", "map")


def test_takes_the_mount_into_account(asked):
    """A sensor that hangs upside down, 1 m ahead of the base and 2 m above it."""
    T_base_sensor = np.diag([1.0, -1.0, -1.0, 1.0])
    T_base_sensor[:3, 3] = [1.0, 0.0, 2.0]
    mount = scanloc.SensorMount(T_base_sensor=T_base_sensor, min_range_m=1.0,
                                self_box=(-2, -1, 0, 0.5, 1, 1.9))
    np.testing.assert_array_equal(mount.T_base_sensor, T_base_sensor)
    hanging = np.ascontiguousarray(scene(5, T_PLACE_QUERY) * np.float32([1, -1, -1]))
    answer = asked.localize(hanging, mount=mount)
    assert answer.localized, answer.reason
    expected = place_pose(5) @ T_PLACE_QUERY @ pose(-1.0, 0.0, 0.0, -2.0)
    np.testing.assert_allclose(answer.T_map_query, expected, atol=0.3)


def test_looks_only_where_the_prior_says(asked):
    x, y = place_pose(5)[:2, 3]
    here = scanloc.Prior(disc=(x, y, 10.0), heights=(-5, 5), sessions=["drive"])
    assert asked.localize(scene(5), prior=here).candidates[0].place == 5
    elsewhere = scanloc.Prior(disc=(x + 100.0, y, 10.0))
    assert not asked.localize(scene(5), prior=elsewhere).localized
    with pytest.raises(scanloc.InvalidArgument, match="night"):
        asked.localize(scene(5), prior=scanloc.Prior(sessions=["night"]))


def test_takes_what_a_describer_gave(asked, town):
    descriptor = scanloc.Describer(town.params).describe(scene(4))
    assert asked.localize(descriptor).candidates[0].place == 4
    with pytest.raises(scanloc.InvalidArgument, match="mount"):
        asked.localize(descriptor, mount=scanloc.SensorMount(min_range_m=1.0))


def test_follows_a_robot_that_keeps_moving(asked):
    with asked.stream(max_step_m=5.0) as robot:
        first = robot.locate(scene(5, T_PLACE_QUERY))
        assert first.num_scans == 1 and first.answer.localized
        step = pose(0.5, 0.2, 0.1)
        second = robot.locate(scene(5, T_PLACE_QUERY @ step), step, stamp_ns=7)
        assert second.num_scans == 2 and not second.relocated
        assert second.answer.stamp_ns == 7
        expected = place_pose(5) @ T_PLACE_QUERY @ step
        np.testing.assert_allclose(second.answer.T_map_query, expected, atol=0.3)
        with pytest.raises(scanloc.InvalidArgument):
            robot.locate(scene(5), np.zeros((4, 4)))


@pytest.mark.parametrize("bad, error", [
    ({"max_step_m": -1.0}, scanloc.InvalidArgument), ({"method": "a-pc"}, scanloc.InvalidArgument),
    ({"step": 1.0}, TypeError), ({"mount": "above"}, TypeError),
])
def test_opens_no_stream_of_bad_options(asked, bad, error):
    with pytest.raises(error):
        asked.stream(**bad)


@pytest.mark.parametrize("bad", [
    {"T_base_sensor": np.zeros((4, 4))}, {"min_range_m": -1.0}, {"min_range_m": float("nan")},
    {"self_box": (0, 0, 0, 0, 1, 1)},
])
def test_refuses_mounts_that_are_none(bad):
    with pytest.raises(scanloc.InvalidArgument):
        scanloc.SensorMount(**bad)


@pytest.mark.parametrize("bad", [{"disc": (0, 0, -1)}, {"heights": (3, 2)}])
def test_refuses_priors_that_hold_nothing(bad):
    with pytest.raises(scanloc.InvalidArgument):
        scanloc.Prior(**bad)


@pytest.mark.parametrize("bad", [{"mehtod": "auto"}, {"max_answers": "three"}, {"method": 5}])
def test_refuses_options_of_another_name_or_type(asked, bad):
    with pytest.raises(TypeError, match=next(iter(bad))):
        asked.localize(scene(0), **bad)
