"""A Slurm of one node on loopback, with separate daemons, key, ports and folders, which it removes at its
end.

It needs no systemd and no rights beyond those of its user; as root the daemons run as root.
"""

import getpass
import os
import pathlib
import secrets
import shutil
import signal
import socket
import subprocess
import tempfile
import time

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "scontrol", "squeue", "scancel", "sinfo")
PATH = os.pathsep.join([os.environ.get("PATH", ""), "/usr/sbin", "/usr/local/sbin"])

# A requeued job waits until its old credential has expired.
CONFIGURATION = """
ClusterName=crt-test
SlurmctldHost={host}(127.0.0.1)
SlurmUser={user}
SlurmdUser={user}
SlurmctldPort={controller_port}
SlurmdPort={node_port}
AuthType=auth/munge
AuthInfo=cred_expire=5,socket={folder}/munge.socket
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/builtin
SchedulerParameters=batch_sched_delay=0,sched_interval=1,sched_min_interval=0
ReturnToService=2
KillWait=5
MinJobAge=300
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} State=UNKNOWN
PartitionName=main Nodes={host} Default=YES MaxTime=INFINITE State=UP OverSubscribe=FORCE:8
"""


def missing():
    """The programs that are not installed."""
    return [name for name in PROGRAMS if shutil.which(name, path=PATH) is None]


def cgroup_plugin():
    """One that needs no control groups: before 23.11 none can be switched off, but v1 is not used then."""
    version = subprocess.run([shutil.which("slurmd", path=PATH), "-V"], capture_output=True, text=True,
                             check=True).stdout.split()[1]
    return "disabled" if tuple(map(int, version.split(".")[:2])) >= (23, 11) else "cgroup/v1"


def free_ports(count):
    sockets = [socket.socket() for _ in range(count)]
    try:
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]
    finally:
        for one in sockets:
            one.close()


class Slurm:
    """A context manager: meanwhile `environment` leads sbatch and others to this Slurm."""

    def __enter__(self):
        # Munge wants a folder that others cannot write to, the whole way up, or one with the sticky bit.
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="crt-slurm-"))
        self.processes = []
        try:
            self.start()
        except BaseException:
            self.__exit__()
            raise
        return self

    def start(self):
        host = socket.gethostname().split(".")[0]
        controller_port, node_port = free_ports(2)
        for name in ("state", "spool"):
            (self.folder / name).mkdir()
        (self.folder / "slurm.conf").write_text(CONFIGURATION.format(
            host=host, user=getpass.getuser(), folder=self.folder, controller_port=controller_port,
            node_port=node_port, cpus=os.cpu_count()))
        (self.folder / "cgroup.conf").write_text(f"CgroupPlugin={cgroup_plugin()}\n")
        key = self.folder / "munge.key"
        key.write_bytes(secrets.token_bytes(1024))
        key.chmod(0o400)
        self.folder.chmod(0o711)
        self.environment = {**os.environ, "PATH": PATH, "SLURM_CONF": str(self.folder / "slurm.conf")}
        self.daemon("munged", "--foreground", "--force", f"--key-file={key}",
                    f"--socket={self.folder}/munge.socket", f"--pid-file={self.folder}/munged.pid",
                    f"--log-file={self.folder}/munged.log", f"--seed-file={self.folder}/munged.seed",
                    "--num-threads=2")
        self.wait(lambda: (self.folder / "munge.socket").exists(), 600, "munged's socket")
        self.daemon("slurmctld", "-D", "-i")
        self.daemon("slurmd", "-D", "-N", host)
        self.wait(lambda: "idle" in self.run("sinfo", "-h", "-o", "%t", check=False), 600, "an idle node")

    def daemon(self, name, *arguments):
        log = open(self.folder / f"{name}.out", "wb")
        with log:
            self.processes.append((name, subprocess.Popen(
                [shutil.which(name, path=PATH), *arguments], env=self.environment, stdin=subprocess.DEVNULL,
                stdout=log, stderr=subprocess.STDOUT, start_new_session=True, cwd=self.folder)))

    def run(self, *words, check=True):
        """The output of the program."""
        done = subprocess.run([str(word) for word in words], env=self.environment, capture_output=True,
                              text=True, timeout=900)
        assert not check or done.returncode == 0, f"{words}: {done.stderr}"
        return done.stdout

    def wait(self, is_so, seconds, what):
        until = time.monotonic() + seconds
        while not is_so():
            ended = [name for name, process in self.processes if process.poll() is not None]
            if ended or time.monotonic() > until:
                raise AssertionError(f"no {what} after {seconds} s; ended: {ended}\n{self.logs()}")
            time.sleep(0.05)

    def logs(self):
        files = [*self.folder.glob("*.log"), *self.folder.glob("*.out")]
        return "\n".join(f"--- {file.name}\n{file.read_text(errors='replace')[-3000:]}" for file in files)

    def states(self, jobs):
        """{job or array_task: state} of the jobs, those that have ended too."""
        lines = self.run("squeue", "-h", "-r", "-t", "all", "-j", jobs, "-o", "%i %T").splitlines()
        return dict(line.split() for line in lines)

    def __exit__(self, *_):
        if hasattr(self, "environment"):
            subprocess.run(["scancel", "--full", f"--user={getpass.getuser()}"], env=self.environment,
                           timeout=900, capture_output=True, check=False)
        for _, process in reversed(self.processes):  # munged last: the others end by its word.
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(300)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)
