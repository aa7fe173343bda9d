#!/usr/bin/env python3
"""Writes drive1.mcap and drive2.mcap beside this file, two drives through a made street, with the
writers of rosbags and mcap, not with our own:
    python3 -m venv v && v/bin/pip install rosbags==0.11.9 mcap==1.6.0
    v/bin/python make_drive_bags.py path/to/scanloc
Topics: /points, frame lidar, at 10 Hz; /odom, base_link in odom, at 20 Hz; /tf_static, the sensor 1.2 m
ahead of base_link and 1.7 m above it. The odometry of drive 1 is that of the street, as the map takes
it; that of drive 2 begins elsewhere, as odometry does. truth2.txt has the poses of drive 2 in the
street's frame, of the sensor, one KITTI row a cloud.
"""
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, Writer
from rosbags.typesys import Stores, get_typestore

HERE = Path(__file__).resolve().parent
STORE = get_typestore(Stores.ROS2_HUMBLE)
T = STORE.types
START = 1_700_000_000_000_000_000
STREET = '--town-seed 3 --length-m 40 --rays 16 --azimuths 240 --spacing-m 4 --quiet'.split()
MOUNT = np.eye(4)
MOUNT[:3, 3] = 1.2, 0, 1.7


def header(ns, frame):
    stamp = T['builtin_interfaces/msg/Time'](sec=ns // 10**9, nanosec=ns % 10**9)
    return T['std_msgs/msg/Header'](stamp=stamp, frame_id=frame)


def quaternion(r):
    w = np.sqrt(max(0.0, 1 + np.trace(r))) / 2
    x, y, z = (r[2, 1] - r[1, 2]) / (4 * w), (r[0, 2] - r[2, 0]) / (4 * w), (r[1, 0] - r[0, 1]) / (4 * w)
    return T['geometry_msgs/msg/Quaternion'](x=x, y=y, z=z, w=w)


def odometry(ns, pose):
    zero = T['geometry_msgs/msg/Vector3'](x=0.0, y=0.0, z=0.0)
    position = T['geometry_msgs/msg/Point'](x=pose[0, 3], y=pose[1, 3], z=pose[2, 3])
    return T['nav_msgs/msg/Odometry'](
        header=header(ns, 'odom'), child_frame_id='base_link',
        pose=T['geometry_msgs/msg/PoseWithCovariance'](
            pose=T['geometry_msgs/msg/Pose'](position=position, orientation=quaternion(pose[:3, :3])),
            covariance=np.zeros(36)),
        twist=T['geometry_msgs/msg/TwistWithCovariance'](
            twist=T['geometry_msgs/msg/Twist'](linear=zero, angular=zero), covariance=np.zeros(36)))


def mount(ns):
    t = MOUNT[:3, 3]
    return T['tf2_msgs/msg/TFMessage'](transforms=[T['geometry_msgs/msg/TransformStamped'](
        header=header(ns, 'base_link'), child_frame_id='lidar',
        transform=T['geometry_msgs/msg/Transform'](
            translation=T['geometry_msgs/msg/Vector3'](x=t[0], y=t[1], z=t[2]),
            rotation=quaternion(MOUNT[:3, :3])))])


def cloud(ns, path):
    # Whole centimetres: the bag is then half as large.
    xyz = np.round(np.fromfile(path, '<f4').reshape(-1, 4)[:, :3], 2).astype('<f4')
    field = T['sensor_msgs/msg/PointField']
    return T['sensor_msgs/msg/PointCloud2'](
        header=header(ns, 'lidar'), height=1, width=len(xyz),
        fields=[field(name=n, offset=4 * i, datatype=7, count=1) for i, n in enumerate('xyz')],
        is_bigendian=False, point_step=12, row_step=12 * len(xyz),
        data=np.frombuffer(xyz.tobytes(), np.uint8), is_dense=True)


def messages(drive, poses, T_odom_street):
    yield '/tf_static', 'tf2_msgs/msg/TFMessage', START, mount(START)
    base = [T_odom_street @ pose @ np.linalg.inv(MOUNT) for pose in poses]
    for i, pose in enumerate(base):
        ns = START + i * 100_000_000
        yield '/odom', 'nav_msgs/msg/Odometry', ns, odometry(ns, pose)
        yield '/points', 'sensor_msgs/msg/PointCloud2', ns, cloud(ns, drive / f'velodyne/{i:06d}.bin')
        # Straight on until the next, and beyond the last.
        half = base[i + 1] if i + 1 < len(base) else pose
        between = pose.copy()
        between[:3, 3] = (pose[:3, 3] + half[:3, 3]) / 2
        yield '/odom', 'nav_msgs/msg/Odometry', ns + 50_000_000, odometry(ns + 50_000_000, between)


def write(path, source):
    with open(path, 'wb') as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start('ros2', 'make_drive_bags')
        channels = {}
        for topic, kind, ns, message in source:
            if topic not in channels:
                text = STORE.generate_msgdef(kind, ros_version=2)[0].encode()
                channels[topic] = writer.register_channel(topic, 'cdr', writer.register_schema(kind, 'ros2msg', text))
            writer.add_message(channels[topic], ns, STORE.serialize_cdr(message, kind), ns)
        writer.finish()


def main():
    scanloc = sys.argv[1]
    with tempfile.TemporaryDirectory() as work:
        for number, more in ((1, []), (2, ['--lane-shift-m', '1'])):
            drive = Path(work) / f'drive{number}'
            subprocess.run([scanloc, 'simulate', drive, '--session-seed', str(number), *STREET, *more], check=True)
            rows = np.loadtxt(drive / 'poses.txt').reshape(-1, 3, 4)
            poses = [np.vstack([row, [0, 0, 0, 1]]) for row in rows]
            shift = np.eye(4)
            if number == 2:
                poses = poses[3:6]
                for i in range(3):
                    (drive / f'velodyne/{i + 3:06d}.bin').replace(drive / f'velodyne/{i:06d}.bin')
                shift = np.linalg.inv(poses[0])
                np.savetxt(HERE / 'truth2.txt', [pose[:3].ravel() for pose in poses], fmt='%.6f')
            write(HERE / f'drive{number}.mcap', messages(drive, poses, shift))


if __name__ == '__main__':
    main()
