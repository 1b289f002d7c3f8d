# SPDX-License-Identifier: BSD-3-Clause
# Language levels, build types and warnings, as interface targets that our own targets link privately.
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Release, Debug or RelWithDebInfo" FORCE)
endif()

set(CMAKE_C_STANDARD 11)
set(CMAKE_C_STANDARD_REQUIRED ON)
set(CMAKE_C_EXTENSIONS OFF)
set(CMAKE_CXX_STANDARD 17)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)

# C keeps its contract asserts in a release: they are few and cheap. C++ drops them for Eigen's and OpenCV's sake.
set(CMAKE_C_FLAGS_RELEASE "-O3")
set(CMAKE_CXX_FLAGS_RELEASE "-O2 -DNDEBUG")

# No -march and no fused multiply-add: the same figures on every machine. Never -ffast-math: NaN must fail range tests.
add_compile_options(-ffp-contract=off -fstack-protector-strong)

option(OUTCROP_SANITIZE "address and undefined-behaviour sanitizers, findings are fatal" OFF)
if(OUTCROP_SANITIZE)
  set(CMAKE_C_FLAGS_DEBUG "-O1 -g")
  set(CMAKE_CXX_FLAGS_DEBUG "-O1 -g")
  add_compile_options(-fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options(-fsanitize=address,undefined)
endif()

option(OUTCROP_THREAD_SANITIZE "thread sanitizer, findings are fatal" OFF)
if(OUTCROP_THREAD_SANITIZE)
  set(CMAKE_C_FLAGS_DEBUG "-O1 -g")
  set(CMAKE_CXX_FLAGS_DEBUG "-O1 -g")
  add_compile_options(-fsanitize=thread)
  add_link_options(-fsanitize=thread)
endif()

option(OUTCROP_FUZZ "everything instrumented for libFuzzer, which needs clang; only the fuzzers are built" OFF)
if(OUTCROP_FUZZ)
  set(CMAKE_C_FLAGS_RELEASE "-O1 -g")
  add_compile_options(-fsanitize=fuzzer-no-link,address,undefined,float-cast-overflow -fno-sanitize-recover=all)
  add_link_options(-fsanitize=address,undefined)
endif()

option(OUTCROP_CCACHE "compile through ccache where it is installed" ON)
find_program(OUTCROP_CCACHE_PROGRAM ccache)
if(OUTCROP_CCACHE AND OUTCROP_CCACHE_PROGRAM)
  set(CMAKE_C_COMPILER_LAUNCHER ${OUTCROP_CCACHE_PROGRAM})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${OUTCROP_CCACHE_PROGRAM})
endif()

add_library(outcrop_warnings_c INTERFACE)
target_compile_options(outcrop_warnings_c INTERFACE $<$<COMPILE_LANGUAGE:C>:
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wdouble-promotion -Wvla -Wmissing-prototypes -Wstrict-prototypes -Werror>)

add_library(outcrop_warnings_cxx INTERFACE)
target_compile_options(outcrop_warnings_cxx INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-Wall -Wextra -Wshadow -Werror>)
if(OUTCROP_SANITIZE) # g++ 12 sees ghosts inside std::function and std::regex when it instruments them
  target_compile_options(outcrop_warnings_cxx INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-Wno-maybe-uninitialized>)
endif()
