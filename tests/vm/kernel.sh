#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Fetches Debian's own kernel as the virtual machine boots it, builds gpio-sim for it and prints the folder that holds both.
# Nothing is installed. Kept in ${OUTCROP_VM_CACHE:-${XDG_CACHE_HOME:-~/.cache}/outcrop-vm}/KVER; status 77 when it cannot be had.
set -euo pipefail
export LC_ALL=C

series=6.12
cache=${OUTCROP_VM_CACHE:-${XDG_CACHE_HOME:-$HOME/.cache}/outcrop-vm}

skip() { printf 'vm: SKIPPED: %s\n' "$*" >&2; exit 77; }
die() { printf 'vm: %s\n' "$*" >&2; exit 1; }

image_package() {
    apt-cache show --no-all-versions "linux-image-$series-amd64" 2>/dev/null |
        sed -n 's/^Depends: \(linux-image-[^ ]*\).*/\1/p' | head -n 1
}

# The kernel that the meta package stands for today, else the newest one kept.
kernel_version() {
    local image
    image=$(image_package) || true
    if [ -z "$image" ] && [ "$(id -u)" = 0 ]; then # a machine without package lists
        apt-get -qq -o Acquire::Retries=3 update >/dev/null 2>&1 || true
        image=$(image_package) || true
    fi
    if [ -n "$image" ]; then
        echo "${image#linux-image-}"
    else
        find "$cache" -maxdepth 2 -name ready -printf '%h\n' 2>/dev/null | xargs -r -n 1 basename | sort -V | tail -n 1
    fi
}

header_packages() {
    apt-cache depends --no-recommends --no-suggests --no-conflicts --no-breaks --no-replaces "linux-headers-$version" |
        sed -n 's/^ *Depends: \(linux-\(headers\|kbuild\)-.*\)/\1/p' | sort -u
}

fetch() {
    mapfile -t headers < <(header_packages)
    apt-get -qq -o APT::Sandbox::User="$(id -un)" -o Acquire::Retries=3 download "linux-image-$version" \
        "linux-headers-$version" "${headers[@]}" "linux-source-$series" >log 2>&1 ||
        { tail -n 5 log >&2; skip "apt cannot fetch the packages of Linux $version"; }
    dpkg-deb -x linux-image-*.deb kernel
    rm -rf kernel/usr
    local package
    for package in linux-headers-*.deb linux-kbuild-*.deb; do dpkg-deb -x "$package" headers; done
    # No vmlinux: no type information for modules is asked for then, which would need pahole.
    rm -f "headers/usr/src/linux-headers-$version/vmlinux"
    sed -i "s#/usr/src/#$PWD/headers/usr/src/#" "headers/usr/src/linux-headers-$version/Makefile"
    local tree=linux-source-$series source
    local sources=(drivers/gpio/gpio-sim.c drivers/gpio/gpiolib.h kernel/irq/irq_sim.c)
    # tar stops reading when it has all three, which those before it in the pipe take for a failure.
    dpkg-deb --fsys-tarfile linux-source-*.deb 2>/dev/null | tar xO "./usr/src/$tree.tar.xz" 2>/dev/null |
        xz -dc -T0 2>/dev/null | tar x --strip-components=1 --occurrence=1 "${sources[@]/#/$tree/}" || true
    for source in "${sources[@]}"; do [ -s "$source" ] || die "linux-source-$series has no $source"; done
}

# Debian builds neither GPIO_SIM nor IRQ_SIM: one module of both. irq_to_desc() is not exported, what it is replaced by is.
build_gpio_sim() {
    mkdir gpio-sim
    cp drivers/gpio/gpio-sim.c gpio-sim/gpio-sim-main.c
    cp drivers/gpio/gpiolib.h gpio-sim/
    sed 's/irq_to_desc(\([a-z]*\))/irq_data_to_desc(irq_get_irq_data(\1))/' kernel/irq/irq_sim.c >gpio-sim/irq_sim.c
    printf '%s\n' 'obj-m := gpio-sim.o' 'gpio-sim-y := gpio-sim-main.o irq_sim.o' 'ccflags-y := -DCONFIG_IRQ_SIM=1' \
        >gpio-sim/Makefile
    make -s -j"$(nproc)" -C "headers/usr/src/linux-headers-$version" M="$PWD/gpio-sim" modules >log 2>&1 ||
        { grep -E 'error|ERROR|No such' log | head -n 5 >&2; die "gpio-sim does not build for Linux $version"; }
    strip -g gpio-sim/gpio-sim.ko
    install -D -m 644 gpio-sim/gpio-sim.ko "kernel/lib/modules/$version/extra/gpio-sim.ko"
}

version=$(kernel_version)
[ -n "$version" ] || skip "apt knows no package linux-image-$series-amd64 and none is kept in $cache"
folder=$cache/$version
if [ ! -e "$folder/ready" ]; then
    mkdir -p "$cache"
    work=$(mktemp -d "$cache/.new.XXXXXX")
    trap 'rm -rf "$work"' EXIT
    cd "$work"
    fetch
    build_gpio_sim
    depmod -b kernel "$version"
    : >kernel/ready
    # Whoever is first wins; two of them have made the same.
    mv -T kernel "$folder" 2>/dev/null || [ -e "$folder/ready" ] || die "cannot move the kernel to $folder"
fi
echo "$folder"
