# Headers that most sources include, compiled once for all targets: parsing them takes longer than
# most sources do. Not for clang, which wants one for each set of definitions: linting and fuzzing
# show where a source lacks an #include.
if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
  set(CMAKE_DISABLE_PRECOMPILE_HEADERS ON)
endif()

# scanloc_declare_precompiled(grpc DEPS scanloc_wire_headers HEADERS <grpcpp/grpcpp.h> [OPTIONS -O1])
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

set(common_headers <absl/strings/numbers.h> <absl/strings/str_join.h> <absl/strings/str_split.h> <array>
  <atomic> <charconv> <condition_variable> <deque> <fstream> <limits> <list> <nlohmann/json.hpp> <numbers>
  <numeric> <random> <set> <variant>)
scanloc_declare_precompiled(common DEPS nlohmann_json::nlohmann_json HEADERS ${common_headers})
# Only for what reads the command line, which is run once: of CLI11, which is large, every source that
# sees it compiles a part. Some libraries have all that use them compiled with -pthread, in which no
# source may differ; how far sources are optimised may.
scanloc_declare_precompiled(cli DEPS CLI11::CLI11 nlohmann_json::nlohmann_json
  HEADERS <CLI/CLI.hpp> ${common_headers} OPTIONS -O1 -pthread)
set(grpc_headers <grpcpp/grpcpp.h> <scanloc/v1/localization.grpc.pb.h>)
scanloc_declare_precompiled(grpc DEPS scanloc_wire_headers nlohmann_json::nlohmann_json
  HEADERS ${grpc_headers} ${common_headers} <absl/functional/any_invocable.h>
    <grpc/health/v1/health.grpc.pb.h> <scanloc/v1/admin.grpc.pb.h> <scanloc/v1/capture.pb.h>
    <scanloc/v1/viewer.grpc.pb.h>
  OPTIONS -O2)
if(SCANLOC_BUILD_TESTS)
  set(test_headers <gtest/gtest.h> <gmock/gmock.h>)
  scanloc_declare_precompiled(tests DEPS GTest::gmock HEADERS ${test_headers} OPTIONS -O1 -pthread)
  scanloc_declare_precompiled(grpc_tests DEPS scanloc_wire_headers GTest::gmock
    HEADERS ${test_headers} ${grpc_headers} OPTIONS -O1 -pthread)
endif()
