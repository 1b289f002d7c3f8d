#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs what Outcrop needs on Debian 12: packages that are missing, then LCM and Unity into third_party/.
# Asks nothing, may be repeated, touches nothing that is already there. --dev adds what only maintainers use,
# --peers the programs that tools/peer_colmap.py compares with.
set -euo pipefail
cd "$(dirname "$0")/.."
export LC_ALL=C

say() { printf 'setup: %s\n' "$*"; }
die() { printf 'setup: %s\n' "$*" >&2; exit 1; }

packages=(
    build-essential cmake ninja-build ccache pkg-config clang-format-14
    libglib2.0-dev libgpiod-dev libsystemd-dev libcyaml-dev libyaml-dev libjansson-dev libjpeg62-turbo-dev libpng-dev libwebp-dev zlib1g-dev libzip-dev
    libopencv-core-dev libopencv-imgproc-dev libopencv-imgcodecs-dev libopencv-features2d-dev libopencv-calib3d-dev
    libeigen3-dev libceres-dev libnanoflann-dev nlohmann-json3-dev libcli11-dev
    libgtest-dev libgmock-dev libbenchmark-dev
    gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user-static
    clang-14 libclang-rt-14-dev valgrind
    assimp-utils ffmpeg iproute2 util-linux
    qemu-system-x86 busybox-static kmod cpio libelf1 systemd udev v4l-utils groff-base
    python3 python3-pip python3-numpy
    ca-certificates debian-archive-keyring dpkg-dev xz-utils
)
developer_packages=(clang-tidy-14 python3-opencv)
peer_packages=(colmap)

for option in "$@"; do
    case "$option" in
        --dev) packages+=("${developer_packages[@]}") ;;
        --peers) packages+=("${peer_packages[@]}") ;;
        *) die "usage: tools/setup.sh [--dev] [--peers]" ;;
    esac
done

# ---- Debian packages

missing_packages() {
    dpkg-query -W -f '${binary:Package} ${Package} ${db:Status-Status}\n' "${packages[@]}" 2>/dev/null |
        awk '$3 == "installed" {print $2}' | sort -u |
        comm -13 - <(printf '%s\n' "${packages[@]}" | sort -u)
}

# Runs a command as root, its output only shown when it fails.
as_root() {
    local log status=0
    log=$(mktemp)
    if [ "$(id -u)" = 0 ]; then "$@" >"$log" 2>&1 || status=$?; else sudo "$@" >"$log" 2>&1 || status=$?; fi
    [ $status = 0 ] || tail -n 20 "$log" >&2
    rm -f "$log"
    return $status
}

install_packages() {
    command -v dpkg-query >/dev/null || die "this is not Debian: dpkg-query is missing"
    local missing
    mapfile -t missing < <(missing_packages)
    [ ${#missing[@]} -gt 0 ] || return 0
    if [ "$(id -u)" != 0 ] && ! command -v sudo >/dev/null; then
        die "neither root nor sudo is at hand to install: ${missing[*]}"
    fi
    say "installing ${#missing[@]} Debian packages and what they need (minutes on a bare machine): ${missing[*]}"
    as_root apt-get -q -o DPkg::Lock::Timeout=300 -o Acquire::Retries=3 update || die "apt-get update failed"
    as_root env DEBIAN_FRONTEND=noninteractive apt-get -q -y --no-install-recommends -o DPkg::Lock::Timeout=300 \
        -o Acquire::Retries=3 -o Dpkg::Use-Pty=0 install "${missing[@]}" || die "apt-get install failed"
    say "packages installed"
}

# ---- LCM 1.5.3, from its wheel: a CMake prefix with a static library. Debian's 1.3.1 loses fragments out of order.

install_lcm() {
    [ -e third_party/lcm/lcm-1.5.3.dist-info/RECORD ] && [ -e third_party/lcm/lib/liblcm.a ] && return 0
    say "fetching LCM 1.5.3"
    local work=third_party/.lcm
    rm -rf "$work" third_party/lcm
    mkdir -p "$work"
    # x86_64 and aarch64, Python 3.11 as in Debian 12.
    cat >"$work/requirements.txt" <<'END'
lcm==1.5.3 \
    --hash=sha256:1d4eb1e1a3fe20242a7149d6d56192f652d25701feae18d9774b4f69f10ef445 \
    --hash=sha256:92732d4521c05c4c012a51a418287b20c413eca611174c461b3c2801262ccd47
END
    PIP_USER=0 PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_ROOT_USER_ACTION=ignore /usr/bin/python3 -m pip install --quiet \
        --no-deps --only-binary :all: --require-hashes --target "$work/lcm" -r "$work/requirements.txt" \
        >"$work/log" 2>&1 || { tail -n 20 "$work/log" >&2; die "pip could not fetch lcm 1.5.3"; }
    mv "$work/lcm" third_party/lcm
    rm -rf "$work"
}

# ---- Unity 2.5.1, out of Debian's signed source of ntpsec, with lists and cache of its own.

unity_sums='2e3a0610268455520a5796345b503d00c34a47fe97ed3750349cbd4b2b1990f3  unity.c
681ac98a63ac11effb11e59d580f6ca82abca1bd34069465c38e3b15344256c0  unity.h
adfd612c217e59468c5ebe978640e77e5f539e820ffc0c195a98c5a36f0ac868  unity_internals.h'

unity_is_right() { (cd "$1" 2>/dev/null && sha256sum --check --status <<<"$unity_sums" 2>/dev/null); }

# The mirror this machine uses already.
debian_mirror() {
    local mirror
    mirror=$(apt-get indextargets --format '$(REPO_URI) $(CODENAME) $(COMPONENT)' 'Created-By: Packages' |
        awk '$2 == "bookworm" && $3 == "main" {print $1; exit}')
    if [ -z "$mirror" ]; then # no lists yet
        mirror=$(grep -hoE 'https?://[^ ]+/debian/?( |$)' /etc/apt/sources.list /etc/apt/sources.list.d/* 2>/dev/null |
            head -n 1 | tr -d ' ' || true)
    fi
    printf '%s' "${mirror:-http://deb.debian.org/debian}"
}

install_unity() {
    unity_is_right third_party/unity && return 0
    say "fetching Unity 2.5.1"
    local work=third_party/.unity
    rm -rf "$work" third_party/unity
    mkdir -p "$work"/{lists/partial,cache/archives/partial,parts,unity}
    printf 'Types: deb-src\nURIs: %s\nSuites: bookworm\nComponents: main\nSigned-By: %s\n' "$(debian_mirror)" \
        /usr/share/keyrings/debian-archive-keyring.gpg >"$work/parts/source.sources"
    local top
    top=$(pwd)/$work
    local apt=(apt-get -qq -o Dir::Etc::SourceList=/dev/null -o Dir::Etc::SourceParts="$top/parts"
        -o Dir::State::Lists="$top/lists" -o Dir::Cache="$top/cache" -o Acquire::Retries=3
        -o APT::Sandbox::User="$(id -un)")
    "${apt[@]}" update >"$work/log" 2>&1 && (cd "$work" && "${apt[@]}" source --download-only ntpsec) >>"$work/log" 2>&1 ||
        { tail -n 20 "$work/log" >&2; die "could not fetch the source of ntpsec, which holds Unity"; }
    tar -C "$work/unity" -xJf "$work"/ntpsec_*.orig.tar.xz --strip-components=3 --wildcards '*/tests/unity/unity*.[ch]'
    unity_is_right "$work/unity" || die "Unity as fetched does not have the expected checksums"
    mv "$work/unity" third_party/unity
    rm -rf "$work"
}

install_packages
mkdir -p third_party
install_lcm
install_unity
say "ready"
