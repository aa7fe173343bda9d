# Sourced by the scripts: Debian's own tools and libraries only. Other Pythons, Nodes, compilers and
# libraries in /usr/local, a home folder or an active environment are not taken by accident.
export PATH=/usr/sbin:/usr/bin:/sbin:/bin
unset CC CXX CFLAGS CXXFLAGS CPPFLAGS LDFLAGS CPATH CPLUS_INCLUDE_PATH LIBRARY_PATH LD_LIBRARY_PATH \
  PKG_CONFIG_PATH CMAKE_PREFIX_PATH PYTHONHOME PYTHONPATH VIRTUAL_ENV

# python_for_package: prints a Python with what the package is built and tested with, in build/venv.
python_for_package() {
  if [[ ! -e build/venv/complete ]]; then
    /usr/bin/python3 -m venv --clear --system-site-packages build/venv
    build/venv/bin/pip install -q 'nanobind>=2,<4' 'pytest>=7' >&2
    touch build/venv/complete
  fi
  echo "$PWD/build/venv/bin/python"
}

# configure PRESET [CMAKE_FLAG ...]
configure() {
  cmake --preset "$@" -DCMAKE_IGNORE_PREFIX_PATH=/usr/local >/dev/null
}
