# Functions that every CMakeLists.txt of the project uses to declare its targets.

# The warnings and the code generation of every target. Programs of others do not get them.
add_library(fivepipe_compile_options INTERFACE)
target_compile_options(fivepipe_compile_options INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor>
  # Shaders and the page of the study report are string literals, which -Wpedantic limits to 64 kB.
  $<$<COMPILE_LANG_AND_ID:CXX,Clang>:-Wno-overlength-strings>
  # GCC 12 reports correct operations of std::string and std::vector (GCC bugs 105329, 105651).
  "$<$<CXX_COMPILER_ID:GNU>:-Wno-restrict;-Wno-array-bounds;-Wno-stringop-overflow>"
  "$<$<CXX_COMPILER_ID:GNU>:-Wno-stringop-overread>"
  # Bit-identical results on every machine: the compiler adds no fused multiply-add.
  -ffp-contract=off
  # GCC collects garbage less often, which saves a tenth of its time and needs a sixth more memory.
  "$<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=600000;--param=ggc-min-expand=100>"
  # In a unity build GCC treats the sources as headers and warns about their unnamed namespaces.
  "$<$<AND:$<CXX_COMPILER_ID:GNU>,$<BOOL:$<TARGET_PROPERTY:UNITY_BUILD>>>:-Wno-subobject-linkage>"
  # Lets ccache cache files that use precompiled headers.
  $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-fpch-preprocess>
  "$<$<COMPILE_LANG_AND_ID:CXX,Clang>:SHELL:-Xclang -fno-pch-timestamp>")

# GNU gold links the 200 programs in a third of the time of GNU ld. With Clang's address sanitizer
# it warns about 131 symbols per program; LLVM's lld does not.
include(CheckLinkerFlag)
if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang" AND CMAKE_CXX_FLAGS MATCHES "-fsanitize")
  check_linker_flag(CXX -fuse-ld=lld FIVEPIPE_HAS_LLD)
endif()
check_linker_flag(CXX -fuse-ld=gold FIVEPIPE_HAS_GOLD)
if(FIVEPIPE_HAS_LLD)
  add_link_options(-fuse-ld=lld)
elseif(FIVEPIPE_HAS_GOLD)
  add_link_options(-fuse-ld=gold)
endif()

# The include path and the language of every target.
add_library(fivepipe_options INTERFACE)
target_include_directories(fivepipe_options INTERFACE $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}>
  $<INSTALL_INTERFACE:include/fivepipe>)
target_compile_features(fivepipe_options INTERFACE cxx_std_20)
# Programs of others: types have the layout that they have in our libraries, whatever the
# instruction set, and the code of our headers gives the same bits.
target_compile_definitions(fivepipe_options INTERFACE
  $<INSTALL_INTERFACE:EIGEN_MAX_ALIGN_BYTES=16>)
target_compile_options(fivepipe_options INTERFACE $<INSTALL_INTERFACE:-ffp-contract=off>)
target_link_libraries(fivepipe_options INTERFACE $<BUILD_INTERFACE:fivepipe_compile_options>
  Eigen3::Eigen)

# Parsing the standard library and Eigen takes most of the compile time of most files, so the
# libraries share one precompiled header.
add_library(fivepipe_precompiled STATIC ${CMAKE_SOURCE_DIR}/cmake/precompiled.cpp)
target_link_libraries(fivepipe_precompiled PUBLIC fivepipe_options)
target_precompile_headers(fivepipe_precompiled PRIVATE ${CMAKE_SOURCE_DIR}/cmake/precompiled.h)

# The optimisation level of COLD libraries and programs in preset release. A build with a sanitizer
# does not optimise them.
set(FIVEPIPE_COLD_OPTIMISATION -O1 CACHE STRING
  "Optimisation level of code that runs rarely. CI uses -O0, which halves its compile time.")
if(CMAKE_CXX_FLAGS MATCHES "-fsanitize")
  set(FIVEPIPE_COLD_OPTION -O0)
else()
  set(FIVEPIPE_COLD_OPTION $<$<CONFIG:Release>:${FIVEPIPE_COLD_OPTIMISATION}>)
endif()

# The same for COLD libraries: GCC takes the optimisation level from the precompiled header.
add_library(fivepipe_precompiled_cold STATIC ${CMAKE_SOURCE_DIR}/cmake/precompiled.cpp)
target_link_libraries(fivepipe_precompiled_cold PUBLIC fivepipe_options)
target_compile_options(fivepipe_precompiled_cold PRIVATE ${FIVEPIPE_COLD_OPTION})
target_precompile_headers(fivepipe_precompiled_cold PRIVATE
  ${CMAKE_SOURCE_DIR}/cmake/precompiled.h)

# fivepipe_library(NAME [COLD] source... LINK library...): a static library. COLD is for code that
# runs once or a few times a second (command line, configuration, reports): the compiler spends less
# time on its optimisation.
function(fivepipe_library name)
  cmake_parse_arguments(ARG "COLD" "" "LINK" ${ARGN})
  add_library(${name} STATIC ${ARG_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PUBLIC fivepipe_options ${ARG_LINK})
  if(ARG_COLD)
    target_compile_options(${name} PRIVATE ${FIVEPIPE_COLD_OPTION})
    target_precompile_headers(${name} REUSE_FROM fivepipe_precompiled_cold)
  else()
    target_precompile_headers(${name} REUSE_FROM fivepipe_precompiled)
  endif()
endfunction()

# fivepipe_simd(NAME source...): these sources of the library NAME hold Highway SIMD kernels, which
# choose their instruction set at run time.
function(fivepipe_simd name)
  if(NOT TARGET ${name})  # a test that this build leaves out
    return()
  endif()
  target_link_libraries(${name} PUBLIC PkgConfig::HWY)
  # Highway compiles each file several times by including it from itself.
  set_source_files_properties(${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  # The lowest target of the kernels. Every x86-64 processor since 2011 has SSSE3. A precompiled
  # header is valid only for the instruction set for which it was built.
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS -mssse3
      SKIP_PRECOMPILE_HEADERS ON)
  endif()
endfunction()

# fivepipe_module(NAME source... LINK library...): a shared library NAME.so beside the programs,
# which they load at run time. Without the precompiled header: the options of GLib (-pthread) do not
# fit it.
function(fivepipe_module name)
  cmake_parse_arguments(ARG "" "" "LINK" ${ARGN})
  add_library(${name} MODULE ${ARG_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PRIVATE fivepipe_options ${ARG_LINK})
  target_include_directories(${name} SYSTEM PRIVATE ${OpenCV_INCLUDE_DIRS})
  set_target_properties(${name} PROPERTIES PREFIX "" DEFINE_SYMBOL ""
    LIBRARY_OUTPUT_DIRECTORY ${CMAKE_RUNTIME_OUTPUT_DIRECTORY})
endfunction()

# fivepipe_program(NAME [COLD] source... LINK library...): a program. COLD as for libraries.
function(fivepipe_program name)
  cmake_parse_arguments(ARG "COLD" "" "LINK" ${ARGN})
  add_executable(${name} ${ARG_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PRIVATE fivepipe_options ${ARG_LINK})
  # GCC accepts the precompiled header of the libraries only with the option for which it was built:
  # -fPIC, not -fPIE.
  set_target_properties(${name} PROPERTIES POSITION_INDEPENDENT_CODE OFF)
  target_compile_options(${name} PRIVATE -fPIC)
  if(ARG_COLD)
    target_compile_options(${name} PRIVATE ${FIVEPIPE_COLD_OPTION})
    target_precompile_headers(${name} REUSE_FROM fivepipe_precompiled_cold)
  else()
    target_precompile_headers(${name} REUSE_FROM fivepipe_precompiled)
  endif()
endfunction()

# The precompiled headers of the test programs. These programs are half of all sources, so the
# compiler does not optimise them, except NUMERIC ones (-O1).
function(fivepipe_test_precompiled_headers)
  foreach(name fivepipe_test_precompiled fivepipe_numeric_test_precompiled)
    add_executable(${name} ${CMAKE_SOURCE_DIR}/cmake/precompiled_main.cpp)
    target_link_libraries(${name} PRIVATE fivepipe_options GTest::gtest
      nlohmann_json::nlohmann_json)
    target_precompile_headers(${name} PRIVATE
      ${CMAKE_SOURCE_DIR}/cmake/precompiled_test.h)
  endforeach()
  target_compile_options(fivepipe_test_precompiled PRIVATE -O0)
  target_compile_options(fivepipe_numeric_test_precompiled PRIVATE $<$<CONFIG:Release>:-O1>)
endfunction()

# The time after which ctest ends a test [s].
function(fivepipe_test_timeout variable)
  if(CMAKE_CXX_FLAGS MATCHES "-fsanitize")
    set(${variable} 400 PARENT_SCOPE)
  else()
    set(${variable} 120 PARENT_SCOPE)
  endif()
endfunction()

# fivepipe_discover_tests(NAME FILTER PROPERTY value...): ctest runs each test of the program NAME
# that the GoogleTest filter matches, with these properties.
function(fivepipe_discover_tests name filter)
  fivepipe_test_timeout(timeout_s)
  # A program that is built for a sanitizer takes seconds to start on a busy machine.
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 120
    TEST_FILTER "${filter}" PROPERTIES TIMEOUT ${timeout_s} ${ARGN})
endfunction()

# The same for the tests of a list of patterns, which may be empty.
function(fivepipe_discover_some name patterns)
  if(patterns)
    list(JOIN patterns ":" filter)
    fivepipe_discover_tests(${name} "${filter}" ${ARGN})
  endif()
endfunction()

# fivepipe_test(NAME [PAIRED | ALONE | ALWAYS_ALONE] [WAITS lock] [LENGTHY] [NUMERIC] source...
# [PAIRED_TESTS pattern...] [ALONE_TESTS pattern...] [LONG_TESTS pattern...] LINK library...): a
# GoogleTest program; the patterns are those of GoogleTest. ctest runs all its tests in one process:
# one process per test would take twice the processor time. For tests/run -R, ctest also has one
# entry per test.
# ALONE is for programs whose tests measure times or rates, or need all cores for a whole pipeline:
# ctest runs each test in a process of its own, and no other test at the same time. Under the
# sanitizers, which slow the tests too much to measure, other tests run at the same time, and a test
# may take longer.
# PAIRED is for programs of which two tests leave each other enough of two cores, and which fail on
# a busy machine: tests/run runs two of them at a time, and no other test.
# ALWAYS_ALONE is for programs that load the machine for seconds: no other test runs at the same
# time under the sanitizers either.
# WAITS is for programs whose tests wait for most of their time and hold on a busy machine, too.
# ctest runs each test in a process of its own, beside all that are not alone, but at most one per
# lock at a time: `pipeline` for whole pipelines, `session` for `doctor` between hosts, deployments
# with keys, and studies, `node` for single nodes, commands and cameras. The tests of each lock
# together take about the same time.
# The tests of ALONE_TESTS and PAIRED_TESTS of a WAITS program run as those of ALONE and PAIRED
# programs, because they assert a time that is less than three times what they need on an idle
# machine. Under the sanitizers, WAITS and PAIRED have no effect either; a program that is
# ALWAYS_ALONE, too, is so only there.
# LENGTHY is for programs without PAIRED, ALONE or WAITS that run for more than 25 s: ctest starts
# them before shorter ones, because a long program that starts last leaves the other cores idle.
# LONG_TESTS run only in the program's long test (fivepipe_long_test), with tests/run -R, and under
# the sanitizers. Only PAIRED, ALONE and WAITS programs can have them.
# NUMERIC is for programs that compute for long: the compiler optimises them, except in preset
# debug. The build with the thread sanitizer has none of them, because their only threads are those
# of base::WorkerPool, which tests of tests/base and tests/system run there.
function(fivepipe_test name)
  if(NOT FIVEPIPE_TESTS)
    return()
  endif()
  cmake_parse_arguments(ARG "PAIRED;ALONE;ALWAYS_ALONE;LENGTHY;NUMERIC" "WAITS"
    "PAIRED_TESTS;ALONE_TESTS;LONG_TESTS;LINK" ${ARGN})
  if(ARG_WAITS AND NOT ARG_WAITS MATCHES "^(pipeline|session|node)$")
    message(FATAL_ERROR
      "${name}: WAITS must be pipeline, session or node, not ${ARG_WAITS}")
  endif()
  if((ARG_PAIRED AND (ARG_ALONE OR ARG_ALWAYS_ALONE)) OR (ARG_WAITS AND (ARG_PAIRED OR ARG_ALONE)))
    message(FATAL_ERROR "${name}: PAIRED, ALONE and WAITS exclude each other")
  endif()
  if((ARG_ALONE_TESTS OR ARG_PAIRED_TESTS) AND NOT ARG_WAITS)
    message(FATAL_ERROR "${name}: ALONE_TESTS and PAIRED_TESTS need WAITS; without it, declare the \
program ALONE or PAIRED, or neither")
  endif()
  if(ARG_PAIRED OR ARG_ALONE OR ARG_ALWAYS_ALONE OR ARG_WAITS)
    set(is_whole FALSE)
  else()
    set(is_whole TRUE)
  endif()
  if(ARG_LENGTHY AND NOT is_whole)
    message(FATAL_ERROR "${name}: LENGTHY excludes PAIRED, ALONE and WAITS")
  endif()
  if(ARG_LONG_TESTS AND is_whole)
    message(FATAL_ERROR
      "${name}: LONG_TESTS needs PAIRED, ALONE or WAITS; the others run in one process")
  endif()
  if(NOT ARG_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "${name}: no sources; they must precede the lists of tests and LINK")
  endif()
  if(ARG_NUMERIC AND CMAKE_CXX_FLAGS MATCHES "-fsanitize=thread")
    return()
  endif()
  # Sources of tests/support replace functions of the standard library, so each is compiled alone.
  foreach(source IN LISTS ARG_UNPARSED_ARGUMENTS)
    if(source MATCHES "/support/")
      set_source_files_properties(${source} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    endif()
  endforeach()
  add_executable(${name} ${ARG_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PRIVATE fivepipe_options ${ARG_LINK} GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE FIVEPIPE_SOURCE_DIR="${CMAKE_SOURCE_DIR}"
    FIVEPIPE_BINARY_DIR="${CMAKE_RUNTIME_OUTPUT_DIRECTORY}")
  if(ARG_NUMERIC)
    target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
    target_precompile_headers(${name} REUSE_FROM fivepipe_numeric_test_precompiled)
  else()
    target_compile_options(${name} PRIVATE -O0)
    target_precompile_headers(${name} REUSE_FROM fivepipe_test_precompiled)
  endif()
  set(has_sanitizer FALSE)
  if(CMAKE_CXX_FLAGS MATCHES "-fsanitize")
    set(has_sanitizer TRUE)
  endif()
  if(has_sanitizer)
    set(alone ${ARG_ALWAYS_ALONE})
  elseif(NOT is_whole)
    set(alone TRUE)
  else()
    set(alone FALSE)
  endif()
  set_target_properties(${name} PROPERTIES FIVEPIPE_LONG_ALONE "${alone}")
  if(is_whole)
    fivepipe_discover_tests(${name} "*" LABELS single)
    fivepipe_test_timeout(timeout_s)
    math(EXPR timeout_s "5 * ${timeout_s}")
    # tests/run counts the tests by this file.
    add_test(NAME ${name} COMMAND ${name})
    set_tests_properties(${name} PROPERTIES LABELS whole TIMEOUT ${timeout_s}
      ENVIRONMENT GTEST_OUTPUT=xml:${CMAKE_BINARY_DIR}/whole/${name}.xml)
    if(ARG_LENGTHY)
      set_tests_properties(${name} PROPERTIES COST 100)
    endif()
    return()
  endif()
  if(has_sanitizer)
    fivepipe_discover_tests(${name} "*" RUN_SERIAL ${alone})
    return()
  endif()
  # After the others, tests/run runs those with label quiet, two at a time if they are not serial.
  set(others ${ARG_LONG_TESTS} ${ARG_PAIRED_TESTS} ${ARG_ALONE_TESTS})
  if(others)
    list(JOIN others ":" others)
    set(others "*-${others}")
  else()
    set(others "*")
  endif()
  fivepipe_discover_some(${name} "${ARG_LONG_TESTS}" RUN_SERIAL TRUE LABELS single)
  fivepipe_discover_some(${name} "${ARG_PAIRED_TESTS}" LABELS quiet)
  fivepipe_discover_some(${name} "${ARG_ALONE_TESTS}" RUN_SERIAL TRUE LABELS quiet)
  if(ARG_WAITS)
    # Their cost lets ctest start them first: one at a time, they would else be the last.
    fivepipe_discover_tests(${name} "${others}" RESOURCE_LOCK ${ARG_WAITS} COST 1000)
  elseif(ARG_PAIRED)
    fivepipe_discover_tests(${name} "${others}" LABELS quiet)
  else()
    fivepipe_discover_tests(${name} "${others}" RUN_SERIAL TRUE LABELS quiet)
  endif()
endfunction()

# fivepipe_long_test(NAME TIMEOUT [PROGRAM] [ALONE]): the test program PROGRAM (default: NAME_test)
# as the long test Long_NAME, which runs for at most TIMEOUT seconds, with FIVEPIPE_LONG=1: the
# program's full numbers. With ALONE, or if the program is PAIRED, ALONE or WAITS, no other test
# runs at the same time, so its checks may be stricter.
function(fivepipe_long_test name timeout_s)
  cmake_parse_arguments(ARG "ALONE" "" "" ${ARGN})
  set(program ${name}_test)
  if(ARG_UNPARSED_ARGUMENTS)
    set(program ${ARG_UNPARSED_ARGUMENTS})
  endif()
  if(NOT TARGET ${program})
    return()
  endif()
  get_target_property(alone ${program} FIVEPIPE_LONG_ALONE)
  if(ARG_ALONE)
    set(alone TRUE)
  endif()
  add_test(NAME Long_${name} COMMAND ${program})
  set_tests_properties(Long_${name} PROPERTIES
    LABELS long TIMEOUT ${timeout_s} ENVIRONMENT FIVEPIPE_LONG=1 RUN_SERIAL ${alone})
endfunction()
