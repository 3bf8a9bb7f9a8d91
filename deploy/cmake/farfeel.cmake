# How every Farfeel target is made: one target a folder that holds sources, public headers in a header set (so that
# each can be compiled alone), warnings as errors, includes written from the repository's root.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/bin")
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

set(FARFEEL_SANITIZE "" CACHE STRING "Sanitizers for every target, as -fsanitize= takes them; empty for none")
option(FARFEEL_SANITIZE_ALL "With sanitizers: also build and run the tests that are marked NUMBERS" OFF)
set(FARFEEL_FUZZ_SECONDS 0 CACHE STRING "How long ctest runs each libFuzzer program; 0 for a fixed, small number of inputs")

# What a person runs; deploy/run builds only these. Measurements are built by whoever asks for them: `farfeel bench`,
# deploy/measure.
add_custom_target(programs)

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
  if(FARFEEL_SANITIZE MATCHES "address,undefined")
    # A wrong pointer is the address sanitizer's to find, where it is used; looking for it twice is a fifth of the compiler's time.
    target_compile_options(farfeel_options INTERFACE
      -fno-sanitize=null,vptr,object-size,pointer-overflow,nonnull-attribute,returns-nonnull-attribute)
  endif()
  target_link_options(farfeel_options INTERFACE -fsanitize=${FARFEEL_SANITIZE})
  target_compile_definitions(farfeel_options INTERFACE FARFEEL_SANITIZED)
endif()

# What sanitizers look at. A sanitizer finds wrong indices, lifetimes and data races. So under one, what reads strangers'
# bytes, crosses threads or computes indices is built and run: codecs, transport, keys, recordings, fuzzers, devices,
# real time, sessions, collision, penetration, contacts, geometry, bake, tiles. A test whose code only computes numbers or
# words is marked NUMBERS and left out, as are slow tests, umockdev's, the benchmarks and what reads the source tree. `all` is
# then what the remaining tests need. FARFEEL_SANITIZE_ALL (deploy/test --full) takes those marked NUMBERS in again.
set(FARFEEL_NEEDED_ONLY "")
if(FARFEEL_SANITIZE)
  set(FARFEEL_NEEDED_ONLY EXCLUDE_FROM_ALL)
endif()

# Headers that most sources include, compiled once for all libraries. Under sanitizers alone: without them, each source shows that
# it includes what it uses.
set(FARFEEL_COMMON_HEADERS
  <glm/glm.hpp> <glm/gtc/quaternion.hpp> <algorithm> <array> <chrono> <cmath> <cstdint> <filesystem> <fstream> <functional> <limits>
  <map> <memory> <numbers> <optional> <random> <span> <string> <string_view> <thread> <vector>)
if(FARFEEL_SANITIZE)
  add_library(farfeel_common_headers OBJECT EXCLUDE_FROM_ALL "${CMAKE_CURRENT_LIST_DIR}/common_headers.cpp")
  target_link_libraries(farfeel_common_headers PRIVATE farfeel_options)
  target_precompile_headers(farfeel_common_headers PRIVATE ${FARFEEL_COMMON_HEADERS} <tl/expected.hpp>)
endif()

# farfeel_library(NAME [HEADERS h...] [SOURCES s...] [LINKS public...] [PRIVATE_LINKS private...])
# A library for the current folder; without sources it is an interface library.
function(farfeel_library name)
  cmake_parse_arguments(arg "" "" "HEADERS;SOURCES;LINKS;PRIVATE_LINKS" ${ARGN})
  if(arg_SOURCES)
    add_library(${name} STATIC ${FARFEEL_NEEDED_ONLY} ${arg_SOURCES})
    set(scope PUBLIC)
    target_link_libraries(${name} PRIVATE ${arg_PRIVATE_LINKS})
    if(FARFEEL_SANITIZE)
      target_precompile_headers(${name} REUSE_FROM farfeel_common_headers)
    endif()
  else()
    add_library(${name} INTERFACE)
    set(scope INTERFACE)
  endif()
  target_link_libraries(${name} ${scope} farfeel_options ${arg_LINKS})
  if(arg_HEADERS)
    # A header that a source of this library includes before all else is compiled alone there; only the others are left to
    # all_verify_interface_header_sets. Which these are is looked up when CMake configures.
    set(shown "")
    set(unshown "")
    foreach(header IN LISTS arg_HEADERS)
      string(REGEX REPLACE "[.]h$" ".cpp" source "${header}")
      set(first "")
      if("${source}" IN_LIST arg_SOURCES)
        file(STRINGS "${source}" first REGEX "^#include" LIMIT_COUNT 1)
      endif()
      if(first MATCHES "/${header}\"$")
        list(APPEND shown ${header})
      else()
        list(APPEND unshown ${header})
      endif()
    endforeach()
    target_sources(${name} ${scope}
      FILE_SET HEADERS BASE_DIRS "${PROJECT_SOURCE_DIR}" FILES ${unshown}
      FILE_SET shown_headers TYPE HEADERS BASE_DIRS "${PROJECT_SOURCE_DIR}" FILES ${shown})
    set_target_properties(${name} PROPERTIES VERIFY_INTERFACE_HEADER_SETS ON INTERFACE_HEADER_SETS_TO_VERIFY HEADERS)
  endif()
endfunction()

# farfeel_program(NAME [MEASURES] SOURCES s... [LINKS l...]): an executable in build/<preset>/bin. MEASURES: it is part of
# farfeel-bench, not of `programs`.
function(farfeel_program name)
  cmake_parse_arguments(arg "MEASURES" "" "SOURCES;LINKS" ${ARGN})
  add_executable(${name} ${FARFEEL_NEEDED_ONLY} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE farfeel_options ${arg_LINKS})
  # main.cpp only wires things up, and optimising the command-line library's headers takes a minute a program.
  set_source_files_properties(main.cpp PROPERTIES COMPILE_OPTIONS -O0 SKIP_PRECOMPILE_HEADERS ON)
  set_property(GLOBAL APPEND PROPERTY FARFEEL_PROGRAMS ${name})
  if(NOT arg_MEASURES)
    add_dependencies(programs ${name})
  endif()
endfunction()

# farfeel_plug_in(NAME SOURCES s... [LINKS l...]): a device's shared library in build/<preset>/plug-ins, plain C99 against
# master_station/devices/plug_in/farfeel_device.h and nothing else of ours, as a stranger would build it: no sanitizer either.
function(farfeel_plug_in name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINKS" ${ARGN})
  add_library(${name} MODULE ${arg_SOURCES})
  set_target_properties(${name} PROPERTIES PREFIX "" C_STANDARD 99 C_EXTENSIONS OFF C_VISIBILITY_PRESET hidden
    LIBRARY_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/plug-ins")
  target_include_directories(${name} PRIVATE "${PROJECT_SOURCE_DIR}/master_station/devices/plug_in")
  target_compile_options(${name} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Werror)
  target_link_libraries(${name} PRIVATE ${arg_LINKS})
endfunction()

# A test's own code: what it tests is optimised and sanitized as in the product, and its own lines need no more than this. It must
# be one for all of them, since they share a precompiled header.
set(FARFEEL_TEST_CODE $<$<CONFIG:Release>:-O1>)
if(FARFEEL_SANITIZE)
  list(APPEND FARFEEL_TEST_CODE -g0)
endif()
if(FARFEEL_SANITIZE MATCHES "undefined")
  list(APPEND FARFEEL_TEST_CODE -fno-sanitize=undefined)
endif()

# All test programs that deploy/soak --stalls runs.
add_custom_target(machine_tests)

# farfeel_test(NAME [SERIAL] [MACHINE] [DRAWS] [NUMBERS] SOURCES s... [LINKS l...] [LABELS l...]): a GoogleTest program whose cases
# ctest lists one by one. MACHINE: its cases open sockets, or start threads or processes, so what they see depends on when this
# machine lets them run; they have the label machine, too, and pass while deploy/soak --stalls stops them at random. SERIAL: the
# same, and its cases have the machine to themselves, for those that need a real-time thread's due. DRAWS: its cases load OpenGL,
# whose drivers leak memory and race among themselves; leaks and what uninstrumented libraries do are not looked at then, every
# other check stays. NUMBERS: what it tests only computes numbers or words; sanitizers leave it out.
function(farfeel_test name)
  cmake_parse_arguments(arg "SERIAL;MACHINE;DRAWS;NUMBERS" "" "SOURCES;LINKS;LABELS" ${ARGN})
  if(NOT arg_SERIAL)
    set(arg_SERIAL OFF)
  endif()
  set(environment "")
  if(arg_DRAWS AND FARFEEL_SANITIZE MATCHES "thread")
    set(environment ENVIRONMENT "TSAN_OPTIONS=ignore_noninstrumented_modules=1")
  elseif(arg_DRAWS)
    set(environment ENVIRONMENT "ASAN_OPTIONS=detect_leaks=0")
  endif()
  add_executable(${name} ${arg_SOURCES})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/tests")
  target_link_libraries(${name} PRIVATE farfeel_options ${arg_LINKS} GTest::gtest_main)
  target_compile_options(${name} PRIVATE ${FARFEEL_TEST_CODE})
  target_precompile_headers(${name} REUSE_FROM farfeel_test_headers)
  if(NOT arg_LABELS)
    set(arg_LABELS fast)
  endif()
  if(FARFEEL_SANITIZE AND arg_NUMBERS AND NOT FARFEEL_SANITIZE_ALL)
    list(TRANSFORM arg_LABELS REPLACE "^fast$" numbers)
  endif()
  if(FARFEEL_SANITIZE AND NOT "fast" IN_LIST arg_LABELS)
    # deploy/test runs what is labelled fast under sanitizers. Whoever wants this one builds it by its name.
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON)
  endif()
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST PROPERTIES
    LABELS "${arg_LABELS}" RUN_SERIAL ${arg_SERIAL} TIMEOUT 300 ${environment}
    ENVIRONMENT_MODIFICATION "SUDO_UID=unset:")  # under sudo, a slave would become somebody else than its test
  if(arg_MACHINE OR arg_SERIAL)
    # gtest_discover_tests takes one label alone: the others are added where ctest reads its list of cases.
    set(labels_file "${CMAKE_CURRENT_BINARY_DIR}/${name}_labels.cmake")
    file(CONFIGURE OUTPUT "${labels_file}" @ONLY CONTENT
      "if(@name@_TESTS)\n  set_tests_properties(\${@name@_TESTS} PROPERTIES LABELS \"@arg_LABELS@;machine\")\nendif()\n")
    set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES "${labels_file}")
    add_dependencies(machine_tests ${name})
  endif()
endfunction()

# farfeel_fuzzer(NAME SOURCES s... [LINKS l...] [CORPUS folder] [MUTATIONS n]): LLVMFuzzerTestOneInput over hostile bytes.
# With the fuzz preset (clang) a libFuzzer program; under other sanitizers tests/fuzz/replay.cpp runs the same function over
# the seed corpus and MUTATIONS mutated copies of it (2000 unless told). Either way ctest runs it, briefly, as fuzz.NAME. Without
# a sanitizer most faults would pass unseen, so there is none.
function(farfeel_fuzzer name)
  if(NOT FARFEEL_SANITIZE)
    return()
  endif()
  cmake_parse_arguments(arg "" "CORPUS;MUTATIONS" "SOURCES;LINKS" ${ARGN})
  if(NOT DEFINED arg_MUTATIONS)
    set(arg_MUTATIONS 2000)
  endif()
  if(arg_CORPUS)
    get_filename_component(arg_CORPUS "${arg_CORPUS}" ABSOLUTE)
    if(NOT IS_DIRECTORY "${arg_CORPUS}")
      message(FATAL_ERROR "farfeel_fuzzer(${name}): there is no corpus folder ${arg_CORPUS}")
    endif()
  endif()
  add_executable(${name} ${arg_SOURCES})
  target_precompile_headers(${name} REUSE_FROM farfeel_common_headers)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/fuzz")
  target_link_libraries(${name} PRIVATE farfeel_options ${arg_LINKS})
  math(EXPR timeout "300 + ${FARFEEL_FUZZ_SECONDS}")
  set(found "${PROJECT_BINARY_DIR}/fuzz/${name}.found")
  file(MAKE_DIRECTORY "${found}")  # what libFuzzer discovers, and what crashed, never goes to the source tree
  if(FARFEEL_SANITIZE MATCHES "fuzzer-no-link")
    target_link_options(${name} PRIVATE -fsanitize=fuzzer)
    if(FARFEEL_FUZZ_SECONDS GREATER 0)
      set(how_long -max_total_time=${FARFEEL_FUZZ_SECONDS})
    else()
      set(how_long -seed=1 -runs=${arg_MUTATIONS})
    endif()
    add_test(NAME fuzz.${name} COMMAND ${name} ${how_long} -print_final_stats=1 "${found}" ${arg_CORPUS}
      WORKING_DIRECTORY "${found}")
  else()
    if(NOT TARGET farfeel_fuzz_replay)
      add_library(farfeel_fuzz_replay OBJECT "${PROJECT_SOURCE_DIR}/tests/fuzz/replay.cpp")
      target_link_libraries(farfeel_fuzz_replay PRIVATE farfeel_options)
    endif()
    target_link_libraries(${name} PRIVATE farfeel_fuzz_replay)
    add_test(NAME fuzz.${name} COMMAND ${name} --mutations ${arg_MUTATIONS} ${arg_CORPUS}
      WORKING_DIRECTORY "${found}")
  endif()
  set_tests_properties(fuzz.${name} PROPERTIES LABELS "fast;fuzz" TIMEOUT ${timeout})
endfunction()
