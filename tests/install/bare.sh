# Sourced: a bare Debian in the folder $root, with packages installed in it. Needs root. The caller has `packages`, a
# folder for logs, and `root`.

unmount() {
  local folder
  for folder in "$root"/{proc,sys,dev}; do
    ! mountpoint -q "$folder" || umount -R -l "$folder"
  done
}

mount_bare() {
  local folder
  for folder in proc sys dev; do
    mount --rbind "/$folder" "$root/$folder"
    mount --make-rslave "$root/$folder"
  done
}

fail() {
  echo "$(basename "$0"): $*" >&2
  exit 1
}

# Debian as debootstrap makes it, with this machine's way to the packages.
make_bare() {
  unmount
  ! grep -q " $root/" /proc/self/mounts || fail "$root still has mounts; unmount them first"
  rm -rf "$root"
  debootstrap --variant=minbase --include=ca-certificates bookworm "$root" >"$packages/debootstrap.log" 2>&1 ||
    { tail "$packages/debootstrap.log" >&2; fail "debootstrap failed"; }
  mount_bare
  cp /etc/resolv.conf /etc/hosts "$root/etc/"
  cp /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/"
  rm -f "$root/etc/apt/sources.list"
  cp -r /etc/apt/apt.conf.d /etc/apt/sources.list.d "$root/etc/apt/"
  [ ! -f /etc/apt/sources.list ] || cp /etc/apt/sources.list "$root/etc/apt/"
  inside apt-get update -qq
}

# inside COMMAND...: in the bare Debian, with an empty home.
inside() {
  chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
    http_proxy="${http_proxy:-}" https_proxy="${https_proxy:-}" "$@"
}

# install_packages NAME|FILE...: packages of Debian, and files of this machine.
install_packages() {
  local name names=()
  for name in "$@"; do
    [ ! -f "$name" ] || { cp "$name" "$root/tmp/"; name=/tmp/$(basename "$name"); }
    names+=("$name")
  done
  inside apt-get install -y -qq "${names[@]}" >"$packages/apt.log" 2>&1 ||
    { tail "$packages/apt.log" >&2; fail "apt cannot install $*"; }
}
