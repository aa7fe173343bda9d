"""Made scans: posts in the plane, seen from where a robot stands."""

import contextlib
import os
import pathlib
import select
import subprocess

import numpy as np
import pytest

import scanloc

NUM_PLACES = 12


def pose(x, y, yaw, z=0.0):
    T = np.eye(4)
    c, s = np.cos(yaw), np.sin(yaw)
    T[:2, :2] = [[c, -s], [s, c]]
    T[:3, 3] = [x, y, z]
    return T


def place_pose(number):
    return pose(40.0 * number, 3.0 * number, 0.4 * number, 0.5)


def scene(seed, T_place_query=np.eye(4)):
    """N x 3 float32: 70 posts on a ground, of the place `seed`, as a query sees them."""
    random = np.random.default_rng(seed)
    angle = random.uniform(0, 2 * np.pi, 70)
    reach = random.uniform(5, 45, 70)
    posts = np.stack([reach * np.cos(angle), reach * np.sin(angle)], 1)
    heights = np.arange(-1.6, 3.0, 0.2)
    points = np.concatenate([np.column_stack([posts, np.full(len(posts), z)]) for z in heights])
    around = np.linspace(0, 2 * np.pi, 240, endpoint=False)
    rings = np.concatenate([
        np.column_stack([r * np.cos(around), r * np.sin(around), np.full(240, -2.0)])
        for r in (4, 7, 11, 16, 22)])
    points = np.concatenate([points, rings])
    T = np.linalg.inv(T_place_query)
    return np.ascontiguousarray(points @ T[:3, :3].T + T[:3, 3], dtype=np.float32)


@pytest.fixture(scope="session")
def scans():
    return [scene(i) for i in range(NUM_PLACES)]


@pytest.fixture(scope="session")
def poses():
    return np.stack([place_pose(i) for i in range(NUM_PLACES)])


@pytest.fixture(scope="session")
def town(tmp_path_factory, scans, poses):
    path = tmp_path_factory.mktemp("map") / "town.scanloc"
    return scanloc.Map.build(str(path), scans, poses, stamps_ns=list(range(NUM_PLACES)))


@pytest.fixture(scope="session")
def scanlocd():
    """Serves maps, NAME=PATH each, while its context lasts; gives HOST:PORT."""
    binary = pathlib.Path(os.environ.get("SCANLOC_BIN_DIR", ".")) / "scanlocd"
    if not binary.exists():
        pytest.skip(f"there is no {binary}: build scanlocd, and set SCANLOC_BIN_DIR")

    @contextlib.contextmanager
    def serve(**maps):
        named = [option for name, path in maps.items() for option in ("--map", f"{name}={path}")]
        process = subprocess.Popen([str(binary), *named, "--listen", "127.0.0.1:0"],
                                   stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        try:
            assert select.select([process.stdout], [], [], 60)[0], "scanlocd is not ready"
            yield process.stdout.readline().split()[-1]
        finally:
            process.terminate()
            process.wait(30)

    return serve


@pytest.fixture(scope="session")
def server(scanlocd, town):
    """HOST:PORT of a scanlocd that serves the town."""
    with scanlocd(town=town.path) as address:
        yield address
