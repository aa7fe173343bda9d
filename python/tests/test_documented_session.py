"""The session in docs/client.md is run as it is printed there."""

import doctest
import pathlib
import re

import numpy as np

from conftest import place_pose, pose, scene

DOCUMENT = pathlib.Path(__file__).parents[2] / "docs" / "client.md"


def test_does_what_is_documented(tmp_path, monkeypatch, server, scans, poses):
    monkeypatch.chdir(tmp_path)
    query = scene(5, pose(0.5, 1.0, 2.0))
    np.column_stack([query, np.zeros(len(query), np.float32)]).tofile("query.bin")
    text = re.search(r"```pycon\n(.*?)```", DOCUMENT.read_text(), re.DOTALL).group(1)
    assert "127.0.0.1:50061" in text
    given = {"scans": scans, "T_map_scan": poses, "more_scans": [scene(20 + i) for i in range(3)],
             "T_map_more": np.stack([place_pose(20 + i) for i in range(3)])}
    session = doctest.DocTestParser().get_doctest(text.replace("127.0.0.1:50061", server), given,
                                                  "client.md", str(DOCUMENT), 0)
    told = []
    options = doctest.ELLIPSIS | doctest.IGNORE_EXCEPTION_DETAIL
    failed, tried = doctest.DocTestRunner(optionflags=options).run(session, out=told.append)
    assert failed == 0, "".join(told)
    assert tried > 10
