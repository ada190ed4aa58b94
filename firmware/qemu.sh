#!/usr/bin/env bash
# Runs an ELF on an emulated Cortex-M4F; its exit code is the program's.
#
#   firmware/qemu.sh ELF
#
# With -icount a run is deterministic. With shift=10 an instruction takes 1024 ns of virtual time, as the program
# `instructions` assumes.
set -euo pipefail

if ! command -v qemu-system-arm >/dev/null; then
    echo "firmware/qemu.sh: qemu-system-arm is not installed; tests/run.sh installs it" >&2
    exit 127
fi
exec qemu-system-arm -M mps2-an386 -display none -monitor none -icount shift=10 \
    -semihosting-config enable=on,target=native -kernel "$1"
