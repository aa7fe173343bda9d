"""OpenStack Swift with its S3 interface, of one device in a folder, on free ports of this machine.

Prints the port when the bucket `maps` is there. The bucket's owner has the key `test:robot` with
the secret `secret`. Needs Debian's python3-swift.
"""
import multiprocessing
import os
import signal
import socket
import sys
import time

from beside import PATIENCE_S, end_with_parent, free_port
from swift.common.internal_client import InternalClient
from swift.common.ring import RingBuilder
from swift.common.utils import set_swift_dir
from swift.common.wsgi import run_wsgi

FOLDER = sys.argv[1]
STORES = ("account", "container", "object")

PIPELINES = {name: f"""
[pipeline:main]
pipeline = {name}-server
[app:{name}-server]
use = egg:swift#{name}
""" for name in STORES}
PROXY = """
[pipeline:main]
pipeline = catch_errors cache {filters} proxy-server
[app:proxy-server]
use = egg:swift#proxy
account_autocreate = true
[filter:catch_errors]
use = egg:swift#catch_errors
[filter:cache]
use = egg:swift#memcache
memcache_servers = 127.0.0.1:1
[filter:s3api]
use = egg:swift#s3api
[filter:tempauth]
use = egg:swift#tempauth
user_test_robot = secret .admin
"""
PIPELINES["proxy"] = PROXY.format(filters="s3api tempauth")
PIPELINES["internal"] = PROXY.format(filters="")


def configure(name, port):
    path = os.path.join(FOLDER, name + "-server.conf")
    with open(path, "w", encoding="utf-8") as file:
        file.write(f"[DEFAULT]\nbind_ip = 127.0.0.1\nbind_port = {port}\nswift_dir = {FOLDER}\n"
                   f"devices = {FOLDER}\nmount_check = false\nworkers = 0\n{PIPELINES[name]}")
    return path


def make_ring(name, port):
    builder = RingBuilder(1, 1, 1)
    builder.add_dev({"region": 1, "zone": 1, "ip": "127.0.0.1", "port": port, "device": "disk",
                     "weight": 1})
    builder.rebalance()
    builder.get_ring().save(os.path.join(FOLDER, name + ".ring.gz"))


def wait_for(port):
    end = time.monotonic() + PATIENCE_S
    while True:
        try:
            socket.create_connection(("127.0.0.1", port)).close()
            return
        except ConnectionRefusedError:
            if time.monotonic() > end:
                raise
            time.sleep(0.1)


def serve(configuration, name):
    end_with_parent()
    run_wsgi(configuration, name + "-server")


def main():
    os.makedirs(os.path.join(FOLDER, "disk"))
    with open(os.path.join(FOLDER, "swift.conf"), "w", encoding="utf-8") as file:
        file.write("[swift-hash]\nswift_hash_path_suffix = test\n")
    set_swift_dir(FOLDER)  # some versions read swift.conf before they look at swift_dir
    ports = {name: free_port() for name in (*STORES, "proxy")}
    for name, port in ports.items():
        if name in STORES:
            make_ring(name, port)
        multiprocessing.Process(target=serve, args=(configure(name, port), name)).start()
    for port in ports.values():
        wait_for(port)
    InternalClient(configure("internal", 0), "test", 1).create_container("AUTH_test", "maps")
    print(ports["proxy"], flush=True)
    signal.pause()


main()
