# SPDX-License-Identifier: BSD-3-Clause
# Functions that the directories' CMakeLists.txt call to declare parts, libraries, programs and tests.

# Adds those of the given directories that have a CMakeLists.txt.
function(outcrop_add_parts)
  foreach(part ${ARGN})
    if(EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/${part}/CMakeLists.txt)
      add_subdirectory(${part})
    endif()
  endforeach()
endfunction()

# outcrop_library(NAME source...): a static library with our warnings, included from lib/ ("core/x.h").
function(outcrop_library name)
  set(sources ${ARGN})
  if(NOT sources)
    # ar refuses an archive without members.
    set(sources ${CMAKE_CURRENT_BINARY_DIR}/${name}_empty.c)
    file(CONFIGURE OUTPUT ${sources} CONTENT "typedef int ${name}_empty;\n")
  endif()
  add_library(${name} STATIC ${sources})
  target_include_directories(${name} PUBLIC ${CMAKE_SOURCE_DIR}/lib)
  target_link_libraries(${name} PRIVATE outcrop_warnings_c outcrop_warnings_cxx)
endfunction()

# outcrop_program(NAME source...): goes to bin/. Link its libraries with target_link_libraries(NAME PRIVATE ...).
function(outcrop_program name)
  add_executable(${name} ${ARGN})
  target_include_directories(${name} PRIVATE ${CMAKE_SOURCE_DIR}/lib)
  target_link_libraries(${name} PRIVATE outcrop_warnings_c outcrop_warnings_cxx)
endfunction()

# All test programs of a kind, without the rest.
add_custom_target(tests_unit)
add_custom_target(tests_site)
add_custom_target(tests_threads)
add_custom_target(tests_vm)

# What all test programs share: where they are built, where test data is.
function(outcrop_test_program name)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests/bin)
  target_include_directories(${name} PRIVATE ${CMAKE_SOURCE_DIR}/lib ${CMAKE_CURRENT_SOURCE_DIR})
  target_compile_definitions(${name} PRIVATE OUTCROP_TEST_DATA="${CMAKE_SOURCE_DIR}/tests/data")
  target_link_libraries(${name} PRIVATE outcrop_warnings_c outcrop_warnings_cxx)
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES TIMEOUT $<IF:$<BOOL:${OUTCROP_SANITIZE}>,1200,300> SKIP_RETURN_CODE 77)
endfunction()

# outcrop_unit_test(NAME library...): NAME.c, a Unity test program.
function(outcrop_unit_test name)
  add_executable(${name} ${name}.c)
  outcrop_test_program(${name})
  target_link_libraries(${name} PRIVATE unity ${ARGN} m)
  set_tests_properties(${name} PROPERTIES LABELS unit)
  add_dependencies(tests_unit ${name})
endfunction()

# outcrop_site_test(NAME [library...]): NAME.cpp, a GoogleTest program on outcrop_site.
function(outcrop_site_test name)
  add_executable(${name} ${name}.cpp)
  outcrop_test_program(${name})
  target_link_libraries(${name} PRIVATE ${ARGN} outcrop_site GTest::gmock_main)
  set_tests_properties(${name} PROPERTIES LABELS site)
  add_dependencies(tests_site ${name})
endfunction()
