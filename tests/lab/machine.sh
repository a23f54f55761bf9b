# Sourced: Debian's kernel in QEMU, for tests that need a machine of their own. KVM is not needed.
machine_folder=$(dirname "$(realpath "${BASH_SOURCE[0]}")")
kernel=$machine_folder/../../build/lab/kernel # outside the build folders, so that the download is kept

newest_kernel() {
  apt-cache depends linux-image-amd64 2>/dev/null | sed -n 's/^ *Depends: \(linux-image-[0-9].*\)/\1/p' | head -1
}

download_kernel() {
  local package=$1
  mkdir -p "$kernel"
  if [ ! -e "$kernel/$package.ready" ]; then
    (cd "$kernel" && apt-get download -qq "$package" && dpkg-deb -x "$package"_*.deb unpacked &&
      rm "$package"_*.deb) || return
    touch "$kernel/$package.ready"
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

# begin_initramfs ROOT MODULES INIT: busybox, the kernel's modules (one a line, in the order in which they need each
# other; the rest of a line is options) and the script that the kernel starts, which begins with `. /begin`.
begin_initramfs() {
  local root=$1 modules=$2 init=$3 module options
  rm -rf "$root"
  mkdir -p "$root"/{bin,proc,sys,dev,modules,tmp}
  cp /bin/busybox "$root/bin/busybox"
  install -m 755 "$init" "$root/init"
  cp "$machine_folder/begin" "$root/begin"
  while read -r module options; do
    cp "$(find "$kernel/unpacked/lib/modules/$kernel_version" -name "$module.ko")" "$root/modules/"
  done <<<"$modules"
  echo "$modules" >"$root/modules/list"
}

pack_initramfs() {
  (cd "$1" && find . | cpio --quiet -o -H newc | gzip -1) >"$2"
}

# run_machine INITRAMFS CONSOLE SECONDS [OPTION...]: boots, shows the console's lines that begin with ok, FAIL or LAB,
# and keeps all of them in the file CONSOLE. The machine's clock counts its instructions (one nanosecond each), and
# waiting takes no time, so its times do not depend on the host's load. This works with one processor only.
# POSED_LAB_SMP=2 gives it two processors and the host's clock, to look for races.
run_machine() {
  local initramfs=$1 console=$2 seconds=$3 clock="-smp 1 -icount shift=0,sleep=off -rtc clock=vm"
  shift 3
  [ -z "${POSED_LAB_SMP:-}" ] || clock="-smp $POSED_LAB_SMP"
  timeout "$seconds" qemu-system-x86_64 $clock -nographic -no-reboot \
    -kernel "$kernel/unpacked/boot/vmlinuz-$kernel_version" -initrd "$initramfs" "$@" </dev/null | sed -u 's/\r//g' |
    tee "$console" | grep --line-buffered -aE '^(ok|FAIL|LAB)' || true
}
