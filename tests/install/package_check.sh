#!/usr/bin/env bash
# package_check.sh FOLDER: installs the packages of FOLDER in a bare Debian below it, uses them, installs a newer number
# over an older one, removes and purges them, and runs the program on an emulated CPU without AVX2. Needs root, because
# it makes and mounts the bare Debian. FOLDER/older has the same packages with the number 0.0.1.
set -euo pipefail
packages=$(realpath "$1")
root=$packages/bare
[ "$(id -u)" -eq 0 ] || { echo "the check of packages makes a bare Debian, which needs root" >&2; exit 1; }

. "$(dirname "$0")/bare.sh"
trap unmount EXIT

# Like `inside`, without this machine's network, so that its ports are free.
alone() {
  unshare --net sh -c 'ip link set lo up && exec "$@"' sh \
    chroot "$root" env -i PATH=/usr/bin:/bin HOME=/root LC_ALL=C.UTF-8 "$@"
}

# A new user's first styled frame: all of the demo but the three seconds that it shows.
use_demo() {
  local begin seconds
  rm -rf "$root/root/.cache"
  begin=$(date +%s%N)
  alone posed demo --seconds 3 >"$packages/demo.log" 2>&1 || { cat "$packages/demo.log" >&2; fail "posed demo failed"; }
  seconds=$((($(date +%s%N) - begin) / 10000000 - 300))
  printf 'first styled frame %d.%02d s after apt install\n' $((seconds / 100)) $((seconds % 100))
  [ $seconds -lt 1500 ] || fail "the first styled frame must come within 15 s"
}

use_clients() {
  inside python3 -c 'import posed; from posed.v1 import posed_pb2; posed.Client; posed_pb2.Frame()' ||
    fail "python3-posed cannot be imported"
  [ -n "$(find "$root/usr/include/posed/v1" -name posed.pb.h)" ] || fail "libposed-dev has no messages"
}

# The steps of config/ci/gitlab.yml, as a runner runs them, on a log that this posed has recorded.
use_gitlab_recipe() {
  local project=$root/root/project steps
  steps=$(awk '/^  (before_)?script:/ { on = 1; next } /^  [a-z]/ { on = 0 } on { sub(/^    - /, ""); print }' \
    config/ci/gitlab.yml)
  mkdir -p "$project/takes"
  cp "$packages"/posed_*.deb "$project/posed.deb"
  alone posed demo --prepare /root/demo &>"$packages/ci.log" || fail "no demo for the recipe"
  alone posed record --config /root/demo/demo.toml --seconds 3 --frames --out /root/project/takes/a.plog \
    &>"$packages/ci.log" || { cat "$packages/ci.log" >&2; fail "no log for the recipe"; }
  inside sh -ec "cd /root/project; $steps" &>"$packages/ci.log" ||
    { cat "$packages/ci.log" >&2; fail "the steps of config/ci/gitlab.yml fail"; }
  grep -q 'tests="1" failures="0"' "$project/replay.xml" || fail "the recipe's report lacks its test case"
  # A single byte may lie where the log has none.
  head -c 20000 /dev/zero | tr '\0' x |
    dd of="$project/takes/a.plog" bs=1 seek=$(($(stat -c %s "$project/takes/a.plog") / 2)) conv=notrunc status=none
  ! inside sh -ec "cd /root/project; posed replay --expect takes/*.plog" &>"$packages/ci.log" ||
    fail "the recipe does not see a damaged log"
}

# The step of config/ci/Containerfile: there is no registry here to take its base image from.
use_containerfile() {
  cp "$packages"/posed_*.deb "$root/tmp/posed.deb"
  inside sh -ec "$(sed -n 's/^RUN //p' config/ci/Containerfile)" &>"$packages/ci.log" ||
    { cat "$packages/ci.log" >&2; fail "the step of config/ci/Containerfile fails"; }
  inside posed --version || fail "the image has no posed"
}

# An older number in use, the newer one over it, removed, purged.
life_of_packages() {
  local version left
  make_bare
  install_packages "$packages"/older/*.deb
  use_demo
  echo '# made by the user' >"$root/etc/posed/mine.toml"
  version=$(dpkg-deb -f "$packages"/posed_*.deb Version)
  install_packages "$packages"/*.deb
  [ "$(inside dpkg-query -W -f='${Version}' posed)" = "$version" ] || fail "the upgrade did not install $version"
  inside dpkg --verify posed libposed-dev python3-posed || fail "installed files differ from those of the packages"
  inside getent passwd posed >/dev/null || fail "there is no account posed"
  use_demo
  use_clients
  use_gitlab_recipe
  inside apt-get remove -y -qq posed >"$packages/apt.log" 2>&1 || fail "apt cannot remove"
  [ ! -e "$root/usr/bin/posed" ] || fail "removed, but /usr/bin/posed is still there"
  inside apt-get purge -y -qq posed libposed-dev python3-posed >"$packages/apt.log" 2>&1 || fail "apt cannot purge"
  # What a user made stays: their config, and the clips and models that the demo keeps in their home.
  left=$(cd "$root" && find . -xdev -name '*posed*' ! -path './root/*' ! -path './tmp/*' ! -path './proc/*' ! -path './sys/*')
  [ "$left" = ./etc/posed ] || fail "purge left more than the user's config: $left"
  [ "$(ls "$root/etc/posed")" = mine.toml ] || fail "purge took the user's config, or left more: $(ls "$root/etc/posed")"
  ! inside getent passwd posed >/dev/null || fail "purge left the account posed"
  use_containerfile
  echo "installed, used, upgraded to $version, replayed as config/ci says, removed, purged"
}

# The values of two BVH files differ by less than 0.001 degrees or centimetres.
same_clip() {
  cmp -s <(grep -c . "$1") <(grep -c . "$2") &&
    paste -d' ' "$1" "$2" | awk '/^[-0-9. ]+$/ {
      for (i = 1; i <= NF / 2; i++) { d = $i - $(i + NF / 2); if (d < 0) d = -d; if (d > worst) worst = d; values++ }
    } END { exit !(values > 1000 && worst < 0.001) }'
}

# Nehalem (2008) has SSE 4.2, but no AVX: qemu stops a program there at its first instruction of AVX2.
old_cpu() {
  local folder=$packages/old_cpu posed=$packages/old_cpu/unpacked/usr/bin/posed
  local emulated=(qemu-x86_64 -cpu Nehalem "$posed")
  rm -rf "$folder"
  mkdir -p "$folder"
  dpkg-deb -x "$packages"/posed_*.deb "$folder/unpacked"
  "${emulated[@]}" demo --prepare "$folder/demo" >"$folder/log" 2>&1 || { tail "$folder/log" >&2; fail "no demo without AVX2"; }
  "${emulated[@]}" check --config "$folder/demo/demo.toml" >"$folder/log" 2>&1 || { tail "$folder/log" >&2; fail "no check without AVX2"; }
  local model=$folder/demo/walk-to-sneak.style walker=$folder/demo/new_walker.bvh
  "${emulated[@]}" apply --model "$model" "$walker" --out "$folder/old.bvh" &>"$folder/log" || fail "no style without AVX2"
  "$posed" apply --model "$model" "$walker" --out "$folder/new.bvh" &>"$folder/log"
  same_clip "$folder/old.bvh" "$folder/new.bvh" || fail "the style on a CPU without AVX2 differs"
  ! same_clip "$folder/old.bvh" "$walker" || fail "a CPU without AVX2 leaves the walker without style"
  echo "on a CPU without AVX2 posed learns, and styles as here within 0.001 degrees"
}

lintian --allow-root --fail-on error,warning "$packages"/*.deb || fail "lintian has complaints"
echo "lintian has no error and no warning"
life_of_packages
old_cpu
