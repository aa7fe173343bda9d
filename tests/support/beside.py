"""What servers beside a test need."""
import ctypes
import signal
import socket

PATIENCE_S = 60.0


def free_port():
    """Of this machine, for programs that cannot listen on port 0: free a moment ago."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


def end_with_parent():
    """This process lives no longer than the one that started it."""
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
