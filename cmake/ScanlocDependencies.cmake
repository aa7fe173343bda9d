# Everything scanloc links against, by Debian 12 package (scripts/setup.sh installs them).
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)  # libeigen3-dev
find_package(absl REQUIRED)                  # libabsl-dev
find_package(PkgConfig REQUIRED)             # pkg-config
find_package(SQLite3 3.38 REQUIRED)          # libsqlite3-dev
find_package(spdlog REQUIRED)                # libspdlog-dev
find_package(Protobuf REQUIRED)              # libprotobuf-dev, protobuf-compiler
find_package(OpenSSL REQUIRED)               # libssl-dev
find_package(CLI11 REQUIRED)                 # libcli11-dev
find_package(gRPC CONFIG REQUIRED)           # libgrpc++-dev, protobuf-compiler-grpc
find_package(prometheus-cpp CONFIG REQUIRED)  # prometheus-cpp-dev
find_package(Ceres 2.1 REQUIRED)               # libceres-dev
find_package(nanoflann REQUIRED)             # libnanoflann-dev
find_package(nlohmann_json 3.11 REQUIRED)     # nlohmann-json3-dev
find_package(PostgreSQL REQUIRED)           # libpq-dev
find_package(CURL 7.88 REQUIRED)              # libcurl4-openssl-dev
pkg_check_modules(XXHASH REQUIRED IMPORTED_TARGET libxxhash)  # libxxhash-dev
pkg_check_modules(GEOGRAPHICLIB REQUIRED IMPORTED_TARGET geographiclib)  # libgeographiclib-dev

pkg_check_modules(LZF REQUIRED IMPORTED_TARGET liblzf)        # liblzf-dev
pkg_check_modules(PNG REQUIRED IMPORTED_TARGET libpng)        # libpng-dev
pkg_check_modules(ZSTD REQUIRED IMPORTED_TARGET libzstd)      # libzstd-dev
pkg_check_modules(LZ4 REQUIRED IMPORTED_TARGET liblz4)        # liblz4-dev
find_package(BZip2 REQUIRED)                                  # libbz2-dev
pkg_check_modules(DEFLATE REQUIRED IMPORTED_TARGET libdeflate)  # libdeflate-dev

# References to compare with; no installed program links PCL. Its CMake package demands VTK and Qt;
# its pkg-config files name only what is linked.
if(SCANLOC_BUILD_TESTS)
  pkg_check_modules(PCL_IO REQUIRED IMPORTED_TARGET pcl_io)        # libpcl-dev
endif()
if(SCANLOC_BUILD_BENCH)
  pkg_check_modules(PCL_FILTERS REQUIRED IMPORTED_TARGET pcl_filters)
  pkg_check_modules(PCL_REGISTRATION REQUIRED IMPORTED_TARGET pcl_registration)
endif()
if(SCANLOC_BUILD_TESTS)
  find_package(GTest 1.12 REQUIRED)    # libgtest-dev, libgmock-dev
  find_package(ZLIB REQUIRED)          # zlib1g-dev
endif()
if(SCANLOC_BUILD_BENCH)
  find_package(benchmark REQUIRED)     # libbenchmark-dev
endif()
