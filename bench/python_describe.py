#!/usr/bin/env python3
"""Describes the same scans from Python and from C++, in turns; prints least times and their ratio.

    PYTHONPATH=build/release/python bench/python_describe.py build/release/bench/describe_bench \\
        FOLDER_OF_KITTI_BIN_FILES
"""

import csv
import os
import pathlib
import subprocess
import sys
import time

import numpy as np

import scanloc


def cpp_us(bench, folder):
    out = subprocess.run(
        [bench, "--benchmark_filter=^DescribeQuery$", "--benchmark_format=csv",
         "--benchmark_min_time=0.2"],
        env={**os.environ, "SCANLOC_BENCH_SCANS": folder}, check=True, capture_output=True,
        text=True).stdout
    rows = csv.DictReader(out[out.index("name,"):].splitlines())
    return float(next(rows)["cpu_time"])


def python_us(describer, scans, rounds=40):
    start = time.process_time()
    for _ in range(rounds):
        for scan in scans:
            describer.describe(scan)
    return (time.process_time() - start) / (rounds * len(scans)) * 1e6


bench, folder = sys.argv[1:]
rows = [np.fromfile(path, np.float32).reshape(-1, 4)
        for path in sorted(pathlib.Path(folder).glob("*.bin"))]
packed = [np.ascontiguousarray(points[:, :3]) for points in rows]
describer = scanloc.Describer()
python_us(describer, packed, 5)  # buffers reach their size
least = {"C++": [], "Python, N x 3": [], "Python, N x 4": []}
for _ in range(15):
    least["C++"].append(cpp_us(bench, folder))
    least["Python, N x 3"].append(python_us(describer, packed))
    least["Python, N x 4"].append(python_us(describer, rows))
for name, times in least.items():
    print(f"{name:14} {min(times):7.0f} us   {min(times) / min(least['C++']):.3f}")
