# How every Farfeel target is made: one target a folder that holds sources, public headers in a header set (so that
# each can be compiled alone), warnings as errors, includes written from the repository's root.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/bin")
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

set(FARFEEL_SANITIZE "" CACHE STRING "Sanitizers for every target, as -fsanitize= takes them; empty for none")

add_library(farfeel_options INTERFACE)
target_include_directories(farfeel_options INTERFACE "${PROJECT_SOURCE_DIR}")
target_compile_options(farfeel_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Werror -ffp-contract=off
  $<$<CONFIG:Debug>:-fno-omit-frame-pointer>)
# g++ 12 reports these in optimised library code that is correct.
target_compile_options(farfeel_options INTERFACE
  $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized -Wno-array-bounds -Wno-stringop-overflow -Wno-restrict>)
target_compile_definitions(farfeel_options INTERFACE GLM_FORCE_EXPLICIT_CTOR GLM_FORCE_SILENT_WARNINGS)
if(FARFEEL_SANITIZE)
  target_compile_options(farfeel_options INTERFACE -fsanitize=${FARFEEL_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(farfeel_options INTERFACE -fsanitize=${FARFEEL_SANITIZE})
  target_compile_definitions(farfeel_options INTERFACE FARFEEL_SANITIZED)
endif()

# farfeel_library(NAME [HEADERS h...] [SOURCES s...] [LINKS public...] [PRIVATE_LINKS private...])
# A library for the current folder; without sources it is an interface library.
function(farfeel_library name)
  cmake_parse_arguments(arg "" "" "HEADERS;SOURCES;LINKS;PRIVATE_LINKS" ${ARGN})
  if(arg_SOURCES)
    add_library(${name} STATIC ${arg_SOURCES})
    set(scope PUBLIC)
    target_link_libraries(${name} PRIVATE ${arg_PRIVATE_LINKS})
  else()
    add_library(${name} INTERFACE)
    set(scope INTERFACE)
  endif()
  target_link_libraries(${name} ${scope} farfeel_options ${arg_LINKS})
  if(arg_HEADERS)
    target_sources(${name} ${scope} FILE_SET HEADERS BASE_DIRS "${PROJECT_SOURCE_DIR}" FILES ${arg_HEADERS})
    set_target_properties(${name} PROPERTIES VERIFY_INTERFACE_HEADER_SETS ON)
  endif()
endfunction()

# farfeel_program(NAME SOURCES s... [LINKS l...]): an executable in build/<preset>/bin.
function(farfeel_program name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINKS" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE farfeel_options ${arg_LINKS})
endfunction()

# farfeel_test(NAME SOURCES s... [LINKS l...] [LABELS l...]): a GoogleTest program whose cases ctest lists one by one.
function(farfeel_test name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINKS;LABELS" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/tests")
  target_link_libraries(${name} PRIVATE farfeel_options ${arg_LINKS} GTest::gtest_main)
  if(NOT arg_LABELS)
    set(arg_LABELS fast)
  endif()
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST PROPERTIES LABELS "${arg_LABELS}" TIMEOUT 300)
endfunction()
