#!/usr/bin/env bash
# service_check.sh FOLDER: the packages of FOLDER in a machine that runs Debian with its systemd (QEMU, no KVM needed):
# posed@stage is started, reloaded, each of its threads is stopped, and so on; service/check.py has the checks. Uses the
# bare Debian that package_check.sh leaves in FOLDER, or makes one, which needs root.
set -euo pipefail
here=$(realpath "$(dirname "$0")")
packages=$(realpath "$1")
root=$packages/bare
work=$packages/service
[ "$(id -u)" -eq 0 ] || { echo "the check of the service makes a bare Debian, which needs root" >&2; exit 1; }

. "$here/bare.sh"
. "$here/../lab/machine.sh"
trap unmount EXIT

# What the initramfs loads to find the disks.
disk_modules="libnvdimm
nfit
nd_btt
nd_pmem
crc16
crc32c_generic
mbcache
jbd2
ext4"

# What the machine may load itself: the drivers of gloves, and a USB port with a serial glove (dummy_hcd, g_serial).
add_modules() {
  local from=$kernel/unpacked/lib/modules/$kernel_version to=$root/lib/modules/$kernel_version
  local folder
  for folder in drivers/usb/{common,core,class,serial,gadget} drivers/hid drivers/tty fs/{configfs,autofs}; do
    mkdir -p "$to/kernel/$folder"
    cp -r "$from/kernel/$folder/." "$to/kernel/$folder/"
  done
  cp "$from"/modules.{builtin,builtin.modinfo,order} "$to/"
  inside depmod "$kernel_version"
}

# A stage that an administrator has set up: config, keys, clip and model in /etc/posed, a disk for takes.
set_up_stage() {
  local stage=$root/etc/posed name
  inside posed demo --prepare /root/demo >"$work/demo.log" 2>&1 ||
    { tail "$work/demo.log" >&2; fail "posed demo failed"; }
  cp "$root"/root/demo/{new_walker.bvh,walk-to-sneak.style} "$here/service/stage.toml" "$stage/"
  chmod 644 "$stage"/*.*
  rm -rf "$stage/keys"
  for name in server viewer late; do inside posed keygen $name --out /etc/posed/keys; done >"$work/keys.log"
  inside chown -R posed /etc/posed/keys
  echo 'nonsense = 1' >"$stage/wrong.toml"
  sed 's/new_walker/lost_walker/; s/:1512/:0/; s/:5572/:0/' "$stage/stage.toml" >"$stage/hopeless.toml"
  inside install -d -o posed -g posed /var/lib/posed /var/lib/posed/takes
  echo 'LABEL=takes /var/lib/posed/takes ext4 defaults 0 0' >"$root/etc/fstab"
}

set_up_machine() {
  cp "$here/service/check.py" "$packages"/posed_*.deb "$root/opt/"
  cp "$here/service/service-check.service" "$root/etc/systemd/system/"
  echo 0123456789abcdef0123456789abcdef >"$root/etc/machine-id"
  inside systemctl enable -q service-check
  # They would only take time.
  inside systemctl mask -q serial-getty@ttyS0 getty@tty1 apt-daily.timer apt-daily-upgrade.timer
}

make_disks() {
  rm -f "$work"/*.img
  mke2fs -q -t ext4 -L root -d "$root" "$work/root.img" 2G
  mke2fs -q -t ext4 -L takes -E root_owner="$(inside id -u posed):$(inside id -g posed)" "$work/takes.img" 256M
}

# disk NAME SIZE: the image as persistent memory. A disk that takes time would take far too much of it here: the
# machine's clock leaps to its next timer whenever the machine waits.
disk() {
  echo "-object memory-backend-file,id=$1,share=on,mem-path=$work/$1.img,size=$2 -device nvdimm,memdev=$1"
}

# boot PART: one part of check.py.
boot() {
  run_machine "$work/init.gz" "$work/$1.log" "${POSED_SERVICE_SECONDS:-900}" -machine pc,nvdimm=on -nic none \
    -m 1024,slots=2,maxmem=8G $(disk root 2G) $(disk takes 256M) \
    -append "console=ttyS0 panic=-1 quiet systemd.show_status=no check=$1"
  grep -q "^LAB PASSED $1\$" "$work/$1.log" || { tail -40 "$work/$1.log" >&2; fail "see $work/$1.log"; }
}

mkdir -p "$work"
fetch_kernel
if [ -x "$root/usr/bin/apt-get" ]; then mount_bare; else make_bare; fi
install_packages systemd-sysv dbus udev kmod "$packages"/posed_*.deb "$packages"/python3-posed_*.deb
add_modules
set_up_stage
set_up_machine
unmount
make_disks
begin_initramfs "$work/init" "$disk_modules" "$here/service/init"
pack_initramfs "$work/init" "$work/init.gz"
boot service
boot reboot
