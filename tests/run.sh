#!/usr/bin/env bash
# The one test command: installs what a bare Debian or Ubuntu machine with rustup's Rust lacks, then checks everything
# and stops at the first failure.
#
#   tests/run.sh          everything
#   tests/run.sh quick    format, lints, unit tests and one closed loop
#
# Property tests draw the same cases on every machine (.cargo/config.toml); tests/soak.sh draws fresh ones.
set -euo pipefail
cd "$(dirname "$0")/.."

lane=${1:-everything}
case $lane in
everything | quick) ;;
*)
    echo "tests/run.sh: $lane: expected quick, or nothing for everything" >&2
    exit 2
    ;;
esac

# What the background prints, and the tests' own lines, from which the summary is made.
logs=$(mktemp -d)
firmware_id=
core_id=
finish() {
    for id in $firmware_id $core_id; do kill "$id" 2>/dev/null || true; done
    rm -r "$logs"
}
trap finish EXIT

# Waits for a job of the background, prints what it said, and ends with it where it failed.
end_job() {
    local status=0
    wait "$1" || status=$?
    cat "$2"
    ((status == 0)) || exit "$status"
}

heading() { printf '\n== %s (%d s)\n' "$*" "$SECONDS"; }
as_root() { if ((EUID == 0)); then "$@"; else sudo "$@"; fi; }

packages=()
needs() { command -v "$1" >/dev/null || packages+=("$2"); }

component() {
    cargo "$1" --version >/dev/null 2>&1 || timeout 180 rustup component add "$2"
}

find_tools() {
    if ! command -v cargo >/dev/null && [[ -r $HOME/.cargo/env ]]; then
        # shellcheck source=/dev/null
        . "$HOME/.cargo/env"
    fi
    if ! command -v cargo >/dev/null; then
        echo "tests/run.sh: no cargo; install Rust from https://rustup.rs" >&2
        exit 1
    fi
    needs cc build-essential
    needs qemu-system-arm qemu-system-arm
    # The solver of the stator's finite elements.
    needs ccx calculix-ccx
    # It makes the page's module small and quick.
    needs wasm-opt binaryen
    # The browser that opens the reports, and letters for it.
    needs chromium chromium
    [[ -e /usr/share/fonts/truetype/dejavu/DejaVuSans.ttf ]] || packages+=(fonts-dejavu-core)
    # One of the integrators that `host-sim accuracy` sets beside the twin.
    has_scipy() { "$1" -c 'import scipy.integrate' 2>/dev/null; }
    has_scipy python3 || has_scipy /usr/bin/python3 || packages+=(python3-scipy)
    # The cluster of one node of tests/cluster.
    PATH=$PATH:/usr/sbin needs munged munge
    PATH=$PATH:/usr/sbin needs slurmctld slurmctld
    PATH=$PATH:/usr/sbin needs slurmd slurmd
    needs sbatch slurm-client
    # The readers of tests/logs, in an environment of their own.
    python3 -c 'import ensurepip, venv' 2>/dev/null || packages+=(python3-venv)
    component fmt rustfmt
    component clippy clippy
    rustc --version
}

install_packages() {
    if ((${#packages[@]})); then
        echo "installing ${packages[*]}"
        as_root timeout 180 apt-get -qq update
        as_root env DEBIAN_FRONTEND=noninteractive timeout 600 \
            apt-get -qq install -y --no-install-recommends "${packages[@]}" >/dev/null
        packages=()
    fi
}

# All that is for the microcontroller: its own profile has folders of its own, so that it is built while the host's code
# is linted.
check_firmware() {
    local target=thumbv7em-none-eabihf
    firmware/build.sh
    if [[ -d $(rustc --print sysroot)/lib/rustlib/$target/lib ]]; then
        lint() { cargo clippy --profile firmware --target "$target" "$@" -- -D warnings; }
        lint --package firmware --package firmware-checks --lib --bins
        # As firmware/BRINGUP.md builds them, and one with the filters that it leaves out.
        local h743=(--no-default-features --features stm32h743,commissioning,impact_aided,keep,slow_cameras)
        lint --package firmware --lib --bin board --features stm32g474,every_filter
        # As the tests on the emulated board build it.
        lint --package firmware --lib --bin board --features scripted
        lint --package firmware --lib --bin board "${h743[@]}"
        # The filter core with its optional parts, and without those that are on by default.
        lint --package ud-filter --lib --no-default-features --features defmt,serde
        firmware/build.sh board stm32g474
        firmware/build.sh board stm32h743
    else
        echo "firmware not linted as built for $target: only Debian's toolchain has the target here"
    fi
}

# The fuzz targets are linted here and run by tests/soak.sh: they have a main function of their own, which does not end.
#
# Everything of the host is built once, in one profile. The tests run by `cargo test`, which shares a run between the
# tests of a binary; cargo-nextest would repeat it for each of them.

# The test harness tells how long each test takes only if it may use options that are not stable yet.
#
# The Python module is built with the system tests, which load it. A test program of its own would need Python's
# library. The benches have no tests: they are linted.
tested=(--workspace --exclude fuzz --exclude micromotor-python --exclude benches)

# The first argument names the log: two of these may run at a time.
timed_tests() {
    local log=$logs/tests.$1
    shift
    cargo test "${tested[@]}" \
        --config 'target."cfg(not(target_os = \"none\"))".runner = ["env", "RUSTC_BOOTSTRAP=1"]' \
        "$@" -Z unstable-options --report-time 2>&1 | tee "$log"
}

summary() {
    echo
    echo "== the ten slowest tests"
    # awk reads all that sort writes: a reader that ends early would break the pipe, and pipefail the run.
    sed -n 's/^test \([^ ]*\) .*ok <\([0-9.]*\)s>$/\2 \1/p' "$logs"/tests.* | sort -rn |
        awk 'NR <= 10 { printf "%8.1f s  %s\n", $1, $2 }'
    awk '/^test result: ok/ { passed += $4; failed += $6 } END { print passed " passed, " failed " failed" }' \
        "$logs"/tests.*
    printf '%s: %d min %d s in all\n' "$lane" $((SECONDS / 60)) $((SECONDS % 60))
}

heading "tools"
find_tools
# Rust needs a linker from the start. All else is installed while the host's code is linted.
command -v cc >/dev/null || install_packages

heading "format"
cargo fmt --all --check

if [[ $lane == quick ]]; then
    heading "lints"
    cargo clippy --workspace --all-targets -- -D warnings
    heading "unit tests"
    install_packages
    timed_tests unit --lib --
    heading "one closed loop"
    timed_tests system --test system -- closed_loop::tool_position::
    summary
    exit
fi

target=$(realpath "${CARGO_TARGET_DIR:-target}")
mkdir -p "$target/tmp"

# The readers of the logs are downloaded while the code is built; a test that does not find them does it itself. The
# page's module has a profile, and so folders, of its own as well.
(
    install_packages
    qemu-system-arm --version | sed -n 1p
    environment=$target/tmp/python
    tests/logs/environment.sh "$environment" >"$logs/environment" 2>&1 &
    environment_id=$!
    check_firmware
    web/build.sh
    wait "$environment_id" || cat "$logs/environment"
) >"$logs/firmware" 2>&1 &
firmware_id=$!

# The command's optional parts are linted and tested by tests/soak.sh: they take as long to build as all the rest.
heading "lints"
cargo clippy --workspace --all-targets -- -D warnings

# With an example among what it documents, cargo takes the same features as the lints, and so what they have checked of
# other people's crates. Nobody reads documentation of the fuzz targets.
heading "documentation"
RUSTDOCFLAGS="-D warnings" cargo doc --workspace --exclude fuzz --no-deps --document-private-items \
    --lib --bins --example turn

heading "tests are built"
cargo test "${tested[@]}" --lib --tests --no-run

heading "firmware builds for the microcontroller, and so does each no_std crate by itself; the page builds"
end_job "$firmware_id" "$logs/firmware"
firmware_id=

# The filter core without its default features shares no crate with the rest: it is built in a folder of its own, while
# a solver of one thread is tested.
heading "unit tests"
cargo test --target-dir "$target/core" --package ud-filter --lib --no-default-features --features defmt,serde \
    >"$logs/core" 2>&1 &
core_id=$!
timed_tests unit --lib --test instruments --
cargo test "${tested[@]}" --doc
end_job "$core_id" "$logs/core"
core_id=

# The emulated microcontroller and the host wait for each other in every tick, and a board at a serial line keeps its
# time: nothing else runs beside them.
heading "on the emulated microcontroller"
timed_tests qemu --test qemu --
heading "boards at serial lines"
timed_tests serial --test serial --

heading "system tests"
timed_tests system --test system --

summary
