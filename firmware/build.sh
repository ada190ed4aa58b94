#!/usr/bin/env bash
# Builds programs for the microcontroller; the last line on standard output is the path of an ELF.
#
#   firmware/build.sh [PROGRAM [FILTER | PART | scripted]]
#
# PROGRAM is a file of firmware/src/bin or firmware-checks/src/bin, without its ending; the path is that of its ELF.
# Without PROGRAM the script builds everything except `peers`, and the path is that of `parity`. With a FILTER,
# constant_rate or impact_aided, a program of firmware has that filter alone, keeps no description, and fits a smaller
# part. For a PART, stm32g474 or stm32h743, it is built as BRINGUP.md says. A program of firmware that is scripted takes
# what it is sent and shown from memory, for the emulator.
#
# The script looks for a Rust that can build for the target, in this order, each attempt of bounded time:
#
#   installed  the rustup toolchain has the target
#   rustup     rustup adds it
#   debian     Debian's rustc-web, cargo-web and rust-web-src, which build `core` from source
#
# FIRMWARE_TOOLCHAIN set to one of these allows that one only.
set -euo pipefail
cd "$(dirname "$0")/.."

target=thumbv7em-none-eabihf
profile=firmware
program=${1:-}
filter=${2:-}
wanted=${FIRMWARE_TOOLCHAIN:-any}
target_dir=$(cargo metadata --no-deps --format-version 1 | sed -n 's/.*"target_directory":"\([^"]*\)".*/\1/p')

# The features of the parts, as in BRINGUP.md.
declare -A parts=(
    [stm32g474]=stm32g474,commissioning,keep
    [stm32h743]=stm32h743,commissioning,impact_aided,keep,slow_cameras
)

log() { echo "firmware/build.sh: $*" >&2; }
allowed() { [[ $wanted == any || $wanted == "$1" ]]; }
as_root() { if ((EUID == 0)); then "$@"; else sudo "$@"; fi; }

target_installed() {
    [[ -d $(rustc --print sysroot)/lib/rustlib/$target/lib ]]
}

add_target() {
    command -v rustup >/dev/null && timeout 180 rustup target add "$target" >&2
}

debian_installed() {
    [[ -x /usr/bin/cargo && -x /usr/bin/rustc && -d /usr/lib/rustlib/src/rust/library/core ]]
}

add_debian() {
    debian_installed && return
    command -v apt-get >/dev/null || return 1
    as_root timeout 120 apt-get -qq update >&2 || return 1
    as_root env DEBIAN_FRONTEND=noninteractive timeout 300 \
        apt-get -qq install -y --no-install-recommends rustc-web cargo-web rust-web-src >&2 || return 1
    debian_installed
}

# Builds by the command given as arguments, and sets `elf`.
build_all() {
    local build=(timeout 900 "$@" build --profile "$profile" --target "$target")
    if [[ -z $program ]]; then
        # Each library by itself first: none may need another's features to do without std.
        local each
        for each in micromotor-{model,estimator,controller,link} firmware firmware-checks; do
            "${build[@]}" -p "$each" >&2
        done
        elf=$target_dir/$target/$profile/parity
    elif [[ -z $filter ]]; then
        local features=()
        [[ $program != peers ]] || features=(--features peers)
        "${build[@]}" -p "$package" --bin "$program" "${features[@]}" >&2
        elf=$target_dir/$target/$profile/$program
    elif [[ $filter == scripted ]]; then
        # In a folder of its own, as below.
        "${build[@]}" -p "$package" --bin "$program" --features scripted \
            --config "build.build-dir='$target_dir'" --target-dir "$target_dir/scripted" >&2
        elf=$target_dir/scripted/$target/$profile/$program
    elif [[ -n ${parts[$filter]-} ]]; then
        # In a folder of its own, as above.
        "${build[@]}" -p "$package" --bin "$program" --no-default-features --features "${parts[$filter]}" \
            --config "build.build-dir='$target_dir'" --target-dir "$target_dir/$filter" >&2
        elf=$target_dir/$filter/$target/$profile/$program
    else
        local features=()
        [[ $filter == constant_rate ]] || features=(--features "$filter")
        # In a folder of its own, because the program with all filters has the same name; other people's crates are
        # shared with it. For a small part: libm serves only the construction of filters here, the motor model mostly
        # its parameters, and the controller only the next command, so they are small, not fast.
        "${build[@]}" -p "$package" --bin "$program" --no-default-features "${features[@]}" \
            --config "profile.$profile.package.libm.opt-level='s'" \
            --config "profile.$profile.package.micromotor-controller.opt-level='s'" \
            --config "profile.$profile.package.micromotor-model.opt-level='s'" \
            --config "build.build-dir='$target_dir'" --target-dir "$target_dir/one-filter" >&2
        elf=$target_dir/one-filter/$target/$profile/$program-$filter
        cp "$target_dir/one-filter/$target/$profile/$program" "$elf"
    fi
}

build_with_rustup() {
    build_all cargo
}

build_with_debian() {
    # Debian brings no linker for the target: this one is the rustup toolchain's.
    local linker
    linker=$(rustc --print sysroot)/lib/rustlib/$(rustc -vV | sed -n 's/^host: //p')/bin/rust-lld
    # A folder of its own, because artefacts of two compilers do not mix. Without the variables of an outer cargo, which
    # would select rustup's.
    target_dir=$target_dir/debian
    build_all env -u CARGO -u LD_LIBRARY_PATH -u RUSTUP_TOOLCHAIN -u RUSTC_WRAPPER \
        PATH="/usr/bin:$PATH" RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1 CARGO_UNSTABLE_BUILD_STD=core \
        CARGO_TARGET_DIR="$target_dir" CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER="$linker" /usr/bin/cargo
}

for package in firmware firmware-checks; do
    [[ -f $package/src/bin/$program.rs ]] && break
done
if [[ -n $program && ! -f $package/src/bin/$program.rs ]]; then
    log "$program: no such program in firmware/src/bin or firmware-checks/src/bin"
    exit 2
fi

case $package/$filter in
*/ | firmware/constant_rate | firmware/impact_aided | firmware/stm32g474 | firmware/stm32h743 | firmware/scripted) ;;
*)
    log "$filter: expected constant_rate, impact_aided, stm32g474, stm32h743 or scripted, for a program of firmware"
    exit 2
    ;;
esac

case $wanted in
any | installed | rustup | debian) ;;
*)
    log "FIRMWARE_TOOLCHAIN=$wanted: expected installed, rustup or debian"
    exit 2
    ;;
esac

if allowed installed && target_installed; then
    log "toolchain: installed ($(rustc --version))"
    build_with_rustup
elif allowed rustup && add_target; then
    log "toolchain: rustup ($(rustc --version))"
    build_with_rustup
elif allowed debian && add_debian; then
    log "toolchain: debian ($(/usr/bin/rustc --version))"
    build_with_debian
else
    log "no Rust for $target: not installed, and neither rustup nor Debian's packages supplied it (allowed: $wanted)"
    exit 1
fi

echo "$elf"
