import functools
import os
import pathlib
import signal

import numpy as np
import pytest

import scanloc
from conftest import NUM_PLACES, place_pose, pose, scene


def test_tells_its_places_as_arrays(town, poses):
    assert len(town) == NUM_PLACES
    np.testing.assert_allclose(town.T_map_place, poses, atol=1e-9)
    np.testing.assert_array_equal(town.stamps_ns, np.arange(NUM_PLACES))
    assert town.session_of_place.dtype == np.int32 and not town.session_of_place.any()
    assert town.sessions == ["drive"] and town.content_id


def test_opens_and_appends(tmp_path, town, scans, poses):
    path = tmp_path / "town.scanloc"
    path.write_bytes(pathlib.Path(town.path).read_bytes())
    before = scanloc.Map.open(str(path))
    assert before.content_id == town.content_id
    more = np.stack([place_pose(i) for i in range(20, 25)])
    grown = scanloc.Map.append(path, lambda i: scene(20 + i), more, "second")
    assert len(grown) == NUM_PLACES + 5 and len(before) == NUM_PLACES
    assert grown.sessions == ["drive", "second"] and grown.session_of_place[-1] == 1
    with pytest.raises(scanloc.AlreadyExists):
        scanloc.Map.append(path, scans, poses, "second", check=False)
    assert scanloc.Map.open(path).content_id == grown.content_id


def test_takes_names_of_files_that_are_no_text(tmp_path, town):
    path = os.fsencode(tmp_path) + b"/\xff.scanloc"
    with pytest.raises(scanloc.NotFound, match="\udcff.scanloc"):
        scanloc.Map.open(path)
    with open(path, "wb") as file:
        file.write(pathlib.Path(town.path).read_bytes())
    opened = scanloc.Map.open(path)
    assert os.fsencode(opened.path) == path and "\udcff" in repr(opened)


def test_raises_errors_of_their_kinds(tmp_path, town, scans, poses):
    with pytest.raises(scanloc.NotFound):
        scanloc.Map.open(str(tmp_path / "none.scanloc"))
    whole = pathlib.Path(town.path).read_bytes()
    damaged = whole[:len(whole) // 2]
    (tmp_path / "damaged.scanloc").write_bytes(damaged)
    with pytest.raises(scanloc.DataLoss):
        scanloc.Map.open(str(tmp_path / "damaged.scanloc"))
    with pytest.raises(scanloc.AlreadyExists):
        scanloc.Map.build(town.path, scans, poses)
    assert issubclass(scanloc.NotFound, scanloc.Error) and issubclass(scanloc.NotFound, LookupError)
    assert issubclass(scanloc.InvalidArgument, ValueError)


def bad_pose(poses, change):
    poses = poses.copy()
    change(poses)
    return poses


def stretch(poses):
    poses[3, :3, :3] *= 2


def forget(poses):
    poses[3, 0, 3] = np.nan


def flatten(poses):
    poses[3, 3, 3] = 0


@pytest.mark.parametrize("change", [stretch, forget, flatten])
def test_refuses_poses_that_are_none(tmp_path, scans, poses, change):
    path = str(tmp_path / "m.scanloc")
    with pytest.raises(scanloc.InvalidArgument, match=r"T_map_scan\[3\]"):
        scanloc.Map.build(path, scans, bad_pose(poses, change))
    assert not os.path.exists(path)


def test_refuses_shapes_that_do_not_fit(tmp_path, scans, poses):
    path = str(tmp_path / "m.scanloc")
    for bad in (poses[:-1], poses[:, :2], poses[0], poses.astype(int), None, "poses"):
        with pytest.raises(scanloc.InvalidArgument):
            scanloc.Map.build(path, scans, bad)
    with pytest.raises(scanloc.InvalidArgument):
        scanloc.Map.build(path, scans, poses, stamps_ns=[1, 2])
    assert not os.path.exists(path)


def test_passes_on_what_reading_a_scan_raises(tmp_path, poses):
    def load(number):
        if number == 5:
            raise OSError("the disk is gone")
        return scene(number)

    with pytest.raises(OSError, match="the disk is gone"):
        scanloc.Map.build(str(tmp_path / "a.scanloc"), load, poses)
    with pytest.raises(scanloc.InvalidArgument, match="float64"):
        scanloc.Map.build(str(tmp_path / "b.scanloc"), lambda i: np.zeros((5, 3)), poses)


def test_evaluates(town, scans, poses):
    auto, keys = scanloc.evaluate(town, scans, poses, methods=["auto", "a-pc:2"])
    assert auto.name == "auto" and auto.outcomes.num_queries == NUM_PLACES
    assert auto.outcomes.num_localized_right == NUM_PLACES and auto.outcomes.num_false == 0
    assert auto.f1_max == 1.0 and auto.recall[-1] == 1.0 and auto.precision.min() == 1.0
    assert keys.name == "a-pc:2"
    with pytest.raises(scanloc.InvalidArgument):
        scanloc.evaluate(town, scans, poses, methods=["none"])
    with pytest.raises(scanloc.InvalidArgument):
        scanloc.evaluate(town, scans, poses[:3])


def test_builds_with_a_mount(tmp_path, town, scans, poses):
    """A sensor upside down, 1 m ahead of the base: the map is that of one which stands upright."""
    T_base_sensor = np.diag([1.0, -1.0, -1.0, 1.0])
    T_base_sensor[0, 3] = 1.0
    hanging = [scan * np.float32([1, -1, -1]) for scan in scans]
    built = scanloc.Map.build(str(tmp_path / "m.scanloc"), hanging, poses @ pose(-1.0, 0.0, 0.0),
                              mount=scanloc.SensorMount(T_base_sensor=T_base_sensor))
    np.testing.assert_allclose(built.T_map_place, town.T_map_place, atol=1e-9)
    assert scanloc.Localizer(built).localize(scene(5)).candidates[0].place == 5


def test_keeps_places_apart(tmp_path, scans, poses):
    apart = np.linalg.norm(poses[1, :3, 3] - poses[0, :3, 3])
    every = scanloc.Map.build(str(tmp_path / "a.scanloc"), scans, poses, calibrate=False)
    assert len(every) == NUM_PLACES
    thinned = scanloc.Map.build(str(tmp_path / "b.scanloc"), scans, poses, spacing_m=1.5 * apart,
                                stamps_ns=list(range(NUM_PLACES)), calibrate=False)
    np.testing.assert_array_equal(thinned.stamps_ns, np.arange(0, NUM_PLACES, 2))
    np.testing.assert_allclose(thinned.T_map_place, poses[::2], atol=1e-9)
    still = scanloc.Map.build(str(tmp_path / "c.scanloc"), scans[:1] * 5, poses[[0] * 5],
                              calibrate=False)
    assert len(still) == 1
    all_of_it = scanloc.Map.build(str(tmp_path / "d.scanloc"), scans[:1] * 5, poses[[0] * 5],
                                  spacing_m=0, calibrate=False)
    assert len(all_of_it) == 5
    for bad in (-1.0, np.nan, 1e7):
        with pytest.raises(scanloc.InvalidArgument, match="spacing_m"):
            scanloc.Map.build(str(tmp_path / "e.scanloc"), scans, poses, spacing_m=bad)


def test_learns_the_scale_from_the_scans(tmp_path, scans, poses):
    def scale(name, points, **keywords):
        built = scanloc.Map.build(str(tmp_path / name), points, poses, check=False,
                                  calibrate=False, **keywords)
        return built.params["auto.scale"]

    rooms = [scan * np.float32([0.2, 0.2, 1]) for scan in scans]
    assert scale("streets", scans) == 1.0
    assert scale("rooms", rooms) == 0.35
    assert scale("said", rooms, scale=0.5) == 0.5
    assert scale("set", rooms, params=scanloc.Params({"auto.scale": 2.0})) == 2.0
    with pytest.raises(scanloc.InvalidArgument, match="scale is 9"):
        scale("bad", rooms, scale=9.0)
    with pytest.raises(scanloc.InvalidArgument, match="one of the two"):
        scale("both", rooms, scale=0.5, params=scanloc.Params({"auto.scale": 2.0}))


@pytest.mark.parametrize("appends", [False, True])
def test_goes_on_where_ctrl_c_stopped_it(tmp_path, scans, poses, appends):
    path = str(tmp_path / "m.scanloc")
    if appends:
        scanloc.Map.build(path, scans[:3], poses[:3], session="first", calibrate=False)
    build = functools.partial(
        scanloc.Map.append if appends else scanloc.Map.build, path, scans, poses,
        session="drive", check=False, calibrate=False, num_threads=1)
    told = []

    def interrupt(done, total):
        told.append((done, total))
        if done == 4:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        build(progress=interrupt)
    assert told[-1] == (4, NUM_PLACES)
    resumed = build(resume=True)
    assert len(resumed) == NUM_PLACES + (3 if appends else 0)
    with pytest.raises(scanloc.AlreadyExists):
        build()


def test_passes_on_what_telling_of_progress_raises(tmp_path, scans, poses):
    def tell(done, total):
        raise RuntimeError(f"{done} of {total}")

    with pytest.raises(RuntimeError, match=f"of {NUM_PLACES}"):
        scanloc.Map.build(str(tmp_path / "m.scanloc"), scans, poses, progress=tell)


def test_goes_on_with_a_build_of_the_same_scans_only(tmp_path, scans, poses):
    path = str(tmp_path / "m.scanloc")
    built = scanloc.Map.build(path, scans, poses, calibrate=False)
    with pytest.raises(scanloc.AlreadyExists):
        scanloc.Map.build(path, scans, poses)
    again = scanloc.Map.build(path, scans, poses, calibrate=False, resume=True)
    assert again.content_id == built.content_id
    with pytest.raises(scanloc.FailedPrecondition):
        scanloc.Map.build(path, scans, poses[::-1], check=False, resume=True)
