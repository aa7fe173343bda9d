import multiprocessing
import os
import socket
import threading

import numpy as np
import pytest

import scanloc
from conftest import pose, scene


def test_answers_as_the_map_does(server, town):
    client = scanloc.Client(server)
    query = scene(5, pose(0.5, 1.0, 2.0))
    expected = scanloc.Localizer(town).localize(query)
    for send_scan in (False, True):
        answer = client.localize(query, "town", send_scan=send_scan)
        assert answer.outcome == scanloc.Outcome.LOCALIZED
        assert answer.content_id == town.content_id
        np.testing.assert_array_equal(answer.T_map_query, expected.T_map_query)


def test_tells_of_the_maps(server, town):
    client = scanloc.Client(server, timeout_s=10)
    assert [m.name for m in client.list_maps()] == ["town"]
    assert client.map_info().params == town.params and client.is_serving("town")
    with pytest.raises(scanloc.NotFound):
        client.localize(scene(1), "nowhere")
    with pytest.raises(scanloc.InvalidArgument):
        client.localize(scene(1).astype(np.float64))


def test_asks_all_maps_without_a_name(scanlocd, town, tmp_path, poses):
    other = scanloc.Map.build(str(tmp_path / "other.scanloc"), [scene(50 + i) for i in range(12)],
                              poses)
    with scanlocd(town=town.path, other=other.path) as address:
        client = scanloc.Client(address)
        answer = client.localize(scene(53, pose(0.5, 1.0, 2.0)))
        assert answer.localized and answer.map == "other" and answer.content_id == other.content_id
        assert [c.map for c in answer.candidates] == ["other"]
        assert client.localize(scene(5), "town").candidates[0].map == ""
        with pytest.raises(scanloc.NotFound, match="other, town"):
            client.stream()


def test_threads_share_a_client(server):
    client = scanloc.Client(server)
    found = {}

    def ask(number):
        found[number] = client.localize(scene(number, pose(0.5, 1.0, 2.0))).candidates[0].place

    threads = [threading.Thread(target=ask, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == {i: i for i in range(4)}


def test_says_that_nobody_is_there():
    with socket.socket() as held:
        held.bind(("127.0.0.1", 0))  # and does not listen
        with pytest.raises(scanloc.Unavailable):
            scanloc.Client(f"127.0.0.1:{held.getsockname()[1]}", connect_timeout_s=0.5)


def test_refuses_bad_options():
    for options in ({"timeout_s": -1}, {"timeout_s": float("nan")}, {"max_attempts": 0},
                    {"token": "secret", "address": "192.0.2.1:1"}, {"tls_cert_file": "a.pem"}):
        with pytest.raises(scanloc.InvalidArgument):
            scanloc.Client(**{"address": "127.0.0.1:1", "connect_timeout_s": 0, **options})


def in_child(server_address, client, results):
    """What survives a fork, and what says that it does not."""
    try:
        scan = scene(2)
        results.append(scanloc.Describer().describe(scan).num_voxels > 0)
        for use in (lambda: client.localize(scan), lambda: scanloc.Client(server_address)):
            try:
                use()
                results.append("worked")
            except scanloc.FailedPrecondition as error:
                results.append("fork" in str(error))
    except BaseException as error:  # told to the parent, which asserts
        results.append(repr(error))


def test_a_forked_child_is_told_instead_of_hanging(server):
    client = scanloc.Client(server)
    client.localize(scene(1))
    read_end, write_end = os.pipe()
    child = os.fork()
    if child == 0:
        results = []
        in_child(server, client, results)
        os.write(write_end, repr(results).encode())
        os._exit(0)
    os.close(write_end)
    with os.fdopen(read_end) as pipe:
        said = pipe.read()
    assert os.waitpid(child, 0)[1] == 0
    assert said == "[True, True, True]"
    assert client.localize(scene(1)).localized


def ask_in_spawned(address):
    return scanloc.Client(address).localize(scene(3)).candidates[0].place


def test_a_spawned_process_has_its_own_client(server):
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        assert pool.map(ask_in_spawned, [server, server]) == [3, 3]
