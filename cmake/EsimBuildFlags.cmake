# Compiler flags of all targets, as the interface library esim_build_flags.
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Type of build" FORCE)
endif()
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

add_library(esim_build_flags INTERFACE)
# g++ 12 reports restrict, maybe-uninitialized, stringop-overflow and array-bounds in the standard library's own strings and optionals.
target_compile_options(esim_build_flags INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
                       $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict;-Wno-maybe-uninitialized;-Wno-stringop-overflow;-Wno-array-bounds>
                       -fno-math-errno -fno-trapping-math -fopenmp-simd)
# g++ 13 and later report references to objects that exist for the whole program, such as the formats.
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 13)
  target_compile_options(esim_build_flags INTERFACE -Wno-dangling-reference)
endif()
if(ESIM_WERROR)
  target_compile_options(esim_build_flags INTERFACE -Werror)
endif()

# AVX2 and FMA, if the build machine supports them.
if(ESIM_MARCH AND CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
  include(CheckCXXSourceRuns)
  set(CMAKE_REQUIRED_QUIET ON)
  check_cxx_source_runs("int main() { return __builtin_cpu_supports(\"avx2\") && __builtin_cpu_supports(\"fma\") ? 0 : 1; }"
                        ESIM_HOST_HAS_AVX2)
  if(ESIM_HOST_HAS_AVX2 OR NOT ESIM_MARCH STREQUAL "x86-64-v3")
    add_compile_options(-march=${ESIM_MARCH})
    if(ESIM_MARCH STREQUAL "x86-64-v3")
      set(ESIM_USES_AVX2 ON)
    endif()
  endif()
endif()

# Highway compiles its code for the cryptographic extension, and code that calls it must have the same features.
if(CMAKE_SYSTEM_PROCESSOR STREQUAL "aarch64")
  add_compile_options(-march=armv8-a+crypto)
endif()

if(ESIM_SANITIZE)
  add_compile_options(-fsanitize=${ESIM_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${ESIM_SANITIZE})
  # The address sanitizer finds accesses through wrong pointers. Checking each pointer, too, takes half as long again to
  # compile.
  if(ESIM_SANITIZE MATCHES "address")
    add_compile_options(-fno-sanitize=null,vptr,object-size,pointer-overflow)
  endif()
endif()
