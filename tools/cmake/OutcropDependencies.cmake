# SPDX-License-Identifier: BSD-3-Clause
# What comes from outside: Debian's packages, and LCM and Unity out of third_party/ (tools/setup.sh puts them there).
set(OUTCROP_THIRD_PARTY ${CMAKE_SOURCE_DIR}/third_party)
set(pieces unity/unity.c)
if(NOT OUTCROP_VEHICLE_ONLY)
  list(APPEND pieces lcm/lib/liblcm.a)
endif()
foreach(piece ${pieces})
  if(NOT EXISTS ${OUTCROP_THIRD_PARTY}/${piece})
    message(FATAL_ERROR "third_party/${piece} is missing: run tools/setup.sh first")
  endif()
endforeach()

# ---- the tests' of the vehicle's half, which needs nothing else
add_library(unity STATIC ${OUTCROP_THIRD_PARTY}/unity/unity.c)
target_include_directories(unity SYSTEM PUBLIC ${OUTCROP_THIRD_PARTY}/unity)
target_compile_definitions(unity PUBLIC UNITY_INCLUDE_DOUBLE)
if(OUTCROP_VEHICLE_ONLY)
  return()
endif()

find_package(Threads REQUIRED)
find_package(PkgConfig REQUIRED)

# ---- LCM 1.5.3, static: Debian's older liblcm has the same SONAME. lcmConfig leaves GLib2::glib to its user.
pkg_check_modules(GLIB REQUIRED IMPORTED_TARGET GLOBAL glib-2.0)
add_library(GLib2::glib ALIAS PkgConfig::GLIB)
find_package(lcm 1.5.3 EXACT REQUIRED CONFIG PATHS ${OUTCROP_THIRD_PARTY}/lcm NO_DEFAULT_PATH)
include(${LCM_USE_FILE})

# ---- the vehicle's
pkg_check_modules(GPIOD REQUIRED IMPORTED_TARGET GLOBAL libgpiod)
pkg_check_modules(SYSTEMD REQUIRED IMPORTED_TARGET GLOBAL libsystemd)
pkg_check_modules(CYAML REQUIRED IMPORTED_TARGET GLOBAL libcyaml)
pkg_check_modules(YAML REQUIRED IMPORTED_TARGET GLOBAL yaml-0.1)
pkg_check_modules(JANSSON REQUIRED IMPORTED_TARGET GLOBAL jansson)
find_package(JPEG REQUIRED)
pkg_check_modules(WEBP REQUIRED IMPORTED_TARGET GLOBAL libwebp)
pkg_check_modules(PNG REQUIRED IMPORTED_TARGET GLOBAL libpng)

# ---- the base's
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(Ceres 2.1 REQUIRED)
find_package(nanoflann REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(CLI11 REQUIRED)
find_package(ZLIB REQUIRED)

# Debian ships OpenCVConfig.cmake only in libopencv-dev, which pulls in VTK and Qt. The component packages are enough.
find_path(OUTCROP_OPENCV_INCLUDE opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
add_library(outcrop_opencv INTERFACE)
target_include_directories(outcrop_opencv SYSTEM INTERFACE ${OUTCROP_OPENCV_INCLUDE})
foreach(module calib3d features2d imgcodecs imgproc core)
  find_library(OUTCROP_OPENCV_${module} opencv_${module} REQUIRED)
  target_link_libraries(outcrop_opencv INTERFACE ${OUTCROP_OPENCV_${module}})
endforeach()

# ---- the other tests'
find_package(GTest REQUIRED)
