#!/usr/bin/env bash
# Boots the Debian with systemd in ROOT, where in_clean_root.sh has been, in a container without a network, and
# has systemd start scanlocd; fails as what is checked there does.
#   unit_in_clean_root.sh ROOT
set -euo pipefail
root=$1
chroot "$root" bash -c 'dpkg -i /debs/scanlocd_*.deb' >/dev/null
cp "$root/tmp/drive/velodyne/000003.bin" "$root/example/scan.bin"

cat >"$root/example/check_unit.sh" <<'END'
set -euo pipefail
pid() { systemctl show -p MainPID --value scanlocd; }
asks() { scanloc locate --server 127.0.0.1:50061 --scan /example/scan.bin --quiet; }
first=$(pid)
[[ $(stat -c %U "/proc/$first") == scanlocd ]]
asks | grep ' localized '
systemctl reload scanlocd
[[ $(pid) == "$first" ]]
kill -9 "$first"
until [[ $(pid) != 0 && $(pid) != "$first" ]] && systemctl is-active -q scanlocd; do sleep 0.2; done
asks | grep ' localized '
systemctl stop scanlocd
[[ $(systemctl show -p Result --value scanlocd) == success ]]
echo "unit: all well"
END
cat >"$root/etc/systemd/system/check-unit.service" <<'END'
[Unit]
Wants=scanlocd.service
After=scanlocd.service
SuccessAction=exit-force
FailureAction=exit-force
FailureActionExitStatus=1
[Service]
Type=oneshot
TimeoutStartSec=120
StandardOutput=truncate:/example/unit.log
StandardError=inherit
ExecStart=/bin/bash /example/check_unit.sh
END
ended=0
systemd-nspawn --quiet --directory="$root" --private-network --register=no --keep-unit --boot \
  systemd.unit=check-unit.service </dev/null >"$root/example/boot.log" 2>&1 || ended=$?
cat "$root/example/unit.log"
exit "$ended"
