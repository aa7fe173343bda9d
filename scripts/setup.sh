#!/usr/bin/env bash
# Installs what a fresh Debian 12 lacks to build, test and demonstrate scanloc.
#   scripts/setup.sh [--programs | --with-checks | --with-fuzz]
# --programs: what the programs are built with alone. Needs root or sudo only if something is missing;
# asks nothing.
set -euo pipefail
. "$(dirname "$0")/common.sh"

case "${1:-}" in
  "" | --programs | --with-checks | --with-fuzz) ;;
  *)
    echo "setup: there is no '$1'; give --programs, --with-checks, --with-fuzz or nothing" >&2
    exit 2 ;;
esac

packages=(
  g++ cmake ninja-build ccache pkg-config git ca-certificates
  libeigen3-dev libnanoflann-dev libgeographiclib-dev libceres-dev libsqlite3-dev libxxhash-dev
  liblzf-dev libzstd-dev liblz4-dev libbz2-dev libdeflate-dev libpng-dev
  libgrpc++-dev libprotobuf-dev protobuf-compiler protobuf-compiler-grpc libabsl-dev
  libpq-dev libcurl4-openssl-dev
  libssl-dev zlib1g-dev prometheus-cpp-dev libspdlog-dev libcli11-dev nlohmann-json3-dev
  cyclonedds-dev cyclonedds-tools
  libboost-dev
)
# The page of scanloc-web; another Node.js that brings its npm along is as good.
command -v npm >/dev/null || packages+=(nodejs npm)
if [[ "${1:-}" != "--programs" ]]; then
  packages+=(
    libpcl-dev libgtest-dev libgmock-dev libbenchmark-dev libfastrtps-dev libfastcdr-dev
    openssl postgresql haproxy parallel slurmctld slurmd slurm-client python3-swift chromium
    python3 python3-dev python3-venv python3-numpy python3-grpcio python3-protobuf
    librsvg2-bin dpkg-dev help2man time
  )
fi
if [[ "${1:-}" == "--with-checks" ]]; then
  packages+=(clang-format-14 clang-tidy-14 clang-format clang-tidy)
fi
if [[ "${1:-}" == "--with-fuzz" ]]; then
  packages+=(clang-14 libclang-rt-14-dev)
fi

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
  [[ "$status" == "installed" ]] || missing+=("$package")
done
if [[ ${#missing[@]} -eq 0 ]]; then
  exit 0
fi

as_root=()
if [[ $(id -u) -ne 0 ]]; then
  command -v sudo >/dev/null || {
    echo "setup: run as root, or install sudo; missing packages: ${missing[*]}" >&2
    exit 1
  }
  as_root=(sudo)
fi
echo "setup: installing ${missing[*]}" >&2
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
  apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
