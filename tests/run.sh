#!/usr/bin/env bash
# The one test command: installs what a bare Debian or Ubuntu machine with rustup's Rust lacks, then checks everything and stops at
# the first failure.
#
#   tests/run.sh
set -euo pipefail
cd "$(dirname "$0")/.."

heading() { printf '\n== %s (%d s)\n' "$*" "$SECONDS"; }
as_root() { if ((EUID == 0)); then "$@"; else sudo "$@"; fi; }

packages=()
needs() { command -v "$1" >/dev/null || packages+=("$2"); }

component() {
    cargo "$1" --version >/dev/null 2>&1 || timeout 180 rustup component add "$2"
}

heading "tools"
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
# One of the integrators that `host-sim accuracy` sets beside the twin.
has_scipy() { "$1" -c 'import scipy.integrate' 2>/dev/null; }
has_scipy python3 || has_scipy /usr/bin/python3 || packages+=(python3-scipy)
if ((${#packages[@]})); then
    echo "installing ${packages[*]}"
    as_root timeout 180 apt-get -qq update
    as_root env DEBIAN_FRONTEND=noninteractive timeout 600 \
        apt-get -qq install -y --no-install-recommends "${packages[@]}" >/dev/null
fi
component fmt rustfmt
component clippy clippy
rustc --version
qemu-system-arm --version | sed -n 1p

heading "format"
cargo fmt --all --check

heading "firmware builds for the microcontroller, and so does each no_std crate by itself"
elf=$(firmware/build.sh | tail -n 1)
echo "$elf"

heading "lints"
cargo clippy --workspace --all-targets -- -D warnings
target=thumbv7em-none-eabihf
if [[ -d $(rustc --print sysroot)/lib/rustlib/$target/lib ]]; then
    cargo clippy --package firmware --package firmware-checks --lib --bins --target "$target" -- -D warnings
    cargo clippy --package firmware --lib --bin board --features stm32g474 --target "$target" -- -D warnings
    cargo build --package firmware --bin board --features stm32g474 --profile firmware --target "$target"
else
    echo "firmware not linted as built for $target: only Debian's toolchain has the target here"
fi

heading "documentation"
RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --document-private-items

# On the host and, through tests/qemu, on the emulated microcontroller.
heading "tests"
cargo test --workspace

# Optional, so that a build from nothing stays short.
heading "integrators of other crates"
cargo clippy --package host-sim --features peers --all-targets -- -D warnings
cargo test --package host-sim --features peers --lib accuracy
