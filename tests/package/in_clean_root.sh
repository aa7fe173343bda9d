#!/usr/bin/env bash
# Installs the packages in /debs and uses each of them as a newcomer would. In a Debian 12 that has
# nothing yet, and that may be spoilt: scripts/package.sh --check.
set -euo pipefail
export DEBIAN_FRONTEND=noninteractive
say() { printf '\n== %s\n' "$*"; }
apt-get update -qq
cd /tmp

say "scanloc: a map and an answer"
apt-get install -y -qq --no-install-recommends /debs/scanloc_*.deb >/dev/null
scanloc --version
scanloc simulate drive --town-seed 1 --session-seed 1 --length-m 40 --quiet
scanloc build town.scanloc --scans drive --poses drive/poses.txt --quiet
scanloc locate town.scanloc --scan - <drive/velodyne/000003.bin | grep ' localized '
test -s /usr/share/man/man1/scanloc-locate.1.gz
test -s /usr/share/bash-completion/completions/scanloc

say "scanlocd: its user, options and unit"
apt-get install -y -qq --no-install-recommends /debs/scanlocd_*.deb >/dev/null
getent passwd scanlocd
grep '^ExecStart=/usr/bin/scanlocd ' /lib/systemd/system/scanlocd.service
cp town.scanloc /srv/scanloc/
mkfifo ready
setpriv --reuid scanlocd --regid scanlocd --clear-groups \
  scanlocd --config /etc/scanloc/scanlocd.toml --listen 127.0.0.1:0 >ready 2>server.log &
server=$!
trap 'kill "$server"' EXIT
read -r line <ready || { cat server.log >&2; exit 1; }
address=${line##* }
scanloc locate --server "$address" --scan drive/velodyne/000003.bin | grep ' localized '

say "python3-scanloc: the same from Python"
apt-get install -y -qq --no-install-recommends /debs/python3-scanloc_*.deb >/dev/null
python3 - "$address" <<'END'
import sys, numpy, scanloc
points = numpy.fromfile("drive/velodyne/000003.bin", numpy.float32).reshape(-1, 4)
here = scanloc.Localizer(scanloc.Map.open("town.scanloc")).localize(points)
there = scanloc.Client(sys.argv[1]).localize(points)
print(here, here.T_map_query[:3, 3], sep="\n")
assert here.localized and numpy.allclose(here.T_map_query, there.T_map_query)
END

if compgen -G '/debs/scanloc-ros2_*.deb' >/dev/null; then
  say "scanloc-ros2"
  apt-get install -y -qq --no-install-recommends /debs/scanloc-ros2_*.deb >/dev/null
  mkfifo hears
  CYCLONEDDS_URI='<General><Interfaces><NetworkInterface name="lo"/></Interfaces></General>' \
    scanloc-ros2 --map town.scanloc --domain 77 >hears 2>robot.log &
  robot=$!
  read -r line <hears || { cat robot.log >&2; exit 1; }
  [[ "$line" == "scanloc-ros2 ready" ]]
  kill "$robot"
  wait "$robot"
fi

say "scanloc-web: the page, and HTTP"
apt-get install -y -qq --no-install-recommends /debs/scanloc-web_*.deb >/dev/null
scanloc-web --server "$address" --map town --snapshot town.html
grep -q '"responses"' town.html

say "libscanloc-dev: by CMake and by pkg-config"
apt-get install -y -qq --no-install-recommends /debs/libscanloc-dev_*.deb g++ cmake make >/dev/null
cmake -S /example -B build -DCMAKE_BUILD_TYPE=Release >/dev/null
cmake --build build >/dev/null
build/where_am_i "$address"
build/where_am_i_offline town.scanloc
g++ -std=c++20 /example/close_loops.cpp -o close_loops $(pkg-config --cflags --libs scanloc-core)
./close_loops | grep '^scan 45 is at place 0$'

say "gone again"
kill "$server"
trap - EXIT
apt-get purge -y -qq scanlocd python3-scanloc >/dev/null
test ! -e /usr/lib/python3/dist-packages/scanloc
test ! -e /etc/scanloc/scanlocd.toml
test -e /srv/scanloc/town.scanloc
echo "packages: all well"
