# SPDX-License-Identifier: GPL-3.0-or-later
# One folder, one module, one library target tenter::<name>.
#
#   tenter_module(<name> [PUBLIC lib...] [PRIVATE lib...] [TEST_LIBS lib...] [EXCLUDE regex])
#
# EXCLUDE leaves out sources and tests whose path matches.
#
# Sources are src/*.cpp, unit tests are test/*_test.cpp (one executable, <name>_tests). A module sees the
# headers of what it names and nothing else, so an upward or sideways include does not compile.
include(GoogleTest)

add_custom_target(unit_tests COMMENT "All executables of unit tests")

function(tenter_module name)
  cmake_parse_arguments(ARG "" "EXCLUDE" "PUBLIC;PRIVATE;TEST_LIBS" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS src/*.cpp)
  file(GLOB tests CONFIGURE_DEPENDS test/*_test.cpp)
  if(ARG_EXCLUDE)
    list(FILTER sources EXCLUDE REGEX "${ARG_EXCLUDE}")
    list(FILTER tests EXCLUDE REGEX "${ARG_EXCLUDE}")
  endif()
  if(NOT sources)  # nothing but headers yet
    add_library(tenter_${name} INTERFACE)
    add_library(tenter::${name} ALIAS tenter_${name})
    target_include_directories(tenter_${name} INTERFACE include)
    target_link_libraries(tenter_${name} INTERFACE ${ARG_PUBLIC} ${ARG_PRIVATE})
    return()
  endif()
  add_library(tenter_${name} STATIC ${sources})
  add_library(tenter::${name} ALIAS tenter_${name})
  target_include_directories(tenter_${name} PUBLIC include PRIVATE src)
  target_link_libraries(tenter_${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE} tenter_warnings)

  if(tests)
    add_executable(${name}_tests ${tests})
    target_include_directories(${name}_tests PRIVATE src test)
    target_link_libraries(${name}_tests PRIVATE tenter_${name} tenter_test_support ${ARG_TEST_LIBS}
                                                GTest::gmock GTest::gtest_main tenter_warnings)
    add_dependencies(unit_tests ${name}_tests)
    gtest_discover_tests(${name}_tests DISCOVERY_TIMEOUT 60 PROPERTIES LABELS unit)
  endif()
endfunction()
