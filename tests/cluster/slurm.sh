#!/usr/bin/env bash
# A Slurm cluster of one node, this one, in a folder of its own: on ports of its own, with a key of its own, run by the
# user who starts it. Debian's packages slurmctld, slurmd, slurm-client and munge have the programs.
#
#   tests/cluster/slurm.sh start FOLDER    SLURM_CONF=FOLDER/slurm.conf then leads to it
#   tests/cluster/slurm.sh stop FOLDER
set -euo pipefail
action=$1
mkdir -p "$2"
folder=$(cd "$2" && pwd)
PATH=$PATH:/usr/sbin

free_port() {
    python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'
}

write_configuration() {
    local host
    host=$(hostname -s)
    cat >"$folder/slurm.conf" <<END
ClusterName=one
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$(free_port)
SlurmdPort=$(free_port)
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
CredType=cred/munge
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=sched_interval=1,batch_sched_delay=0
KillWait=1
ReturnToService=2
SwitchType=switch/none
MpiDefault=none
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 RealMemory=500 State=UNKNOWN
PartitionName=main Nodes=$host Default=YES MaxTime=INFINITE State=UP
END
}

start() {
    mkdir -p "$folder/state" "$folder/spool"
    head -c 1024 /dev/urandom >"$folder/munge.key"
    chmod 600 "$folder/munge.key"
    write_configuration
    munged --force --socket="$folder/munge.socket" --key-file="$folder/munge.key" --pid-file="$folder/munged.pid" \
        --log-file="$folder/munged.log" --seed-file="$folder/munge.seed"
    export SLURM_CONF=$folder/slurm.conf
    slurmctld
    slurmd
    for _ in {1..100}; do
        [[ $(sinfo --noheader --format=%T 2>/dev/null) == idle* ]] && return
        sleep 0.1
    done
    echo "slurm.sh: the node does not become idle" >&2
    cat "$folder"/*.log >&2
    exit 1
}

stop() {
    local name id
    for name in slurmd slurmctld munged; do
        [[ -r $folder/$name.pid ]] || continue
        id=$(<"$folder/$name.pid")
        kill "$id" 2>/dev/null || true
        for _ in {1..50}; do
            kill -0 "$id" 2>/dev/null || break
            sleep 0.1
        done
        kill -KILL "$id" 2>/dev/null || true
    done
}

case $action in
start) start ;;
stop) stop ;;
*)
    echo "slurm.sh: $action: expected start or stop" >&2
    exit 2
    ;;
esac
