#!/usr/bin/env python3
"""Reads the same clouds from MCAP with scanloc and with the Python package rosbags, in turns; prints the
least time a cloud, opening aside, by the clock and of processors, what the compression's own library takes
of the latter, and opening by itself, in which all checksums are looked at.

    python3 -m venv v && v/bin/pip install rosbags==0.11.9 mcap==1.6.0 numpy
    v/bin/python bench/bag_against_rosbags.py build/release/bench/bag_bench FOLDER_OF_KITTI_BIN_FILES
"""

import csv
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
from mcap.writer import CompressionType, Writer
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_HUMBLE)
T = STORE.types
CLOUD = "sensor_msgs/msg/PointCloud2"
NUM_CLOUDS = 40
POINT = np.dtype({"names": ["x", "y", "z", "intensity", "ring", "t"],
                  "formats": ["<f4", "<f4", "<f4", "<f4", "<u2", "<u4"],
                  "offsets": [0, 4, 8, 16, 20, 24], "itemsize": 32})  # as Ouster's driver has it


def message(points, stamp_ns):
    rows = np.zeros(len(points), POINT)
    for axis, name in enumerate(("x", "y", "z", "intensity")):
        rows[name] = points[:, axis]
    rows["ring"] = np.arange(len(points)) % 64
    rows["t"] = np.linspace(0, 99_999_999, len(points))
    kinds = {"<f4": 7, "<u2": 4, "<u4": 6}
    fields = [T["sensor_msgs/msg/PointField"](name=name, offset=POINT.fields[name][1], count=1,
                                              datatype=kinds[POINT[name].str])
              for name in POINT.names]
    stamp = T["builtin_interfaces/msg/Time"](sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    header = T["std_msgs/msg/Header"](stamp=stamp, frame_id="lidar")
    return T[CLOUD](header=header, height=1, width=len(rows), fields=fields, is_bigendian=False,
                    point_step=32, row_step=32 * len(rows), data=rows.view(np.uint8), is_dense=True)


def write(path, scans, compression):
    serialised = [bytes(STORE.serialize_cdr(message(scan, 10**9), CLOUD)) for scan in scans]
    with open(path, "wb") as stream:
        writer = Writer(stream, compression=compression, chunk_size=6 << 20)  # two clouds
        writer.start(profile="ros2")
        text, _ = STORE.generate_msgdef(CLOUD, ros_version=2)
        schema = writer.register_schema(CLOUD, "ros2msg", text.encode())
        channel = writer.register_channel("/points", "cdr", schema)
        for i in range(NUM_CLOUDS):
            stamp_ns = (10 + i) * 10**8
            writer.add_message(channel, stamp_ns, serialised[i % len(serialised)], stamp_ns)
        writer.finish()


def scanloc_ms(bench, bag):
    out = subprocess.run(
        [bench, "--benchmark_filter=^(OpenBag/.*|ReadClouds/.*|DescribeClouds|Decompress.*)$",
         "--benchmark_format=csv", "--benchmark_min_time=0.3"],
        env={**os.environ, "SCANLOC_BENCH_BAG": str(bag)}, check=True, capture_output=True,
        text=True).stdout
    rows = csv.DictReader(out[out.index("name,"):].splitlines())
    least = {}
    for row in rows:
        name = row["name"].split("/")[0]
        least[name] = float(row["cpu_time"]) / 1e3
        least[name + " by the clock"] = float(row["real_time"]) / 1e3
    return least


def rosbags_ms(bag):
    with AnyReader([bag]) as reader:
        for _ in range(2):  # the first time it makes its deserialisers, in some 0.1 s
            start = time.perf_counter(), time.process_time()
            for connection, _, raw in reader.messages():
                reader.deserialize(raw, connection.msgtype)
            took = time.perf_counter() - start[0], time.process_time() - start[1]
        return [seconds / NUM_CLOUDS * 1e3 for seconds in took]


bench, folder = sys.argv[1:]
scans = [np.fromfile(path, np.float32).reshape(-1, 4)
         for path in sorted(pathlib.Path(folder).glob("*.bin"))]
kinds = {"not compressed": (CompressionType.NONE, None),
         "lz4": (CompressionType.LZ4, "DecompressLz4"),
         "zstd": (CompressionType.ZSTD, "DecompressZstd")}
with tempfile.TemporaryDirectory() as work:
    print("chunks            by the clock               of processors              of which the library"
          "  opening  describing")
    for name, (compression, library) in kinds.items():
        bag = pathlib.Path(work) / f"{compression.name}.mcap"
        write(bag, scans, compression)
        turns = [(scanloc_ms(bench, bag), rosbags_ms(bag)) for _ in range(7)]
        least = {key: min(ours[key] for ours, _ in turns) for key in turns[0][0]}
        print(f"{name:15}", end="")
        for i, key in enumerate(("ReadClouds by the clock", "ReadClouds")):
            theirs = min(turn[1][i] for turn in turns)
            print(f"{least[key]:5.2f} {theirs:5.2f} ms {theirs / least[key]:5.2f} times  ", end="")
        print(f"{least.get(library, 0):10.2f} ms {least['OpenBag'] / NUM_CLOUDS:14.2f} ms"
              f"{least['DescribeClouds']:9.2f} ms")
