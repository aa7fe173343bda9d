#!/usr/bin/env python3
"""Writes the bags beside this file, with the writers of rosbags and mcap, not with our own:
    python3 -m venv v && v/bin/pip install rosbags==0.11.9 mcap==1.6.0 && v/bin/python make_bags.py
A robot drives along x at 10 m/s and turns left at 0.3 rad/s; its sensor stands 1 m ahead of base_link
and 1.5 m above, turned to the left by 90 degrees. All points are of the same few posts, each measured
at its own time of the sweep. TF says map -> odom, a shift by (100, 50, 0); topic /pose is of the
sensor in odom.
"""
import math
import shutil
import sys
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, IndexType, Writer as McapWriter
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

HERE = Path(sys.argv[1] if len(sys.argv) > 1 else __file__).resolve()
HERE = HERE if HERE.is_dir() else HERE.parent
S1, S2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
S1.register(get_types_from_msg('geometry_msgs/TransformStamped[] transforms', 'tf2_msgs/msg/TFMessage'))
START = 1_700_000_000_000_000_000
POSTS = np.array([[20, 5, 0], [20, 5, 3], [-8, 12, 1], [3, -30, 2], [40, 0.5, -1], [-25, -6, 4]], float)
NUM_CLOUDS = 6


def transform(x, y, z, yaw):
    t = np.eye(4)
    t[:2, :2] = [[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]]
    t[:3, 3] = x, y, z
    return t


MOUNT = transform(1, 0, 1.5, math.pi / 2)


def base(s):
    return transform(10 * s, 0, 0, 0.3 * s)


def stamp(store, ns):
    return store.types['builtin_interfaces/msg/Time'](sec=ns // 10**9, nanosec=ns % 10**9)


def header(store, ns, frame):
    kind = store.types['std_msgs/msg/Header']
    return kind(seq=7, stamp=stamp(store, ns), frame_id=frame) if store is S1 else kind(
        stamp=stamp(store, ns), frame_id=frame)


def parts(store, t, kind):
    v = store.types['geometry_msgs/msg/' + ('Vector3' if kind == 'Transform' else 'Point')]
    q = store.types['geometry_msgs/msg/Quaternion']
    yaw = math.atan2(t[1, 0], t[0, 0])
    return v(x=t[0, 3], y=t[1, 3], z=t[2, 3]), q(x=0.0, y=0.0, z=math.sin(yaw / 2), w=math.cos(yaw / 2))


def pose(store, t):
    position, orientation = parts(store, t, 'Pose')
    return store.types['geometry_msgs/msg/Pose'](position=position, orientation=orientation)


def odometry(store, ns):
    types = store.types
    zero = types['geometry_msgs/msg/Vector3'](x=0.0, y=0.0, z=0.0)
    return types['nav_msgs/msg/Odometry'](
        header=header(store, ns, 'odom'), child_frame_id='base_link',
        pose=types['geometry_msgs/msg/PoseWithCovariance'](pose=pose(store, base((ns - START) * 1e-9)),
                                                            covariance=np.zeros(36)),
        twist=types['geometry_msgs/msg/TwistWithCovariance'](
            twist=types['geometry_msgs/msg/Twist'](linear=zero, angular=zero), covariance=np.zeros(36)))


def tf(store, ns, *edges):
    stamped = []
    for parent, child, t in edges:
        translation, rotation = parts(store, t, 'Transform')
        stamped.append(store.types['geometry_msgs/msg/TransformStamped'](
            header=header(store, ns, parent), child_frame_id=child,
            transform=store.types['geometry_msgs/msg/Transform'](translation=translation, rotation=rotation)))
    return store.types['tf2_msgs/msg/TFMessage'](transforms=stamped)


def cloud(store, ns, dtype, big=False, height=1, row_padding=0, skewed=True):
    """The posts as the sensor sees them, and one point that is NaN, in the layout of dtype."""
    n = len(POSTS)
    offsets = np.linspace(-0.05, 0.05, n) if skewed else np.zeros(n)
    rows = np.zeros(n + 1 + (n + 1) % height, np.dtype(dtype).newbyteorder('>' if big else '<'))
    for i, (post, offset) in enumerate(zip(POSTS, offsets)):
        s = (ns - START) * 1e-9 + offset
        seen = np.linalg.inv(base(s) @ MOUNT) @ np.append(post, 1)
        rows['x'][i], rows['y'][i], rows['z'][i] = seen[:3]
        names = rows.dtype.names
        if 'time' in names:
            rows['time'][i] = offset
        if 'timestamp' in names:
            rows['timestamp'][i] = ns * 1e-9 + offset
        if 't' in names:
            rows['t'][i] = round((offset + 0.05) * 1e9)
    for name in 'xyz':
        rows[name][n:] = np.nan
    kinds = {'i1': 1, 'u1': 2, 'i2': 3, 'u2': 4, 'i4': 5, 'u4': 6, 'f4': 7, 'f8': 8}
    field = store.types['sensor_msgs/msg/PointField']
    fields = [field(name=name, offset=kind[1], datatype=kinds[kind[0].str[1:]], count=1)
              for name, kind in rows.dtype.fields.items()]
    width = len(rows) // height
    data = b''.join(rows[r * width:(r + 1) * width].tobytes() + b'\xaa' * row_padding for r in range(height))
    return store.types['sensor_msgs/msg/PointCloud2'](
        header=header(store, ns, 'velodyne'), height=height, width=width, fields=fields, is_bigendian=big,
        point_step=rows.dtype.itemsize, row_step=width * rows.dtype.itemsize + row_padding,
        data=np.frombuffer(data, np.uint8), is_dense=False)


VELODYNE = {'names': ['x', 'y', 'z', 'intensity', 'ring', 'time'], 'formats': ['f4', 'f4', 'f4', 'f4', 'u2', 'f4'],
            'offsets': [0, 4, 8, 16, 20, 24], 'itemsize': 32}
LAYOUTS = {
    'hesai': dict(dtype=[('timestamp', 'f8'), ('z', 'f4'), ('ring', 'u2'), ('y', 'f4'), ('x', 'f4')]),
    'float64_big': dict(dtype=[('x', 'f8'), ('y', 'f8'), ('z', 'f8')], big=True, skewed=False),
    'organised': dict(dtype=[('x', 'f4'), ('y', 'f4'), ('z', 'f4'), ('time', 'f4')], height=2, row_padding=5),
}


def messages(store):
    """(topic, type, ns, message), in the order of time."""
    yield '/tf_static', 'tf2_msgs/msg/TFMessage', START, tf(store, START, ('base_link', 'velodyne', MOUNT))
    for step in range(-2, 2 * NUM_CLOUDS + 2):  # 50 ms each
        ns = START + step * 50_000_000
        s = step * 0.05
        yield '/odom', 'nav_msgs/msg/Odometry', ns, odometry(store, ns)
        yield '/tf', 'tf2_msgs/msg/TFMessage', ns, tf(store, ns, ('map', 'odom', transform(100, 50, 0, 0)),
                                                      ('odom', 'base_link', base(s)))
        yield '/pose', 'geometry_msgs/msg/PoseStamped', ns, store.types['geometry_msgs/msg/PoseStamped'](
            header=header(store, ns, 'odom'), pose=pose(store, base(s) @ MOUNT))
        if step >= 0 and step % 2 == 0:
            yield '/points', 'sensor_msgs/msg/PointCloud2', ns, cloud(store, ns, VELODYNE)


def odd_clouds(store):
    """Two of seven clouds name no frame, the first among them."""
    steps = 0
    for topic, kind, ns, message in messages(store):
        if topic == '/points':
            if steps in (0, 3):
                message.header.frame_id = ''
            steps += 1
        yield topic, kind, ns, message


def unseen(store):
    """All points of all clouds are NaN."""
    for topic, kind, ns, message in messages(store):
        if topic == '/points':
            message.data = np.full(len(message.data), 0xff, np.uint8)
        yield topic, kind, ns, message


def write1(path, compression):
    bag = Writer1(path)
    if compression:
        bag.set_compression(compression)
    with bag as writer:
        connections = {}
        for topic, kind, ns, message in messages(S1):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=S1)
            writer.write(connections[topic], ns, S1.serialize_ros1(message, kind))


def write2(path, plugin, mode=None):
    shutil.rmtree(path, ignore_errors=True)
    bag = Writer2(path, version=9, storage_plugin=plugin)
    if mode:
        bag.set_compression(mode, CompressionFormat.ZSTD)
    with bag as writer:
        connections = {}
        for topic, kind, ns, message in messages(S2):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=S2)
            writer.write(connections[topic], ns, S2.serialize_cdr(message, kind))


def write_mcap(path, source=messages, encoding='cdr', **options):
    with open(path, 'wb') as file:
        writer = McapWriter(file, **options)
        writer.start('ros2', 'make_bags')
        channels = {}
        for topic, kind, ns, message in source(S2):
            if topic not in channels:
                schema = writer.register_schema(kind, 'ros2msg', S2.generate_msgdef(kind, ros_version=2)[0].encode())
                channels[topic] = writer.register_channel(topic, encoding, schema)
            writer.add_message(channels[topic], ns, S2.serialize_cdr(message, kind), ns)
        writer.finish()


def without_poses(store, is_there, shift_s=0):
    """The clouds, and the odometry of some steps of 50 ms, shifted."""
    yield from (m for m in messages(store) if m[0] in ('/points', '/tf_static'))
    for step in range(-2, 40):
        if is_there(step):
            ns = START + step * 50_000_000 + shift_s * 10**9
            yield '/odom', 'nav_msgs/msg/Odometry', ns, odometry(store, ns)


def unstamped(store):
    """Clouds and transforms have no stamps but those of their recording."""
    for topic, kind, ns, message in messages(store):
        if topic in ('/points', '/tf'):
            for stamped in [message] if topic == '/points' else message.transforms:
                stamped.header.stamp = stamp(store, 0)
            yield topic, kind, ns, message
    yield from (m for m in messages(store) if m[0] == '/tf_static')


def of_ptp(store):
    """Clouds are stamped by a clock that is 37 s ahead."""
    for topic, kind, ns, message in messages(store):
        if topic == '/points':
            message.header.stamp = stamp(store, ns + 37 * 10**9)
        yield topic, kind, ns, message


def beside(store):
    """Another node's odometry, 3 m to the left."""
    for step in range(-2, 2 * NUM_CLOUDS + 2):
        ns = START + step * 50_000_000 + 4_000_000
        message = odometry(store, ns)
        message.pose.pose.position.y += 3
        yield '/odom', 'nav_msgs/msg/Odometry', ns, message


def layouts(store):
    for name, options in LAYOUTS.items():
        ns = START + 100_000_000
        yield '/' + name, 'sensor_msgs/msg/PointCloud2', ns, cloud(store, ns, **options)
    yield from (m for m in messages(store) if m[0] in ('/odom', '/tf_static'))


def main():
    for old in [*HERE.glob('*.bag'), *HERE.glob('*.mcap')]:
        if not old.name.startswith('drive'):  # make_drive_bags.py's
            old.unlink()
    write1(HERE / 'ros1.bag', None)
    write1(HERE / 'ros1_bz2.bag', Writer1.CompressionFormat.BZ2)
    write1(HERE / 'ros1_lz4.bag', Writer1.CompressionFormat.LZ4)
    write2(HERE / 'ros2', StoragePlugin.SQLITE3)
    write2(HERE / 'ros2_file_zstd', StoragePlugin.SQLITE3, CompressionMode.FILE)
    write2(HERE / 'ros2_message_zstd', StoragePlugin.SQLITE3, CompressionMode.MESSAGE)
    write2(HERE / 'ros2_mcap', StoragePlugin.MCAP)
    write2(HERE / 'ros2_mcap_message_zstd', StoragePlugin.MCAP, CompressionMode.MESSAGE)
    write_mcap(HERE / 'zstd.mcap', compression=CompressionType.ZSTD, chunk_size=2000)
    write_mcap(HERE / 'lz4.mcap', compression=CompressionType.LZ4, chunk_size=2000)
    write_mcap(HERE / 'plain.mcap', compression=CompressionType.NONE, chunk_size=2000)
    write_mcap(HERE / 'unindexed.mcap', compression=CompressionType.ZSTD, chunk_size=2000,
               index_types=IndexType.NONE, use_statistics=False, repeat_channels=False,
               repeat_schemas=False, use_summary_offsets=False)
    write_mcap(HERE / 'unchunked.mcap', use_chunking=False)
    write_mcap(HERE / 'unchunked_checksum.mcap', use_chunking=False, enable_data_crcs=True)
    write_mcap(HERE / 'gap.mcap', source=lambda store: without_poses(store, lambda step: step < 4 or step > 30))
    write_mcap(HERE / 'late.mcap', source=lambda store: without_poses(store, lambda step: True, 3600))
    write_mcap(HERE / 'unstamped.mcap', source=unstamped, compression=CompressionType.ZSTD)
    write_mcap(HERE / 'of_ptp.mcap', source=of_ptp, compression=CompressionType.ZSTD)
    write_mcap(HERE / 'beside.mcap', source=beside, compression=CompressionType.ZSTD)
    write_mcap(HERE / 'odd_clouds.mcap', source=odd_clouds, compression=CompressionType.ZSTD)
    write_mcap(HERE / 'all_nan.mcap', source=unseen, compression=CompressionType.ZSTD)
    write_mcap(HERE / 'called_json.mcap', source=layouts, encoding='json', compression=CompressionType.ZSTD)
    write_mcap(HERE / 'layouts.mcap', source=layouts, compression=CompressionType.ZSTD)


if __name__ == '__main__':
    main()
