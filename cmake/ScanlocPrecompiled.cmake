# Headers that most sources include, compiled once for all targets: parsing them takes longer than
# most sources do. Not for clang, which wants one for each set of definitions: linting and fuzzing
# show where a source lacks an #include.
if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
  set(CMAKE_DISABLE_PRECOMPILE_HEADERS ON)
endif()

# scanloc_declare_precompiled(grpc DEPS scanloc::wire HEADERS <grpcpp/grpcpp.h> [OPTIONS -O1])
function(scanloc_declare_precompiled name)
  cmake_parse_arguments(ARG "" "" "DEPS;HEADERS;OPTIONS" ${ARGN})
  set(target scanloc_precompiled_${name})
  set(source "${PROJECT_BINARY_DIR}/precompiled_${name}.cpp")
  file(CONFIGURE OUTPUT "${source}" CONTENT "")
  add_library(${target} STATIC EXCLUDE_FROM_ALL "${source}")
  target_compile_options(${target} PUBLIC ${ARG_OPTIONS})
  target_link_libraries(${target} PRIVATE Eigen3::Eigen absl::statusor absl::strings
    absl::str_format scanloc_warnings ${ARG_DEPS})
  target_precompile_headers(${target} PRIVATE
    <Eigen/Core> <Eigen/Geometry> <absl/status/statusor.h> <absl/strings/str_cat.h>
    <absl/strings/str_format.h> <algorithm> <chrono> <cmath> <filesystem> <functional> <map> <memory>
    <mutex> <optional> <span> <string> <thread> <vector> ${ARG_HEADERS})
endfunction()

# scanloc_precompile(server_tests grpc_tests): its sources see these headers, whatever they include.
function(scanloc_precompile target name)
  get_target_property(type ${target} TYPE)
  if(type STREQUAL EXECUTABLE)
    target_compile_options(${target} PRIVATE -fPIC)  # as libraries, or they could share none
  endif()
  target_compile_options(${target} PRIVATE
    $<TARGET_PROPERTY:scanloc_precompiled_${name},INTERFACE_COMPILE_OPTIONS>)
  target_precompile_headers(${target} REUSE_FROM scanloc_precompiled_${name})
endfunction()

scanloc_declare_precompiled(common)
# What reads the command line is run once, and CLI11 is large. Some libraries have all that use them
# compiled with -pthread, in which no source may differ.
scanloc_declare_precompiled(cli DEPS CLI11::CLI11 HEADERS <CLI/CLI.hpp> OPTIONS -O1 -pthread)
set(grpc_headers <grpcpp/grpcpp.h> <scanloc/v1/localization.grpc.pb.h>)
scanloc_declare_precompiled(grpc DEPS scanloc::wire HEADERS ${grpc_headers})
if(SCANLOC_BUILD_TESTS)
  set(test_headers <gtest/gtest.h> <gmock/gmock.h>)
  scanloc_declare_precompiled(tests DEPS GTest::gmock HEADERS ${test_headers} OPTIONS -O1 -pthread)
  scanloc_declare_precompiled(grpc_tests DEPS scanloc::wire GTest::gmock
    HEADERS ${test_headers} ${grpc_headers} OPTIONS -O1 -pthread)
endif()
