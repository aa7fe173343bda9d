# Debian packages by CPack (scripts/package.sh): `cpack` in a build folder configured with
# -DCMAKE_INSTALL_PREFIX=/usr. Their dependencies are those of the libraries that they are linked to.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME scanloc)
set(CPACK_PACKAGE_VENDOR "scanloc")
set(CPACK_PACKAGE_CONTACT "scanloc maintainers <maintainers@scanloc.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Where a LiDAR scan was taken, from one scan and nothing else")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_COMPONENTS_ALL scanloc scanlocd dev)

set(CPACK_DEBIAN_SCANLOC_PACKAGE_NAME scanloc)
set(CPACK_DEBIAN_SCANLOC_PACKAGE_RECOMMENDS librsvg2-bin)  # PDFs of a report's figures
set(CPACK_COMPONENT_SCANLOC_DESCRIPTION
  "The program scanloc: builds maps from LiDAR drives and bags, locates scans in them, evaluates.")

set(CPACK_DEBIAN_SCANLOCD_PACKAGE_NAME scanlocd)
set(CPACK_COMPONENT_SCANLOCD_DESCRIPTION
  "The server scanlocd: answers robots over gRPC. Serves the maps in /srv/scanloc once the systemd
service scanlocd is enabled; options are in /etc/scanloc/scanlocd.toml.")
set(CPACK_DEBIAN_SCANLOCD_PACKAGE_DEPENDS passwd)
set(CPACK_DEBIAN_SCANLOCD_PACKAGE_CONTROL_EXTRA
  "${PROJECT_SOURCE_DIR}/packaging/debian/postinst"
  "${PROJECT_SOURCE_DIR}/packaging/debian/prerm"
  "${PROJECT_SOURCE_DIR}/packaging/debian/postrm")

set(CPACK_DEBIAN_DEV_PACKAGE_NAME libscanloc-dev)
set(CPACK_COMPONENT_DEV_DESCRIPTION
  "Libraries and headers of scanloc, for CMake and pkg-config: the method (core), answers from map
files (offline), and from servers (client); the .proto files.")
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "libeigen3-dev, libabsl-dev, libsqlite3-dev, libxxhash-dev, libgeographiclib-dev, \
libgrpc++-dev, libprotobuf-dev, protobuf-compiler-grpc, pkg-config")

if(TARGET scanloc-ros2)
  list(APPEND CPACK_COMPONENTS_ALL scanloc-ros2)
  set(CPACK_DEBIAN_SCANLOC-ROS2_PACKAGE_NAME scanloc-ros2)
  set(CPACK_COMPONENT_SCANLOC-ROS2_DESCRIPTION
    "The program scanloc-ros2: hears the clouds of a ROS 2 robot over DDS and tells /initialpose,
without ROS on the machine.")
endif()
if(TARGET scanloc-web)
  list(APPEND CPACK_COMPONENTS_ALL scanloc-web)
  set(CPACK_DEBIAN_SCANLOC-WEB_PACKAGE_NAME scanloc-web)
  set(CPACK_COMPONENT_SCANLOC-WEB_DESCRIPTION
    "The program scanloc-web: a page to look at what a scanlocd answers, and HTTP/JSON.")
endif()
if(TARGET scanloc_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-scanloc)
  set(CPACK_COMPONENT_PYTHON_DESCRIPTION
    "The Python package scanloc: numpy in, numpy out; maps, localization, loop closure, evaluation.")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA
    "${PROJECT_SOURCE_DIR}/packaging/debian/python3-scanloc/prerm")
  math(EXPR next_minor "${Python_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3-numpy, \
python3 (>= 3.${Python_VERSION_MINOR}), python3 (<< 3.${next_minor})")
endif()
include(CPack)
