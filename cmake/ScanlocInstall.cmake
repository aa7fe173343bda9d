# `cmake --install`: the programs with what goes along, and what an outside project needs for
# find_package(scanloc COMPONENTS core offline client) or pkg-config. What was not built is left out.
include(CMakePackageConfigHelpers)

# What each component of find_package adds; every one includes the core.
set(core_libraries core)
set(interface_libraries messages client_interface files)  # what offline and client share
set(offline_libraries geo jobs mapdb offline_client)
set(client_libraries wire proto client)

set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/scanloc")
foreach(component core interface offline client)
  list(TRANSFORM ${component}_libraries PREPEND scanloc_ OUTPUT_VARIABLE targets)
  install(TARGETS ${targets} EXPORT scanloc-${component}
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev OPTIONAL
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev OPTIONAL)
  install(EXPORT scanloc-${component} NAMESPACE scanloc:: DESTINATION "${package_dir}"
    COMPONENT dev)
endforeach()
install(DIRECTORY core/include/ mapdb/include/ client/include/ client/offline/include/ pcl/include/
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev
  PATTERN "status_macros.hpp" EXCLUDE)  # for our own sources: its names are short
# The conversions need generated headers; the library alone uses them.
install(FILES proto/include/scanloc/proto/messages.hpp proto/include/scanloc/proto/viewer.hpp
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/scanloc/proto COMPONENT dev)
install(DIRECTORY proto/scanloc DESTINATION ${CMAKE_INSTALL_DATADIR}/scanloc/proto COMPONENT dev
  FILES_MATCHING PATTERN "*.proto")

configure_package_config_file(cmake/scanlocConfig.cmake.in
  "${PROJECT_BINARY_DIR}/scanlocConfig.cmake" INSTALL_DESTINATION "${package_dir}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/scanlocConfigVersion.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/scanlocConfig.cmake"
  "${PROJECT_BINARY_DIR}/scanlocConfigVersion.cmake" DESTINATION "${package_dir}" COMPONENT dev)

# The same for pkg-config: scanloc-core, scanloc-offline, scanloc-client.
file(RELATIVE_PATH PC_PREFIX "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
function(scanloc_add_pkg_config component requires)
  set(PC_NAME "scanloc-${component}")
  set(PC_REQUIRES "${requires}")
  set(PC_LIBS "")
  foreach(library IN LISTS ARGN)
    string(APPEND PC_LIBS " -lscanloc_${library}")
  endforeach()
  configure_file(cmake/scanloc.pc.in "${PROJECT_BINARY_DIR}/${PC_NAME}.pc" @ONLY)
  install(FILES "${PROJECT_BINARY_DIR}/${PC_NAME}.pc"
    DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig" COMPONENT dev)
endfunction()
scanloc_add_pkg_config(core
  "eigen3 absl_flat_hash_map absl_status absl_statusor absl_strings absl_str_format" core)
scanloc_add_pkg_config(offline "scanloc-core sqlite3 libxxhash geographiclib"
  offline_client geo mapdb jobs files client_interface messages)
scanloc_add_pkg_config(client "scanloc-core grpc++ protobuf"
  client proto wire files client_interface messages)

# The programs' manual pages (`--target man`) and completion, both from what their --help says.
find_program(HELP2MAN_PROGRAM help2man)
if(HELP2MAN_PROGRAM)
  set(programs scanloc scanlocd)
  foreach(program scanloc-ros2 scanloc-web)
    if(TARGET ${program})
      list(APPEND programs ${program})
    endif()
  endforeach()
  list(TRANSFORM programs REPLACE "(.+)" "$<TARGET_FILE:\\1>" OUTPUT_VARIABLE files)
  add_custom_target(man
    COMMAND "${PROJECT_SOURCE_DIR}/scripts/man_pages.sh" "${PROJECT_BINARY_DIR}/man" ${files}
    VERBATIM)
  add_dependencies(man ${programs})
endif()
set(bash_dir "${CMAKE_INSTALL_DATADIR}/bash-completion/completions")
set(zsh_dir "${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions")
foreach(program scanloc scanlocd scanloc-ros2 scanloc-web)
  install(FILES scripts/completion.bash DESTINATION ${bash_dir} RENAME ${program}
    COMPONENT ${program})
  install(FILES scripts/completion.zsh DESTINATION ${zsh_dir} RENAME _${program}
    COMPONENT ${program})
endforeach()

# The server's unit runs it where it was installed.
file(READ packaging/scanlocd.service unit)
string(REPLACE "/usr/local/bin" "${CMAKE_INSTALL_FULL_BINDIR}" unit "${unit}")
file(GENERATE OUTPUT "${PROJECT_BINARY_DIR}/scanlocd.service" CONTENT "${unit}")
install(FILES "${PROJECT_BINARY_DIR}/scanlocd.service" DESTINATION lib/systemd/system
  COMPONENT scanlocd)
install(FILES packaging/scanlocd.toml DESTINATION ${CMAKE_INSTALL_DATADIR}/scanloc
  COMPONENT scanlocd)

install(FILES README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT scanloc)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT scanloc)
foreach(package scanloc scanlocd scanloc-ros2 scanloc-web dev python)
  set(folder "${package}")
  string(REGEX REPLACE "^dev$" "libscanloc-dev" folder "${folder}")
  string(REGEX REPLACE "^python$" "python3-scanloc" folder "${folder}")
  set(exclude "")
  if(package STREQUAL "python")
    set(exclude EXCLUDE_FROM_ALL)
  endif()
  if(NOT SKBUILD)  # a wheel has its own
    install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${folder} RENAME copyright
      COMPONENT ${package} ${exclude})
  endif()
endforeach()
