#!/usr/bin/env bash
# A temporary Slurm cluster of two nodes on loopback, without systemd, cgroups or accounting; needs root.
#   cluster.sh up FOLDER      keeps all state in FOLDER; prints the variables that a client must export
#   cluster.sh down FOLDER    stops the daemons that were started there, by their PID
# Needs the packages slurm-wlm and munge; exits with 77 and a message if it cannot run.
set -euo pipefail
verb=$1 at=$2
port=${SLURM_TEST_PORT:-16900}

cannot_run() { echo "$*" >&2; exit 77; }

up() {
  [ "$(id -u)" = 0 ] || cannot_run "a local Slurm cluster needs root"
  for program in munged slurmctld slurmd sbatch squeue; do
    command -v "$program" >/dev/null || cannot_run "$program is not installed (Debian: slurm-wlm and munge)"
  done
  local host memory
  host=$(hostname -s)
  getent hosts "$host" >/dev/null || cannot_run "the host's name $host is not resolvable"
  memory=$(($(awk '/MemTotal/ { print $2 }' /proc/meminfo) / 1024 * 9 / 20))
  # munged requires private folders below folders that others cannot write.
  mkdir -p "$at"/{munge,state,log,spool.n0,spool.n1}
  chmod 755 "$at" "$at/munge"
  dd if=/dev/urandom of="$at/munge/key" bs=1024 count=1 status=none
  chmod 400 "$at/munge/key"
  cat >"$at/slurm.conf" <<CONF
ClusterName=zsim
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$at/munge/socket
CredType=cred/munge
MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=0,sched_interval=1,bf_interval=1,sched_min_interval=0
ReturnToService=2
SlurmctldPort=$port
SlurmctldPidFile=$at/slurmctld.pid
SlurmctldLogFile=$at/log/slurmctld.log
StateSaveLocation=$at/state
SlurmdSpoolDir=$at/spool.%n
SlurmdPidFile=$at/slurmd.%n.pid
SlurmdLogFile=$at/log/slurmd.%n.log
KillWait=5
NodeName=n0 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 1)) CPUs=1 RealMemory=$memory State=UNKNOWN
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 2)) CPUs=1 RealMemory=$memory State=UNKNOWN
PartitionName=main Nodes=n[0-1] Default=YES MaxTime=INFINITE State=UP
CONF
  printf 'ConstrainCores=no\nConstrainRAMSpace=no\n' >"$at/cgroup.conf"
  export SLURM_CONF=$at/slurm.conf
  munged --force --key-file="$at/munge/key" --socket="$at/munge/socket" --pid-file="$at/munge/munged.pid" \
    --log-file="$at/munge/log" --seed-file="$at/munge/seed" >&2
  for _ in $(seq 100); do munge -S "$at/munge/socket" -n >/dev/null 2>&1 && break; sleep 0.1; done
  slurmctld -c >&2
  slurmd -N n0 >&2
  slurmd -N n1 >&2
  for _ in $(seq 600); do
    if [ "$(sinfo -h -N -t idle -o %N 2>/dev/null | sort -u | wc -l)" = 2 ]; then
      echo "SLURM_CONF=$SLURM_CONF"
      return
    fi
    sleep 0.1
  done
  tail -n 20 "$at"/log/*.log >&2
  echo "the nodes did not start" >&2
  exit 1
}

down() {
  local file pid
  for file in "$at"/slurmd.*.pid "$at/slurmctld.pid" "$at/munge/munged.pid"; do
    [ -s "$file" ] || continue
    pid=$(cat "$file")
    case "$(cat "/proc/$pid/comm" 2>/dev/null || true)" in
      slurmd | slurmctld | munged) kill "$pid" 2>/dev/null || true ;;
      *) continue ;;
    esac
    for _ in $(seq 100); do kill -0 "$pid" 2>/dev/null || break; sleep 0.1; done
    kill -9 "$pid" 2>/dev/null || true
  done
}

"$verb"
