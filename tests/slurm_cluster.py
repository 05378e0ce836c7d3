"""A Slurm of one's own on this host, for tests: slurmctld, some slurmd, and a munged, with all their files in one
folder, reached by the loopback interface alone. Needs Debian's slurmctld, slurmd, slurm-client and munge; works as root
and as any user."""
import getpass
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import time

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "squeue", "scancel", "scontrol")
PATH = os.environ.get("PATH", "") + ":/usr/sbin:/sbin"
# Quick, not polite: Slurm's defaults wait seconds between two looks at the queue.
CONFIG = """
ClusterName=catoptric
SlurmctldHost={host}(127.0.0.1)
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
CryptoType=crypto/munge
AuthInfo=socket={folder}/munge.socket
CommunicationParameters=NoInAddrAny
SlurmctldPort={controller}
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/%n.pid
SlurmdSpoolDir={folder}/spool/%n
StateSaveLocation={folder}/state
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/%n.log
SlurmdTimeout=5
SlurmctldTimeout=5
InactiveLimit=0
KillWait=5
MessageTimeout=10
MaxArraySize={array}
MaxJobCount=100000
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=0,sched_min_interval=1000,sched_interval=1,bf_interval=1,{scheduler}
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
JobAcctGatherType=jobacct_gather/none
{nodes}
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def missing():
    """Names of programs that are not installed."""
    return [name for name in PROGRAMS if shutil.which(name, path=PATH) is None]


def free_ports(count):
    sockets = [socket.socket() for _ in range(count)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


class Cluster:
    """Nodes n1, n2, ... with `slots` processors each."""

    def __init__(self, folder, nodes=2, slots=1, array=1001, scheduler="default_queue_depth=1000"):
        self.folder = pathlib.Path(folder)
        self.slots = slots
        self.names = [f"n{i + 1}" for i in range(nodes)]
        self.processes = {}
        for name in ("state", "spool"):
            (self.folder / name).mkdir(parents=True)
        os.chmod(self.folder, 0o755)
        ports = free_ports(nodes + 1)
        host = socket.gethostname().split(".")[0]
        lines = [f"NodeName={name} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} CPUs={slots} State=UNKNOWN"
                 for name, port in zip(self.names, ports[1:])]
        self.config = self.folder / "slurm.conf"
        self.config.write_text(CONFIG.format(
            host=host, user=getpass.getuser(), folder=self.folder, controller=ports[0], array=array,
            scheduler=scheduler, nodes="\n".join(lines)))
        key = self.folder / "munge.key"
        key.write_bytes(os.urandom(64))
        key.chmod(0o400)
        self.environment = {**os.environ, "PATH": PATH, "SLURM_CONF": str(self.config)}

    def __enter__(self):
        self.start("munged", ["munged", "--foreground", "--force", f"--socket={self.folder}/munge.socket",
                              f"--key-file={self.folder}/munge.key", f"--pid-file={self.folder}/munged.pid",
                              f"--seed-file={self.folder}/munge.seed", f"--log-file={self.folder}/munged.log"])
        self.wait_for(lambda: (self.folder / "munge.socket").exists(), "munged")
        self.start("slurmctld", ["slurmctld", "-D", "-c", "-f", str(self.config)])
        for name in self.names:
            self.start_node(name)
        self.wait_for(lambda: self.idle() == len(self.names), "the nodes")
        return self

    def __exit__(self, *_):
        if "slurmctld" in self.processes:
            self.run("scancel", "--me", check=False)
        for name in reversed(list(self.processes)):
            self.kill(name, signal.SIGKILL)

    def start(self, name, words):
        with open(self.folder / f"{name}.out", "ab") as log:
            # A session of its own: all of it can be ended at once
            self.processes[name] = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                                                    env=self.environment, start_new_session=True)

    def start_node(self, name):
        (self.folder / "spool" / name).mkdir(exist_ok=True)
        self.start(name, ["slurmd", "-D", "-N", name, "-f", str(self.config)])

    def kill(self, name, how=signal.SIGKILL):
        process = self.processes.pop(name)
        process.send_signal(how)
        process.wait()

    def tasks_of(self, name):
        """Processes of the tasks on a node, with those of Slurm that watch them: they say the node's name."""
        found = []
        for place in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                words = (place / "environ").read_bytes().split(b"\0")
                command = (place / "cmdline").read_bytes()
            except OSError:
                continue
            ours = f"SLURM_CONF={self.config}".encode() in words
            if ours and (f"SLURMD_NODENAME={name}".encode() in words or
                         command.startswith(b"slurmstepd") and self.step_of(name, place)):
                found.append(int(place.name))
        return found

    def step_of(self, name, place):
        """A slurmstepd holds its socket or its log below the node's spool folder."""
        try:
            held = [os.readlink(link) for link in (place / "fd").iterdir()]
        except OSError:
            return False
        return any(f"/{name}.log" in link or f"/spool/{name}" in link for link in held)

    def lose_busy_node(self):
        """A node that renders is gone at once, with all that runs on it, as when its power fails; its name."""
        found = []

        def stopped():
            for name in reversed(self.names):
                numbers = self.tasks_of(name)
                self.signal(numbers, signal.SIGSTOP)
                if any(self.renders(number) for number in numbers):  # it has not told Slurm that it ended
                    found.extend([name, numbers])
                    return True
                self.signal(numbers, signal.SIGCONT)
            return False

        self.wait_for(stopped, "a task on a node", 60)
        self.kill(found[0])
        self.signal(found[1], signal.SIGKILL)
        return found[0]

    @staticmethod
    def signal(numbers, which):
        for number in numbers:
            try:
                os.kill(number, which)
            except ProcessLookupError:
                pass

    @staticmethod
    def renders(number):
        """Whether a process is there, has not ended, and is not Slurm's own."""
        try:
            place = pathlib.Path("/proc", str(number))
            state = (place / "stat").read_text().rpartition(")")[2].split()[0]
            return state != "Z" and not (place / "cmdline").read_bytes().startswith(b"slurmstepd")
        except OSError:
            return False

    def requeued(self):
        """Tasks that wait after their node was lost: Slurm lets each wait two minutes before it may start again."""
        lines = self.run("squeue", "--me", "--noheader", "--array", "--format=%i|%r", check=False).splitlines()
        return [line.split("|")[0] for line in lines if line.endswith("|BeginTime")]

    def start_requeued(self):
        """Waits until tasks of a lost node are in the queue again, and lets them start at once; how many."""
        self.wait_for(self.requeued, "tasks of the lost node")
        tasks = self.requeued()
        for task in tasks:
            self.run("scontrol", "update", f"JobId={task}", "StartTime=now", check=False)
        return len(tasks)

    def run(self, *words, check=True):
        return subprocess.run(words, env=self.environment, check=check, text=True, capture_output=True).stdout

    def idle(self):
        return self.run("sinfo", "--noheader", "--Node", "--format=%T", check=False).split().count("idle")

    def wait_for(self, condition, what, seconds=30):
        end = time.monotonic() + seconds
        while not condition():
            if time.monotonic() > end:
                raise RuntimeError(f"{what}: not there after {seconds} s; see the logs in {self.folder}")
            time.sleep(0.05)
