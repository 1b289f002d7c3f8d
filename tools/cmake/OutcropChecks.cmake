# SPDX-License-Identifier: BSD-3-Clause
# The rules of the house as build checks: who links whom, what may be included, what a library may call.

# Everything a target links, directly and through others.
function(outcrop_links_of target result)
  set(seen)
  set(queue ${target})
  while(queue)
    list(POP_FRONT queue next)
    # "$<LINK_ONLY:x>" is how a static library keeps its private links.
    string(REGEX REPLACE "^\\$<LINK_ONLY:(.*)>$" "\\1" next "${next}")
    if(next IN_LIST seen)
      continue()
    endif()
    list(APPEND seen "${next}")
    if(NOT TARGET "${next}")
      continue()
    endif()
    get_target_property(type ${next} TYPE)
    set(properties INTERFACE_LINK_LIBRARIES)
    if(NOT type STREQUAL "INTERFACE_LIBRARY")
      list(APPEND properties LINK_LIBRARIES)
    endif()
    foreach(property ${properties})
      get_target_property(links ${next} ${property})
      if(links)
        list(APPEND queue ${links})
      endif()
    endforeach()
  endwhile()
  list(REMOVE_ITEM seen ${target})
  set(${result} "${seen}" PARENT_SCOPE)
endfunction()

# target links nothing but the given ones.
function(outcrop_may_link_only target)
  outcrop_links_of(${target} links)
  foreach(link IN LISTS links)
    if(NOT link IN_LIST ARGN)
      message(FATAL_ERROR "${target} may not link ${link} (docs/design.md, section 2)")
    endif()
  endforeach()
endfunction()

# target links none of the given ones.
function(outcrop_must_not_link target)
  if(NOT TARGET ${target})
    return()
  endif()
  outcrop_links_of(${target} links)
  foreach(link IN LISTS ARGN)
    if(link IN_LIST links)
      message(FATAL_ERROR "${target} may not link ${link} (docs/design.md, section 2)")
    endif()
  endforeach()
endfunction()

function(outcrop_check_link_rules)
  set(plain m outcrop_warnings_c outcrop_warnings_cxx)
  outcrop_may_link_only(outcrop_core ${plain})
  outcrop_may_link_only(outcrop_vehicle ${plain} outcrop_core)
  outcrop_must_not_link(outcrop_site outcrop_vehicle outcrop_lcmtypes outcrop_lcmtypes_cpp lcm-static)
  outcrop_must_not_link(outcropd outcrop_site outcrop_opencv)
endfunction()

# Every header of lib/DIRECTORY compiled alone in each of the languages (c, cpp), with our warnings.
function(outcrop_check_headers directory)
  file(GLOB headers CONFIGURE_DEPENDS RELATIVE ${CMAKE_SOURCE_DIR}/lib ${CMAKE_SOURCE_DIR}/lib/${directory}/*.h)
  list(FILTER headers EXCLUDE REGEX "_body\\.h$") # code that is compiled several times over
  set(sources)
  foreach(header ${headers})
    foreach(language ${ARGN})
      set(source ${CMAKE_BINARY_DIR}/header_checks/${header}.${language})
      file(CONFIGURE OUTPUT ${source} CONTENT "#include \"${header}\"\n#include \"${header}\"\n")
      list(APPEND sources ${source})
    endforeach()
  endforeach()
  if(sources)
    add_library(outcrop_headers_${directory} OBJECT ${sources})
    target_link_libraries(outcrop_headers_${directory}
      PRIVATE outcrop_${directory} outcrop_warnings_c outcrop_warnings_cxx)
  endif()
endfunction()

function(outcrop_add_checks)
  outcrop_check_headers(core c cpp)
  outcrop_check_headers(vehicle c cpp)
  outcrop_check_headers(site cpp)

  # Each check is a test, and that it finds what it looks for is another.
  set(checks ${CMAKE_SOURCE_DIR}/tools/checks)
  add_test(NAME check_includes COMMAND ${checks}/includes.py)
  add_test(NAME check_includes_finds_violations COMMAND ${checks}/includes.py --self-test)
  add_test(NAME check_house COMMAND ${checks}/house.py)
  add_test(NAME check_house_finds_violations COMMAND ${checks}/house.py --self-test)
  add_test(NAME check_format COMMAND ${checks}/format.sh)
  add_test(NAME check_test_counting COMMAND ${checks}/count_tests.py --self-test)
  set(tests check_includes check_includes_finds_violations check_house check_house_finds_violations check_format
    check_test_counting)
  if(NOT OUTCROP_SANITIZE) # which adds calls and writable data of its own
    add_test(NAME check_symbols COMMAND ${checks}/symbols.py --nm ${CMAKE_NM}
      $<TARGET_FILE:outcrop_core> $<TARGET_FILE:outcrop_vehicle>)
    add_test(NAME check_symbols_finds_violations
      COMMAND ${checks}/symbols.py --nm ${CMAKE_NM} --self-test ${CMAKE_C_COMPILER})
    list(APPEND tests check_symbols check_symbols_finds_violations)
  endif()
  set_tests_properties(${tests} PROPERTIES LABELS check TIMEOUT 60)

  add_custom_target(tidy COMMAND ${checks}/tidy.sh -p ${CMAKE_BINARY_DIR} USES_TERMINAL)
  add_custom_target(format COMMAND ${checks}/format.sh --fix)
endfunction()
