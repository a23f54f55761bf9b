#!/usr/bin/env bash
# boot.sh BUILD_FOLDER: packs posed and posed_lab with busybox and the kernel's USB gadget modules
# into an initramfs, boots Debian's kernel with it in QEMU and reports the result. KVM is not needed.
set -euo pipefail
build=$(realpath "$1")
here=$(realpath "$(dirname "$0")")
. "$here/machine.sh"
lab=$here/../../build/lab
root=$lab/root

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

# add_program FILE: the program and every library it needs, at the paths where it looks for them.
add_program() {
  strip -o "$root/bin/$(basename "$1")" "$1"
  ldd "$1" | grep -o '/[^ ]*' | while read -r library; do
    mkdir -p "$root/$(dirname "$library")"
    cp -Lu "$library" "$root/$library"
  done
}

fetch_kernel
begin_initramfs "$root" "$modules" "$here/init"
add_program "$build/posed"
add_program "$build/posed_lab"
pack_initramfs "$root" "$lab/init.gz"
run_machine "$lab/init.gz" "$lab/console.log" "${POSED_LAB_SECONDS:-600}" -m 768 \
  -append "console=ttyS0 panic=-1 ${POSED_LAB_VERBOSE:-loglevel=3} ${POSED_LAB_ONLY:+posed_lab=$POSED_LAB_ONLY}"
grep -q '^LAB PASSED$' "$lab/console.log" ||
  { echo "the lab failed; see $lab/console.log" >&2; tail -20 "$lab/console.log" >&2; exit 1; }
