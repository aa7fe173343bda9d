# Sourced by the scripts: Debian's own tools and libraries only. Other Pythons, Nodes, compilers and
# libraries in /usr/local, a home folder or an active environment are not taken by accident.
export PATH=/usr/sbin:/usr/bin:/sbin:/bin
unset CC CXX CFLAGS CXXFLAGS CPPFLAGS LDFLAGS CPATH CPLUS_INCLUDE_PATH LIBRARY_PATH LD_LIBRARY_PATH \
  PKG_CONFIG_PATH CMAKE_PREFIX_PATH PYTHONHOME PYTHONPATH VIRTUAL_ENV

# configure PRESET [CMAKE_FLAG ...]
configure() {
  cmake --preset "$@" -DCMAKE_IGNORE_PREFIX_PATH=/usr/local >/dev/null
}
