#!/usr/bin/env bash
# boot.sh BUILD_FOLDER: packs posed and posed_lab with busybox and the kernel's USB gadget modules
# into an initramfs, boots Debian's kernel with it in QEMU and reports the result. KVM is not needed.
set -euo pipefail
build=$(realpath "$1")
here=$(realpath "$(dirname "$0")")
lab=$here/../../build/lab # outside the build folder, so that the downloaded kernel is kept
root=$lab/root
seconds=${POSED_LAB_SECONDS:-600}

# The modules in the order in which they need each other; the rest of a line is module options.
modules="configfs
usb-common
usbcore
udc-core
libcomposite
dummy_hcd num=3
hid
hid-generic
usbhid
u_serial
usb_f_hid
usb_f_acm
usb_f_fs
cdc-acm"

newest_kernel() {
  apt-cache depends linux-image-amd64 2>/dev/null | sed -n 's/^ *Depends: \(linux-image-[0-9].*\)/\1/p' | head -1
}

download_kernel() {
  local package=$1
  mkdir -p "$lab/kernel"
  if [ ! -e "$lab/kernel/$package.ready" ]; then
    (cd "$lab/kernel" && apt-get download -qq "$package" && dpkg-deb -x "$package"_*.deb unpacked && rm "$package"_*.deb) || return
    touch "$lab/kernel/$package.ready"
  fi
  kernel_version=${package#linux-image-}
}

# The kernel's package is downloaded and unpacked, never installed. If apt's package lists are missing or too old
# for the mirror, they are updated, which needs root.
fetch_kernel() {
  local package
  package=$(newest_kernel)
  if [ -n "$package" ] && download_kernel "$package" 2>/dev/null; then return; fi
  apt-get update -qq
  package=$(newest_kernel)
  [ -n "$package" ] || { echo "apt knows no linux-image-amd64; is this Debian on amd64?" >&2; exit 1; }
  download_kernel "$package"
}

# add_program FILE: the program and every library it needs, at the paths where it looks for them.
add_program() {
  strip -o "$root/bin/$(basename "$1")" "$1"
  ldd "$1" | grep -o '/[^ ]*' | while read -r library; do
    mkdir -p "$root/$(dirname "$library")"
    cp -Lu "$library" "$root/$library"
  done
}

pack() {
  rm -rf "$root"
  mkdir -p "$root"/{bin,proc,sys,dev,modules,tmp}
  cp /bin/busybox "$root/bin/busybox"
  install -m 755 "$here/init" "$root/init"
  add_program "$build/posed"
  add_program "$build/posed_lab"
  local module options
  while read -r module options; do
    cp "$(find "$lab/kernel/unpacked/lib/modules/$kernel_version" -name "$module.ko")" "$root/modules/"
  done <<<"$modules"
  echo "$modules" >"$root/modules/list"
  (cd "$root" && find . | cpio --quiet -o -H newc | gzip -1) >"$lab/init.gz"
}

# The machine's clock counts its instructions (one nanosecond each), and waiting takes no time, so its times do
# not depend on the host's load. This works with one processor only. POSED_LAB_SMP=2 gives it two processors and
# the host's clock, to look for races.
boot() {
  local clock="-smp 1 -icount shift=0,sleep=off -rtc clock=vm"
  [ -z "${POSED_LAB_SMP:-}" ] || clock="-smp $POSED_LAB_SMP"
  timeout "$seconds" qemu-system-x86_64 -m 768 $clock -nographic -no-reboot \
    -kernel "$lab/kernel/unpacked/boot/vmlinuz-$kernel_version" -initrd "$lab/init.gz" \
    -append "console=ttyS0 panic=-1 ${POSED_LAB_VERBOSE:-loglevel=3} ${POSED_LAB_ONLY:+posed_lab=$POSED_LAB_ONLY}" </dev/null | tr -d '\r' | tee "$lab/console.log" | grep --line-buffered -aE '^(ok|FAIL|LAB)' || true
  grep -q '^LAB PASSED$' "$lab/console.log" || { echo "the lab failed; see $lab/console.log" >&2; tail -20 "$lab/console.log" >&2; exit 1; }
}

fetch_kernel
pack
boot
