# Build settings and the few functions that every module's CMakeLists.txt uses.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()

# Sixteen sources are compiled as one: that takes half the time. So names in anonymous namespaces differ within a module
# (-DCMAKE_UNITY_BUILD=OFF compiles each source by itself).
if(NOT DEFINED CMAKE_UNITY_BUILD)
  set(CMAKE_UNITY_BUILD ON)
endif()
set(CMAKE_UNITY_BUILD_BATCH_SIZE 16)

include(CatoptricShaders)

option(CATOPTRIC_SANITIZE "Build with AddressSanitizer and UndefinedBehaviorSanitizer" OFF)
option(CATOPTRIC_FUZZ "Build the fuzz targets for libFuzzer (needs Clang)" OFF)
option(CATOPTRIC_COVERAGE "Build with gcov instrumentation" OFF)

find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
  set(CMAKE_C_COMPILER_LAUNCHER ${CCACHE})
endif()

add_library(catoptric_options INTERFACE)
target_compile_options(catoptric_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Werror
  $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>  # it takes joined sources for headers
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>  # false alarms on std::string in GCC 12 (its bug 105651)
  -ffp-contract=off)  # the same result from the same source, whatever the inlining
target_link_options(catoptric_options INTERFACE -fuse-ld=lld -Wl,--build-id=sha1)  # buildFingerprint()
if(CATOPTRIC_SANITIZE)
  target_compile_options(catoptric_options INTERFACE
    -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(catoptric_options INTERFACE -fsanitize=address,undefined)
endif()
if(CATOPTRIC_FUZZ)
  target_compile_options(catoptric_options INTERFACE -fsanitize=fuzzer-no-link)
endif()
if(CATOPTRIC_COVERAGE)
  target_compile_options(catoptric_options INTERFACE --coverage)
  target_link_options(catoptric_options INTERFACE --coverage)
endif()

# Optimizes a target's code less: where no frame waits for it, compiling takes three fifths of the time.
function(catoptric_cold target)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
endfunction()

# catoptric_module(NAME SOURCES a.cpp... [DEPENDS core ...] [LIBRARIES third::party ...] [COLD])
# makes the static library catoptric::NAME of src/NAME; DEPENDS are other modules (public),
# LIBRARIES third-party ones (private to the module's sources). COLD: see catoptric_cold().
function(catoptric_module name)
  cmake_parse_arguments(arg "COLD" "" "SOURCES;DEPENDS;LIBRARIES;PUBLIC_LIBRARIES" ${ARGN})
  add_library(catoptric_${name} STATIC ${arg_SOURCES})
  add_library(catoptric::${name} ALIAS catoptric_${name})
  target_include_directories(catoptric_${name} PUBLIC ${PROJECT_SOURCE_DIR}/src)
  foreach(dependency ${arg_DEPENDS})
    target_link_libraries(catoptric_${name} PUBLIC catoptric::${dependency})
  endforeach()
  target_link_libraries(catoptric_${name} PUBLIC ${arg_PUBLIC_LIBRARIES}
    PRIVATE ${arg_LIBRARIES} catoptric_options)
  if(arg_COLD)
    catoptric_cold(catoptric_${name})
  endif()
endfunction()

# catoptric_test(NAME LABEL label SOURCES a_test.cpp... DEPENDS module... [LIBRARIES ...] [TIMEOUT s])
# makes a GoogleTest program. LABEL is unit, gl, trace, image or e2e; a gl test is run twice,
# on EGL surfaceless and on OSMesa (environment variable CATOPTRIC_DEVICE).
function(catoptric_test name)
  cmake_parse_arguments(arg "" "LABEL;TIMEOUT" "SOURCES;DEPENDS;LIBRARIES" ${ARGN})
  find_package(GTest REQUIRED)
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 300)
  endif()
  if(CATOPTRIC_SANITIZE)
    math(EXPR arg_TIMEOUT "3 * ${arg_TIMEOUT}")
  endif()
  add_executable(${name} ${arg_SOURCES})
  foreach(dependency ${arg_DEPENDS})
    target_link_libraries(${name} PRIVATE catoptric::${dependency})
  endforeach()
  target_link_libraries(${name} PRIVATE ${arg_LIBRARIES} GTest::gmock GTest::gtest GTest::gtest_main catoptric_options)
  catoptric_cold(${name})
  target_compile_definitions(${name} PRIVATE CATOPTRIC_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  # Files of tests of other builds and users, which have the same names, are elsewhere
  set(temporary ${PROJECT_BINARY_DIR}/temporary)
  file(MAKE_DIRECTORY ${temporary})
  set(environment TEST_TMPDIR=${temporary} TMPDIR=${temporary})
  if(arg_LABEL STREQUAL "gl")
    foreach(device surfaceless osmesa)
      add_test(NAME ${name}.${device} COMMAND ${name})
      set_tests_properties(${name}.${device} PROPERTIES LABELS gl TIMEOUT ${arg_TIMEOUT}
        ENVIRONMENT "CATOPTRIC_DEVICE=${device};${environment}")
    endforeach()
  else()
    add_test(NAME ${name} COMMAND ${name})
    set_tests_properties(${name} PROPERTIES LABELS ${arg_LABEL} TIMEOUT ${arg_TIMEOUT}
      ENVIRONMENT "${environment}")
  endif()
endfunction()
