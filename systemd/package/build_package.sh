#!/usr/bin/env bash
# Debian packages from a build tree: build_package.sh BUILD_FOLDER OUTPUT_FOLDER. The tree was configured with
# -DCMAKE_INSTALL_PREFIX=/usr -DCMAKE_INSTALL_LIBDIR=lib/MULTIARCH (./run package does) and is built.
set -euo pipefail
build=$(realpath "$1")
mkdir -p "$2"
output=$(realpath "$2")
package=$(dirname "$(realpath "$0")")
source=$(realpath "$package/../..")
for tool in dh dh_strip dpkg-shlibdeps; do
  command -v "$tool" >/dev/null || { echo "build_package.sh: no $tool: apt-get install debhelper dpkg-dev" >&2; exit 69; }
done

work=$output/work
rm -rf "$work" "$output"/*.deb
mkdir -p "$work/tree/man"
multiarch=$(dpkg-architecture -qDEB_HOST_MULTIARCH)
cmake --install "$build" --prefix "$work/stage/usr" >"$work/install.log"
# A tree configured for another place has its libraries in lib itself.
if [ ! -d "$work/stage/usr/lib/$multiarch" ]; then
  mkdir "$work/lib" && mv "$work/stage/usr/lib"/* "$work/lib/" && mv "$work/lib" "$work/stage/usr/lib/$multiarch"
fi

cd "$work/tree"
cp -a "$package/debian" .
cp "$package"/man/*.8 man/
python3 "$package/make_man_pages.py" "$build/bin" man
"$build/bin/tubed" --sample | python3 "$package/start_configuration.py" >tubed.toml
"$build/bin/tubed" --check tubed.toml >/dev/null
for unit in "$source"/systemd/*.service; do
  name=$(basename "$unit")
  case "$name" in
    tubed.service) cp "$unit" debian/tubed.service ;;
    tubed@.service) cp "$unit" debian/tubed@.service ;;
    *@.service) cp "$unit" "debian/tubed@.${name%@.service}.service" ;;  # as dh_installsystemd --name looks for it
    *) cp "$unit" "debian/tubed.$name" ;;
  esac
done
cp "$source/systemd/60-tubed.rules" debian/tubed.tubed.udev
cp "$source/systemd/tubed.sysusers" "$source/systemd/tubed.tmpfiles" debian/
TUBED_STAGE=$work/stage TUBED_SOURCE=$source dpkg-buildpackage -b -us -uc -d >"$work/dpkg.log" 2>&1 ||
  { tail -n 40 "$work/dpkg.log" >&2; exit 1; }
mv "$work"/*.deb "$output/"
ls -1 "$output"/*.deb
