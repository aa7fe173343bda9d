import ast
import os
import pathlib
import subprocess
import sys
import threading

import numpy as np
import pytest

import scanloc
from conftest import NUM_PLACES, place_pose, pose, scene

T_PLACE_QUERY = pose(0.8, 1.5, 3.0)


@pytest.fixture(scope="module")
def localizer(town):
    return scanloc.Localizer(town)


def test_finds_place_and_pose(localizer):
    for place in (0, 5, NUM_PLACES - 1):
        answer = localizer.localize(scene(place, T_PLACE_QUERY), max_answers=3)
        assert answer.outcome == scanloc.Outcome.LOCALIZED, answer.reason
        best = answer.candidates[0]
        assert best.place == place and best.session_name == "drive" and best.confidence > 0.8
        np.testing.assert_allclose(answer.T_map_query, place_pose(place) @ T_PLACE_QUERY, atol=0.3)
        assert answer.T_map_query.dtype == np.float64
        assert len(answer.candidates) <= 3


def test_says_nothing_of_what_it_does_not_know(localizer):
    answer = localizer.localize(scene(999))
    assert not answer.localized and answer.T_map_query is None
    empty = localizer.localize(np.zeros((0, 3), np.float32))
    assert empty.outcome == scanloc.Outcome.INSUFFICIENT_SCAN


def test_takes_any_strides_and_gives_the_same(localizer):
    points = scene(3, T_PLACE_QUERY)
    wide = np.zeros((len(points), 4), np.float32)
    wide[:, :3] = points
    expected = localizer.localize(points).T_map_query
    backwards = np.ascontiguousarray(points[::-1])[::-1]
    for same in (wide, wide[:, :3], np.asfortranarray(points), backwards):
        np.testing.assert_array_equal(localizer.localize(same).T_map_query, expected)
    read_only = points.copy()
    read_only.flags.writeable = False
    np.testing.assert_array_equal(localizer.localize(read_only).T_map_query, expected)


def test_skips_points_that_are_not_finite(localizer):
    points = scene(3, T_PLACE_QUERY)
    holes = np.full((500, 3), np.nan, np.float32)
    holes[::2] = np.inf
    answer = localizer.localize(np.concatenate([points, holes]))
    np.testing.assert_array_equal(answer.T_map_query, localizer.localize(points).T_map_query)
    assert localizer.localize(holes).outcome == scanloc.Outcome.INSUFFICIENT_SCAN


def test_takes_no_point_that_is_masked(localizer):
    points = scene(4)
    masked = np.ma.masked_array(points, mask=np.zeros_like(points, dtype=bool))
    assert localizer.localize(masked).candidates[0].place == 4
    masked[::2] = np.ma.masked
    with pytest.raises(scanloc.InvalidArgument, match="compress_rows"):
        localizer.localize(masked)
    answer = localizer.localize(np.ma.compress_rows(masked))
    np.testing.assert_array_equal(answer.T_map_query, localizer.localize(points[1::2]).T_map_query)


@pytest.mark.parametrize("bad, text", [
    (np.zeros((5, 2), np.float32), r"\(5, 2\)"),
    (np.zeros((3, 5000), np.float32), r"\(3, 5000\)"),
    (np.zeros(12, np.float32), r"\(12\)"),
    (np.broadcast_to(np.float32(1), (4_000_001, 3)), "at most 4000000 points"),
    (np.zeros((4, 4, 4), np.float32), r"\(4, 4, 4\)"),
    (np.zeros((5, 3)), "float64"),
    (np.zeros((5, 3), np.int32), "int32"),
    (np.zeros((5, 3), ">f4"), ">f4"),
    (np.array([[None] * 3]), "object"),
    ([[1.0, 2.0, 3.0]], "list"),
    ("points", "str"),
    (bytes(48), "bytes"),
    (None, "NoneType"),
])
def test_refuses_arrays_that_are_no_scan(localizer, bad, text):
    with pytest.raises(scanloc.InvalidArgument, match=text):
        localizer.localize(bad)
    with pytest.raises(scanloc.InvalidArgument, match=text):
        scanloc.Describer().describe(bad)


@pytest.mark.parametrize("options", [
    {"method": "no-such"}, {"num_candidates": 0}, {"min_confidence": 2.0}, {"max_answers": -1},
    {"threshold": 0.3, "method": "auto"},
])
def test_refuses_bad_options(localizer, options):
    with pytest.raises(scanloc.InvalidArgument):
        localizer.localize(scene(0), **options)


def test_describes_once_and_asks_often(localizer, town):
    descriptor = scanloc.Describer(town.params).describe(scene(4))
    assert descriptor.polar.shape == (20, 60) and descriptor.cart.dtype == np.uint16
    assert descriptor.posts.shape[1] == 2 and descriptor.num_voxels > 100
    for method in ("auto", "a-pc"):
        assert localizer.localize(descriptor, method=method).candidates[0].place == 4
    other = scanloc.Describer(scanloc.Params({"polar.num_rings": 10})).describe(scene(4))
    with pytest.raises(scanloc.FailedPrecondition):
        localizer.localize(other)


def test_threads_share_a_localizer_and_release_the_lock(localizer):
    scans = [scene(i, T_PLACE_QUERY) for i in range(NUM_PLACES)]
    expected = [localizer.localize(scan).T_map_query for scan in scans]
    wrong = []

    def ask():
        for scan, pose_expected in zip(scans, expected):
            if not np.array_equal(localizer.localize(scan).T_map_query, pose_expected):
                wrong.append(scan)

    threads = [threading.Thread(target=ask) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_another_thread_runs_while_one_computes():
    """A barrier within scans that are read by threads of scanloc: it opens only if the lock is
    free while the main thread waits in C++."""
    reached = threading.Event()
    released = threading.Event()

    def helper():
        if reached.wait(30):
            released.set()

    thread = threading.Thread(target=helper)
    thread.start()

    def load(number):
        reached.set()
        assert released.wait(30)
        return scene(number)

    import tempfile
    with tempfile.TemporaryDirectory() as folder:
        poses = np.stack([place_pose(i) for i in range(4)])
        built = scanloc.Map.build(folder + "/m.scanloc", load, poses, check=False, num_threads=2)
    thread.join()
    assert len(built) == 4


@pytest.mark.parametrize("what", [
    "scanloc.Localizer(scanloc.Map.open(town)).localize(scan)",
    "describer.describe(scan)",
    "build(scan)",
])
def test_the_program_may_end_while_threads_work(town, what, tmp_path):
    program = f"""
import itertools, threading, numpy as np, scanloc
town, number = {town.path!r}, itertools.count()
scan = np.random.default_rng(1).uniform(-50, 50, (100_000, 3)).astype(np.float32)
describer = scanloc.Describer()
turn = threading.Barrier(5)
def build(scan):
    poses = np.tile(np.eye(4), (1000, 1, 1))
    poses[:, 0, 3] = np.arange(1000) * 5.0
    scanloc.Map.build(f"{tmp_path}/{{next(number)}}.scanloc", lambda i: scan, poses)
def work():
    turn.wait()
    while True:
        {what}
for _ in range(4):
    threading.Thread(target=work, daemon=True).start()
turn.wait()
for _ in range(3):
    describer.describe(scan)
"""
    for _ in range(3):
        ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True,
                               timeout=120)
        assert (ended.returncode, ended.stderr) == (0, "")


def test_stubs_tell_types():
    """As type checkers need them: what `with` gives, what can be compared, what is an array."""
    stub = ast.parse(pathlib.Path(scanloc.__file__).with_name("_scanloc.pyi").read_text())
    methods = {f"{of.name}.{method.name}": method for of in stub.body if isinstance(of, ast.ClassDef)
               for method in of.body if isinstance(method, ast.FunctionDef)}
    untyped = [name for name, method in methods.items()
               if method.returns is None or ast.unparse(method.returns) == "object"]
    assert untyped == ["Params.__getitem__"]
    compared = methods["Params.__eq__"].args
    assert ast.unparse((compared.posonlyargs + compared.args)[1].annotation) == "object"


def test_tells_its_version():
    program = pathlib.Path(os.environ["SCANLOC_BIN_DIR"]) / "scanloc"
    told = subprocess.run([program, "--version"], capture_output=True, text=True, check=True)
    assert told.stdout.split()[1] == scanloc.__version__


def test_params_are_by_name():
    params = scanloc.Params({"voxel_size_m": 0.4, "polar.num_rings": 10})
    assert params["voxel_size_m"] == 0.4 and params["polar.num_sectors"] == 60
    assert params == scanloc.Params(params.to_dict()) != scanloc.Params()
    assert params != params.to_dict() and len({params, scanloc.Params(params.to_dict())}) == 1
    assert params.signature != scanloc.Params().signature
    for bad in ({"voxel": 1.0}, {"voxel_size_m": "x"}, {"voxel_size_m": -1.0},
                {"cart.shift_mode": 7}, {1: 2}):
        with pytest.raises(scanloc.InvalidArgument):
            scanloc.Params(bad)
    with pytest.raises(KeyError):
        params["voxel"]
