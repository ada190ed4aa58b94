"""A HyperQueue cluster of one worker on this machine, while a command runs that submits jobs to it by `hq`.

    python3 tests/cluster/hyperqueue_cluster.py FOLDER COMMAND ARGUMENT...

starts server and worker, runs the command, waits for what it has submitted, and ends with 1 if a task has failed.
HyperQueue's Python package has server and worker but no `hq`. What stands in its place on the command's PATH is this
file again: it reads the flags of `hq submit` that `host-sim sweep --hyperqueue` uses, and submits by the package.
"""

import argparse
import os
import pathlib
import subprocess
import sys

from hyperqueue import Client, Job, LocalCluster
from hyperqueue.cluster import WorkerConfig
from hyperqueue.ffi.protocol import ResourceRequest


def submit(server, words):
    """`hq submit` of an array, whose tasks find their number in HQ_TASK_ID."""
    parser = argparse.ArgumentParser(prog="hq submit", allow_abbrev=False)
    for flag in ["--name", "--array", "--cpus", "--stdout", "--stderr"]:
        parser.add_argument(flag, required=True)
    parser.add_argument("command", nargs="+")
    flags = parser.parse_args(words)
    assert flags.stdout == "none"
    first, last = map(int, flags.array.split("-"))
    # Without a bound on the tasks that may fail, as `hq` has it.
    job = Job(name=flags.name, max_fails=None)
    # The package numbers tasks from 0, an array of `hq` from its first number: what is before that does nothing.
    for _ in range(first):
        job.program(["true"])
    for task in range(first, last + 1):
        job.program(
            flags.command,
            cwd=os.getcwd(),
            stdout=None,
            stderr=flags.stderr.replace("%{TASK_ID}", str(task)),
            resources=ResourceRequest(cpus=int(flags.cpus)),
        )
    number = Client(server).submit(job).id
    with open(pathlib.Path(server).parent / "jobs", "a", encoding="utf-8") as file:
        print(number, file=file)
    print(f"Job submitted successfully, job ID: {number}")


def run(folder, command):
    """Runs the command beside the cluster; whether no task has failed."""
    folder = pathlib.Path(folder).resolve()
    programs = folder / "bin"
    programs.mkdir(parents=True)
    with LocalCluster(str(folder / "server"), WorkerConfig(cores=2)) as cluster:
        hq = programs / "hq"
        shim = [sys.executable, str(pathlib.Path(__file__).resolve()), "--hq", cluster.cluster.server_dir]
        hq.write_text("#!/bin/sh\nexec " + " ".join(f"'{word}'" for word in shim) + ' "$@"\n', encoding="utf-8")
        hq.chmod(0o755)
        path = f"{programs}{os.pathsep}{os.environ['PATH']}"
        subprocess.run(command, check=True, env=dict(os.environ, PATH=path))
        jobs = [int(number) for number in (folder / "jobs").read_text(encoding="utf-8").split()]
        failed = cluster.client().connection.wait_for_jobs(jobs, lambda _: None)
        return not failed


if sys.argv[1] == "--hq":
    assert sys.argv[3] == "submit"
    submit(sys.argv[2], sys.argv[4:])
else:
    sys.exit(0 if run(sys.argv[1], sys.argv[2:]) else 1)
