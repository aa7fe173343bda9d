# `cmake --install`: the programs, and what an outside project needs for find_package(scanloc).
include(CMakePackageConfigHelpers)

set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/scanloc")
install(TARGETS scanloc_core scanloc_mapdb scanloc_wire scanloc_proto scanloc_client
  scanloc_offline_client
  EXPORT scanlocTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} OPTIONAL)
install(EXPORT scanlocTargets NAMESPACE scanloc:: DESTINATION "${package_dir}")
install(DIRECTORY core/include/ mapdb/include/ client/include/ client/offline/include/
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
# The conversions need generated headers; the library alone uses them.
install(FILES proto/include/scanloc/proto/messages.hpp
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/scanloc/proto)

install(DIRECTORY proto/scanloc DESTINATION ${CMAKE_INSTALL_DATADIR}/scanloc/proto
  FILES_MATCHING PATTERN "*.proto")

configure_package_config_file(cmake/scanlocConfig.cmake.in
  "${PROJECT_BINARY_DIR}/scanlocConfig.cmake" INSTALL_DESTINATION "${package_dir}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/scanlocConfigVersion.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/scanlocConfig.cmake"
  "${PROJECT_BINARY_DIR}/scanlocConfigVersion.cmake" DESTINATION "${package_dir}")
