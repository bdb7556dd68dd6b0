# SPDX-License-Identifier: GPL-3.0-or-later
# Every library that more than one module may link, found once, in the sizes Debian 12 ships. A module links
# what it names; finding a library here does not put it on anybody's include path.
set(CMAKE_FIND_PACKAGE_TARGETS_GLOBAL ON)  # a static module hands its private libraries on to whoever links it

find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(OpenSSL REQUIRED COMPONENTS Crypto)
find_package(tomlplusplus 3.3 REQUIRED)
find_package(CLI11 2.1 REQUIRED)
find_package(spdlog REQUIRED)
find_package(TBB REQUIRED)
find_package(Ceres 2.1 REQUIRED)
find_package(ZLIB REQUIRED)
find_package(EXPAT 2.5 REQUIRED)
find_package(OpenCV 4.6 REQUIRED COMPONENTS core imgproc imgcodecs calib3d video objdetect aruco)
find_package(embree 3.13 REQUIRED)
find_package(VTK 9.1 REQUIRED COMPONENTS CommonCore CommonDataModel IOPLY IOXML)

# tenter_umfpack: SuiteSparse 5.12 of Debian comes without a CMake package.
find_path(UMFPACK_INCLUDE_DIR umfpack.h PATH_SUFFIXES suitesparse REQUIRED)
find_library(UMFPACK_LIBRARY umfpack REQUIRED)
add_library(tenter_umfpack INTERFACE)
add_library(tenter::umfpack ALIAS tenter_umfpack)
target_include_directories(tenter_umfpack SYSTEM INTERFACE ${UMFPACK_INCLUDE_DIR})
target_link_libraries(tenter_umfpack INTERFACE ${UMFPACK_LIBRARY})

# HDF5 without MPI, even where its parallel build is installed too.
find_package(PkgConfig REQUIRED)
pkg_check_modules(hdf5 REQUIRED IMPORTED_TARGET GLOBAL hdf5-serial)
if(TENTER_HARDWARE)
  pkg_check_modules(libusb REQUIRED IMPORTED_TARGET GLOBAL libusb-1.0>=1.0.26)
  pkg_check_modules(umockdev REQUIRED IMPORTED_TARGET GLOBAL umockdev-1.0>=0.17 gobject-2.0)
  pkg_check_modules(libsystemd REQUIRED IMPORTED_TARGET GLOBAL libsystemd)
  pkg_check_modules(libmodbus REQUIRED IMPORTED_TARGET GLOBAL libmodbus>=3.1.6)
  pkg_check_modules(aravis REQUIRED IMPORTED_TARGET GLOBAL aravis-0.8>=0.8.26)
endif()

# tests only
find_package(GTest 1.12 REQUIRED)
find_package(valijson REQUIRED)
if(TENTER_BENCHMARKS)
  find_package(benchmark REQUIRED)
endif()
