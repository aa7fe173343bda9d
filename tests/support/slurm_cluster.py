"""A Slurm cluster of this machine alone, in a folder, on free ports; Debian's slurmctld and slurmd.

Prints the file for $SLURM_CONF when jobs can be submitted.
"""
import getpass
import os
import signal
import socket
import subprocess
import sys
import time

from beside import PATIENCE_S, end_with_parent, free_port

FOLDER = sys.argv[1]
HOST = socket.gethostname().split(".")[0]


def write(name, text):
    path = os.path.join(FOLDER, name)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
    return path


def main():
    for name in ("state", "spool"):
        os.mkdir(os.path.join(FOLDER, name))
    write("cgroup.conf", "CgroupPlugin=cgroup/v1\n")  # looked for, but not used
    conf = write("slurm.conf", f"""
ClusterName=test
SlurmctldHost={HOST}(127.0.0.1)
SlurmctldPort={free_port()}
SlurmdPort={free_port()}
SlurmUser={getpass.getuser()}
SlurmdUser={getpass.getuser()}
AuthType=auth/none
CredType=cred/none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=1,bf_interval=1
ReturnToService=2
StateSaveLocation={FOLDER}/state
SlurmdSpoolDir={FOLDER}/spool
SlurmctldPidFile={FOLDER}/slurmctld.pid
SlurmdPidFile={FOLDER}/slurmd.pid
NodeName={HOST} NodeAddr=127.0.0.1 CPUs={os.cpu_count()} State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES State=UP
""")
    for program in ("slurmctld", "slurmd"):
        subprocess.Popen([f"/usr/sbin/{program}", "-D", "-f", conf], preexec_fn=end_with_parent,
                         stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    end = time.monotonic() + PATIENCE_S
    while subprocess.run(["sinfo", "--noheader", "--states=idle", "--format=%D"],
                         env={**os.environ, "SLURM_CONF": conf}, capture_output=True,
                         check=False).stdout != b"1\n":
        if time.monotonic() > end:
            sys.exit("no node answers")
        time.sleep(0.1)
    print(conf, flush=True)
    signal.pause()


main()
