# Settings shared by every target, and the functions that declare a library, a program and a test.
include(GNUInstallDirs)
include(GoogleTest)

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
set(CMAKE_CXX_FLAGS_RELEASE "-O3 -DNDEBUG")
set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O2 -g1")
if(BUILD_SHARED_LIBS)
  set(CMAKE_INSTALL_RPATH "$ORIGIN;$ORIGIN/../${CMAKE_INSTALL_LIBDIR}")
endif()
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/bin")

# Clones of the project share what ccache holds: paths count relative to the clone.
find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  set(CMAKE_CXX_COMPILER_LAUNCHER "${CMAKE_COMMAND}" -E env "CCACHE_BASEDIR=${PROJECT_SOURCE_DIR}"
    CCACHE_NOHASHDIR=1 CCACHE_SLOPPINESS=pch_defines,time_macros "${CCACHE_PROGRAM}")
endif()

# Settings of scanloc's own code only; generated protobuf code is compiled without the warnings.
add_library(scanloc_warnings INTERFACE)
target_compile_options(scanloc_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
  # {.one_field = 1} leaves the other fields at their defaults, on purpose.
  -Wno-missing-field-initializers)
if(SCANLOC_WARNINGS_AS_ERRORS)
  target_compile_options(scanloc_warnings INTERFACE -Werror)
endif()

# The same scan must give the same bits on every machine: a*b+c is never contracted into one
# rounding, whichever instruction set a function is dispatched to.
add_compile_options(-ffp-contract=off)
if(SCANLOC_SANITIZE)
  add_compile_options(-fsanitize=${SCANLOC_SANITIZE} -fno-omit-frame-pointer)
  add_compile_definitions(SCANLOC_SANITIZED)
  add_link_options(-fsanitize=${SCANLOC_SANITIZE})
endif()
if(SCANLOC_FUZZ)
  add_compile_options(-fsanitize=fuzzer-no-link)
endif()

# scanloc_add_installed(wire a.cpp) declares scanloc_wire, known as scanloc::wire: a library that others
# link, shared with -DBUILD_SHARED_LIBS=ON. Only what is of scanloc can then be seen from outside.
function(scanloc_add_installed module)
  set(target scanloc_${module})
  add_library(${target} ${ARGN})
  add_library(scanloc::${module} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${module} VERSION ${PROJECT_VERSION}
    SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
    DEFINE_SYMBOL "")  # objects are the same for either kind of library
  if(BUILD_SHARED_LIBS)
    target_link_options(${target} PRIVATE
      "LINKER:--version-script=${PROJECT_SOURCE_DIR}/cmake/exported_symbols.map")
  endif()
endfunction()

# scanloc_combine(scanloc_cli NOT main.cpp): with SCANLOC_UNITY_BUILD several sources of a target are
# compiled as one, so that headers are read and templates made once for all of them. Names in their
# anonymous namespaces must differ; the sources after NOT stay alone.
function(scanloc_combine target)
  cmake_parse_arguments(ARG "" "" "NOT" ${ARGN})
  if(NOT SCANLOC_UNITY_BUILD)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
  target_compile_options(${target} PRIVATE -Wno-subobject-linkage)  # each is a source, not a header
  set_source_files_properties(${ARG_NOT} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# scanloc_find_sources(sources src/*.cpp): the files of these names in this folder and those below, in
# the order of their names. Without main.cpp, which is a program's, so that tests can link the rest.
function(scanloc_find_sources sources)
  file(GLOB_RECURSE found CONFIGURE_DEPENDS RELATIVE "${CMAKE_CURRENT_SOURCE_DIR}" ${ARGN})
  list(FILTER found EXCLUDE REGEX "(^|/)main\\.cpp$")
  set(${sources} ${found} PARENT_SCOPE)
endfunction()

# scanloc_add_library(core [INSTALLED] [SOURCES a.cpp] PUBLIC_DEPS x PRIVATE_DEPS y [PRECOMPILED grpc]
#   [NOT_COMBINED b.cpp])
# declares scanloc_core, known as scanloc::core, of all sources in src/ if none are named, with its
# public headers in include/.
function(scanloc_add_library module)
  cmake_parse_arguments(ARG "INSTALLED" "PRECOMPILED" "SOURCES;PUBLIC_DEPS;PRIVATE_DEPS;NOT_COMBINED" ${ARGN})
  if(NOT ARG_PRECOMPILED)
    set(ARG_PRECOMPILED common)
  endif()
  if(NOT ARG_SOURCES)
    scanloc_find_sources(ARG_SOURCES src/*.cpp)
  endif()
  set(target scanloc_${module})
  if(ARG_INSTALLED)
    scanloc_add_installed(${module} ${ARG_SOURCES})
  else()
    add_library(${target} STATIC ${ARG_SOURCES})
    add_library(scanloc::${module} ALIAS ${target})
  endif()
  target_include_directories(${target} PUBLIC
    "$<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>"
    "$<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>"
    PRIVATE "${CMAKE_CURRENT_SOURCE_DIR}/src")
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_link_libraries(${target} PUBLIC ${ARG_PUBLIC_DEPS}
    PRIVATE ${ARG_PRIVATE_DEPS} $<BUILD_INTERFACE:scanloc_warnings>)
  scanloc_precompile(${target} ${ARG_PRECOMPILED})
  scanloc_combine(${target} NOT ${ARG_NOT_COMBINED})
endfunction()

# scanloc_add_program(scanlocd SOURCES main.cpp DEPS scanloc::server)
function(scanloc_add_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_DEPS} scanloc_warnings)
  scanloc_precompile(${name} cli)
  # OPTIONAL: what was not built is not installed, and hinders nobody.
  install(TARGETS ${name} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT ${name} OPTIONAL)
  install(DIRECTORY "${PROJECT_BINARY_DIR}/man/${name}/" DESTINATION ${CMAKE_INSTALL_MANDIR}/man1
    COMPONENT ${name} OPTIONAL)
endfunction()

# scanloc_add_test(core_tests [SOURCES a_test.cpp] [ALSO b.cpp] DEPS scanloc::core [PRECOMPILED grpc_tests])
# declares a GoogleTest program, of all *_test.cpp if no sources are named, whose tests ctest lists one
# by one.
function(scanloc_add_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT;PRECOMPILED" "SOURCES;ALSO;DEPS" ${ARGN})
  if(NOT ARG_SOURCES)
    scanloc_find_sources(ARG_SOURCES *_test.cpp)
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  add_executable(${name} ${ARG_SOURCES} ${ARG_ALSO})
  target_include_directories(${name} PRIVATE "${PROJECT_SOURCE_DIR}/tests")
  target_link_libraries(${name} PRIVATE ${ARG_DEPS} scanloc_test_support scanloc_warnings
    GTest::gtest GTest::gmock
    GTest::gtest_main)
  if(NOT ARG_PRECOMPILED)
    set(ARG_PRECOMPILED tests)
  endif()
  scanloc_precompile(${name} ${ARG_PRECOMPILED})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/tests")
  # Sanitizers get their options from the test preset, so that no test may run while building.
  set(discovery POST_BUILD)
  if(SCANLOC_SANITIZE)
    set(discovery PRE_TEST)
  endif()
  gtest_discover_tests(${name} PROPERTIES TIMEOUT ${ARG_TIMEOUT} DISCOVERY_TIMEOUT 60
    DISCOVERY_MODE ${discovery})
endfunction()
