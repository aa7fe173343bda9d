#!/usr/bin/env bash
# Makes the Debian packages scanloc, scanlocd, scanloc-ros2, scanloc-web, libscanloc-dev and
# python3-scanloc.
#   scripts/package.sh [OUT]            into OUT (dist/)
#   scripts/package.sh --check [OUT]    and installs them into a clean Debian 12, made by debootstrap,
#                                       and uses them there, the server under systemd, too; as root
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/common.sh
check=
if [[ "${1:-}" == --check ]]; then
  check=yes
  shift
fi
out=$(realpath -m "${1:-dist}")
build=$PWD/build/package

scripts/setup.sh
python=$(python_for_package)
configure release -B "$build" -DCMAKE_INSTALL_PREFIX=/usr -DSCANLOC_BUILD_TESTS=OFF \
  -DSCANLOC_BUILD_BENCH=OFF -DSCANLOC_PAGE=ON -DSCANLOC_BUILD_PYTHON=ON -DPython_EXECUTABLE="$python" \
  -DSCANLOC_PYTHON_INSTALL_DIR=lib/python3/dist-packages/scanloc
cmake --build "$build"
cmake --build "$build" --target man
rm -rf "$build/debs"
(cd "$build" && cpack -B "$build/debs")
mkdir -p "$out"
cp "$build"/debs/*.deb "$out"
ls -l "$out"/*.deb
[[ -n "$check" ]] || exit 0

root=$(mktemp -d)
cleanup() {
  umount "$root/dev/pts" "$root/proc" 2>/dev/null || true
  rm -rf --one-file-system "$root"
}
trap cleanup EXIT
{ command -v debootstrap && command -v systemd-nspawn; } >/dev/null ||
  apt-get install -y -qq --no-install-recommends debootstrap systemd-container >/dev/null
debootstrap --variant=minbase --include=systemd-sysv,dbus bookworm "$root" >/dev/null
chmod 755 "$root"  # other users than root live there, too
mount -t proc proc "$root/proc"
mount -t devpts devpts "$root/dev/pts"
mkdir "$root/debs" "$root/example"
cp "$build"/debs/*.deb "$root/debs"
cp tests/package/*.{txt,cpp,py} tests/package/in_clean_root.sh "$root/example"
chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 \
  bash /example/in_clean_root.sh
umount "$root/dev/pts" "$root/proc"  # of the container that is booted now
tests/package/unit_in_clean_root.sh "$root"
